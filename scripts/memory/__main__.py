"""Run the same scenarios as they are and in memory full of nonsense: every byte written must be the same.

PYTHONPATH=scripts python -m scripts.memory    # exit code 1, and the names of the files that differ, unless it is
"""

from __future__ import annotations

import filecmp
import os
import subprocess
import sys
import tempfile
from pathlib import Path

# What C and Python allocate, compiled kernels' arrays among it; NumPy's own memory is `poison`'s.
POISONED = {"MALLOC_PERTURB_": "36", "PYTHONMALLOC": "malloc_debug"}


def main() -> int:
    with tempfile.TemporaryDirectory(prefix="memory-") as folder:
        plain, poisoned = Path(folder) / "plain", Path(folder) / "poisoned"
        _run(plain, {})
        _run(poisoned, POISONED, "--poisoned")
        names = sorted(path.name for path in plain.iterdir())
        different = [name for name in names if not filecmp.cmp(plain / name, poisoned / name, shallow=False)]
    print(f"{len(names)} files, {len(different)} differ in poisoned memory: {', '.join(different) or 'none'}")
    return 1 if different else 0


def _run(folder: Path, environment: dict[str, str], *options: str) -> None:
    folder.mkdir()
    command = [sys.executable, "-m", "scripts.memory.runs", str(folder), *options]
    subprocess.run(command, env=os.environ | environment, check=True)


if __name__ == "__main__":
    sys.exit(main())
