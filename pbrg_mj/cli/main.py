"""`pbrg`: the commands and their exit codes.

0 done; 1 the run failed its purpose; 2 the input is wrong; 3 a defect of this package; 130, 143, 129 Ctrl-C, SIGTERM,
SIGHUP; 141 nobody reads stdout any more. Commands import what they need when they run: help must not wait for the
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
from pbrg_mj.cli.answers import answering
from pbrg_mj.cli.console import Notes, emit, keep_standard_streams
from pbrg_mj.cli.failures import DEFECT, explain, one_line_each

NOTES = Notes(logging.WARNING)
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


app.command("list")(answering(scenarios.list_scenarios))
app.command("show")(answering(scenarios.show))
app.command("draw")(answering(scenarios.draw))
app.command("new")(answering(scenarios.new))
app.command("schema")(answering(scenarios.schema))
app.command("validate")(answering(scenarios.validate))
app.command("run")(answering(run.run))
app.command("robot")(answering(robot.robot))
app.command("batch")(answering(batch.batch))
app.command("sweep")(answering(sweep.sweep))
app.command("tune")(answering(tune.tune))
app.command("bench")(answering(bench.bench))
app.command("falsify")(answering(falsify.falsify))
app.command("compare")(answering(compare.compare))
app.command("export")(answering(export.export))
app.command("plot")(answering(plot.plot))
app.command("render")(answering(render.render))
app.command("report")(answering(report.report))
app.command("replay")(answering(replay.replay))
app.command("repair")(answering(repair.repair))
app.command("reproduce")(answering(reproduce.reproduce))
app.command("doctor")(answering(doctor.doctor))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; `arguments` default to the process's own."""
    keep_standard_streams()
    logging.getLogger("pbrg_mj").addHandler(NOTES)
    given, debug = _without_debug(sys.argv[1:] if arguments is None else arguments)
    with one_line_each(debug=debug) as failed:
        try:
            with stoppable():
                code = _command()(given, prog_name="pbrg", standalone_mode=False)
        except BaseException as error:
            if isinstance(error, SystemExit) and (COMPLETING in os.environ or COMPLETION.intersection(given)):
                raise
            return explain(error, debug=debug)
    code = code if isinstance(code, int) else 0
    return DEFECT if failed and code == 0 else code


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
