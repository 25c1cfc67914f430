"""`check_governor` passes governors that keep the protocol, and names what each of the others does wrong."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from pydantic import BaseModel

import pbrg_mj as pbrg
from pbrg_mj.errors import InputError, PlugInError
from pbrg_mj.governor.registry import governor
from pbrg_mj.scenario.load import load_scenario

PROTOCOL = "keeps the protocol of governors"


def solution(problem, m):
    n = problem.network.robots
    return pbrg.Solution(np.tile(m, (n, 1)), np.zeros_like(problem.rows.d), "ok", 0, np.zeros(n, dtype=np.int64))


@dataclass(frozen=True)
class Holding:
    """Hands the mean of the hand points on for ever."""

    def init(self, problem):
        return problem.p.mean(axis=0)

    def step(self, problem, memory):
        return solution(problem, memory), memory.copy()


@pytest.mark.parametrize("kind", ["distributed", "centralized", "none"])
def test_our_own_governors_pass(kind):
    report = pbrg.check_governor(
        lambda scenario: governor(load_scenario(f"paper/{NAME}", [f"governor.kind={kind}"]).scenario)
    )
    assert report.passed
    assert PROTOCOL in str(report)


NAME = "simulation_near"


def test_a_governor_itself_or_its_build_function_passes():
    for build in (Holding(), lambda scenario: Holding()):
        assert pbrg.check_governor(build).passed


class Answering(Holding):
    def __init__(self, **fields):
        object.__setattr__(self, "fields", fields)

    def step(self, problem, memory):
        return replace(solution(problem, memory), **self.fields), memory


class Alone(Holding):
    def step(self, problem, memory):
        return solution(problem, memory)


class Failing(Holding):
    def step(self, problem, memory):
        return 1 / (problem.rows.active.sum()), memory


class Overwriting(Holding):
    def step(self, problem, memory):
        problem.p[:] = 0.0
        return solution(problem, memory), memory


class Scribbling(Holding):
    def step(self, problem, memory):
        memory += 1.0
        return solution(problem, memory), memory


class Drawing(Holding):
    def step(self, problem, memory):
        return solution(problem, memory + np.random.default_rng().normal(size=2)), memory


class Counting(Holding):
    def __init__(self):
        object.__setattr__(self, "count", [0])

    def step(self, problem, memory):
        self.count[0] += 1
        return solution(problem, memory + self.count[0]), memory


class Initial(Holding):
    def init(self, problem):
        problem.xi[:] = 1.0
        return super().init(problem)


@pytest.mark.parametrize(
    ("built", "failure"),
    [
        (
            Answering(m=np.zeros((2, 5))),
            r"no half-spaces: Answering: the governor's m has shape \(2, 5\), not \(5, 2\)",
        ),
        (Answering(m=np.full((5, 2), np.nan)), "m is not finite"),
        (Answering(m=[["x", "y"]] * 5), "m is no array of float64"),
        (
            Answering(status="fine"),
            "status is 'fine'; allowed: ok, capped, suspected, inadmissible, holding, infeasible, ",
        ),
        (Answering(bytes_sent=[-1, 0, 0, 0, 0]), r"bytes_sent is \[-1, 0, 0, 0, 0\]; allowed: whole numbers from 0 on"),
        (Answering(rounds=0.5), "rounds is 0.5; allowed: whole numbers from 0 on"),
        (Answering(lost=np.full(5, 3)), "lost is more than a robot has neighbours"),
        (Alone(), "step returned Solution, not solution and memory"),
        (Failing(), "Failing: the governor raised .* in step"),
        (Overwriting(), "no half-spaces, tick 0: step wrote into the problem"),
        (Scribbling(), "no half-spaces, tick 0: step wrote into the memory"),
        (Initial(), "no half-spaces, tick 0: init wrote into the problem"),
        (Drawing(), "two governors built alike answer differently"),
        (Counting(), "a second step from the same memory answers differently"),
    ],
)
def test_what_a_governor_does_wrong_is_named(built, failure):
    with pytest.raises(PlugInError, match=failure) as found:
        pbrg.check_governor(built)
    assert "FAILED" in str(found.value)
    assert f"{type(built).__name__}: breaks the protocol of governors" in str(found.value)


class Options(BaseModel):
    gain: float


def with_options(scenario, options: Options):
    return Holding() if options.gain > 0 else Failing()


def test_options_reach_the_build_function():
    assert pbrg.check_governor(with_options, options={"gain": 1.0}).passed
    with pytest.raises(PlugInError):
        pbrg.check_governor(with_options, options={"gain": -1.0})
    with pytest.raises(InputError, match=r"governor.options.gain: .*Field required"):
        pbrg.check_governor(with_options)
    with pytest.raises(InputError, match=r"governor.options.again: is unknown; known: gain"):
        pbrg.check_governor(with_options, options={"gain": 1.0, "again": 2})


def test_what_cannot_be_built_is_no_report():
    with pytest.raises(PlugInError, match="has no method init or step: 3"):
        pbrg.check_governor(lambda scenario: 3)
