"""The lines of a scan in plain numpy: the same rules as the compiled kernels, written for arrays and lists of beams."""

import math

import numpy as np
from scipy.stats import norm

from pbrg_mj.perception.scan.collinear import NOISE_MARGIN
from pbrg_mj.perception.scan.corners import AMBIGUOUS, MOST_BETWEEN
from pbrg_mj.perception.scan.line_ends import CLEARLY_FARTHER, RANGE_SHARE
from pbrg_mj.perception.scan.line_fit import LEAST_COSINE
from pbrg_mj.perception.scan.parameters import LineParameters
from pbrg_mj.perception.scan.points import BREAK_MARGIN, CHORD_MARGIN, MAX_LOST
from pbrg_mj.perception.scan.robust_fit import (
    FALSE_ALARM,
    HIDES_KINK,
    LIMIT_MARGIN,
    MAX_BEND,
    MAX_BEND_SHORT,
    MAX_OUTLIERS,
    OUTLIER,
    OUTLIER_SHARE,
    SHORT,
)

Beams = list[int]
GRAZING, LEAST_SINE, OBLIQUE = math.sin(math.radians(10.0)), math.sin(math.radians(5.0)), math.tan(math.radians(35.0))
MOST_TURN, MIN_TURN, MAX_TURN, MAX_ANGLE_STD = np.radians([10.0, 5.0, 40.0, 3.5])
LEAST_GAP = 0.1  # [m]


class Scan:
    """A scan and its parameters."""

    def __init__(self, ranges: np.ndarray, directions: np.ndarray, params: LineParameters) -> None:
        self.r, self.d, self.params = ranges, directions, params
        self.beams = len(ranges)
        self.xy = ranges[:, None] * directions
        self.var = params.range_std**2 + (params.noise_ratio * ranges) ** 2
        self.odds: dict[int, float] = {}  # odds of a beam's point, last on its wall, to be beyond the corner

    def apart(self, a: int, b: int, skipped: int) -> bool:
        lost = (b - a) % self.beams - 1 - skipped
        sine = float(np.linalg.det(self.d[[a, b]]))
        if (b <= a and not self.params.closed) or not 0 <= lost <= MAX_LOST or sine <= 0:
            return True
        limit = min(self.r[a], self.r[b]) * sine / GRAZING + BREAK_MARGIN * math.sqrt(self.var[a] + self.var[b])
        return bool(np.linalg.norm(self.xy[b] - self.xy[a]) > limit)

    def broken(self, a: int, b: int) -> bool:
        between = [(a + k) % self.beams for k in range(1, (b - a) % self.beams)]
        return self.apart(a, b, int((self.r[between] < max(self.r[a], self.r[b])).sum()))

    def chord_errors(self, a: int, z: int, some: Beams) -> np.ndarray:
        chord, off = self.xy[z] - self.xy[a], self.xy[some] - self.xy[a]
        length = float(np.linalg.norm(chord))
        if length == 0:
            return np.linalg.norm(off, axis=1) / self.params.split_distance
        n = np.array([chord[1], -chord[0]]) / length
        u = off @ chord / length**2
        across = self.var * (self.d @ n) ** 2
        std = np.sqrt(across[some] + (1 - u) ** 2 * across[a] + u**2 * across[z])
        return off @ n / np.maximum(self.params.split_distance, CHORD_MARGIN * std)


def find_lines(ranges: np.ndarray, directions: np.ndarray, params: LineParameters) -> list[dict]:
    """Walls as dicts of angle, offset, covariance, low, high, free_low, free_high and their beams; longest first."""
    scan = Scan(ranges, directions, params)
    order = without_outliers(scan, np.flatnonzero(np.isfinite(ranges)).tolist())
    clusters, ring = cluster(scan, order)
    segments = [split_and_merge(scan, beams) for beams in clusters]
    flat = [(segment, k) for k, group in enumerate(segments) for segment in group]
    walls = [
        wall
        for i, (segment, _) in enumerate(flat)
        if not curved(scan, flat, ring, i) and (wall := fit_segment(scan, segment))
    ]
    turned = [b for group in clusters for b in group]
    walls = settled(scan, joined(scan, walls, turned), turned)
    for wall in walls:
        others = {b for other in walls if other is not wall for b in other["points"]}
        doubted(scan, wall, (turned, others), inflated(scan, wall))
        wall["free_low"] = ends_at(scan, wall, wall["beams"][0], -1)
        wall["free_high"] = ends_at(scan, wall, wall["beams"][1], 1)
    return sorted(walls, key=lambda wall: wall["low"] - wall["high"])


