"""The tracks of one robot from scan to scan: predict, associate, fuse, initiate, delete."""

from __future__ import annotations

import math

from pbrg_mj.kernel import kernel
from pbrg_mj.perception.scan.line_fit import wrapped
from pbrg_mj.perception.track.association import CONFLICT, EXTEND, NEW, UPDATE, associate, merge, merge_tracks_on_line
from pbrg_mj.perception.track.confirmation import confirm, note_motion
from pbrg_mj.perception.track.extent import (
    IN_RANGE,
    beam_on_line,
    restart_extent,
    update_extent,
    widen_extent,
)

LEAST_BEAMS = 3  # beams on a track that may contradict it
PASSED_SHARE = 0.6  # of them must

SEEN_SHARE = 0.02  # of the drift while in sight: nothing is known for ever
MAX_CONTRADICTIONS = 3  # scans against a track before it is deleted, and scans an unconfirmed one may be out of sight
FEW_HITS, MORE_MISSES = 3, 3  # seen at most so often, and missed so much more often: what was seen was no line
CLOCK_ROUNDING = 1e-9  # [s] rounding of the clock


@kernel
def update_tracks(tracks, lines, scan, now, params):
    """Bring one robot's tracks (M,) up to date with one scan, in place.

    `lines` are records LINE (L,) in the world, to which roles and tracks are written; `scan` is (ranges (B,) [m],
    directions (B, 2) in the world), `now` the ScanPose.
    """
    for i in range(len(tracks)):
        if tracks[i]["live"]:
            _predict(tracks[i], now, params)
    associate(tracks, lines, params)
    for k in range(len(lines)):
        line = lines[k]
        if line["role"] == UPDATE:
            line["track"] = merge_tracks_on_line(tracks, line, line["track"], params)
            _fuse(tracks[line["track"]], line, scan, now, params)
        elif line["role"] == EXTEND:
            widen_extent(tracks[line["track"]], line)
        elif line["role"] == CONFLICT:
            _note_conflict(tracks[line["track"]])
            if not tracks[line["track"]]["live"]:
                line["role"] = NEW
    for k in range(len(lines)):
        if lines[k]["role"] == NEW:
            _initiate(tracks, lines[k], scan, now, params)
    _delete_contradicted(tracks, scan, params)
    merge(tracks, params)


@kernel
def _predict(track, now, params):
    """Take a track from the last anchor to this one, let its uncertainty grow, and forget it in the end."""
    cos, sin = math.cos(track["angle"]), math.sin(track["angle"])
    along = now.shift_y * cos - now.shift_x * sin
    track["offset"] -= now.shift_x * cos + now.shift_y * sin
    track["low"] -= along
    track["high"] -= along
    track["low_bound"] -= along
    track["high_bound"] -= along
    # offset' = offset - n . shift, so the angle's error moves it by -t . shift
    track["p_cc"] += along * (along * track["p_aa"] - 2 * track["p_ac"])
    track["p_ac"] -= along * track["p_aa"]
    track["e_cc"] += along * (along * track["e_aa"] - 2 * track["e_ac"])
    track["e_ac"] -= along * track["e_aa"]
    track["away"] += now.elapsed
    share = SEEN_SHARE if track["unseen"] == 0 else 1.0
    track["p_aa"] += (share * params.turn) ** 2 * now.elapsed
    track["p_cc"] += (share * params.drift) ** 2 * now.elapsed
    track["unseen"] += 1
    if now.time - track["seen"] > params.memory + CLOCK_ROUNDING or (
        not track["confirmed"] and track["unseen"] > MAX_CONTRADICTIONS
    ):
        track["live"] = 0


@kernel
def _fuse(track, line, scan, now, params):
    """Kalman update of (angle, offset) with a sighting: its noise is independent of the scans before."""
    note_motion(track, line, now)
    da = wrapped(line["angle"] - track["angle"])
    dc = line["offset"] - track["offset"]
    paa, pac, pcc = track["p_aa"], track["p_ac"], track["p_cc"]
    saa, sac, scc = paa + line["c_aa"], pac + line["c_ac"], pcc + line["c_cc"]
    det = saa * scc - sac * sac
    kaa, kac = (paa * scc - pac * sac) / det, (pac * saa - paa * sac) / det  # K = P S^-1
    kca, kcc = (pac * scc - pcc * sac) / det, (pcc * saa - pac * sac) / det
    track["angle"] = wrapped(track["angle"] + kaa * da + kac * dc)
    track["offset"] += kca * da + kcc * dc
    track["p_aa"] = (1 - kaa) * paa - kac * pac
    track["p_cc"] = (1 - kcc) * pcc - kca * pac
    track["p_ac"] = (1 - kaa) * pac - kac * pcc
    _update_errors(track, line, (kaa, kac, kca, kcc))
    track["seen"] = now.time
    track["hits"] += 1
    track["unseen"] = track["contradictions"] = track["conflicts"] = 0
    update_extent(track, line, scan, now, params)
    confirm(track, line, now, params)


