"""One scan to line features in the body frame.

In: ranges of one scan, directions of its beams, `LineParameters`. Out: `Lines` with covariance and free ends.

    self_occlusion  which beams meet the robot's own wheels
    points          ranges to points, without lone outliers
    segmentation    points to clusters (adaptive breakpoints) to straight segments (split and merge)
    line_fit        the line through the points of a segment, and its covariance
    robust_fit      outliers removed, tests of straightness, outlier inflation of the covariance
    line_ends       what the beams beside a line say: it ends, it has a gap, or nothing
    collinear       segments of one line merged
    corners         whose the points beside a corner are
    joined_ends     last points that may be another surface's, in the line and its covariance
    extract_lines   all of that, in this order
    team_mates      which echoes are team-mates', and lines that they alone may make
    parameters      what it needs to know of the sensor and the estimator
"""
