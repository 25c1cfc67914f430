"""Records of a suite to the rows of its table: one for each group of seeds, network and governor."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from pbrg_mj.analysis.metrics.rates import Rate
from pbrg_mj.scenario.schema.graph import edge_list
from pbrg_mj.studies.bench.statistics import Difference, Quartiles, shifted_geometric_mean
from pbrg_mj.studies.bench.suite import Suite, plain_name
from pbrg_mj.studies.run_task import Record
from pbrg_mj.studies.task import Task

WITHOUT = "none"  # the governor that settling is compared with
GAP_SHIFT = 0.01  # [m]
CERTIFICATES = ("certificate_violated_share", "directional_ball_violated_share", "predictive_violated_share")
CONTACTS = ("wall_contacts", "moving_contacts", "robot_contacts")


@dataclass(frozen=True)
class BenchRun:
    """One run of a suite."""

    task: Task
    log: str
    record: Record
    timings: Record
    neighbours: float  # mean number of a robot's

    @property
    def ok(self) -> bool:
        """Whether it ran to its end."""
        return self.record["status"] == "ok"

    @property
    def world(self) -> tuple[str, int, str]:
        """What runs of several governors share."""
        return self.task.source.name, self.task.seed, str(self.task.labels["network_name"])

    def number(self, name: str) -> float | None:
        """Return a metric; None where it does not apply."""
        value = self.record.get(name)
        return None if value is None else float(value)

    @property
    def touched(self) -> bool:
        """Whether a robot touched anything."""
        return any(self.record[name] for name in CONTACTS)

    @property
    def crossed(self) -> bool:
        """Whether a hand point was nearer to an obstacle than the clearance."""
        margin = self.number("true_margin_min_m")
        return margin is not None and margin < 0

    @property
    def infeasible(self) -> float:
        """Time in which the governor had no solution [s]."""
        return self.record["governor_not_ok_share"] * self.record["duration_s"]

    @property
    def messages(self) -> float | None:
        """Messages a robot sends in a tick: one to each neighbour in every round; None of a centralized governor."""
        sent, rounds = self.number("sent_per_robot_per_tick_bytes"), self.number("rounds_per_tick")
        return None if sent is None or rounds is None else rounds * self.neighbours * (sent > 0)


@dataclass(frozen=True)
class Row:
    """What one governor did on one network with one group of seeds."""

    group: str
    network: str
    governor: str
    centralized: bool
    runs: tuple[BenchRun, ...]
    paired: tuple[tuple[BenchRun, BenchRun], ...]  # with the same worlds without governor

    @property
    def anchor(self) -> str:
        """Its name in links."""
        return "-".join(map(plain_name, (self.group, self.network, self.governor)))

    @property
    def ok(self) -> list[BenchRun]:
        """The runs that have numbers."""
        return [one for one in self.runs if one.ok]

    def others(self) -> dict[str, BenchRun]:
        """Return the run without governor in the same world, by the names of the runs' logs; none for `none` itself."""
        return {one.log: other for one, other in self.paired if one is not other}

    def rate(self, what: Callable[[BenchRun], bool]) -> Rate | None:
        """Return how often something happened."""
        return Rate.of(sum(map(what, self.ok)), len(self.ok)) if self.ok else None

    def values(self, name: str) -> list[float]:
        """Return a metric of all runs that have it."""
        return [value for one in self.ok if (value := one.number(name)) is not None]

    def quartiles(self, name: str) -> Quartiles | None:
        """Return a metric's quartiles."""
        return Quartiles.of(self.values(name))

    def mean(self, name: str) -> float | None:
        """Return a metric's mean."""
        values = self.values(name)
        return math.fsum(values) / len(values) if values else None

    @property
    def gap(self) -> float | None:
        """Shifted geometric mean of the mean optimality gap [m]."""
        return shifted_geometric_mean(self.values("optimality_gap_m.mean"), GAP_SHIFT)

    @property
    def infeasible(self) -> float | None:
        """Mean time in which the governor had no solution [s]."""
        times = [one.infeasible for one in self.ok]
        return math.fsum(times) / len(times) if times else None

    @property
    def messages(self) -> float | None:
        """Mean number of messages a robot sends in a tick."""
        counts = [count for one in self.ok if (count := one.messages) is not None]
        return math.fsum(counts) / len(counts) if counts else None

    def ratios(self, name: str) -> list[float]:
        """Return a metric relative to that without governor, of the worlds where both have it."""
        found = [(one.number(name), other.number(name)) for one, other in self.paired]
        return [own / without for own, without in found if own is not None and without]

    def difference(self, name: str) -> Difference | None:
        """Return how much a metric is above that without governor, in the same worlds."""
        found = [(one.number(name), other.number(name)) for one, other in self.paired]
        return Difference.of([own - without for own, without in found if own is not None and without is not None])

    def compute_us(self) -> Quartiles | None:
        """Return the governor's wall-clock time a robot and tick [us]: the median tick of each run."""
        times = [(one.timings.get("governor_ms.median"), one.record["robots"]) for one in self.ok]
        return Quartiles.of([1e3 * time / robots for time, robots in times if time is not None])

    def by_margin(self) -> list[BenchRun]:
        """Return the runs that have a margin, the worst one first."""
        known = [one for one in self.ok if one.number("true_margin_min_m") is not None]
        return sorted(known, key=lambda one: (one.record["true_margin_min_m"], one.log))


def bench_runs(suite: Suite, results: Sequence[tuple[Record, Record]]) -> list[BenchRun]:
    """Return the suite's runs with what they gave."""
    made = []
    for task, log, (record, timings) in zip(suite.tasks, suite.logs, results, strict=True):
        made.append(BenchRun(task, log, record, timings, _neighbours(task) if record["status"] == "ok" else 0.0))
    return made


def table(suite: Suite, runs: Sequence[BenchRun]) -> list[Row]:
    """Return the rows in the suite's order: held-out seeds first.

    Where `none` has no run on a network, its run of the same world on another one stands for it: it sends nothing.
    """
    alone = [one for one in runs if one.task.labels["governor_name"] == WITHOUT and one.ok]
    own, elsewhere = {one.world: one for one in alone}, {one.world[:2]: one for one in reversed(alone)}

    def without(one: BenchRun) -> BenchRun | None:
        return own.get(one.world) or elsewhere.get(one.world[:2])

    grouped: dict[tuple[str, str, str], list[BenchRun]] = {}
    for one in runs:
        labels = one.task.labels
        grouped.setdefault((labels["group"], labels["network_name"], labels["governor_name"]), []).append(one)
    return [
        Row(
            *key,
            key[2] in suite.centralized,
            tuple(found),
            tuple((one, other) for one in found if one.ok and (other := without(one))),
        )
        for key, found in grouped.items()
    ]


def _neighbours(task: Task) -> float:
    settings = task.scenario().settings
    return 2 * len(edge_list(settings.graph, settings.robots)) / settings.robots