def without_outliers(scan: Scan, order: Beams) -> Beams:
    count = len(order)

    def spike(i: int, size: int) -> bool:
        if count < size + 4:
            return False
        a2, a, *off, z, z2 = (order[k % count] for k in range(i - 2, i + size + 2))
        errors = scan.chord_errors(a, z, off)
        if np.any(np.abs(errors) <= 1) or (size == 2 and np.any(errors > 0)):
            return False
        same = not (scan.apart(a2, a, 0) or scan.apart(a, z, int((errors < 0).sum())) or scan.apart(z, z2, 0))
        return same and bool(np.all(np.abs(scan.chord_errors(a2, z2, [a, z])) <= 1))

    return [b for i, b in enumerate(order) if not (spike(i, 1) or spike(i, 2) or spike(i - 1, 2))]


def cluster(scan: Scan, order: Beams) -> tuple[list[Beams], bool]:
    if not order:
        return [], False
    broken = [scan.broken(b, after) for b, after in zip(order, order[1:] + order[:1], strict=True)]
    ring = not any(broken)
    first = int(np.argmax(scan.r[order])) if ring else int(np.flatnonzero(broken)[-1]) + 1
    turned = order[first:] + order[:first]
    cuts = [i for i in range(1, len(turned)) if scan.broken(turned[i - 1], turned[i])]
    return [turned[i:j] for i, j in zip([0, *cuts], [*cuts, len(turned)], strict=True)], ring


def split_and_merge(scan: Scan, beams: Beams) -> list[Beams]:
    def cut(some: Beams) -> int | None:
        if len(some) < 3:
            return None
        errors = np.abs(scan.chord_errors(some[0], some[-1], some[1:-1]))
        return int(np.argmax(errors)) + 1 if errors.max() > 1 else None

    def split(some: Beams) -> list[Beams]:
        at = cut(some)
        return [some] if at is None else split(some[:at]) + split(some[at:])

    merged: list[Beams] = []
    for segment in split(beams):
        if merged and cut(merged[-1] + segment) is None:
            merged[-1] = merged[-1] + segment
        else:
            merged.append(segment)
    return merged


def curved(scan: Scan, segments: list[tuple[Beams, int]], ring: bool, i: int) -> bool:
    def turn(a: tuple[Beams, int], b: tuple[Beams, int]) -> float:
        if min(len(a[0]), len(b[0])) < 3 or (a[1] != b[1] and not ring):
            return 0.0
        chords = [complex(*(scan.xy[segment[-1]] - scan.xy[segment[0]])) for segment in (a[0], b[0])]
        angle = float(np.angle(chords[1] * chords[0].conjugate()))
        return angle if MIN_TURN < abs(angle) < MAX_TURN else 0.0

    after = segments[(i + 1) % len(segments)]
    return len(segments) >= 3 and turn(segments[i - 1], segments[i]) * turn(segments[i], after) > 0


def weights(scan: Scan, some: Beams, normal: np.ndarray, c: float) -> np.ndarray:
    cosine = np.maximum(np.abs(scan.d[some] @ normal), LEAST_COSINE)
    return 1 / ((cosine * scan.params.range_std) ** 2 + (scan.params.noise_ratio * c) ** 2)


def jacobian(scan: Scan, some: Beams, normal: np.ndarray, c: float) -> np.ndarray:
    """Of the residuals n . p - c by (angle, offset), each point where its beam meets the line."""
    tangent = np.array([-normal[1], normal[0]])
    cosine = scan.d[some] @ normal
    met = c * (scan.d[some] @ tangent) / np.maximum(cosine, LEAST_COSINE)
    return np.column_stack([np.where(cosine < LEAST_COSINE, scan.xy[some] @ tangent, met), -np.ones(len(some))])


def unit(angle: float) -> np.ndarray:
    return np.array([math.cos(angle), math.sin(angle)])


