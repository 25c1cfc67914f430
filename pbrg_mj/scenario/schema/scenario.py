"""The whole scenario as frozen, validated data. Every key with its unit and default; SI unless the key says otherwise.

Robots are numbered from 1, as in the paper; arrays inside the package count from 0.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from pbrg_mj.scenario.robots import GAINS, RobotName
from pbrg_mj.scenario.schema.actuation import Drive, Radio
from pbrg_mj.scenario.schema.base import Positive, Section
from pbrg_mj.scenario.schema.disturbances import Disturbances
from pbrg_mj.scenario.schema.estimator import Estimator
from pbrg_mj.scenario.schema.governor import Control, Governor, Reference
from pbrg_mj.scenario.schema.graph import Graph
from pbrg_mj.scenario.schema.network import Network
from pbrg_mj.scenario.schema.operator import Operator, largest_reference
from pbrg_mj.scenario.schema.sensors import Sensors
from pbrg_mj.scenario.schema.team import Team
from pbrg_mj.scenario.schema.timing import Timing
from pbrg_mj.scenario.schema.world import World

Verdict = Literal["violation", "allowed"]
# Defaults where the plant is the paper's integrator: the gains of its simulation. Wheels that stick below a speed stay
# short of their place by that speed over the gain, so physics has those of its experiment.
IDEAL_GAINS = {"control": {"alpha_r": 1.0}, "governor": {"alpha": 2.0}}


class Contacts(Section):
    """Which contacts make a run violated. Contact with the floor never does."""

    walls: Verdict = Field(default="violation", description="contact with an obstacle at rest, or its line crossed")
    moving: Verdict = Field(default="violation", description="contact with a moving box, or its line crossed")
    robots: Verdict = Field(default="violation", description="contact between robots")


class Outcome(Section):
    """When a run counts as converged, and when as at rest."""

    tolerance: Positive = Field(default=0.05, description="largest ||q_j - b_j - target|| of a converged team [m]")
    rest_speed: Positive = Field(
        default=0.0005, description="a robot slower than this, over `rest_time`, is at rest [m/s]"
    )
    rest_time: Positive = Field(default=5.0, description="window over which speeds are averaged [s]")
    trend_time: Positive = Field(
        default=20.0, description="window over which a team comes closer to its target, or does not [s]"
    )
    diverged_beyond: Positive = Field(
        default=1000.0,
        description="any state or governed reference larger than the largest r by more than this has diverged [m]",
    )
    contacts: Contacts = Contacts()


class Log(Section):
    """What goes into the log."""

    timings: bool = Field(
        default=True, description="wall-clock timings, on a channel of their own; off: byte-identical files"
    )


class Scenario(Section):
    """One run, completely."""

    description: str = Field(default="", description="one sentence: what the scenario shows")
    seed: Annotated[int, Field(ge=0, lt=2**63)] = Field(default=1, description="of all noise in the run")
    plant: Literal["physics", "ideal"] = Field(
        default="physics", description="MuJoCo, or the paper's integrator dq/dt = u"
    )
    robot: RobotName = Field(default="generic", description="the robots' model, in `models/`; all are alike")
    timing: Timing = Timing()
    team: Team
    graph: Graph = Graph()
    world: World = World()
    sensors: Sensors = Sensors()
    estimator: Estimator = Estimator()
    control: Control = Control()
    drive: Drive = Drive()
    radio: Radio = Radio()
    disturbances: Disturbances = Disturbances()
    network: Network = Network()
    governor: Governor = Governor()
    reference: Reference = Reference()
    operator: Operator
    outcome: Outcome = Outcome()
    log: Log = Log()

    @model_validator(mode="before")
    @classmethod
    def _gains(cls, keys: Any) -> Any:
        """Fill in the ideal plant's gains, or in physics those of the robots, where none are given."""
        if not isinstance(keys, dict):
            return keys
        gains = IDEAL_GAINS if keys.get("plant") == "ideal" else _robot_gains(keys.get("robot", "generic"))
        given = {section: keys.get(section, {}) for section in gains}
        return keys | {name: gains[name] | one for name, one in given.items() if isinstance(one, dict)}

    @property
    def robots(self) -> int:
        """Number of robots n."""
        return len(self.team.start)

    @property
    def beam_robots(self) -> tuple[int, ...]:
        """Robots that carry beams, counted from 0, ascending: the rows of every array of ranges."""
        listed = self.sensors.beams.robots
        return tuple(range(self.robots)) if listed == "all" else tuple(sorted(number - 1 for number in listed))

    @property
    def divergence_limit(self) -> float:
        """Size of a component of p, xi or m beyond which a run has diverged [m]; a team may follow r far away."""
        return self.outcome.diverged_beyond + largest_reference(self.operator)

    @property
    def assumed_sensors(self) -> Sensors:
        """The sensors as perception takes them to be."""
        return self.estimator.assumed.of(self.sensors)


def _robot_gains(robot: Any) -> dict[str, dict[str, float]]:
    """Return the gains of a robot that is not the generic one, whose gains are the sections' defaults."""
    if robot == "generic" or not isinstance(robot, str) or robot not in GAINS:
        return {}
    alpha_r, alpha = GAINS[robot]
    return {"control": {"alpha_r": alpha_r}, "governor": {"alpha": alpha}}
