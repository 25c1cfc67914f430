import io
import signal
import sys
from dataclasses import replace

import numpy as np
import pytest

from pbrg_mj.api.interrupt import interruptible
from pbrg_mj.cli import progress as room
from pbrg_mj.cli.progress import RunningSummary, compiling_noted, progress
from pbrg_mj.kernel.stopwatch import report
from tests.records import records


class Terminal(io.StringIO):
    def isatty(self):
        return True


def record(margin=1.0, contact=False, status="ok", time=3.0):
    base = records(1)[0]
    nothing = {
        "moving_margin": np.full(3, np.inf),
        "moving_contact": np.zeros(3, bool),
        "robot_contact": np.zeros(3, bool),
    }
    truth = base.truth._replace(wall_margin=np.full(3, margin), wall_contact=np.full(3, contact), **nothing)
    return base._replace(time=time, truth=truth, solution=replace(base.solution, status=status))


def test_the_worst_so_far_is_told():
    so_far = RunningSummary()
    so_far.add(record(margin=0.5))
    assert so_far.text() == "no violation, margin 0.500 m"
    so_far.add(record(status="infeasible"))
    assert so_far.text() == "governor infeasible at 3.0 s, margin 0.500 m"
    so_far.add(record(margin=-0.01))
    so_far.add(record())
    assert so_far.text() == "past a line, margin -0.010 m"
    so_far.add(record(contact=True))
    assert so_far.text().startswith("a robot touched a wall at 3.0 s")


@pytest.mark.parametrize(("field", "what"), [("moving_contact", "a moving box"), ("robot_contact", "another robot")])
def test_the_first_contact_of_any_kind_is_told(field, what):
    so_far, seen = RunningSummary(), record()
    so_far.add(seen._replace(truth=seen.truth._replace(**{field: np.array([False, True, False])})))
    so_far.add(record(contact=True))
    assert so_far.text().startswith(f"a robot touched {what} at 3.0 s")


def test_without_walls_there_is_no_margin_to_tell():
    so_far = RunningSummary()
    so_far.add(record(margin=np.inf))
    assert so_far.text() == "no violation"


def test_a_terminal_sees_time_speed_and_outcome(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Terminal())
    monkeypatch.setattr(room, "REFRESH", 0.0)
    with progress(10.0, True) as show:
        show(record())
    text = sys.stderr.getvalue()
    assert "3.0 of 10 s" in text
    assert "x real time, no violation, margin 1.000 m" in text


@pytest.mark.parametrize(("stream", "wanted"), [(io.StringIO, True), (Terminal, False)])
def test_no_progress_without_a_terminal_or_when_not_wanted(monkeypatch, stream, wanted):
    monkeypatch.setattr(sys, "stderr", stream())
    monkeypatch.setattr(room, "REFRESH", 0.0)
    with progress(10.0, wanted) as show:
        show(record())
    assert sys.stderr.getvalue() == ""


def test_ctrl_c_waits_for_the_tick_and_a_second_one_does_not():
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), interruptible() as pressed:
        assert not pressed()
        signal.raise_signal(signal.SIGINT)
        assert pressed()
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("context", [lambda: progress(10.0, True), compiling_noted])
def test_a_terminal_sees_that_kernels_are_compiled(monkeypatch, context):
    monkeypatch.setattr(sys, "stderr", Terminal())
    with context():
        report("perception.perceive.perceive_scans")
        report(None)
    assert "compiling kernels, once per version of the code: " in sys.stderr.getvalue()


def test_without_a_terminal_compiling_is_not_noted(monkeypatch):
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    with compiling_noted():
        report("perception.perceive.perceive_scans")
    assert sys.stderr.getvalue() == ""
