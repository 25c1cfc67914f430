"""How the noise of the poses between which a scan was taken moves its lines.

In a scan that takes time a beam is placed by the poses before and after it, with shares lambda, so that each pose has
an error of its own. An error of one of them moves an echo along the line's normal, by itself if it is of the position
and by as much as the echo is along the line if it is of the heading. The line fitted moves by P sum w (s, -1)' lambda
and P sum w s (s, -1)' lambda of that, with P the covariance of the fit, w and s as in `line_fit`. Of one pose alone
that is a shift by the position's error and a turn by the heading's; of several both are averaged, and positions that
differ turn the line.
"""

from __future__ import annotations

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.line_fit import WEIGHT, S, covariance, extent


@kernel
def write_pose_covariances(work, count, params, shares, covariances):
    """Write `covariances` (L, 6) of lines by unit variances of all poses: aa, ac, cc by positions, and by headings.

    `work` is the LineWorkspace of a scan of `count` lines, `shares` (B, J) those of J poses in its beams, or (1, 1).
    """
    for i in range(count):
        by_poses = covariances[i]
        by_poses[:] = 0.0
        if shares.shape[1] == 1:
            by_poses[2], by_poses[3] = 1.0, 1.0
            continue
        line, size = work.ranking[i], 0
        for b in range(len(work.owner)):
            if work.owner[b] == line:
                work.members[size] = b
                size += 1
        _add_poses(work, work.members[:size], work.fits[line], params, shares, by_poses)


@kernel
def _add_poses(work, members, fit, params, shares, by_poses):
    """Add up what all poses do to a line in `by_poses` (6,); `members` (N,) are its beams, `fit` (7,) is the line."""
    total, mean, spread, _, _ = extent(work.points, params, members, (fit[0], fit[1]), work.at)
    paa, pac, pcc = covariance(total, mean, spread)
    for j in range(shares.shape[1]):
        turn, shift, turned, shifted = 0.0, 0.0, 0.0, 0.0
        for i in range(len(members)):
            s, w = work.at[i, S], work.at[i, WEIGHT] * shares[members[i], j]
            turn, shift = turn + w * (paa * s - pac), shift + w * (pac * s - pcc)
            turned, shifted = turned + w * s * (paa * s - pac), shifted + w * s * (pac * s - pcc)
        by_poses[0] += turn**2
        by_poses[1] += turn * shift
        by_poses[2] += shift**2
        by_poses[3] += turned**2
        by_poses[4] += turned * shifted
        by_poses[5] += shifted**2
