"""Every forged log is read by commands that read logs."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pbrg_mj.cli.main import main
from scripts.fuzz.forgeries import forgery
from scripts.fuzz.sandbox import run_apart
from scripts.fuzz.values import pick
from scripts.fuzz.verdict import Failure, fault

LOG, OUTPUT = "forged.mcap", "out"
COMMANDS = (
    ("compare",),
    ("compare", "--json"),
    ("replay",),
    ("replay", "--verify"),
    ("replay", "--verify"),
    ("repair", "-o", "out.mcap"),
    ("export", "-o", "out.npz"),
    ("export", "-o", "out.csv"),
    ("export", "-o", "out.mat"),
    ("report", "-o", "out.html"),
    ("report", "-o", "out.html"),
)
DRAWN = ("plot", "-o", "out.svg")  # takes longer: one log in eight
MADE = {  # the originals: of both plants, with walls, losses, things that move
    "paper/experiment_near": 0.5,
    "network/lossy": 0.4,
    "team/speed_limited": 0.1,
    "obstacles/moving_box": 0.2,
}
EARLIER = tuple(sorted((Path(__file__).parents[2] / "tests" / "data").glob("*.mcap")))
_originals: list[bytes] = []


def warm_up() -> None:
    """Make the originals, and import all that reads them."""
    for name, duration in MADE.items():
        log = Path("original.mcap")
        main(["run", name, "--duration", str(duration), "--set", "log.timings=false", "--quiet", "-o", str(log)])
        _originals.append(log.read_bytes())
        for command in (*COMMANDS, DRAWN):
            main([*command, str(log)])
            _remove()
        log.unlink()
    _originals.extend(path.read_bytes() for path in EARLIER)


def attack(seed: int, codes: Counter[str]) -> Iterator[Failure]:
    """Give the forgery of that number to some commands, in the current folder; yield what went wrong."""
    Path(LOG).write_bytes(forgery(seed, _originals))
    rng = np.random.default_rng((15, seed))
    chosen = {pick(rng, COMMANDS) for _ in range(3)} | ({DRAWN} if rng.integers(8) == 0 else set())
    for command in sorted(chosen):
        ending = run_apart(lambda command=command: main([*command, LOG]))
        name = shlex.join(command[:1] if "-o" in command else command)
        codes[f"{name} {ending.code}"] += 1
        found = fault(ending, _left(), json_wanted="--json" in command)
        if found:
            yield Failure(seed, f"{name}: {found[0]}", f"pbrg {shlex.join([*command, LOG])}", found[1])
        _remove()


def _left() -> list[str]:
    return [path.name for path in Path.cwd().iterdir() if path.name != LOG]


def _remove() -> None:
    for path in Path.cwd().glob(f"*{OUTPUT}*"):
        path.unlink()