@kernel
def _update_errors(track, line, gain):
    """Update the errors' covariance C of a wall at rest by the gain K, kaa, kac, kca, kcc.

    Its error is e' = (I - K) e + K v, v that of the sighting. So C' = (I - K) C (I - K)' + K R K', for whatever K
    (Gelb, "Applied Optimal Estimation", 1974, section 7.2).
    """
    kaa, kac, kca, kcc = gain
    aa, ac, cc = _congruent((1 - kaa, -kac, -kca, 1 - kcc), (track["e_aa"], track["e_ac"], track["e_cc"]))
    raa, rac, rcc = _congruent(gain, (line["e_aa"], line["e_ac"], line["e_cc"]))
    track["e_aa"], track["e_ac"], track["e_cc"] = aa + raa, ac + rac, cc + rcc
    track["away"] = 0.0


@kernel
def _congruent(matrix, symmetric):
    """Return aa, ac, cc of M C M': the `matrix` M is maa, mac, mca, mcc, and C is `symmetric`: aa, ac, cc."""
    maa, mac, mca, mcc = matrix
    aa, ac, cc = symmetric
    first, second = maa * aa + mac * ac, maa * ac + mac * cc  # the first row of M C
    return (
        first * maa + second * mac,
        first * mca + second * mcc,
        mca * (mca * aa + 2 * mcc * ac) + mcc * mcc * cc,
    )


@kernel
def _note_conflict(track):
    """Count a line near a track but not of it: a moving track gives such lines, and is deleted."""
    track["conflicts"] += 1
    if not track["confirmed"] or track["conflicts"] >= MAX_CONTRADICTIONS:
        track["live"] = 0


@kernel
def _initiate(tracks, line, scan, now, params):
    """Initiate a track; when all are in use, the farthest unconfirmed one is replaced, or none."""
    free, farthest = -1, -1.0
    for i in range(len(tracks)):
        if not tracks[i]["live"]:
            free = i
            break
        if not tracks[i]["confirmed"] and tracks[i]["offset"] > max(farthest, line["offset"]):
            free, farthest = i, tracks[i]["offset"]
    if free < 0:
        return
    track = tracks[free]
    track["angle"] = wrapped(line["angle"])
    track["offset"] = line["offset"]
    track["p_aa"], track["p_ac"], track["p_cc"] = line["c_aa"], line["c_ac"], line["c_cc"]
    track["e_aa"], track["e_ac"], track["e_cc"], track["away"] = line["e_aa"], line["e_ac"], line["e_cc"], 0.0
    track["first"] = track["seen"] = now.time
    track["hits"] = track["live"] = 1
    track["missed"] = 0
    track["unseen"] = track["contradictions"] = track["conflicts"] = track["end_moves"] = track["own_only"] = 0
    track["confirmed"] = 0
    track["slot"] = -1
    restart_extent(track, line, scan, now, params)
    note_motion(track, line, now)
    confirm(track, line, now, params)


@kernel
def _delete_contradicted(tracks, scan, params):
    for i in range(len(tracks)):
        track = tracks[i]
        if track["live"] and track["unseen"] > 0:
            met, past, echoes = _beams_on(track, scan, params)
            against = echoes > 0 and met + past >= LEAST_BEAMS and past >= PASSED_SHARE * (met + past)
            track["contradictions"] = track["contradictions"] + 1 if against else 0
            if met >= LEAST_BEAMS:
                track["away"] = 0.0
            if params.min_points > 0 and met >= params.min_points:
                _count_miss(track)
            if track["contradictions"] >= MAX_CONTRADICTIONS:
                track["live"] = 0


@kernel
def _count_miss(track):
    """Take back a sighting for a scan whose beams met the track, and that showed no line there.

    A wall hardly ever fails to be a line. What fails often, as two walls at an obtuse corner do, is a line only in
    scans whose noise makes it look straight. Such sightings are wrong alike. What has hardly been seen and fails more
    often is no wall; one that was seen often and is no line from where the robot stands now stays.
    """
    counted = track["hits"] - track["missed"]
    track["missed"] += 1
    if track["hits"] <= FEW_HITS and track["missed"] >= track["hits"] + MORE_MISSES:
        track["live"] = 0
    if counted > 1:
        grows = counted / (counted - 1.0)
        track["p_aa"], track["p_ac"], track["p_cc"] = (
            grows * track["p_aa"],
            grows * track["p_ac"],
            grows * track["p_cc"],
        )
        track["e_aa"], track["e_ac"], track["e_cc"] = (
            grows * track["e_aa"],
            grows * track["e_ac"],
            grows * track["e_cc"],
        )


@kernel
def _beams_on(track, scan, params):
    """Return how many beams of a scan met a track, how many went past it that should have met it, and all echoes.

    `scan` is ranges (B,) [m] and beams (B, 2). Beams stopped before it say nothing, nor do those without an echo where
    it is nearer than beams tell. A scan without any echo says nothing: the sensor may be blind.
    """
    ranges, beams = scan
    cos, sin, offset = math.cos(track["angle"]), math.sin(track["angle"]), track["offset"]
    low, high = track["low"] + params.extent_margin, track["high"] - params.extent_margin
    met, past, echoes = 0, 0, 0
    for k in range(len(ranges)):
        r = ranges[k]
        if math.isfinite(r):
            echoes += 1
        s, distance = beam_on_line(cos, sin, offset, beams, k)
        if distance > IN_RANGE * params.range_max - params.passed_by or s < low or s > high:
            continue
        if math.isnan(r):
            past += distance > params.blind_range
        elif r > distance + params.passed_by:
            past += 1
        elif r > distance - params.passed_by:
            met += 1
    return met, past, echoes
