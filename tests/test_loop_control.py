"""The control of a tick in one call is that of its parts, bit for bit, and stands only for parts that it has."""

from dataclasses import replace

import numpy as np
import pytest

from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario

SCENARIO = "paper/experiment_inadmissible"
SEPARATED = ["governor.kind=certified", "control.separation=0.22"]


def built(*overrides: str) -> Simulation:
    return Simulation.build(load_scenario(SCENARIO, ["timing.duration=2", *overrides]).scenario)


@pytest.mark.parametrize(
    "overrides",
    [[], SEPARATED, ["set_up=recommended", "drive.pwm_levels=255"], ["control.leak=0.1", "control.separation=0.3"]],
    ids=["paper", "separation", "recommended", "leak"],
)
def test_it_is_that_of_its_parts(overrides: list[str]) -> None:
    at_once, in_parts = built(*overrides), built(*overrides)
    assert at_once.loop.compiled_control is not None
    in_parts = replace(in_parts, loop=replace(in_parts.loop, compiled_control=None))
    moved = 0.0
    for one, other in zip(at_once.control_ticks(), in_parts.control_ticks(), strict=True):
        np.testing.assert_array_equal(one.command, other.command)
        np.testing.assert_array_equal(one.velocity, other.velocity)
        np.testing.assert_array_equal(one.problem.xi, other.problem.xi)
        if one.displacement is None:
            assert other.displacement is None
        else:
            np.testing.assert_array_equal(one.displacement, other.displacement)
            moved = max(moved, float(np.abs(one.displacement).max()))
    assert moved > 0.0 or not any("separation=0" in one for one in overrides)


@pytest.mark.parametrize(
    "overrides",
    [
        ["governor.backend=numpy"],
        ["drive.kind=speed_loop"],
        ["robot=omni"],
        ["network.pre_stabiliser.loss=0.1"],
        ["governor.kind=cbf"],
        ["governor.kind=certified", "governor.predicted_motion=motors"],
    ],
    ids=["numpy", "speed loop", "omnidirectional", "late messages", "other filters", "motors"],
)
def test_other_parts_are_not_in_it(overrides: list[str]) -> None:
    assert built(*overrides).loop.compiled_control is None
