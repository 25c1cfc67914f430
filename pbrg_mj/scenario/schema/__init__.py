"""What a scenario may say: one frozen, validated section for each part of the YAML.

scenario          the whole, with `outcome` and `log`
timing, team, graph, operator
world, sensors, estimator
beam_presets, camera, localization   parts of `sensors`
assumed           what the estimator takes the sensors' errors for
thresholds        when the estimator takes what it sees for one thing
actuation         `drive` and `radio`
disturbances, network
governor          `control`, `governor` and `reference`
base              types that the sections share
describe          the schema in words, for errors and for the reference page
json_schema       the schema for editors
"""

from pbrg_mj.scenario.schema.actuation import Drive, Radio
from pbrg_mj.scenario.schema.base import Section, Vector, per_robot
from pbrg_mj.scenario.schema.beam_presets import PRESETS
from pbrg_mj.scenario.schema.camera import Camera, Occlusion, Swap
from pbrg_mj.scenario.schema.disturbances import DeadMotor, Disturbances, Kidnapping, Push
from pbrg_mj.scenario.schema.estimator import Estimator, GivenHalfSpace
from pbrg_mj.scenario.schema.governor import WITHOUT_GOVERNOR, Control, Governor, Reference
from pbrg_mj.scenario.schema.graph import Edge, Graph, edge_list, unreachable
from pbrg_mj.scenario.schema.network import Link, Network, Outage
from pbrg_mj.scenario.schema.operator import Operator, Waypoint, operator_reference
from pbrg_mj.scenario.schema.scenario import Log, Outcome, Scenario
from pbrg_mj.scenario.schema.sensors import Beams, Sensors, beam_angles, ray_angles
from pbrg_mj.scenario.schema.team import Team
from pbrg_mj.scenario.schema.timing import LONGEST_PHYSICS_STEP, Timing, whole_multiple, whole_number
from pbrg_mj.scenario.schema.world import (
    WHITE,
    Box,
    BoxWaypoint,
    Column,
    MovingBox,
    Patch,
    Prism,
    Ramp,
    Threshold,
    Wall,
    World,
)

__all__ = [
    "LONGEST_PHYSICS_STEP",
    "PRESETS",
    "WHITE",
    "WITHOUT_GOVERNOR",
    "Beams",
    "Box",
    "BoxWaypoint",
    "Camera",
    "Column",
    "Control",
    "DeadMotor",
    "Disturbances",
    "Drive",
    "Edge",
    "Estimator",
    "GivenHalfSpace",
    "Governor",
    "Graph",
    "Kidnapping",
    "Link",
    "Log",
    "MovingBox",
    "Network",
    "Occlusion",
    "Operator",
    "Outage",
    "Outcome",
    "Patch",
    "Prism",
    "Push",
    "Radio",
    "Ramp",
    "Reference",
    "Scenario",
    "Section",
    "Sensors",
    "Swap",
    "Team",
    "Threshold",
    "Timing",
    "Vector",
    "Wall",
    "Waypoint",
    "World",
    "beam_angles",
    "edge_list",
    "operator_reference",
    "per_robot",
    "ray_angles",
    "unreachable",
    "whole_multiple",
    "whole_number",
]
