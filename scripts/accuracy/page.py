"""The measured part of docs/perception-accuracy.md."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterable

from robots import SPACINGS
from walls import band

BEGIN = "<!-- From here on written by `python scripts/accuracy`; change it there. -->\n"
COLUMNS = ("angle_rms_deg", "angle_bias_deg", "offset_rms_m", "offset_bias_m")


def written(page: str, found: dict) -> str:
    """Return the page with its measured part, from BEGIN to the end, written anew."""
    before, begin, _ = page.partition(BEGIN)
    if not begin:
        raise ValueError(f"the page has no line {BEGIN!r}")
    parts = (_what(found), _whole(found), _low(found), _places(found))
    return before + BEGIN + "".join(f"\n{part.strip()}\n" for part in parts)


def _what(found: dict) -> str:
    ring, robotarium, cones = (found["sensors"][name] for name in ("tof_ring", "robotarium", "tof_cones"))
    four, of = found["tof_ring_of_four_points"], found["seeds"]
    (low, high), (near, wide) = band(of), (f"{s[0]:g} to {s[1]:g} m" for s in SPACINGS)
    angle, offset = _worst(ring, "1.5 m", "single")
    far, fused = _worst(robotarium, "2.5 m", "single"), _worst(robotarium, "2.5 m", "fused")
    turned, moved = _bias(robotarium, "fused")
    least, most = min(ring["low"]["recall"]), max(ring["low"]["recall"])
    recall = ", ".join(f"{share:.0%}" for share in four["recall"])
    return _filled(f"""
`python scripts/accuracy`, {of} seeds: a wall of 3 m, its middle at a range and incidence, a robot at rest with a random
heading, ten scans. Every cell has noise of its own, and the camera's (1 mm, 0.2 deg) is part of every figure. `generic`
is the schema's default sensor (5 mm).

- *Recall*: the wall binds after ten scans.
- *Outside*: the half-space for k = 3 lets the hand point nearer to the wall than the clearance; allowed are 0.3 %.
- *False walls*: tracks that count as walls and are not the wall, over 50 scans a seed of a wall at 2 m and four robots
  that move before it at up to 0.3 m/s, always all four within 1.8 m, apart and in view. A track is the wall's when its
  angle and offset are right within their covariance (one honest track in a million is not).
- *Rows*: {of} times, four robots, unknown to the estimator, rest abreast for 50 scans; how often they are
  taken for a wall, spaced {near} and {wide}.
- *Low beams*: the same at 30 mm, where robots are a tub between two wheels and each robot's own wheels stop 42 deg to
  either side: a wall whose middle is 1 m away, at random on the blind sides or not; false walls before the same wall
  with the same four robots, each headed where it goes; close rows in line ahead, whose wheels' flats lie in one line.
- *NEES*: the normalised error squared of (angle, offset), 2 on average when the covariance is right. The mean of {of}
  honest ones is from {low:.2f} to {high:.2f} in 95 % of cells; *pooled* is the mean of all cells with its own band.
- *Bias* is known to RMS / sqrt({of}), so the largest of many such figures may be 2.5 times that by chance.

What the figures say:

- The cheap ring (`tof_ring`) is limited by its 24 beams, six of which meet the wall at 1.5 m: at worst {angle:.2f} deg
  and {offset:.1f} mm from one scan, of which the camera's part is 0.2 deg and 1 mm.
- From 2 m on fewer than `estimator.min_points` = 5 of them do, and the wall is often or always missed. Four points
  would see more (at 2 m {recall} at 0, 30 and 60 deg), but with 15 deg between beams four robots abreast give four
  points on a line, one each, and no beam between them: of {of} rows at rest {four["rows"][0]} and {four["rows"][1]}
  became walls ({near}, {wide}), against {ring["rows"][0]} and {ring["rows"][1]} with five points. Such scans cannot
  distinguish the two, so the default is five. A team with fewer than four other robots may set `min_points: 4`.
- The cones of `tof_cones`, 27 deg wide and 15 deg apart, need eight points: four robots abreast are in seven views.
  With that {cones["rows"][0]} and {cones["rows"][1]} of {of} rows become walls. Walls are as exact as those of
  `tof_ring`, and seen up to 1.5 m (recall {cones["cells"]["1.5 m, 0 deg"]["recall"]:.0%} there). Of low cones, wheels
  hide so many that no line is left to a robot at rest.
- A scan of `lds_02` takes 0.2 s. Nothing moves meanwhile, and each of the camera's frames has noise of its own.
- Other sensors take a close, straight row of strangers at rest for a wall now and then, if the gaps let no beam
  through or noise hides that it is round. Its half-space is where the row is, and it is dropped like any wall that
  beams go past.
