"""Put finished benchmarks into docs/bench.md: their tables with version, date and machine, and the standard one's page.

    pbrg bench standard -o standard && pbrg bench standard -o again && pbrg bench --quick -o quick
    python scripts/bench_page.py standard --again again     # a second run of the same: must have the same bytes
    python scripts/bench_page.py quick

The page, docs/data/standard.html, is `index.html` without links to logs, which stay where they were made: the command
beside each makes it again, and docs/data/standard.release.json, the manifest, tells whether it says the same.
"""

from __future__ import annotations

import argparse
import re
import sys
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path

from worlds.data import ROOT, version

from pbrg_mj.log.read.ticks import read_header
from pbrg_mj.log.write.provenance import code_digest
from pbrg_mj.studies.bench.bench import FILES, PAGE, TABLE
from pbrg_mj.studies.bench.markdown import RUNS
from pbrg_mj.studies.bench.release import MANIFEST, release_bench
from pbrg_mj.studies.bench.suite import Suite, read_suite
from pbrg_mj.studies.bench.table import bench_runs, table
from pbrg_mj.studies.bench.text import as_text
from pbrg_mj.studies.journal import Journal
from pbrg_mj.studies.records import RECORDS
from pbrg_mj.studies.run_task import packages
from pbrg_mj.studies.runner import LOGS

DOCS = ROOT / "docs"
REPRODUCED = (TABLE, RUNS, RECORDS)


def main() -> int:
    """Write what a folder has into the page."""
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("folder", type=Path)
    options.add_argument("--again", type=Path, help="the folder of a second run")
    given = options.parse_args()
    quick = (given.folder / FILES[True]).is_file()
    suite = read_suite(given.folder / FILES[quick], quick=quick)
    text = [_made_by(given.folder, suite), *_second(given.folder, given.again), "", *_table(given.folder, suite)]
    _put("quick" if quick else "standard", "\n".join(text))
    if not quick:
        page = (given.folder / PAGE).read_text("utf-8")
        (DOCS / "data" / "standard.html").write_text(re.sub(rf'<a href="{LOGS}/[^"]*">(.*?)</a>', r"\1", page), "utf-8")
        manifest = release_bench(given.folder).path
        (DOCS / "data" / f"standard.{MANIFEST}").write_bytes(manifest.read_bytes())
        manifest.unlink()  # the folder stays as `pbrg bench` left it
    return 0


def _made_by(folder: Path, suite: Suite) -> str:
    """Return what ran, with which code, when and where. Exits when the logs are of other code than is here."""
    versions = read_header(folder / LOGS / suite.logs[0]).versions
    if versions["pbrg_mj.code"] != code_digest():
        sys.exit(f"{folder}: was made with other code than this checkout's")
    day = datetime.fromtimestamp((folder / TABLE).stat().st_mtime, UTC)
    code = f"version {versions['pbrg_mj']} (code {version()})"
    where = f"{versions['processor']}, Python {versions['python']}, MuJoCo {versions['mujoco']}"
    return f"{len(suite.tasks)} runs, {code}, {day.day} {day:%B %Y}, {where}."


def _second(folder: Path, again: Path | None) -> list[str]:
    """Return a sentence of a second run. Exits when it made other bytes."""
    if again is None:
        return []
    for name in REPRODUCED:
        if (folder / name).read_bytes() != (again / name).read_bytes():
            sys.exit(f"{again / name}: is not {folder / name}")
    digests = [f"`{name}` {sha256((folder / name).read_bytes()).hexdigest()[:16]}" for name in REPRODUCED]
    return [f"A second whole run made the same bytes; SHA-256 begins with: {', '.join(digests)}."]


def _table(folder: Path, suite: Suite) -> list[str]:
    with Journal(folder, packages()) as journal:
        runs = bench_runs(suite, [journal[task.digest] for task in suite.tasks])
    return [f"    {line}".rstrip() for line in as_text(table(suite, runs)).splitlines()]


def _put(name: str, text: str) -> None:
    """Write the text between the page's marks of that name."""
    file = DOCS / "bench.md"
    begin, end = f"<!-- {name}: written by scripts/bench_page.py -->\n", f"<!-- end of {name} -->"
    before, _, rest = file.read_text("utf-8").partition(begin)
    _, found, after = rest.partition(end)
    if not found:
        sys.exit(f"{file}: has no {begin.strip()} and {end}")
    file.write_text(f"{before}{begin}\n{text}\n\n{end}{after}", "utf-8")


if __name__ == "__main__":
    sys.exit(main())
