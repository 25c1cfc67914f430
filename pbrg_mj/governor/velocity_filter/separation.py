"""Robots keep their distance: a filter of velocities that neither the certificate nor eq. 2 need to know of.

Eq. 2 moves the points s_j = p_j + b_j at u_j. Robot j drives at w_j, and q_j - s_j is its displacement:

    d(q_j - s_j)/dt = w_j - u_j,    p_j = q_j - b_j - (q_j - s_j).

So p and xi move by eq. 9 whatever w is: V falls, and what was predicted of the s_j stays true. w_j is the nearest
velocity to u_j - gamma (q_j - s_j), scaled to what the wheels can do, with

    n_ij.w_j <= gamma / 2 (||q_i - q_j|| - d)_+    for every other robot i, n_ij from j to i,
    G.w_j <= max(0, gamma (h - G.q_j), catch_up)   for every half-space that binds j,

catch_up = G.(s_j + tick u_j - q_j) / tick if s_j + tick u_j is behind the half-space and stays there, by the rows that
m meets, else 0: where rows forbid m nobody knows where the s_j go. Where nothing comes it is at most what j wants,
G.(u_j - gamma (q_j - s_j)), so that turns beside what stands are slow. w_j = 0 meets all rows.
A half-space whose h falls at the rate c, the closing speed of what it keeps off, asks instead for

    G.w_j <= gamma (h - G.q_j) - c,

so that h - G.q_j falls by the rate gamma at most (a control barrier function that depends on time). Where that is a
retreat, j has the right of way: its rows of other robots have gamma in place of gamma / 2. Where other rows still do
not leave it, rows of what comes are relaxed, all by the same slack, the least that will do, and then each by as much
less as the others leave: between two that come j goes where it is as badly off with either. Beyond a half-space at
rest, by more than its noise, j goes back at gamma times how far, at most 5 cm, and no slower than motors move and turns
allow; where that is not to be had, as far as it is. Nearer to another robot than d, each goes back at gamma / 2 times
how far likewise, however slowly.

What j knows to come at c pushes robots between it and j, too, and j makes room for them: robot i, at the distance
e = h - G.q_i and between the ends of what comes, must retreat at rho = max(0, c - gamma e), and gamma times the
distance that it needs for that will be c before long; so j keeps

    n_ij.w_j <= gamma (||q_i - q_j|| - d) - (rho + min(c, max(0, 2 c - gamma e))) max(0, G.n_ij).

Where that and retreats of its own are not to be had together, it makes no room.

Where what comes will press j against something, j goes out of its way in place of where u leads it, with the right of
way, and j makes room for who does: evasion.py.

In physics w is scaled down where robots turn, so that it meets these rows while they do; where they retreat, what they
want besides is: turning.py.

A pair takes at most 2 gamma, so ||q_i - q_j|| stays above d if it was, and below d it never falls; nobody crosses a
half-space. Both are exact with w held for a tick and 2 gamma tick <= 1 (docs/distances.md). Half-planes between pairs
of robots: Wang, Ames and Egerstedt, IEEE T-RO 33(3), 2017.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pbrg_mj.governor.certificate.speed import turning_offset
from pbrg_mj.governor.problem.interface import FORBIDDEN, Problem, Solution
from pbrg_mj.governor.velocity_filter.evasion import evasive_closing_speeds, evasive_velocity
from pbrg_mj.governor.velocity_filter.nearest_velocity import (
    is_feasible,
    relax_rows,
    scale_for_wheels,
    velocity_of_share,
    velocity_while_pushed_back,
)
from pbrg_mj.governor.velocity_filter.separation_rows import (
    approach_of_team_mates,
    is_beyond_half_space,
    is_pushed_back,
    makes_room,
    violates_separation,
    write_half_space_rows,
    write_room_for_team_mates,
    write_separation_rows,
)
from pbrg_mj.governor.velocity_filter.turning import turning_share
from pbrg_mj.kernel import kernel
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.world.scene.robot import load_robot_model

MARGIN = 0.02  # [m] of `auto`, above the distance at which two bodies cannot touch at any heading


@dataclass(frozen=True)
class SeparationFilter:
    """What every robot does to its velocity."""

    formation: np.ndarray  # (n, 2) b [m]
    distance: float  # d, of two hand points [m]
    margin: float  # from half-spaces [m]
    gain: float  # gamma [1/s]
    facets: np.ndarray  # (F, 2) facet.w <= 1 in the body's axes: what the wheels can do [s/m]
    tick: float  # [s]
    turning: float = 0.0  # tau / l: by how much a robot turns in its lag, per velocity across its heading [rad s/m]
    min_speed: float = 0.0  # [m/s] no velocity is scaled below it because of turning, and no robot goes back slower

    @property
    def numbers(self) -> tuple[float, float, float, float, float, float]:
        """What `write_driven` takes: distance, margin, gain, tick, turning, min_speed."""
        return self.distance, self.margin, self.gain, self.tick, self.turning, self.min_speed

    @classmethod
    def of(cls, scenario: Scenario, margin: float, facets: np.ndarray) -> SeparationFilter:
        """Return the filter of a scenario that has one. Behind all that lags, no approach at its gain oscillates.

        A distance x above d that falls by gamma x behind a lag tau, tau x'' + x' + gamma x = 0, is critically damped
        at gamma = 1 / (4 tau).
        """
        distance, lag, turning, min_speed = separation(scenario), scenario.timing.tick, 0.0, 0.0
        if distance is None:
            raise ValueError("the scenario asks for no separation")
        if scenario.plant == "physics":
            camera, radio = scenario.assumed_sensors.camera, scenario.radio
            robot = load_robot_model(scenario.robot)
            lag += robot.time_constant + 1.0 / camera.rate_hz + camera.delay + radio.delay + radio.jitter
            turning = lag / turning_offset(robot)
            min_speed = MARGIN / (0.5 * math.pi * lag)
        formation = np.array(scenario.team.formation, dtype=float)
        return cls(formation, distance, margin, 1.0 / (4.0 * lag), facets, scenario.timing.tick, turning, min_speed)

    def filtered(
        self, problem: Problem, solution: Solution, hand_world: np.ndarray, velocity: np.ndarray
    ) -> np.ndarray:
        """Return w (n, 2) [m/s] for u, `velocity`. Raises ValueError for a problem without half-spaces or headings."""
        spaces = problem.half_spaces
        if spaces is None or problem.heading is None:
            raise ValueError("this filter needs half-spaces and headings in the problem")
        driven = np.empty(velocity.shape)
        write_driven(
            spaces.arrays,
            (hand_world, problem.p, self.formation, velocity, solution.status in FORBIDDEN),
            (problem.heading, self.facets),
            self.numbers,
            driven,
        )
        return driven


def separation(scenario: Scenario) -> float | None:
    """Return the least distance of hand points that a scenario asks for [m]; None: robots are no obstacles.

    `auto` keeps bodies apart at all headings, or what the formation leaves.
    """
    given = scenario.control.separation
    if given != "auto":
        return given
    if scenario.plant != "physics" or scenario.governor.kind != "certified":
        return None
    formation = np.array(scenario.team.formation, dtype=float)
    pairs = (float(np.linalg.norm(formation[:j] - formation[j], axis=1).min()) for j in range(1, len(formation)))
    return min([2 * load_robot_model(scenario.robot).clearance + MARGIN, *pairs])


@kernel
def write_driven(half_spaces, state, wheels, numbers, driven):
    """Write the velocities to drive, driven (n, 2) [m/s].

    `half_spaces` (six arrays, n first) are `HalfSpaces.arrays`; `state` q, p, formation and u, each (n, 2) [m], [m/s],
    and `forbidden`, whether rows forbid m; `wheels` heading (n,) [rad] and facets (F, 2) [s/m]; `numbers` those of
    SeparationFilter: distance, margin [m], gain [1/s], tick [s], turning [rad s/m], min_speed [m/s].
    """
    q, p, formation, u, forbidden = state
    heading, facets = wheels
    distance, margin, gain, tick, turning, min_speed = numbers
    n, (owners, slots) = len(q), half_spaces[1].shape
    displacement = np.empty((n, 2))
    for j in range(n):
        for axis in range(2):
            displacement[j, axis] = q[j, axis] - formation[j, axis] - p[j, axis]
    moved = q, displacement, u, forbidden
    most = 2 * n + owners * slots
    normals, offsets, retreats = np.empty((most, 2)), np.empty(most), np.empty(most)
    comes = np.empty(most, np.bool_)
    for j in range(n):
        x, y = u[j, 0] - gain * displacement[j, 0], u[j, 1] - gain * displacement[j, 1]
        evades, x, y = evasive_velocity(half_spaces, q, j, (distance, margin), (heading[j], facets), (x, y))
        scale = scale_for_wheels(x, y, heading[j], facets)
        wx, wy = scale * x, scale * y
        coming = _approach(half_spaces, q, j, (distance, margin, gain), evades)
        pushed = is_pushed_back(half_spaces, q, j, margin, gain) or makes_room(q, j, coming, (distance, gain))
        beyond = is_beyond_half_space(half_spaces, q, j, margin) or violates_separation(q, j, distance)
        away = pushed or beyond  # perhaps faster than it wants to go
        speed = math.inf if away else math.sqrt(wx * wx + wy * wy)
        retreats[:], comes[:] = 0.0, False
        rate = gain if pushed or evades else 0.5 * gain
        written = normals, offsets, retreats, comes
        robots = write_separation_rows(q, j, (distance, rate, speed), written)
        limits = margin, gain, tick, speed, min_speed
        own = write_half_space_rows(half_spaces, moved, j, limits, written, robots)
        rows = write_room_for_team_mates(q, j, coming, (distance, gain, speed), written, own)
        needed, goes_back = (normals[:rows], offsets[:rows], retreats[:rows]), retreats[:rows].any()
        if goes_back and not is_feasible(normals[:rows], offsets[:rows] - retreats[:rows]):
            if retreats[robots:own].any():
                rows = own  # its own retreats come before room for others
                needed = normals[:rows], offsets[:rows], retreats[:rows]
            relax_rows(needed, comes[:rows])
        body = heading[j], facets, turning
        if pushed and goes_back:  # who is pushed back does not wait for what stands
            x, y, theta = velocity_while_pushed_back((wx, wy), needed, body, min_speed, robots)
            counted = robots
        else:
            x, y, theta = velocity_of_share(1.0, (wx, wy), needed, body)
            counted = rows
        share = turning_share(x, y, theta, min_speed, normals[:counted], offsets[:counted])
        driven[j, 0], driven[j, 1] = share * x, share * y


@kernel
def _approach(half_spaces, q, j, numbers, evades):
    """Return what each other robot (n,) needs of robot j [m/s]: as it is pushed back, and as it goes out of the way.

    For the second only where j does not go out of the way itself. `numbers` (3,) are distance and margin [m], gain
    [1/s].
    """
    distance, margin, _ = numbers
    approach = approach_of_team_mates(half_spaces, q, j, numbers)
    if not evades:
        approach = np.maximum(approach, evasive_closing_speeds(half_spaces, q, j, (distance, margin)))
    return approach
