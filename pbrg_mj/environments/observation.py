"""What one robot knows, as a vector: its own measurements, and what its neighbours tell it of themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj.environments.options import Options
from pbrg_mj.loop.tick_data import SensedTick
from pbrg_mj.scenario.schema import Scenario, operator_reference
from pbrg_mj.team.network import Network

ENTRIES = {"neighbours": 4, "half_spaces": 4, "scan": 1}  # numbers of a neighbour, a half-space, a beam
LIMIT = 100.0
"""Entries are clipped to +-LIMIT: lengths [m] beyond it mean no more than far away."""


@dataclass(frozen=True)
class Layout:
    """Where what stands in an observation; the same for all robots of a team.

    goal         r - p_j of a leader [m]; 0 of others, who do not hear r
    heading      cosine and sine of the body's
    xi           its integral state of eq. 2 [m]
    neighbours   p_k - p_j and xi_k - xi_j of every neighbour k, ascending [m]; 0 where it has fewer than others
    half_spaces  of its own: the unit normal G, the slack h - G.q_j [m], and 1; 0 where there is none
    scan         or its beams' ranges, shares of the largest range: 1 where nothing came back
    """

    parts: dict[str, slice]
    size: int
    neighbours: tuple[tuple[int, ...], ...]  # of every robot
    beam_row: tuple[int | None, ...]  # of every robot, in arrays of ranges

    @classmethod
    def of(cls, scenario: Scenario, network: Network, options: Options) -> Layout:
        """Return the layout of a scenario's team."""
        first, beams = network.first, scenario.sensors.beams.count
        lists = tuple(tuple(network.neighbours[first[j] : first[j + 1]].tolist()) for j in range(network.robots))
        widths = {"goal": 2, "heading": 2, "xi": 2, "neighbours": ENTRIES["neighbours"] * max(map(len, lists))}
        scans = options.observations == "scans"
        slots = ENTRIES["half_spaces"] * scenario.estimator.half_spaces_per_robot
        widths |= {"scan": beams} if scans else {"half_spaces": slots}
        parts, size = {}, 0
        for name, width in widths.items():
            parts[name], size = slice(size, size + width), size + width
        carry = scenario.beam_robots
        rows = tuple(carry.index(robot) if robot in carry else None for robot in range(network.robots))
        return cls(parts, size, lists, rows)

    @property
    def counts(self) -> dict[str, int]:
        """How many neighbours, and half-spaces or beams, of a robot there is room for, by the part they stand in."""
        return {name: (one.stop - one.start) // ENTRIES[name] for name, one in self.parts.items() if name in ENTRIES}

    def observations(self, scenario: Scenario, network: Network, sight: SensedTick, xi: np.ndarray) -> np.ndarray:
        """Return what every robot knows at a tick, (n, size) float32; xi (n, 2) [m]."""
        n, p = network.robots, sight.p
        made = np.zeros((n, self.size))
        goal = operator_reference(scenario.operator, sight.time) - p
        made[:, self.parts["goal"]] = goal * (network.leader > 0.0)[:, None]
        heading = sight.readings.body_pose[:, 2]
        made[:, self.parts["heading"]] = np.column_stack([np.cos(heading), np.sin(heading)])
        made[:, self.parts["xi"]] = xi
        start = self.parts["neighbours"].start
        for robot, others in enumerate(map(list, self.neighbours)):
            states = np.column_stack([p[others] - p[robot], xi[others] - xi[robot]])
            made[robot, start : start + states.size] = states.ravel()
        if "scan" in self.parts:
            made[:, self.parts["scan"]] = self._scans(scenario, sight)
        else:
            made[:, self.parts["half_spaces"]] = _half_spaces(sight).reshape(n, -1)
        return np.clip(np.nan_to_num(made), -LIMIT, LIMIT).astype(np.float32)

    def _scans(self, scenario: Scenario, sight: SensedTick) -> np.ndarray:
        beams = scenario.sensors.beams
        shares = np.ones((len(self.beam_row), beams.count))
        for robot, row in enumerate(self.beam_row):
            if row is not None:
                ranges = sight.readings.ranges[row] / beams.range_max
                shares[robot] = np.where(np.isnan(ranges), 1.0, np.clip(ranges, 0.0, 1.0))
        return shares


def _half_spaces(sight: SensedTick) -> np.ndarray:
    """Return normals, slacks and flags (n, H, 4) of the robots' own half-spaces."""
    spaces = sight.half_spaces
    slack = spaces.h - np.einsum("ikx,ix->ik", spaces.G, sight.pose.hand_world)
    known = np.concatenate([spaces.G, slack[..., None], np.ones((*slack.shape, 1))], axis=2)
    return np.where(spaces.active[..., None], known, 0.0)