def fit_line(scan: Scan, some: Beams, normal: np.ndarray, c: float) -> dict:
    """Weighted total least squares, then one weighted step with predicted coordinates; `normal`, c: for the weights."""
    xy, w = scan.xy[some], weights(scan, some, normal, c)
    mean = w @ xy / w.sum()
    _, axes = np.linalg.eigh(((xy - mean).T * w) @ (xy - mean))
    normal = axes[:, 0] * (1 if axes[:, 0] @ mean >= 0 else -1)
    c = float(normal @ mean)
    root = np.sqrt(weights(scan, some, normal, c))
    by = jacobian(scan, some, normal, c)
    turn, shift = np.linalg.lstsq(root[:, None] * by, root * (c - xy @ normal))[0]
    angle, c = math.atan2(normal[1], normal[0]) + turn, c + shift
    angle, c = (math.remainder(angle, 2 * math.pi), c) if c >= 0 else (math.remainder(angle + math.pi, 2 * math.pi), -c)
    normal = unit(angle)
    w, by = weights(scan, some, normal, c), jacobian(scan, some, normal, c)
    return {
        "angle": angle,
        "offset": c,
        "covariance": np.linalg.inv((by.T * w) @ by),
        "low": by[:, 0].min(),
        "high": by[:, 0].max(),
        "normal": normal,
        "jacobian": by,
        "weight": w,
        "residual": xy @ normal - c,
    }


def fit_segment(scan: Scan, segment: Beams) -> dict | None:
    params, some, outliers, checked = scan.params, list(segment), 0, False
    while outliers <= max(MAX_OUTLIERS, OUTLIER_SHARE * len(segment)):
        if len(some) < params.min_points or math.dist(scan.xy[some[0]], scan.xy[some[-1]]) < params.min_length:
            return None
        x, y = scan.xy[some[-1]] - scan.xy[some[0]]
        chord = np.array([y, -x]) / math.hypot(x, y)
        line = fit_line(scan, some, chord, float(abs(chord @ scan.xy[some[0]])))
        if not checked:
            checked = True
            r = line["offset"] / np.maximum(scan.d[some] @ line["normal"], 1e-6)
            inside = r + LIMIT_MARGIN * np.hypot(params.range_std, params.noise_ratio * r) <= params.range_max
            inside &= r >= params.blind_range
            if not inside.all():
                some = np.array(some)[inside].tolist()
                continue
        w, jacobian = line["weight"], line["jacobian"]
        leverage = w * np.einsum("ij,jk,ik->i", jacobian, line["covariance"], jacobian)
        deviation = np.abs(line["residual"]) * np.sqrt(w / np.maximum(1 - leverage, 1e-6))
        if deviation.max() <= OUTLIER:
            return {**line, "points": some, "beams": (some[0], some[-1])} if is_wall(scan, line) else None
        del some[int(np.argmax(deviation))]
        outliers += 1
    return None


def is_wall(scan: Scan, line: dict) -> bool:
    w, e, s = line["weight"], line["residual"], line["jacobian"][:, 0]
    k = 2 / (9 * (len(s) - 2))
    straight = w @ e**2 <= (len(s) - 2) * (1 - k + FALSE_ALARM * math.sqrt(k)) ** 3
    # The bend: the part of the residuals along s^2, made orthogonal to 1 and s in the weighted scalar product.
    s = s - w @ s / w.sum()
    root = np.sqrt(w)
    basis, _ = np.linalg.qr(root[:, None] * np.column_stack([np.ones_like(s), s, s**2]))
    bend = abs(float(basis[:, 2] @ (root * e)))
    short = line["high"] - line["low"] < SHORT * scan.params.min_length
    oblique = abs(line["low"] + line["high"]) > 2 * OBLIQUE * line["offset"]
    sure = line["covariance"][0, 0] <= MAX_ANGLE_STD**2
    strict = short or line["covariance"][0, 0] > HIDES_KINK**2
    return bool(straight and sure and bend <= (MAX_BEND_SHORT if strict else MAX_BEND) and not (short and oblique))


def joined(scan: Scan, walls: list[dict], order: Beams) -> list[dict]:
    result: list[dict] = []
    for wall in sorted(walls, key=lambda wall: wall["low"] - wall["high"]):
        for index, known in enumerate(result):
            both = joint(scan, known, wall, order)
            if both is not None:
                result[index] = both
                break
        else:
            result.append(wall)
    return result


def joint(scan: Scan, a: dict, b: dict, order: Beams) -> dict | None:
    turn = abs(math.remainder(a["angle"] - b["angle"], 2 * math.pi))
    if turn > MOST_TURN + NOISE_MARGIN * math.sqrt(a["covariance"][0, 0] + b["covariance"][0, 0]):
        return None
    members = set(a["points"]) | set(b["points"])
    points = [p for p in order if p in members]
    line = fit_line(scan, points, a["normal"], a["offset"])
    if np.any(
        np.abs(line["residual"]) > np.maximum(scan.params.split_distance, NOISE_MARGIN / np.sqrt(line["weight"]))
    ):
        return None
    first, last = sorted((a, b), key=lambda wall: wall["low"])
    if has_gap(scan, line, first["beams"][1], last["beams"][0]):
        return None
    end = first if last["high"] < first["high"] else last
    return {**line, "points": points, "beams": (first["beams"][0], end["beams"][1])}


