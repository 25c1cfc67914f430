"""`pbrg`: the commands and their exit codes.

0 done; 1 the run failed its purpose; 2 the input is wrong; 3 a defect of this package; 130, 143, 129 Ctrl-C, SIGTERM,
SIGHUP; 141 stdout is closed. Commands import what they need when they run: help must not wait for the
simulator.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable, Sequence
from functools import cache
from typing import Annotated

import typer

from pbrg_mj import __version__
from pbrg_mj.api.interrupt import stoppable
from pbrg_mj.cli import (
    batch,
    bench,
    compare,
    doctor,
    export,
    falsify,
    plot,
    render,
    repair,
    replay,
    report,
    reproduce,
    robot,
    run,
    scenarios,
    sweep,
    tune,
)
from pbrg_mj.cli.console import WarningNotes, emit, keep_standard_streams
from pbrg_mj.cli.failures import explain, failures_on_one_line, signals_as_codes
from pbrg_mj.cli.stdout import protect_stdout

WARNING_NOTES = WarningNotes(logging.WARNING)
DEBUG = "--debug"
COMPLETING = "_PBRG_COMPLETE"  # set by the shell that completes a command
COMPLETION = {"--install-completion", "--show-completion"}  # which, like completing, end with an exit of their own

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
    debug: Annotated[
        bool, typer.Option(DEBUG, help="Print the traceback of an error; before or after COMMAND.")
    ] = False,
) -> None:
    """A physics-based benchmark for distributed reference governors."""


def _add(name: str, command: Callable[..., int | None]) -> None:
    app.command(name)(signals_as_codes(protect_stdout(command)))


_add("list", scenarios.list_scenarios)
_add("show", scenarios.show)
_add("draw", scenarios.draw)
_add("new", scenarios.new)
_add("schema", scenarios.schema)
_add("validate", scenarios.validate)
_add("run", run.run)
_add("robot", robot.robot)
_add("batch", batch.batch)
_add("sweep", sweep.sweep)
_add("tune", tune.tune)
_add("bench", bench.bench)
_add("falsify", falsify.falsify)
_add("compare", compare.compare)
_add("export", export.export)
_add("plot", plot.plot)
_add("render", render.render)
_add("report", report.report)
_add("replay", replay.replay)
_add("repair", repair.repair)
_add("reproduce", reproduce.reproduce)
_add("doctor", doctor.doctor)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; `arguments` default to the process's own."""
    keep_standard_streams()
    os.environ.pop("MPLBACKEND", None)  # figures go to files; one that is not there would be an error of every figure
    logging.getLogger("pbrg_mj").addHandler(WARNING_NOTES)
    given, debug = _without_debug(sys.argv[1:] if arguments is None else arguments)
    with failures_on_one_line(debug=debug) as failed:
        try:
            with stoppable():
                code = _command()(given, prog_name="pbrg", standalone_mode=False)
        except BaseException as error:
            if isinstance(error, SystemExit) and (COMPLETING in os.environ or COMPLETION.intersection(given)):
                raise
            return explain(error, debug=debug)
    code = code if isinstance(code, int) else 0
    return max(failed, default=0) if code == 0 else code


@cache
def _command() -> Callable[..., object]:
    """Return the command line as a function; made anew for each call it would take a third of a short command."""
    return typer.main.get_command(app)


def _without_debug(arguments: Sequence[str]) -> tuple[list[str], bool]:
    """Return the arguments without --debug, which may stand anywhere before a `--`, and whether it was there."""
    end = arguments.index("--") if "--" in arguments else len(arguments)
    options = [one for one in arguments[:end] if one != DEBUG]
    return [*options, *arguments[end:]], len(options) < end


if __name__ == "__main__":
    sys.exit(main())
