"""Worlds run one after the other, each as `pbrg run` runs it but without log and optimum: any scenario at all."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor

from pbrg_mj.governor.certificate.evaluate import VIOLATED, predicted_rows, worst_rows
from pbrg_mj.loop.batch_histories import BatchHistories
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.perception.half_spaces import HalfSpaces
from pbrg_mj.scenario.schema import Reference, Scenario


def run_worlds(scenarios: Sequence[Scenario], processes: int = 1) -> Iterator[BatchHistories]:
    """Yield what happened in every world, in their order, from so many processes.

    Raises what a run raises. Processes are started afresh: a script that asks for several must keep what it does under
    `if __name__ == "__main__"`.
    """
    if min(processes, len(scenarios)) <= 1:
        yield from map(run_world, scenarios)
        return
    start = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(processes, mp_context=start, initializer=_leave_ctrl_c_to_the_parent)
    try:
        yield from pool.map(run_world, scenarios)
    finally:
        pool.shutdown(cancel_futures=True)


def run_world(scenario: Scenario) -> BatchHistories:
    """Return what happened in one world. Raises what `Simulation.build` raises."""
    histories = BatchHistories.empty(scenario, (scenario.seed,))
    simulation = Simulation.build(scenario.model_copy(update={"reference": _no_optimum(scenario)}))
    formation, predicted = simulation.loop.formation, predicted_rows(scenario)
    leaders = simulation.loop.network.leader > 0.0
    for tick in simulation.control_ticks():
        truth, k = simulation.loop.world.truth(), tick.index
        for name in ("hand_world", "wall_margin", "moving_margin", "wall_contact", "moving_contact", "robot_contact"):
            getattr(histories, name)[0, k] = getattr(truth, name)
        histories.m[0, k] = tick.solution.m
        histories.diverged[0, k] = tick.solution.status == "diverged"
        spaces, (p, xi, m) = tick.half_spaces, (tick.problem.p, tick.problem.xi, tick.solution.m[leaders])
        at_once = HalfSpaces(spaces.G[None], spaces.h[None], spaces.active[None], spaces.binds[None])
        motion = None if tick.problem.motion is None else tick.problem.motion[None]
        worst = worst_rows(at_once, (p[None], xi[None], m[None]), formation, predicted, motion)
        histories.certificate_violated[:, k] = worst > VIOLATED
    return histories


def _no_optimum(scenario: Scenario) -> Reference:
    return scenario.reference.model_copy(update={"solver": "none"})


def _leave_ctrl_c_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
