"""Parts of other packages: found by name among entry points, built with options of their own, or objects of one's own.

An entry point names a build function `build(scenario)`. Where it has parameters of these names it is given more:
`options`, annotated with a pydantic model that the scenario's options must fit, and what the kind of part comes with,
such as `network`. A scenario file alone never runs code: the package must be installed.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from importlib.metadata import EntryPoint, entry_points
from typing import Any, NamedTuple

from pydantic import ValidationError

from pbrg_mj.errors import InputError, PlugInError
from pbrg_mj.plugin_calls import plug_in_errors, read_only_copy
from pbrg_mj.plugin_options import option_keys, options_model, parameters, unknown_options, validated

OBJECT = "object:"
"""What a scenario's name of a part begins with where the part is an object handed over in Python."""


class Kind(NamedTuple):
    """One kind of part that other packages may offer."""

    noun: str
    group: str  # of entry points
    key: str  # where a scenario names it; empty: no scenario does
    options: str  # where a scenario gives its options
    built_in: tuple[str, ...]  # names of our own
    methods: tuple[str, ...]  # what the built object must have
    other: Kind | None = None  # another kind whose names may stand there too


ROBOT_PROGRAM = Kind(
    "robot program",
    "pbrg_mj.robot_programs",
    "governor.kind",
    "governor.options",
    (),
    ("start", "begin", "send", "receive", "finish"),
)
GOVERNOR = Kind(
    "governor",
    "pbrg_mj.governors",
    "governor.kind",
    "governor.options",
    ("distributed", "certified", "rollout", "centralized", "none", "cbf", "potential_field"),
    ("init", "step"),
    ROBOT_PROGRAM,
)
CERTIFICATE = Kind(
    "certificate",
    "pbrg_mj.certificates",
    "governor.certificate",
    "governor.certificate_options",
    ("ball", "directional_ball", "predictive"),
    ("rows",),
)
ESTIMATOR = Kind(
    "estimator",
    "pbrg_mj.estimators",
    "estimator.source",
    "estimator.options",
    ("beams", "points", "given"),
    ("init", "step"),
)
NOISE_MODEL = Kind(
    "noise model",
    "pbrg_mj.noise_models",
    "sensors.noise_model",
    "sensors.noise_options",
    ("standard",),
    ("scan", "pose"),
)
REFERENCE_SOLVER = Kind(
    "reference solver",
    "pbrg_mj.reference_solvers",
    "reference.solver",
    "reference.options",
    ("clarabel", "cvxpy", "none"),
    ("solve",),
)
METRIC = Kind("metric", "pbrg_mj.metrics", "", "", (), ())
IN_SCENARIOS = (GOVERNOR, CERTIFICATE, ESTIMATOR, NOISE_MODEL, REFERENCE_SOLVER)


class Objects(NamedTuple):
    """Parts handed over in Python, in place of those that a scenario names; in the order of `IN_SCENARIOS`."""

    governor: Any = None
    certificate: Any = None
    estimator: Any = None
    noise_model: Any = None
    reference_solver: Any = None


def object_name(part: Any) -> str:
    """Return what a scenario says of a part that is an object: `object:` and the name of its class."""
    return OBJECT + type(part).__name__


def object_overrides(objects: Objects) -> dict[str, str]:
    """Return the keys that name parts, with the names of those that are objects.

    Raises InputError for an object without the methods of its kind.
    """
    given = [(kind, part) for kind, part in zip(IN_SCENARIOS, objects, strict=True) if part is not None]
    for kind, part in given:
        if isinstance(part, type) or _missing(kind_of_object(kind, part), part):
            methods = " and ".join(kind.methods)
            methods += f", or {', '.join(kind.other.methods)}" if kind.other else ""
            raise InputError(f"{part!r} is no {kind.noun}; allowed: an object with the methods {methods}")
    return {kind.key: object_name(part) for kind, part in given}


def value_at(scenario: Any, key: str) -> Any:
    """Return the value at a dotted key of a scenario."""
    for part in key.split("."):
        scenario = getattr(scenario, part)
    return scenario