- The 3 % of `robotarium` dominate its errors: {far[0]:.1f} deg and {far[1]:.0f} mm at 2.5 m, {fused[0]:.1f} deg and
  {fused[1]:.0f} mm after ten scans. The bias left then ({turned:.2f} deg, {moved:.1f} mm at most) is fusion's: a wall
  that is seen too near is believed to be seen better, so it weighs more.
- Low beams make no more false walls, and the flats of wheels in line pass for a wall less often than plates. They cost
  recall: a robot at rest with a blind side to the wall has few beams left on it, of the ring's 24 too few in many
  headings (recall {least:.1%} to {most:.1%} at 1 m), and what it sees at 60 deg beside that side may be too oblique to
  be distinguished from a row of robots. It sees the wall when it turns.""")


def _filled(text: str) -> str:
    """Return the text with its paragraphs and items filled anew: figures differ in length."""

    def fill(some: str) -> str:
        indent = "  " if some.startswith("- ") else ""
        return textwrap.fill(" ".join(some.split()), 120, subsequent_indent=indent, break_on_hyphens=False)

    return "\n\n".join("\n".join(map(fill, re.split(r"\n(?=- )", part))) for part in text.strip().split("\n\n"))


def _whole(found: dict) -> str:
    head = "| sensor | outside | evaluated | false walls | in scans | rows, close | wide "
    head += "| NEES in band, one scan | pooled | ten scans | pooled |"
    rows = []
    for sensor, f in found["sensors"].items():
        single, fused = (_consistent(f["consistency"][name]) for name in ("single", "fused"))
        counts = (f["evaluated"], f["false_walls"], f["false_scans"], *f["rows"])
        rows.append((sensor, _share(f["outside"]), *map(str, counts), *single, *fused))
    return f"{head}\n|{'---|' * 11}\n{_table(rows)}"


def _low(found: dict) -> str:
    head = "| low beams | recall at 1 m, 0 deg | 30 deg | 60 deg | outside | evaluated | false walls | in scans "
    head += "| rows, close | NEES pooled, one scan | ten scans |"
    rows = []
    for sensor, f in found["sensors"].items():
        low = f["low"]
        counts = (low["evaluated"], low["false_walls"], f["false_scans"], low["rows"])
        consistent = (_consistent(low["consistency"][name])[1] for name in ("single", "fused"))
        recall = (f"{share:.1%}" for share in low["recall"])
        rows.append((sensor, *recall, _share(low["outside"]), *map(str, counts), *consistent))
    return f"{head}\n|{'---|' * 11}\n{_table(rows)}"


def _share(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.2%}"


def _consistent(f: dict) -> tuple[str, str]:
    if math.isnan(f["mean"]):
        return "-", "-"
    return f"{f['inside']} of {f['cells']}", f"{f['mean']:.2f} ({f['low']:.2f} to {f['high']:.2f})"


def _places(found: dict) -> str:
    head = "| sensor | range, incidence | recall | angle RMS [deg], one scan | ten | bias, one scan | ten "
    head += "| offset RMS [mm], one scan | ten | bias, one scan | ten | NEES, one scan | ten |"
    rows = [
        (sensor, name, f"{c['recall']:.1%}", *_figures(c))
        for sensor, f in found["sensors"].items()
        for name, c in f["cells"].items()
    ]
    return f"{head}\n|{'---|' * 13}\n{_table(rows)}"


def _figures(cell: dict) -> Iterable[str]:
    for column in (*COLUMNS, "nees"):
        digits = 3 if column == "angle_bias_deg" else 2
        for name in ("single", "fused"):
            value = cell.get(f"{name}_{column}", math.nan) * (1000 if column.endswith("_m") else 1)
            yield "-" if math.isnan(value) else f"{value:.{digits}f}"


def _worst(sensor: dict, distance: str, name: str) -> tuple[float, float]:
    """The largest RMS errors [deg], [mm] at a distance."""
    some = [c for key, c in sensor["cells"].items() if key.startswith(distance)]
    return max(c[f"{name}_angle_rms_deg"] for c in some), 1000 * max(c[f"{name}_offset_rms_m"] for c in some)


def _bias(sensor: dict, name: str) -> tuple[float, float]:
    """The largest biases [deg], [mm] of all cells."""
    some = sensor["cells"].values()
    turn, off = (max(abs(c[f"{name}_{key}"]) for c in some) for key in ("angle_bias_deg", "offset_bias_m"))
    return turn, 1000 * off


def _table(rows: Iterable[tuple[str, ...]]) -> str:
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)
