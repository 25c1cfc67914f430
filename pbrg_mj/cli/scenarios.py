"""`pbrg list`, `show`, `new`, `schema` and `validate`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

import pbrg_mj as pbrg
from pbrg_mj.api.files import check_new, check_scenario
from pbrg_mj.cli.arguments import BundledName, FamilyName, Force, Overrides, ScenarioNames
from pbrg_mj.cli.console import emit, emit_json, note
from pbrg_mj.errors import InputError
from pbrg_mj.text import counted, plain


def list_scenarios(
    json: Annotated[bool, typer.Option("--json", help="Print a JSON array, an object per scenario.")] = False,
) -> None:
    """List the bundled scenarios and families of worlds, a line each."""
    listed = pbrg.list_scenarios()
    if json:
        emit_json([asdict(one) for one in listed])
        return
    width = max((len(one.name) for one in listed), default=0)
    for one in listed:
        note = " (governor: centralized)" if one.centralized else ""
        emit(f"{one.name:<{width}}  {one.description}{note}".rstrip())


def show(name: BundledName) -> None:
    """Print a scenario's or a family's YAML, comments included."""
    check_scenario(name)
    loaded = pbrg.load(name)
    emit((loaded.family_yaml or loaded.yaml).rstrip("\n"))


def draw(
    family: FamilyName,
    seed: Annotated[int, typer.Option(help="Which world; its noise, too.")] = 1,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE", help="FILE.yaml to write.")] = None,
    force: Force = False,
    overrides: Overrides = None,
) -> None:
    """Print or write the concrete scenario that a seed draws from a family of worlds."""
    check_scenario(family, seed)
    world = pbrg.draw(family, seed, overrides or (), path=output, force=force)
    if output is None:
        emit(world.yaml.rstrip("\n"))


def new(
    file: Annotated[Path | None, typer.Argument(metavar="[FILE]", help="FILE.yaml; printed if not given.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace FILE if it is there.")] = False,
) -> None:
    """Write a small scenario with comments, to start one of your own from."""
    from pbrg_mj.api.scenario import write_template

    if file is None:
        emit(pbrg.template().rstrip("\n"))
    else:
        write_template(file, force=force)


def schema(
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="FILE.json or .proto to write.")
    ] = None,
    family: Annotated[bool, typer.Option("--family", help="That of a family of worlds.")] = False,
    datagrams: Annotated[
        bool, typer.Option("--datagrams", help="What robots' processes send over UDP instead, as a .proto file.")
    ] = False,
    force: Force = False,
) -> None:
    """Print the JSON Schema of a scenario, by which editors complete and check the YAML."""
    if output is not None:
        check_new(output, force=force)
    from pbrg_mj.api.datagrams import datagram_schema, write_datagram_schema
    from pbrg_mj.api.scenario import write_schema

    if family and datagrams:
        raise InputError("--family and --datagrams do not go together; allowed: one of them")
    if output is None and datagrams:
        emit(datagram_schema().rstrip("\n"))
    elif output is None:
        emit_json(pbrg.schema(family=family))
    elif datagrams:
        write_datagram_schema(output)
    else:
        write_schema(output, family=family)


def validate(
    files: ScenarioNames,
    step: Annotated[bool, typer.Option("--step", help="Print how long a round of the governor may be, too.")] = False,
) -> int:
    """Check scenario files."""
    wrong = 0
    for file in files:
        try:
            check_scenario(file)
            scenario = pbrg.load(file)
            warnings = _validated(scenario, plain(file))
        except InputError as error:
            for one in (error, *error.others):
                note(f"error: {one}")
            wrong += 1
        else:
            one = scenario.settings
            emit(f"{plain(file)}: ok, {counted(one.robots, 'robot')}, {one.plant} plant, {one.timing.duration:g} s")
            if step:
                emit(f"{plain(file)}: {scenario.step_bound()}")
            for line in warnings:
                note(f"warning: {plain(file)}: {line}")
    return 2 if wrong else 0


def _validated(scenario: pbrg.Scenario, file: str) -> list[str]:
    """Return the warnings of a scenario. Raises InputError, which names the file."""
    try:
        return pbrg.validate(scenario)
    except InputError as error:
        raise InputError(error.message, file=file, key=error.key) from None
