"""Names of the channels and of what the log embeds; shared by writer and reader."""

from __future__ import annotations

TICK = "/tick"
OPTIMUM = "/optimum"
TIMING = "/timing"
TRANSFORMS = "/tf"
SCENE = "/scene"
TEAM_SCENE = "/scene/team"
P_POSES = "/poses/p"
M_POSES = "/poses/m"
EVENTS = "/events"

RUN_METADATA = "pbrg"
VERSIONS_METADATA = "pbrg.versions"
CERTIFICATE_METADATA = "pbrg.certificate"
ENDING_METADATA = "pbrg.ending"
SCENARIO_ATTACHMENT = "scenario.yaml"
MODEL_ATTACHMENT = "model.xml"


def scan_channel(robot: int) -> str:
    """Return the channel of robot `robot`'s scans, counted from 1."""
    return f"/scan/robot_{robot}"
