"""The Kalman filter of a track's velocity, which walks at random: flows are fused with it.

What seems to rest takes in the range flow of single echoes (range_flow.py), what moves that of whole faces
(face_flow.py).
"""

from __future__ import annotations

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.points.face_track import predicted_covariance, squared_mahalanobis
from pbrg_mj.perception.points.gate import GATE
from pbrg_mj.perception.points.normal_flow import ANY_SPEED

MANEUVER = 25.0  # squared Mahalanobis distance between a velocity and what the flows of a scan tell of it alone
LEAST_FLOWS = 6  # that may tell of a maneuver: a corner between beams makes a few


@kernel
def has_maneuvered(track, measured, time):
    """Tell whether flows (flows, chosen) tell of another velocity than a track's, which seems to rest.

    Each alone may be within the gate, since a line of two echoes is noisy. What all of a scan tell is the velocity of a
    new track, which is compared with this one's. Both have errors of poses, but of different scans.
    """
    (flows, chosen), (pxx, pxy, pyy) = measured, predicted_covariance(track, time)
    if len(chosen) < LEAST_FLOWS or track["cxx"] == 0.0:
        return False
    anything = _with_poses(flows, chosen, (ANY_SPEED**2, 0.0, ANY_SPEED**2))
    vx, vy, cxx, cxy, cyy, _ = _fused(flows, chosen, (0.0, 0.0), anything)
    both = cxx + pxx, cxy + pxy, cyy + pyy
    return squared_mahalanobis(vx - track["vx"], vy - track["vy"], both) > MANEUVER


@kernel
def fuse_flows(track, measured, time):
    """Fuse flows (flows, chosen) with the velocity v of a track, covariance P, which seems to rest.

    The poses of both scans are wrong, so that all flows tell u = v + b, with the same b of covariance S. Before them u
    has the covariance W = P + S, after them U. With A = P W^-1, v becomes v + A (u - v), exactly, and P becomes
    P - A (W - U) A^T. A scan tells of v no better than S, but the next scan has another b.
    """
    (flows, chosen), (pxx, pxy, pyy) = measured, predicted_covariance(track, time)
    wxx, wxy, wyy = _with_poses(flows, chosen, (pxx, pxy, pyy))
    ux, uy, cxx, cxy, cyy, count = _fused(flows, chosen, (track["vx"], track["vy"]), (wxx, wxy, wyy))
    if count > 0:
        track["told"] = time
    det = wxx * wyy - wxy * wxy
    axx, axy = (pxx * wyy - pxy * wxy) / det, (pxy * wxx - pxx * wxy) / det
    ayx, ayy = (pxy * wyy - pyy * wxy) / det, (pyy * wxx - pxy * wxy) / det
    dx, dy, dxx, dxy, dyy = ux - track["vx"], uy - track["vy"], wxx - cxx, wxy - cxy, wyy - cyy
    track["vx"], track["vy"] = track["vx"] + axx * dx + axy * dy, track["vy"] + ayx * dx + ayy * dy
    track["cxx"] = pxx - (axx * axx * dxx + 2.0 * axx * axy * dxy + axy * axy * dyy)
    track["cxy"] = pxy - (axx * ayx * dxx + (axx * ayy + axy * ayx) * dxy + axy * ayy * dyy)
    track["cyy"] = pyy - (ayx * ayx * dxx + 2.0 * ayx * ayy * dxy + ayy * ayy * dyy)


@kernel
def fuse_faces(track, measured, time):
    """Fuse flows of faces (flows, chosen) with the velocity of a track that moves.

    A flow along a normal n changes the velocity along n alone, with the gain K = n n.P n / S: by P n / S, the Kalman
    filter's, what is left of the normal's error would tell scan by scan that nothing moves along the face. The
    covariance of any gain is P - K (P n)^T - P n K^T + K S K^T (Joseph). In S the error of the pose, which all flows
    share, counts once for each of them. The flow of an end, whose direction is its beam's, has the filter's gain.
    """
    (flows, chosen), (cxx, cxy, cyy) = measured, predicted_covariance(track, time)
    vx, vy = track["vx"], track["vy"]
    for i in chosen:
        fx, fy = flows.nx[i], flows.ny[i]
        gx, gy = cxx * fx + cxy * fy, cxy * fx + cyy * fy
        own, error = fx * gx + fy * gy, flows.speed[i] - fx * vx - fy * vy
        if error * error > GATE * (own + flows.variance[i] + flows.shared[i]):
            continue
        total = own + flows.variance[i] + len(chosen) * flows.shared[i]
        kx, ky = (gx / total, gy / total) if flows.of_end[i] else (own * fx / total, own * fy / total)
        track["told"] = time
        vx, vy = vx + kx * error, vy + ky * error
        cxx += kx * (total * kx - 2.0 * gx)
        cxy += total * kx * ky - kx * gy - ky * gx
        cyy += ky * (total * ky - 2.0 * gy)
    track["vx"], track["vy"], track["cxx"], track["cxy"], track["cyy"] = vx, vy, cxx, cxy, cyy


@kernel
def _fused(flows, chosen, mean, covariance):
    """Return a velocity (x, y), its covariance (xx, xy, yy) once flows are fused with it, and how many within the gate.

    `mean` (x, y) and `covariance` are what it was before [m/s], [m^2/s^2].
    """
    (ux, uy), (cxx, cxy, cyy), count = mean, covariance, 0
    for i in chosen:
        fx, fy = flows.nx[i], flows.ny[i]
        gx, gy = cxx * fx + cxy * fy, cxy * fx + cyy * fy
        total = fx * gx + fy * gy + flows.variance[i]
        error = (flows.speed[i] - fx * ux - fy * uy) / total
        if error * error * total > GATE:
            continue
        count += 1
        ux, uy = ux + gx * error, uy + gy * error
        cxx, cxy, cyy = cxx - gx * gx / total, cxy - gx * gy / total, cyy - gy * gy / total
    return ux, uy, cxx, cxy, cyy, count


@kernel
def _with_poses(flows, chosen, covariance):
    """Return a covariance (xx, xy, yy) and that of what poses add, the mean over the flows chosen [m^2/s^2]."""
    xx, xy, yy = covariance
    for i in chosen:
        xx, xy = xx + flows.poses_xx[i] / len(chosen), xy + flows.poses_xy[i] / len(chosen)
        yy += flows.poses_yy[i] / len(chosen)
    return xx, xy, yy