def settled(scan: Scan, walls: list[dict], order: Beams) -> list[dict]:
    """Points beside a corner are of the wall that their beams meet, if they are on it."""
    owner: dict[int, int] = {b: i for i, wall in enumerate(walls) for b in wall["points"]}
    n, moved = len(order), set()

    def run(i: int, step: int) -> Beams:
        """Beams from place i on, up to the next one of another wall."""
        own, some = owner[order[i]], []
        for k in range(n):
            b = order[(i + step * k) % n]
            if owner.get(b, own) != own:
                break
            some.append(b)
        return some

    for k in range(n):
        ahead = ((k + s) % n for s in range(1, min(MOST_BETWEEN + 2, n)))
        z = next((i for i in ahead if order[i] in owner), None)
        if order[k] not in owner or z is None or owner[order[z]] == owner[order[k]]:
            continue
        pair = owner[order[k]], owner[order[z]]
        normals = np.array([walls[i]["normal"] for i in pair])
        if (
            scan.apart(order[k], order[z], (order[z] - order[k]) % scan.beams - 1)
            or abs(np.linalg.det(normals)) < LEAST_SINE
        ):
            continue
        corner = np.linalg.solve(normals, [walls[i]["offset"] for i in pair])
        u = corner / np.linalg.norm(corner)
        sine = scan.d @ np.array([-u[1], u[0]])
        back, forth = run(k, -1), run(z, 1)
        if not (any(sine[b] < 0 < scan.d[b] @ u for b in back) and any(sine[b] > 0 < scan.d[b] @ u for b in forth)):
            continue
        jacobian = np.linalg.solve(normals.T, np.array([-u[1], u[0]]))
        ambiguous = AMBIGUOUS * math.sqrt(
            sum(j**2 * place_variance(walls[i], corner) for j, i in zip(jacobian, pair, strict=True))
        )
        ambiguous /= float(np.linalg.norm(corner))
        lost = []
        for some, side, own in ((back, -1, 0), (forth, 1, 1)):
            stop = next((i for i, b in enumerate(some) if side * sine[b] > ambiguous), len(some))
            lost.append([b for b in some[:stop] if owner.get(b) == pair[own]])
        few = [
            sum(o == i for o in owner.values()) - len(gone) < scan.params.min_points
            for i, gone in zip(pair, lost, strict=True)
        ]
        if any(few) or not all(on_line(scan, walls[pair[1 - i]], b) for i in (0, 1) for b in lost[i]):
            continue
        for i, side in ((0, -1), (1, 1)):
            for b in lost[i]:
                del owner[b]
                if side * sine[b] < -ambiguous:
                    owner[b] = pair[1 - i]
        moved |= set(pair) if any(lost) else set()
        for i, side, place in ((0, -1, z), (1, 1, k)):
            other = next(s for s in range(n) if owner.get(order[(place - side * s) % n]) == pair[1 - i])
            last = next(b for s in range(n) if owner.get(b := order[(place - side * (other - s)) % n]) == pair[i])
            beyond = float(norm.sf(AMBIGUOUS * side * sine[last] / ambiguous))
            scan.odds[last] = beyond / (1 - beyond)
    for i in moved:
        points = [b for b in order if owner.get(b) == i]
        walls[i] |= fit_line(scan, points, walls[i]["normal"], walls[i]["offset"]) | {"points": points}
    return walls


def place_variance(line: dict, place: np.ndarray) -> float:
    at = np.array([line["normal"][0] * place[1] - line["normal"][1] * place[0], -1])
    return float(at @ line["covariance"] @ at)


def on_line(scan: Scan, line: dict, b: int) -> bool:
    at = np.array([meets(scan, line, b), -1])
    variance = at @ line["covariance"] @ at + 1 / weights(scan, [b], line["normal"], line["offset"])[0]
    off = line["normal"] @ scan.xy[b] - line["offset"]
    return bool(scan.d[b] @ line["normal"] > LEAST_COSINE and off**2 <= OUTLIER**2 * variance)


def left_out(line: dict, i: int) -> tuple[np.ndarray, np.ndarray, float, float]:
    """How far the line moves without point i, its covariance then, and that point's residual then and its deviation."""
    by, w, e = line["jacobian"], line["weight"], line["residual"]
    rest = np.delete(np.arange(len(w)), i)
    without = np.linalg.inv((by[rest].T * w[rest]) @ by[rest])
    shift = without @ by[i] * w[i] * e[i]  # sum w e by = 0 of the whole line, so of the rest it is - w e by
    return shift, without, e[i] + by[i] @ shift, math.sqrt(1 / w[i] + by[i] @ without @ by[i])


