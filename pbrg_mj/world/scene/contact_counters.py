"""Contacts of robots with walls, with moving boxes and with each other, counted by MuJoCo at every physics step.

No sensor of a robot: what they count is part of the truth.
"""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import mujoco

from pbrg_mj.scenario.schema import Scenario, World, whole_number

WALLS, SKIRT, MOVING = 0, 1, 2  # places of a robot's counters; those of moving boxes begin at MOVING, then the ground's


def add_contact_sensors(spec: mujoco.MjSpec, j: int, scenario: Scenario) -> None:
    """Count a robot's contacts; each counter has a history as long as the steps within a tick.

    Robots touch each other with their skirts alone, so there is one counter of all that a skirt touches, and what
    walls, moving boxes and the ground do not account for is another robot. A counter per pair would cost the square of
    their number. The ground is counted in worlds whose thresholds or ramps may reach up to skirts.
    """
    samples = whole_number(scenario.timing.tick, scenario.timing.physics_step) - 1
    body, wall = mujoco.mjtObj.mjOBJ_XBODY, mujoco.mjtObj.mjOBJ_BODY
    robot = {"objtype": body, "objname": f"robot{j}/robot"}
    skirt = {"objtype": mujoco.mjtObj.mjOBJ_GEOM, "objname": f"robot{j}/skirt"}
    counters = [
        robot | {"reftype": wall, "refname": "walls"},
        skirt,
        *(robot | {"reftype": wall, "refname": f"moving_box{k}"} for k in range(len(scenario.world.moving_boxes))),
        *([skirt | {"reftype": wall, "refname": "world"}] if scenario.world.terrain else []),
    ]
    for name, pair in zip(counter_names(scenario.world), counters, strict=True):
        spec.add_sensor(
            name=f"robot{j}/{name}",
            type=mujoco.mjtSensor.mjSENS_CONTACT,
            intprm=[1 << int(mujoco.mjtConDataField.mjCONDATA_FOUND), 0, 1],
            nsample=samples,
            **pair,
        )


def counter_names(world: World) -> list[str]:
    """Return the names of a robot's counters, in their order."""
    boxes = (f"moving_box{k}_contacts" for k in range(len(world.moving_boxes)))
    return ["wall_contacts", "skirt_contacts", *boxes, *(["ground_contacts"] if world.terrain else [])]
