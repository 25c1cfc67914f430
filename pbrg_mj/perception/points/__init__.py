"""Scans to half-spaces without asking for lines: whatever echoes is kept off, whatever its shape.

parameters      of the sensor, the robot and the estimator
beams           the beams of a scan, and which of them looks in a direction
memory          points over time: seen again, hidden, passed by beams, forgotten
corner_bound    how far a corner between two beams may stick out
confirm         which points of earlier scans confirm a lone echo
unexpected      which echoes are where the scan before saw nothing
segment         how far a place is off a segment
replaced        which older points a scan's echoes take the place of
detect          one scan to points in the world; a lone echo waits until a second confirms it
occupancy_grid  what is known to be free on blind sides
known_free      the edge of what a scan shows to be free
obstacle_points both: where hand points must keep away, and the path to the target as far as it is free
hull            the distance of the hull of points from a segment (GJK)
fitted_line     the line through the places of a face
lines           straight faces at rest, and which places and echoes are theirs
face            the places of one face, its normal and its half-space
straight_face   whether a face is straight and at rest, and how well its line is known
separate        half-spaces between the path and all places
past_scan       older scans, as they are kept
older_line      the line of a face in an older scan
normal_flow     how far an echo is off that line, and whether another older scan confirms it
range_flow      what a scan, compared with older ones, tells of velocities
scan_faces      the faces of a scan, one normal for each
face_flow       range flow of whole faces, for tracks that move
face_track      a face that is followed, with a velocity
gate            which flows may be of what moves as it does
fuse_flows      flows fused with its velocity
motion          the track of every face, scan by scan
blind_zone      faces that move and go on in the blind zone, nearer than beams tell
blind_zone_points points of what moves there, which go on with it
initial_blind_zone what a robot starts beside there
face_span       how far the face of what comes reaches to either side
approach        how fast what half-spaces keep off comes nearer
estimator       one tick of all that for all robots

Kernels name their arrays alike, of one robot:

    points (M,)                       of POINT, the memory
    tracks (T,)                       of TRACK, of faces
    past (beams,), past_pose (1,)     of PAST_ECHO and PAST_POSE, an older scan; of several (lag, beams), (lag,)
    ranges (beams,), directions (beams, 2)   of `SeenBeams`: [m], unit vectors in the body's frame
    path (4,)                         x, y of both ends, from the hand point on [m]
    normal (gx, gy), n (nx, ny)       unit vectors in the world
    G (K, 2), h (K,), active (K,), nearest (K, 2)   half-spaces, and the place of each that is nearest to the path [m]
    half_space (normal, nearest, h)   one of them; here nearest is where the hand point is at its nearest place [m]
    lines (K, FIELDS), line           the straight faces of half-spaces, and one of them, a `Line`
    expected (beams,)                 what echoes are by the scan before, `unexpected_echoes`
    grid                              `OccupancyGrid`
    echoes, beams, pose, parameters   `Echoes`, `SeenBeams`, `ScanPose`, `PointParameters`
    measured (flows, count)           the `RangeFlow` of a scan, and how many entries it has
    faces, older, newer               `Faces` of a scan
    of_scan (scan, faces)             a scan (beams,) of PAST_ECHO and its `Faces`
    chosen (F,), others (F,), beside (flows, chosen)   numbers of some of its entries; the flows with these
    weighted (3, size)                s, y [m] and weight of the places of a face, of `fitted_line`
    places, window                    `ObstaclePoints`, and a second one for those of one face
"""
