"""Write docs/scenario.md, the table of every key of a scenario, and the schemas for editors, from the schema.

python scripts/make_scenario_docs.py           # write all
python scripts/make_scenario_docs.py --check   # exit with 1 if one of them is out of date
"""

from __future__ import annotations

import inspect
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from pydantic.fields import FieldInfo

from pbrg_mj.scenario.families.json_schema import family_json_schema
from pbrg_mj.scenario.families.schema import Distribution, Draw, Drawn
from pbrg_mj.scenario.schema import Scenario, Section
from pbrg_mj.scenario.schema.describe import describe, describe_field, keys
from pbrg_mj.scenario.schema.json_schema import json_schema

PAGE = Path(__file__).resolve().parents[1] / "docs" / "scenario.md"
SCHEMA = PAGE.parents[1] / "scenarios" / "schema.json"
FAMILY_SCHEMA = SCHEMA.with_name("family_schema.json")
UNIT = re.compile(r" ?\[(-|m|clearances|s|N|Hz|deg|1/s|m/s|m\^4/s)\]")

HEAD = """# Scenario: every key

<!-- Written by scripts/make_scenario_docs.py from pbrg_mj/scenario/schema: change it there. -->

A scenario is one YAML 1.2 file. Only `team` and `operator` are required; every other key has a default.

- SI units, unless the key says otherwise (`heading_deg`). Positions are in the world frame.
- Robots are numbered from 1, as in the paper. Their number is the length of `team.start`.
- An unknown key, a key given twice, a quoted number and a tag are errors: nothing is guessed or ignored.
- A key's full name is its path with dots, entries of a list counted from 0: `world.walls.0.thickness`. Errors use these
  names, and so do overrides: `pbrg run SCENARIO --set governor.rounds=20 --set world.walls.0.thickness=0.2`.
- In the tables, N stands for an entry's index.

Between keys, this must hold as well: `team.formation` (and `team.heading_deg`, if a list) is as long as `team.start`;
robot numbers exist and stand in a list once; the graph is connected; `timing.tick` is a whole multiple of
`timing.physics_step` (physics plant), and `timing.duration` and `reference.period` are whole multiples of
`timing.tick`; `plant: ideal` goes with `estimator.source: given`, and `estimator.given` with that source alone;
`operator` has either `reference` or `waypoints`, which start at 0 s and move on in time, as do the waypoints of a
moving box; walls, thresholds and ramps have a length, boxes and patches an area, prisms are polygons; at the start
nothing stands in a robot and, in the physics plant, no two robots overlap, nor does a kidnapping put a robot onto what
stands still or another robot's start, or lift it while it is in the air; disturbances last one physics step or longer.

The ideal plant refuses what it would ignore: `drive`, `radio`, `disturbances`, `sensors.camera.delay`, `lost_frames`,
`occlusions` and `swaps`, `sensors.uwb`, `sensors.odometry`, `world.moving_boxes`, `world.patches`,
`world.thresholds`, `world.ramps`, `world.floor_friction` and `world.rolling_resistance` may be given with their
defaults only. A key of `governor` that belongs to another `kind` or `optimizer` than the scenario's is a warning of
`pbrg validate` and `pbrg run`; those of the paper's algorithm, such as `alpha`, are none: scenarios that have them are
run with other kinds, too. So is `control.separation: auto` where it is null beside `estimator.source: points`, with
`rollout`, `centralized`, `cbf` and `potential_field`.

A beam's range becomes a reading in this order: the nearest thing in its cone, echoes lost for want of light, bias,
additive and multiplicative Gaussian noise, quantisation, range limits, outliers, dropout. Keys given beside
`sensors.beams.preset` win over the preset's.
"""

FAMILIES = """
## Families of worlds: `draw`

A scenario with the section `draw` is a family: every seed draws a concrete scenario from it. [worlds.md](worlds.md)
says how. Beside `draw` stand the other sections, without `team.start`, `team.formation` and `operator.reference`, which
are drawn. A distribution is a section with one of the keys `uniform`, `log_uniform`, `integer` (lowest and highest
value), `normal` (mean and standard deviation, cut off at three) and `choice` (a list), such as `{uniform: [1.0, 2.0]}`.
"""


def page() -> str:
    """Return the whole page."""
    return HEAD + "".join(tables(Scenario, "")) + FAMILIES + "".join(tables(Draw, "draw"))


def tables(section: type[Section], path: str) -> Iterator[str]:
    """Yield the section's table, then those of the sections in it."""
    inner = {name: inside for name, field in keys(section).items() if (inside := section_inside(field.annotation))}
    rows = [row(name, field) for name, field in keys(section).items() if name not in inner or is_list(field)]
    title = f"`{path}`" if path else "Top level"
    yield f"\n## {title}\n\n{inspect.cleandoc(section.__doc__ or '')}\n"
    if rows:
        yield "\n| key | allowed | unit | default | meaning |\n|---|---|---|---|---|\n" + "".join(rows)
    if not path:
        yield f"\nAnd the sections {', '.join(f'`{name}`' for name in inner)}.\n"
    for name, inside in inner.items():
        place = f"{path}.{name}" if path else name
        yield from tables(inside, f"{place}.N" if is_list(section.model_fields[name]) else place)


def section_inside(kind: Any) -> type[Section] | None:
    """Return the section that a key holds, by itself or in a list."""
    candidates = [kind, *get_args(kind)]
    sections = (c for c in candidates if isinstance(c, type) and issubclass(c, Section))
    return next((c for c in sections if c is not Distribution), None)


def is_list(field: FieldInfo) -> bool:
    return not isinstance(field.annotation, type)


def row(name: str, field: FieldInfo) -> str:
    units = UNIT.findall(field.description or "")
    meaning = UNIT.sub("", field.description or "")
    allowed = describe_field(field).replace(describe(Drawn), "a number or a distribution")
    cells = [f"`{name}`", allowed, " ".join(units), default(field), meaning]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |\n"


def default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.default
    return f"`{(value or repr(value)) if isinstance(value, str) else json.dumps(value)}`"


def main() -> int:
    late = 0
    texts = (page(), *(json.dumps(made, indent=2) + "\n" for made in (json_schema(), family_json_schema())))
    for file, text in zip((PAGE, SCHEMA, FAMILY_SCHEMA), texts, strict=True):
        if "--check" not in sys.argv[1:]:
            file.write_text(text, encoding="utf-8")
        elif not file.is_file() or file.read_text(encoding="utf-8") != text:
            print(f"{file.name} is out of date: run scripts/make_scenario_docs.py", file=sys.stderr)
            late = 1
    return late


if __name__ == "__main__":
    sys.exit(main())
