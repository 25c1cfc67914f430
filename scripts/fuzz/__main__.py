"""Attack the command line; print what ended as it must not, and how often each exit code was seen.

python -m scripts.fuzz {scenarios,studies,logs,kills,orphans} [--cases 1000] [--first 0] [--failures FILE.jsonl]
python -m scripts.fuzz scenarios --first 1234 --cases 1 --keep FOLDER    # leaves the files of case 1234 there

Case 1234 is the same on every machine. Exit code 1 if anything ended as it must not.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import importlib
import json
import os
import sys
import tempfile
import time
from collections import Counter
from dataclasses import asdict
from pathlib import Path

ATTACKS = ("scenarios", "studies", "logs", "kills", "orphans")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("attack", choices=ATTACKS)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--failures", type=Path, help="append them to this file, a JSON object a line")
    parser.add_argument("--keep", type=Path, help="work in this folder, and leave the last case's files there")
    asked = parser.parse_args()
    failures = asked.failures and asked.failures.resolve()
    with contextlib.ExitStack() as stack:
        folder = asked.keep or Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="fuzz-")))
        folder.mkdir(exist_ok=True)
        stack.enter_context(contextlib.chdir(folder))
        return _campaign(asked.attack, range(asked.first, asked.first + asked.cases), failures)


def _campaign(name: str, seeds: range, failures: Path | None) -> int:
    attack = importlib.import_module(f"scripts.fuzz.{name}")
    with _silent():
        attack.warm_up()
    gc.collect()
    gc.freeze()  # what forks share is not touched by their garbage collection
    began, codes, kinds = time.monotonic(), Counter[str](), Counter[str]()
    for done, seed in enumerate(seeds, start=1):
        for one in attack.attack(seed, codes):
            kinds[one.kind] += 1
            print(f"{one.seed}: {one.kind}: {one.detail}\n    {one.command}", flush=True)
            if failures:
                with failures.open("a") as stream:
                    stream.write(json.dumps(asdict(one)) + "\n")
        if done % 500 == 0 or done == len(seeds):
            print(
                f"{done} cases, {time.monotonic() - began:.0f} s: {_counts(codes)}; failures: {_counts(kinds)}",
                flush=True,
            )
    return 1 if kinds else 0


def _counts(some: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in sorted(some.items())) or "none"


@contextlib.contextmanager
def _silent():
    """Let nothing be printed while the context lasts."""
    with (
        Path(os.devnull).open("w") as nowhere,
        contextlib.redirect_stdout(nowhere),
        contextlib.redirect_stderr(nowhere),
    ):
        yield


if __name__ == "__main__":
    sys.exit(main())
