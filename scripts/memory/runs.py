"""Run scenarios and worlds drawn by seeds into a folder: python -m scripts.memory.runs FOLDER [--poisoned].

`PYTHONPATH=scripts` names the folder of the generator that draws.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pbrg_mj as pbrg
from scripts.memory.bundled import BATCH, RUNS
from scripts.memory.drawn import drawn_worlds
from scripts.memory.poison import poison_arrays


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--poisoned", action="store_true", help="fill NumPy's memory with nonsense")
    asked = parser.parse_args()
    if asked.poisoned:
        poison_arrays()
    for name, (scenario, overrides) in (RUNS | drawn_worlds()).items():
        loaded = pbrg.load(scenario, overrides | {"log.timings": False})
        pbrg.run(loaded, log=asked.folder / f"{name}.mcap")
    scenario, overrides, seeds = BATCH
    pbrg.batch(pbrg.load(scenario, overrides), seeds, path=asked.folder / "batch.npz")


if __name__ == "__main__":
    main()
