"""`pbrg`: the commands and their exit codes. 0 done, 1 the run failed its purpose, 2 the input is wrong.

Commands import what they need when they run: help must not wait for the simulator.
"""

from __future__ import annotations

import logging
import sys
from typing import Annotated

import typer

from pbrg_mj import __version__
from pbrg_mj.cli import batch, compare, doctor, export, plot, render, repair, replay, report, reproduce, run, scenarios
from pbrg_mj.cli.console import Notes, emit, note
from pbrg_mj.cli.progress import INTERRUPTED
from pbrg_mj.errors import InputError, PbrgError

NOTES = Notes(logging.WARNING)
# typer has it only as the base of what it exports.
_ClickError: type[Exception] = typer.BadParameter.__mro__[2]

app = typer.Typer(
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:
    if wanted:
        emit(f"pbrg {__version__}")
        raise typer.Exit()


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_version, help="Show the version.")
    ] = False,
) -> None:
    """A physics-based benchmark for distributed reference governors."""


app.command("list")(scenarios.list_scenarios)
app.command("show")(scenarios.show)
app.command("new")(scenarios.new)
app.command("schema")(scenarios.schema)
app.command("validate")(scenarios.validate)
app.command("run")(run.run)
app.command("batch")(batch.batch)
app.command("compare")(compare.compare)
app.command("export")(export.export)
app.command("plot")(plot.plot)
app.command("render")(render.render)
app.command("report")(report.report)
app.command("replay")(replay.replay)
app.command("repair")(repair.repair)
app.command("reproduce")(reproduce.reproduce)
app.command("doctor")(doctor.doctor)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line and return its exit code; `arguments` default to the process's own."""
    logging.getLogger("pbrg_mj").addHandler(NOTES)
    try:
        code = app(arguments, prog_name="pbrg", standalone_mode=False)
    except PbrgError as error:
        note(f"error: {error}")
        return 2 if isinstance(error, InputError) else 1
    except _ClickError as error:
        note(f"error: {error.format_message()} See: pbrg --help")  # type: ignore[attr-defined]
        return 2
    except OSError as error:
        name = f"{error.filename}: " if error.filename else ""
        note(f"error: {name}{error.strerror or error}")
        return 2
    except (KeyboardInterrupt, typer.Abort):
        return INTERRUPTED
    return code if isinstance(code, int) else 0


if __name__ == "__main__":
    sys.exit(main())
