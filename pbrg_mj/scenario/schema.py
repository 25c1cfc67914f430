"""The scenario as frozen, validated data. Every key with its unit and default; SI unless the key says otherwise.

Robots are numbered from 1, as in the paper; arrays inside the package count from 0.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from pbrg_mj.scenario.base import NonNegative, Positive, RobotNumber, Section, Vector
from pbrg_mj.scenario.governing import Control, Governor, Network, Reference
from pbrg_mj.scenario.sensors import Sensors
from pbrg_mj.scenario.surroundings import Disturbances, Drive, Radio, World


class Timing(Section):
    """Clocks of the run [s]."""

    duration: Positive = Field(
        default=60.0, description="simulated time of the run [s]; a whole number of ticks, at most 100 million"
    )
    tick: Positive = Field(
        default=0.01, description="period of governor and control [s]; a whole number of physics steps, at most 10000"
    )
    physics_step: Positive = Field(default=0.002, description="step of the rigid-body simulation, at most 5 ms [s]")


class Team(Section):
    """The robots: their number is the length of `start`."""

    start: tuple[Vector, ...] = Field(
        description="hand points q(0) in the world, one [x, y] per robot [m]", min_length=1
    )
    heading_deg: float | tuple[float, ...] = Field(
        default=0.0, description="start headings [deg], one for all or one per robot, counter-clockwise from +x"
    )
    formation: tuple[Vector, ...] = Field(description="bias b_j of each robot from the reference [m]")
    leaders: tuple[RobotNumber, ...] = Field(description="robots that hear the operator, counted from 1", min_length=1)


class Graph(Section):
    """Who talks to whom: fixed, undirected, connected."""

    kind: Literal["ring", "path", "complete", "edges"] = Field(default="ring", description="shape of the network")
    edges: tuple[tuple[RobotNumber, RobotNumber], ...] = Field(
        default=(), description="pairs of robots, for `kind: edges`"
    )


class GivenHalfSpace(Section):
    """A half-space normal . q <= offset that one robot knows from the start."""

    robot: RobotNumber = Field(description="the robot that knows it")
    normal: Vector = Field(description="outward normal, of any length but zero [-]")
    offset: float = Field(
        description="right-hand side of normal . q <= offset [m], with the normal as long as it is given"
    )


class Estimator(Section):
    """From scans to half-spaces."""

    source: Literal["beams", "given"] = Field(
        default="beams", description="fit lines to the beams, or use `given` as it is"
    )
    given: tuple[GivenHalfSpace, ...] = Field(default=(), description="the half-spaces for `source: given`")
    half_spaces_per_robot: Annotated[int, Field(ge=1, le=16)] = Field(
        default=4, description="most half-spaces a robot holds"
    )
    min_points: Annotated[int, Field(ge=3)] = Field(default=5, description="fewest beams that make a line")
    split_distance: Positive = Field(
        default=0.03, description="largest distance of a point from its line before a split [m]"
    )
    min_length: Positive = Field(default=0.25, description="shortest run of points that counts as a wall [m]")
    sigmas: NonNegative = Field(
        default=3.0, description="half-spaces move inward by this many standard deviations of the wall's place [-]"
    )
    scope: Literal["team", "own"] = Field(
        default="team", description="whom a half-space binds: every robot, as in the paper, or the one that sees it"
    )
    memory: NonNegative = Field(default=10.0, description="how long a wall out of sight is kept [s]")
    drift_std: NonNegative = Field(
        default=0.005, description="growth of an unseen wall's offset uncertainty [m], per square root of a second"
    )
    drift_std_deg: NonNegative = Field(
        default=0.2, description="growth of an unseen wall's angle uncertainty [deg], per square root of a second"
    )


class Waypoint(Section):
    """The operator's reference from a time on."""

    time: NonNegative = Field(description="from when on [s]")
    reference: Vector = Field(description="r [m]")


class Operator(Section):
    """What the human asks for: one constant reference, or timed waypoints."""

    reference: Vector | None = Field(default=None, description="constant r [m]")
    waypoints: tuple[Waypoint, ...] = Field(
        default=(), description="r over time, each held until the next; the first at 0 s"
    )


class Outcome(Section):
    """When a run counts as converged, and when as at rest."""

    tolerance: Positive = Field(default=0.05, description="largest ||q_j - b_j - target|| of a converged team [m]")
    rest_speed: Positive = Field(
        default=0.0005, description="a robot slower than this, over `rest_time`, is at rest [m/s]"
    )
    rest_time: Positive = Field(default=5.0, description="window over which speeds are averaged [s]")
    diverged_beyond: Positive = Field(
        default=1000.0, description="any state or reference larger than this has diverged [m]"
    )


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

    @property
    def robots(self) -> int:
        """Number of robots n."""
        return len(self.team.start)

    @property
    def beam_robots(self) -> tuple[int, ...]:
        """Robots that carry beams, counted from 0, ascending: the rows of every array of ranges."""
        listed = self.sensors.beams.robots
        return tuple(range(self.robots)) if listed == "all" else tuple(sorted(number - 1 for number in listed))