def installed(kind: Kind) -> dict[str, EntryPoint]:
    """Return the entry points that installed packages offer for a kind of part, by name."""
    offered = [entry for entry in entry_points(group=kind.group) if entry.group == kind.group]
    return {entry.name: entry for entry in sorted(offered, key=lambda entry: entry.name)}


def kind_of_name(kind: Kind, name: str) -> Kind:
    """Return the kind whose entry points have the name: `kind`, or the other that may stand there."""
    other = kind.other if name not in kind.built_in else None
    return other if other and name in installed(other) else kind


def kind_of_object(kind: Kind, part: Any) -> Kind:
    """Return the kind whose methods the object has: `kind`, or the other that may stand there."""
    return kind.other if kind.other and not _missing(kind.other, part) else kind


def is_centralized(name: str, given: Any = None) -> bool:
    """Return whether a governor, by its name or the object `given` in its place, sees the whole team.

    So are those of other packages but robot programs: nobody counts what they tell each other.
    """
    if given is not None:
        return kind_of_object(GOVERNOR, given) is GOVERNOR
    return name == "centralized" or (name not in GOVERNOR.built_in and kind_of_name(GOVERNOR, name) is GOVERNOR)


def find(kind: Kind, name: str) -> Callable[..., Any]:
    """Return the build function of a name.

    Raises InputError when no installed package offers it, PlugInError when it cannot be imported.
    """
    offered = installed(kind)
    if name.startswith(OBJECT):
        of_class = name.removeprefix(OBJECT)
        hand_over = f"hand it to pbrg_mj.run or pbrg_mj.verify as `{kind.noun.replace(' ', '_')}`"
        raise InputError(
            f"the {kind.noun} was an object of the class {of_class} in a Python program; {hand_over}", key=kind.key
        )
    if name not in offered:
        raise InputError(unknown(kind, name, offered), key=kind.key or None)
    with plug_in_errors(kind.noun, name, "import"):
        return offered[name].load()


def unknown(kind: Kind, name: str, offered: Mapping[str, Any]) -> str:
    """Return what is wrong with a name that nobody offers."""
    others = installed(kind.other) if kind.other else {}
    names = ", ".join([*kind.built_in, *offered, *others])
    return f"no {kind.noun} is called {name!r}; allowed: {names or f'what entry points of {kind.group} offer'}"


def build(kind: Kind, scenario: Any, given: Any = None, **context: Any) -> tuple[str, Any]:
    """Return the name and the object of the part that a scenario names; `given` in its place where it is not None.

    Raises InputError for an unknown name or wrong options, PlugInError when the build fails.
    """
    name = value_at(scenario, kind.key)
    if given is not None:
        return type(given).__name__, given
    options = value_at(scenario, kind.options)
    return name, make(kind, name, find(kind, name), copy.deepcopy(scenario), options, **context)


def make(
    kind: Kind, name: str, build: Callable[..., Any], first: Any, options: Mapping[str, Any], **context: Any
) -> Any:
    """Return what a build function makes of its first argument, of options and of what else it has parameters for."""
    arguments = {key: read_only_copy(value) for key, value in context.items() if key in parameters(build)}
    model = options_model(build)
    if model is not None:
        for key in unknown_options(model, options):
            raise InputError(f"is unknown; known: {', '.join(option_keys(model))}", key=_option(kind, key))
        try:
            arguments["options"] = validated(model, options)
        except ValidationError as error:
            item = error.errors(include_url=False)[0]
            raise InputError(f"is {item['input']!r}: {item['msg']}", key=_option(kind, *item["loc"])) from None
    elif options:
        raise InputError(f"{kind.noun} {name!r} takes no options", key=kind.options or None)
    with plug_in_errors(kind.noun, name, "build" if kind.methods else "its function"):
        part = build(first, **arguments)
    if _missing(kind, part):
        raise PlugInError(f"{name}: the {kind.noun} has no method {' or '.join(_missing(kind, part))}: {part!r}")
    return part


def _option(kind: Kind, *loc: str | int) -> str:
    return ".".join(map(str, (kind.options or "options", *loc)))


def _missing(kind: Kind, part: Any) -> list[str]:
    return [name for name in kind.methods if not callable(getattr(part, name, None))]