def inflated(scan: Scan, line: dict) -> np.ndarray:
    """The covariance with what an outlier among the points would mean: the line without it, as often as it is one."""
    plain, cosine = line["covariance"], scan.d[line["points"]] @ line["normal"]
    more = np.zeros((2, 2))
    for i in range(len(line["weight"])):
        shift, without, predicted, std = left_out(line, i)
        odds = scan.params.outlier_density / cosine[i] / norm.pdf(predicted, scale=std)
        more += odds / (1 + odds) * (np.outer(shift, shift) + without - plain)
    return plain + more


def doubted(scan: Scan, line: dict, beams: tuple[Beams, set[int]], covariance: np.ndarray) -> None:
    """Write the mixture of the line with all points and those without a last one that may be another surface's.

    `beams` are all that have a point, in turn, and those of other lines.
    """
    order, others = beams
    plain, along, move = line["covariance"], line["jacobian"][:, 0], np.zeros(2)
    for side, i in ((-1, int(np.argmin(along))), (1, int(np.argmax(along)))):
        b = line["points"][i]
        after = order[(order.index(b) + side) % len(order)]
        first, second = (b, after) if side == 1 else (after, b)
        turn = second - first > 0 or scan.params.closed
        hidden = after in others and turn and (second - first) % scan.beams <= 1 + MAX_LOST
        if scan.apart(first, second, 0) and not hidden:
            continue
        shift, without, predicted, std = left_out(line, i)
        off = line["normal"] @ scan.xy[after] - line["offset"]
        room = max(abs(off), OUTLIER / math.sqrt(weights(scan, [after], line["normal"], line["offset"])[0]))
        density = norm.cdf(predicted / std * np.copysign(1, off)) / room
        odds = scan.odds.get(b, 1.0) * density / norm.pdf(predicted, scale=std)
        p = odds / (1 + odds)
        move = move + p * shift
        covariance = covariance + p * (without - plain + (1 - p) * np.outer(shift, shift))
    line["angle"] = math.remainder(line["angle"] + move[0], 2 * math.pi)
    line["offset"] += move[1]
    line |= {"normal": unit(line["angle"]), "covariance": covariance}


def meets(scan: Scan, line: dict, b: int) -> float:
    """Where a beam meets the line, along t."""
    nx, ny = line["normal"]
    return float(line["offset"] * (np.array([-ny, nx]) @ scan.d[b]) / max(scan.d[b] @ line["normal"], LEAST_COSINE))


def passes(scan: Scan, line: dict, b: int) -> bool:
    cosine, c = float(scan.d[b] @ line["normal"]), line["offset"]
    if cosine < LEAST_COSINE or c / cosine > RANGE_SHARE * scan.params.range_max:
        return False
    if np.isnan(scan.r[b]):
        return bool(c / cosine > scan.params.blind_range)
    at = np.array([meets(scan, line, b), -1])
    variance = at @ line["covariance"] @ at + 1 / weights(scan, [b], line["normal"], c)[0]
    return bool(scan.r[b] * cosine - c > max(scan.params.split_distance, CLEARLY_FARTHER * math.sqrt(variance)))


def beside(scan: Scan, b: int, steps: range) -> Beams:
    numbers = [b + k for k in steps]
    return [k % scan.beams for k in numbers if scan.params.closed or 0 <= k < scan.beams]


def ends_at(scan: Scan, line: dict, b: int, side: int) -> bool:
    others = beside(scan, b, range(side, side * (scan.beams // 2), side))
    for run, other in enumerate(others, start=1):
        if not passes(scan, line, other):
            return False
        if run >= scan.params.agree and abs(meets(scan, line, other) - meets(scan, line, b)) >= LEAST_GAP:
            return True
    return False


def has_gap(scan: Scan, line: dict, low: int, high: int) -> bool:
    between = (high - low) % scan.beams - 1
    if between > scan.beams // 2:
        return False
    run: Beams = [low]  # the last beam that does not pass, and those after it
    for b in beside(scan, low, range(1, between + 1)):
        run = [*run, b] if passes(scan, line, b) else [b]
        if len(run) > scan.params.agree and meets(scan, line, run[-1]) - meets(scan, line, run[0]) >= LEAST_GAP:
            return True
    return False
