"""What a test finds does not depend on how fast a machine is: clocks are read for patience alone."""

from __future__ import annotations

import ast
from pathlib import Path

CLOCKS = {"monotonic", "monotonic_ns", "perf_counter", "perf_counter_ns", "process_time", "thread_time"}
CALENDARS = {"time.time", "time.time_ns", "datetime.now", "datetime.utcnow"}
MAY = {
    "browser.py": "gives up after a while on a browser that does not answer",
    "test_transport.py": "gives up after a while on processes that do not come",
}


def clocks(source: str) -> set[str]:
    """Return the clocks that a source names."""
    nodes = list(ast.walk(ast.parse(source)))
    names = {node.id for node in nodes if isinstance(node, ast.Name)}
    attributes = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    dotted = {ast.unparse(node) for node in nodes if isinstance(node, ast.Attribute)}
    return (names | attributes) & CLOCKS | dotted & CALENDARS


def test_no_test_reads_a_clock():
    found = {path.name for path in Path(__file__).parent.glob("*.py") if clocks(path.read_text(encoding="utf-8"))}
    assert found == set(MAY)


def test_what_the_search_finds():
    assert clocks("import time\nassert time.perf_counter() < 1\n") == {"perf_counter"}
    assert clocks("from time import monotonic as m, perf_counter\nperf_counter()") == {"perf_counter"}
    assert clocks("import time\ntime.time()") == {"time.time"}
    assert clocks("import time\ntime.sleep(0.1)\n'perf_counter'") == set()
