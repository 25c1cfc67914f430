"""One scan to line features in the body frame.

In: ranges of one scan, directions of its beams, `LineParameters`. Out: `Lines` with covariance and free ends.

    self_occlusion  which beams meet the robot's own wheels
    cone            where in its view a cone meets a wall; places and chords of beams
    points          ranges to points, without lone outliers
    segmentation    points to clusters (adaptive breakpoints) to straight segments (split and merge)
    line_fit        the line through the points of a segment, and its covariance
    cone_ends       cones that see the end of a wall
    robust_fit      outliers removed, tests of straightness, outlier inflation of the covariance
    line_ends       what the beams beside a line say: it ends, it has a gap, or nothing
    collinear       segments of one line merged
    corners         whose the points beside a corner are
    joined_ends     last points that may be another surface's, in the line and its covariance
    extract_lines   all of that, in this order
    team_mates      which echoes are team-mates', and lines that they alone may make
    parameters      what it needs to know of the sensor and the estimator

Kernels name their arrays alike, for a scan of B beams:

    ranges (B,), directions (B, 2)  as measured [m], unit vectors in the body's frame
    points (B, 6)                   a row a beam: x, y, range [m], direction x, y, variance of the range [m^2]; of a
                                    cone those of its axis
    order (N,)                      the beams that have a point, counter-clockwise
    owner (B,), ranking (B,)        the line that has a beam's point, -1 for none; lines, longest first
    members (N,), at (B, 4)         beams of one line; where they meet it: s, weight, residual, cosine
    line (2,), fit (7,)             theta, c; the same, var theta, cov, var c, low, high
    moments (5,)                    total weight, mean of s, weighted sum of (s - mean)^2, least and largest s
    segment (3,)                    where it starts and stops in `order`, its cluster
    params, work                    `LineParameters`, `LineWorkspace`
"""
