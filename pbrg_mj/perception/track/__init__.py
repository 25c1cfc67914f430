"""Lines over time: every robot's tracks, in the world frame about the robot's last position.

In: the lines of a scan, the pose estimate, the tracks before. Out: the tracks after, confirmed or not.

    world_frame     the robot's pose at the scan; lines and beams from the body frame into the world frame
    pose_history    where robots were at a scan, from the camera's last frames
    deskew          a scan that takes time, as if taken at once
    filtered_poses  what the poses of a filter are worth where scan after scan is averaged
    pose_noise      how the noise of the poses between which a scan was taken moves its lines
    records         the record of a track, and the parameters
    association     which line belongs to which track; tracks of one line merged
    extent          where a track ends
    confirmation    whether a track is at rest, and so confirmed
    update          all of that for one scan: predict, associate, fuse, initiate, delete

Kernels name their arrays alike, of one robot:

    tracks (M,), track              of TRACK, a record of it
    lines (L,), line                of LINE, the lines of a scan in the world about the anchor; a record of it
    scan                            ranges (B,) [m], directions or beams (B, 2), unit vectors in the world
    now, params                     `ScanPose`, `TrackParameters`
"""
