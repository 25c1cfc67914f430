"""Ticks are evaluated some at a time: what that must not change."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from pbrg_mj.governor.monitor.diagnostics import diagnose
from pbrg_mj.log.write.messages import MessageStream
from pbrg_mj.loop import monitor, simulation
from pbrg_mj.loop.record import TickRecord
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario

PLAN = load_scenario("paper/simulation_near", ["timing.duration=1.23", "log.timings=false"]).scenario


def messages(records: Iterator[TickRecord]) -> list[bytes]:
    stream, said = None, []
    for record in records:
        stream = stream or MessageStream(PLAN, record)
        said += [message.data for message in stream.messages(record)]
    return said


@pytest.mark.parametrize(("block_ticks", "seconds"), [(1, 9.0), (7, 9.0), (1000, 9.0), (50, 0.0)])
def test_records_do_not_depend_on_how_many_ticks_make_a_block(block_ticks, seconds, monkeypatch) -> None:
    expected = messages(Simulation.build(PLAN).records())
    monkeypatch.setattr(simulation, "BLOCK_SECONDS", seconds)
    assert messages(replace(Simulation.build(PLAN), block_ticks=block_ticks).records()) == expected


@pytest.mark.parametrize("ticks", [1, 7])
def test_nor_on_how_many_ticks_are_evaluated_in_one_call(ticks, monkeypatch) -> None:
    expected = messages(Simulation.build(PLAN).records())
    monkeypatch.setattr(monitor, "MAX_BLOCK_BYTES", ticks * 3 * 8 * 5 * 22)
    calls = []
    monkeypatch.setattr(monitor, "diagnose", lambda block, *of: calls.append(block) or diagnose(block, *of))
    assert messages(Simulation.build(PLAN).records()) == expected
    assert {len(block.problems) for block in calls} <= set(range(1, ticks + 1))
    assert sum(len(block.problems) for block in calls) == 124


def test_control_ticks_are_those_of_the_records() -> None:
    records = list(Simulation.build(PLAN).records())
    ticks = list(Simulation.build(PLAN).control_ticks())
    assert [one.index for one in ticks] == [one.index for one in records] == list(range(124))
    for tick, record in zip(ticks, records, strict=True):
        np.testing.assert_array_equal(tick.command, record.command)
        np.testing.assert_array_equal(tick.solution.m, record.solution.m)


def test_the_first_record_comes_before_the_second_tick() -> None:
    run = Simulation.build(PLAN)
    next(run.records())
    np.testing.assert_array_equal(run.loop.world.observe().pose_frame, 1)


def test_what_a_tick_raises_comes_after_the_records_before_it(monkeypatch) -> None:
    run, seen = Simulation.build(PLAN), []
    advance = run.loop.world.advance
    left = iter(range(33))

    def failing(command: np.ndarray) -> None:
        if next(left, None) is None:
            raise ZeroDivisionError
        advance(command)

    monkeypatch.setattr(run.loop.world, "advance", failing)
    with pytest.raises(ZeroDivisionError):
        seen.extend(record.index for record in run.records())
    assert seen == list(range(33))
