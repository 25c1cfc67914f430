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
def write_pose_effects(work, count, params, shares, effects):
    """Write how unit variances of all poses move lines to `effects` (L, 6): of positions aa, ac, cc, and of headings.

    `work` is the LineWorkspace of a scan of `count` lines, `shares` (B, J) those of J poses in its beams, or (1, 1).
    """
    for i in range(count):
        effect = effects[i]
        effect[:] = 0.0
        if shares.shape[1] == 1:
            effect[2], effect[3] = 1.0, 1.0
            continue
        line, size = work.ranking[i], 0
        for b in range(len(work.owner)):
            if work.owner[b] == line:
                work.members[size] = b
                size += 1
        _add_effects(work, work.members[:size], work.fits[line], params, shares, effect)


@kernel
def _add_effects(work, members, fit, params, shares, effect):
    """Add to the `effect` (6,) of a line those of all poses; `members` (N,) are its beams, `fit` (7,) is the line."""
    total, mean, spread, _, _ = extent(work.points, params, members, (fit[0], fit[1]), work.at)
    paa, pac, pcc = covariance(total, mean, spread)
    for j in range(shares.shape[1]):
        turn, shift, turned, shifted = 0.0, 0.0, 0.0, 0.0
        for i in range(len(members)):
            s, w = work.at[i, S], work.at[i, WEIGHT] * shares[members[i], j]
            turn, shift = turn + w * (paa * s - pac), shift + w * (pac * s - pcc)
            turned, shifted = turned + w * s * (paa * s - pac), shifted + w * s * (pac * s - pcc)
        effect[0], effect[1], effect[2] = effect[0] + turn**2, effect[1] + turn * shift, effect[2] + shift**2
        effect[3], effect[4], effect[5] = effect[3] + turned**2, effect[4] + turned * shifted, effect[5] + shifted**2
