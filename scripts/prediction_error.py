"""How far the predicted team is from the true one, with kinematic robots and behind motors and delays.

    python scripts/prediction_error.py paper/experiment_near obstacles/corner --after 3

Every scenario runs with the certified governor and kinematic predictions, sensors without noise, and robots that do not
keep off each other. From each tick on both models are stepped with the references that were applied, and compared with
the true hand points. Printed is the root mean square of the distance [mm], over robots and ticks, by time ahead.
"""

from __future__ import annotations

import argparse

import numpy as np

from pbrg_mj.governor.certificate.team_model import TeamModel
from pbrg_mj.governor.problem.motion import prediction_state
from pbrg_mj.loop.simulation import Simulation
from pbrg_mj.scenario.load import load_scenario
from pbrg_mj.scenario.schema import Scenario
from pbrg_mj.team.graph import network
from pbrg_mj.vehicle.motor_lag import MotorLag

AHEAD = (0.0, 0.1, 0.2, 0.5, 1.0, 2.0)  # [s]
EXACT = ("sensors.camera.position_std=0", "sensors.camera.heading_std_deg=0", "sensors.beams.noise_std=0")
RUN = ("governor.kind=certified", "reference.solver=none", "control.separation=null", *EXACT)


def errors(scenario: Scenario, after: float) -> dict[str, list[float]]:
    """Return the root mean squares [m] at every time of AHEAD, by model, of predictions from `after` [s] on."""
    team, control, tick = network(scenario), scenario.control, scenario.timing.tick
    lag, leaders = MotorLag.of(scenario), network(scenario).leader > 0.0
    true, p, xi, m, motions, motion = [], [], [], [], [], lag.at_rest(team.robots)
    simulation = Simulation.build(scenario)
    for one in simulation.control_ticks():
        true.append(simulation.loop.world.truth().hand_world - simulation.loop.formation)
        p.append(one.problem.p)
        xi.append(one.problem.xi)
        m.append(one.solution.m[leaders].mean(axis=0))
        motions.append(motion)
        motion = lag.after(motion, one.velocity)
    first = round(after / tick)
    states, m, true = (np.array(p[first:]), np.array(xi[first:])), np.array(m[first:]), np.array(true[first:])
    models = {
        "kinematic": (TeamModel.of(team, control, tick), None),
        "motors": (TeamModel.of(team, control, tick, lag), np.array(motions[first:])),
    }
    return {name: _rms(model, prediction_state(*states, own), m, true) for name, (model, own) in models.items()}


def _rms(model: TeamModel, start: tuple[np.ndarray, np.ndarray], m: np.ndarray, true: np.ndarray) -> list[float]:
    """Return the errors of one model, which starts at every tick.

    `m` (T, 2) [m] are the references applied, `true` (T, n, 2) [m] the true shifted hand points.
    """
    found, ahead = [], [round(seconds / model.tick) for seconds in AHEAD]
    starts, x = len(m) - max(ahead), np.concatenate(start, axis=1)  # (T, N, 2)
    x = x[:starts]
    push = (np.eye(len(model.step)) - model.step) @ model.at_rest
    for ticks in range(max(ahead) + 1):
        if ticks in ahead:
            apart = np.linalg.norm(model.position @ x - true[ticks : ticks + starts], axis=-1)
            found.append(float(np.sqrt(np.mean(apart**2))))
        x = model.step @ x + push[:, None] * m[ticks : ticks + starts, None]
    return found


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", nargs="+")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--duration", type=float, default=12.0, help="of the runs, the last 2 s to compare with [s]")
    parser.add_argument("--after", type=float, default=0.0, help="from when on the models start [s]")
    given = parser.parse_args()
    print("scenario", "model", *(f"{seconds:g} s" for seconds in AHEAD), sep="\t")
    for name in given.scenarios:
        scenario = load_scenario(name, [*RUN, f"timing.duration={given.duration}", *given.set]).scenario
        for model, found in errors(scenario, given.after).items():
            print(name, model, *(f"{1000 * one:.1f}" for one in found), sep="\t")


if __name__ == "__main__":
    main()
