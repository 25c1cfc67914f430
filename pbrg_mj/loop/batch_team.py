"""The teams of many worlds side by side: their states, and how these move by eq. 2."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pbrg_mj import plugins
from pbrg_mj.errors import InputError
from pbrg_mj.governor.registry import velocity_filters
from pbrg_mj.kernel import kernel
from pbrg_mj.loop.compiled_control import CompiledControl, write_control
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.exchange import exchange
from pbrg_mj.vehicle.drive import drive_of
from pbrg_mj.vehicle.hand_point import write_hand_points
from pbrg_mj.world.scene.robot import load_robot_model


def control_of_teams(scenario: Scenario) -> CompiledControl:
    """Return what all teams are controlled by. Raises InputError for what is not compiled for worlds side by side."""
    if exchange(scenario) is not None:
        only = "a batch exchanges p and xi at once"
        raise InputError(f"{only}; run the seeds one by one", key="network.pre_stabiliser")
    drive = drive_of(scenario, load_robot_model(scenario.robot))
    found = CompiledControl.of(scenario, drive, velocity_filters(scenario))
    if found is None:
        only = "a batch filters velocities for separation alone"
        raise InputError(f"{only}; run the seeds one by one", key="governor")
    return found


def check_built_in(scenario: Scenario) -> None:
    """Raise InputError for parts of plug-ins that worlds side by side would have to share."""
    for kind in (plugins.CERTIFICATE, plugins.ESTIMATOR, plugins.NOISE_MODEL):
        if plugins.value_at(scenario, kind.key) not in kind.built_in:
            only = f"worlds side by side have no {kind.noun} of a plug-in"
            raise InputError(f"{only}; run the seeds one by one", key=kind.key)


@dataclass(frozen=True)
class TeamStates:
    """The states of W worlds' teams, whatever their governor; they move on in place."""

    pose: np.ndarray  # (W, n, 3) as the robots know them
    xi: np.ndarray  # (W, n, 2) [m]
    displacement: np.ndarray  # (W, n, 2) of q from p + b [m]; 0 where robots keep no distance
    m: np.ndarray  # (W, n, 2) [m]
    diverged: np.ndarray  # (W,) bool
    command: np.ndarray  # (W, n, 2) left, right [V]

    @classmethod
    def initial(cls, worlds: int, robots: int) -> TeamStates:
        """Return the states before the first tick."""
        pairs = (np.zeros((worlds, robots, 2)) for _ in range(4))
        xi, displacement, m, command = pairs
        return cls(np.empty((worlds, robots, 3)), xi, displacement, m, np.zeros(worlds, dtype=bool), command)

    def p(self, team: CompiledControl) -> np.ndarray:
        """Return p (W, n, 2) [m]."""
        q, p = np.empty(self.m.shape), np.empty(self.m.shape)
        _write_all_places(self.pose, self.displacement, team.packed, q, p)
        return p

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """All of them, in their order."""
        return self.pose, self.xi, self.displacement, self.m, self.diverged, self.command


@kernel
def _write_all_places(pose, displacement, team, q, p):
    """Do the same for all worlds: q and p (W, n, 2) [m]."""
    for w in range(len(pose)):
        write_places(pose[w], displacement[w], team, q[w], p[w])


@kernel
def write_places(pose, displacement, team, q, p):
    """Write one world's q and p (n, 2) [m] of pose (n, 3) and displacement (n, 2).

    `team` (a tuple, in its order) is `CompiledControl.packed`.
    """
    formation, sizes, apart = team[1], team[3], team[5][2]
    write_hand_points(pose, sizes[0], q)
    for j in range(len(q)):
        for axis in range(2):
            p[j, axis] = q[j, axis] - formation[j, axis]
            if apart:
                p[j, axis] -= displacement[j, axis]


@kernel
def control_world(w, states, places, half_spaces, forbidden, team):
    """Do in world w what `tick` does between governor and physics.

    `states` are `TeamStates.arrays`; `places` q and p of this world; `half_spaces` the `HalfSpaces.arrays` of all
    worlds; `forbidden` tells whether rows forbid this world's m; `team` is `CompiledControl.packed`.
    """
    pose, xi, displacement, m, _, command = states
    q, p = places
    G, h, active, binds, closing, spans = half_spaces
    velocity = np.empty(p.shape)
    spaces = G[w], h[w], active[w], binds[w], closing[w], spans[w]
    state = pose[w], q, p, xi[w], m[w], displacement[w], forbidden
    write_control(spaces, state, team, (velocity, command[w], xi[w], displacement[w]))
