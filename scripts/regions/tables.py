"""Tables in Markdown of what the methods gave."""

from __future__ import annotations

from collections.abc import Callable
from statistics import mean, median

from regions.measures import NOTED, Worth
from regions.methods import ABOUT, ALONG, CORRIDOR, OURS, TRUE_ABOUT, Row

Found = list[tuple[str, dict[str, Row]]]  # the family and all rows of each view
SAME = 0.01  # [m]
BY_METHOD = (
    "regions",
    "area [m²]",
    "to ours",
    "ahead [m]",
    "left [m]",
    "nearer, farther than ours",
    "too near in",
    "worst [cm]",
    "from [m] on",
    "faces",
    "ms",
)


def by_method(found: Found) -> str:
    """Return a line a method, over all views."""
    lines = [_line(["method", *BY_METHOD]), _line(["---"] * (len(BY_METHOD) + 1))]
    for name in found[0][1]:
        pairs = [(one.worth, view[OURS].worth) for _, view in found if (one := view[name]).worth and view[OURS].worth]
        worths = [one for one, _ in pairs]
        nearer = sum(one.left < ours.left - SAME for one, ours in pairs)
        farther = sum(one.left > ours.left + SAME for one, ours in pairs)
        seconds = median(view[name].seconds for _, view in found)
        cells = [
            f"{sum(one.holds for one in worths)} of {len(found)}",
            f"{median(one.area for one in worths):.1f}",
            f"{median(one.area / ours.area for one, ours in pairs if ours.area > 0.0):.2f}",
            f"{mean(one.ahead for one in worths):.2f}",
            f"{mean(one.left for one in worths):.2f}",
            "" if name == OURS else f"{nearer}, {farther}",
            str(sum(one.depth > NOTED for one in worths)),
            f"{100 * max(one.depth for one in worths):.1f}",
            f"{nearest:.1f}" if (nearest := min(one.away for one in worths)) < float("inf") else "",
            f"{median(one.faces for one in worths):g}, {max(one.faces for one in worths)}",
            "" if seconds != seconds else f"{1e3 * seconds:.2g}",
        ]
        lines.append(_line([name, *cells]))
    return "\n".join(lines)


def by_family(found: Found) -> str:
    """Return a line a family: areas and what is left to the target, of some methods."""
    shown = [name for name in (OURS, CORRIDOR, ABOUT, ALONG, TRUE_ABOUT) if name in found[0][1]]
    lines = [_line(["family", *(f"{name}: area, left" for name in shown)]), _line(["---"] * (len(shown) + 1))]
    for family in dict.fromkeys(name for name, _ in found):
        views = [view for name, view in found if name == family]
        cells = []
        for name in shown:
            worths = [one.worth for view in views if (one := view[name]).worth]
            cells.append(f"{_of(median, worths, 'area'):.1f}, {_of(mean, worths, 'left'):.2f}")
        lines.append(_line([family, *cells]))
    return "\n".join(lines)


def _of(middle: Callable[[list[float]], float], worths: list[Worth], figure: str) -> float:
    return middle([getattr(one, figure) for one in worths])


def _line(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"
