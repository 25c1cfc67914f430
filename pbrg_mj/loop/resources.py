"""What a scenario asks of the machine, estimated before it runs: memory, and time."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path

from pbrg_mj.errors import InputError
from pbrg_mj.scenario.checks.work import numbers_per_tick, robot_steps_per_tick
from pbrg_mj.scenario.schema import Scenario, edge_list, whole_number

# Against runs of 5 to 500 robots and batches of 32 worlds: what they took is within a third of the estimates.
BASE = 250e6  # bytes of Python, the libraries and the kernels
ROBOT, BEAM = 300e3, 13e3  # bytes of MuJoCo's model and data
SHARE = 0.05  # of that, what every world of a batch has for itself
TICKS_IN_MEMORY = 8  # ticks' estimates that exist at once: in the rounds, in records, in the log's buffer
LONG_RUN = 3600.0  # [s] of a run that is warned of
NUMBERS_A_SECOND, ROBOT_STEPS_A_SECOND = 1e9, 1e5


def check_memory(scenario: Scenario, worlds: int = 0) -> None:
    """Raise InputError when a run needs more memory than there is; of a batch, with so many worlds."""
    needed, there = batch_bytes(scenario, worlds) if worlds else run_bytes(scenario), available_bytes()
    if needed > there:
        less = "fewer seeds, a shorter timing.duration" if worlds else "fewer robots or links, a shorter delay"
        raise InputError(
            f"{'the batch' if worlds else 'the run'} needs some {_size(needed)} of memory, and {_size(there)} are free "
            f"here; {less} or estimator.half_spaces_per_robot take less"
        )


def resource_warnings(scenario: Scenario) -> Iterator[str]:
    """Yield a line for a run that lasts for hours, and one for a run that needs more memory than there is here."""
    ticks = scenario.timing.duration / scenario.timing.tick
    numbers, steps = ticks * numbers_per_tick(scenario), ticks * robot_steps_per_tick(scenario)
    if numbers > LONG_RUN * NUMBERS_A_SECOND:
        hours = numbers / NUMBERS_A_SECOND / 3600
        yield f"{ticks:.3g} ticks handle {numbers:.1e} numbers in governor.rounds: at 1e9 a second, {hours:.2g} hours"
    if steps > LONG_RUN * ROBOT_STEPS_A_SECOND:
        hours = steps / ROBOT_STEPS_A_SECOND / 3600
        yield f"{ticks:.3g} ticks are {steps:.1e} physics steps of a robot: at 1e5 a second, {hours:.2g} hours"
    needed, there = run_bytes(scenario), available_bytes()
    if needed > there:
        yield f"a run needs some {_size(needed)} of memory, and {_size(there)} are free here"


def run_bytes(scenario: Scenario) -> float:
    """Return about how much memory a run takes [bytes]."""
    numbers = TICKS_IN_MEMORY * _estimates(scenario) + 3 * _rows(scenario) + 4 * _links(scenario)
    return BASE + numbers + _world(scenario)


def batch_bytes(scenario: Scenario, worlds: int) -> float:
    """Return about how much memory a batch takes [bytes]: histories, twice where they are evaluated, and the worlds."""
    ticks, n = whole_number(scenario.timing.duration, scenario.timing.tick) + 1, scenario.robots
    histories = 2.0 * ticks * (51 * n + 9)
    state = 3 * _estimates(scenario) + 2 * _rows(scenario) + SHARE * _world(scenario)
    return BASE + _world(scenario) + worlds * (histories + state)


def available_bytes() -> float:
    """Return how much memory this process may still take [bytes]: what is free, and within its limits."""
    limits = [_free(), _container(), _address_space()]
    return max(0.0, min(limits))


def _estimates(scenario: Scenario) -> float:
    """Return the bytes of z, zeta and lam of all robots."""
    n = scenario.robots
    return 8.0 * n * (2 * (4 * n + 2) + n * scenario.estimator.half_spaces_per_robot)


def _rows(scenario: Scenario) -> float:
    n = scenario.robots
    return 34.0 * n * n * scenario.estimator.half_spaces_per_robot


def _links(scenario: Scenario) -> float:
    """Return the bytes of the messages under way."""
    network, n = scenario.network, scenario.robots
    longest = max([network.delay_rounds, *(link.delay_rounds for link in network.links)]) + network.jitter_rounds
    if not (longest or network.loss or network.outages or network.exchange != "plain"):
        return 0.0
    messages = longest + (2 if network.exchange == "plain" else 4)  # the one kept, and sums of waves
    return 2 * len(edge_list(scenario.graph, n)) * messages * 2 * (4 * n + 2) * 8.0


def _world(scenario: Scenario) -> float:
    if scenario.plant == "ideal":
        return 0.0
    return scenario.robots * ROBOT + len(scenario.beam_robots) * scenario.sensors.beams.all_rays * BEAM


def _free() -> float:
    for line in _lines("/proc/meminfo"):
        if line.startswith("MemAvailable:"):
            return 1024.0 * float(line.split()[1])
    return math.inf


def _container() -> float:
    limit, used = (" ".join(_lines(f"/sys/fs/cgroup/memory.{name}")) for name in ("max", "current"))
    return float(limit) - float(used) if limit.isdigit() and used.isdigit() else math.inf


def _address_space() -> float:
    try:
        import resource  # not on every system
    except ImportError:
        return math.inf
    limit, pages = resource.getrlimit(resource.RLIMIT_AS)[0], _lines("/proc/self/statm")
    if limit == resource.RLIM_INFINITY or not pages:
        return math.inf
    return limit - float(pages[0].split()[0]) * os.sysconf("SC_PAGE_SIZE")


def _lines(path: str) -> list[str]:
    try:
        return Path(path).read_text().splitlines()
    except OSError:
        return []


def _size(count: float) -> str:
    return f"{count / 1e9:.2g} GB" if count < 1e11 else f"{count / 1e9:.0f} GB"
