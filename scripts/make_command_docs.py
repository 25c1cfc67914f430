"""Write docs/commands.md: every command with what it prints, by running them all in an empty folder.

python scripts/make_command_docs.py           # write the page, in a minute
python scripts/make_command_docs.py --check   # exit with 1 if commands print something of another kind by now

Numbers differ from machine to machine; --check holds the page's words against those of now.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

PAGE = Path(__file__).resolve().parents[1] / "docs" / "commands.md"
HEAD = """# Commands, and what they print

<!-- Written by scripts/make_command_docs.py, which runs them all: change it there. -->

`pbrg COMMAND --help` lists all options. Results go to stdout; progress, on a terminal only, warnings and errors to
stderr, a line each. Where no output stands below, there is none.

| exit code | meaning |
|---|---|
| 0 | done |
| 1 | the run failed its purpose: a wall touched, a line crossed, a state diverged, a replay that differs |
| 1 | a plug-in broke its contract; disk or memory ran out |
| 2 | the input is wrong: one line with file, line, key, value and what is allowed |
| 3 | a defect of this package: one line; `pbrg --debug COMMAND` prints the traceback before it |
| 130, 143, 129 | ended by Ctrl-C, SIGTERM, SIGHUP; the log so far is whole |
| 141 | standard output is closed, as by `head`; nothing is printed |
"""
WRONG = """\
team:
  start: [[0, 0]]
  formation: [[0, 0]]
  leaders: [2]
operator: {reference: [1, 0]}
sensors: {beams: {robots: [3]}}
"""
SWEEP = "scenario: paper/simulation_near\nseeds: 1-4\nduration: 2\ngrid: {governor.rounds: [2, 10]}\n"
TUNE = """\
scenario: paper/simulation_near
seeds: 1,2
held_out: 3
duration: 2
keys: {control.alpha_r: {uniform: [0.5, 3]}}
budget: 6
"""
SUITE = """\
scenario: [paper/simulation_inadmissible]
train: 1
held_out: 2-3
duration: 2
governors:
  none: {settings: {governor.kind: none}, tuning: nothing to tune}
  centralized: {settings: {governor.kind: centralized}, tuning: nothing to tune}
"""
SPACE = """\
find: crossing
duration: 20
set: {governor.kind: none, reference.solver: none}
keys: {control.alpha_r: {uniform: [0.5, 2]}}
"""
# Not shown: it compiles the kernels, which would pass for the speed of the first run that is.
FIRST = "pbrg run paper/experiment_near --duration 1 --quiet -o near.mcap && rm near.mcap"
# Each paragraph, and the commands that show it.
PARTS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("The commands", ("pbrg --help",)),
    (
        "Scenarios",
        (
            "pbrg list",
            "pbrg show paper/experiment_near",
            "pbrg draw families/long_wall --seed 2",
            "pbrg new mine.yaml",
            "pbrg validate paper/experiment_near mine.yaml",
            "cat wrong.yaml",
            "pbrg validate wrong.yaml",
            "pbrg schema -o scenario.schema.json",
            "pbrg schema --datagrams -o datagram.proto",
        ),
    ),
    (
        "Runs",
        (
            "pbrg run paper/experiment_near --duration 20 -o near.mcap",
            "pbrg run paper/experiment_near --duration 20 --set governor.rounds=2 -o coarse.mcap --quiet",
            "pbrg run paper/experiment_near --duration 5 --profile -o short.mcap",
            "pbrg robot paper/simulation_near 6 --connect 192.168.0.7:7400",
            "pbrg batch paper/experiment_near --duration 20 --seeds 1-8 -o seeds.npz",
            "cat rounds.yaml",
            "pbrg sweep rounds.yaml -o rounds",
            "cat gain.yaml",
            "pbrg tune gain.yaml -o gain",
            "cat two.yaml",
            "pbrg bench two.yaml -o two",
            "pbrg bench --verify two",
            "cat space.yaml",
            "pbrg falsify paper/simulation_inadmissible --search space.yaml --budget 20 -o shortest",
        ),
    ),
    ("Distributed against centralized: [metrics](metrics.md)", ("pbrg compare near.mcap coarse.mcap",)),
    (
        "Pictures, pages, series: [plot](plot.md), [video](video.md), [report](report.md), [export](export.md)",
        (
            "pbrg plot near.mcap -o near.pdf",
            "pbrg plot near.mcap -o margin.png --panels margin,gap",
            "pbrg render near.mcap -o near.png --at 12",
            "pbrg render near.mcap -o near.mp4 --size 640x360 --start 10 --end 12",
            "pbrg report near.mcap coarse.mcap -o near.html",
            "pbrg export near.mcap -o near.npz",
            "ls",
        ),
    ),
    ("Replay and repair: [replay](replay.md)", (
        "pbrg replay near.mcap",
        "pbrg replay near.mcap --verify",
        "head -c 1000000 near.mcap > cut.mcap",
        "pbrg repair cut.mcap -o clean.mcap",
    )),
    ("The paper", ("pbrg reproduce -o paper --duration 5", "ls paper")),
    ("This machine", ("pbrg doctor",)),
)  # fmt: skip
EVENT = re.compile(r" *\d+\.\d+ s  ")  # of a replay


def run(command: str, folder: Path) -> str:
    """Return the command's line and all that it printed, with its exit code unless that is 0."""
    # The package of this checkout, called as a user calls it.
    python = f'python() {{ "{sys.executable}" "$@"; }}'
    line = f'{python}; pbrg() {{ python -P -m pbrg_mj.cli.main "$@"; }}; {command}'
    environment = os.environ | {"PYTHONPATH": str(PAGE.parents[1]), "COLUMNS": "100"}
    done = subprocess.run(
        line, shell=True, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False
    )
    said = done.stdout.decode().replace(str(Path.home()), "~").rstrip()
    code = f"\n[exit code {done.returncode}]" if done.returncode else ""
    return f"$ {command}\n{said}{code}".rstrip()


def page() -> str:
    """Run all commands and return the page."""
    text = HEAD
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        run(FIRST, folder)
        (folder / "wrong.yaml").write_text(WRONG)
        (folder / "rounds.yaml").write_text(SWEEP)
        (folder / "gain.yaml").write_text(TUNE)
        (folder / "two.yaml").write_text(SUITE)
        (folder / "space.yaml").write_text(SPACE)
        for title, commands in PARTS:
            shown = "\n".join(run(command, folder) for command in commands)
            block = "\n".join(f"    {line}".rstrip() for line in shown.splitlines())
            text += f"\n## {title}\n\n{block}\n"
    return text


def words(text: str) -> list[str]:
    """Return the page's lines without numbers and hashes, and without a run's events, which depend on its physics."""
    lines = [line for line in text.splitlines() if not EVENT.match(line)]
    return [" ".join(re.sub(r"\b[0-9a-f]{16}\b|-?\d[\w.+-]*", "#", line).split()) for line in lines]


def main() -> int:
    """Write or check the page."""
    made = page()
    if "--check" not in sys.argv:
        PAGE.write_text(made, encoding="utf-8")
        return 0
    ours, theirs = words(PAGE.read_text(encoding="utf-8")), words(made)
    differing = [f"- {line}" for line in ours if line not in theirs]
    differing += [f"+ {line}" for line in theirs if line not in ours]
    if differing:
        print("\n".join([f"{PAGE.name} is out of date: run {Path(__file__).name}", *differing]), file=sys.stderr)
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
