from __future__ import annotations

import re
from pathlib import Path

from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.fields import MESSAGES, SCHEMA_VERSION, Field
from pbrg_mj.log.write.writer import CHUNK_SECONDS
from pbrg_mj.loop.simulation import BLOCK_SECONDS, BLOCK_TICKS

PAGE = (Path(__file__).parent.parent / "docs" / "log.md").read_text(encoding="utf-8")


def row(field: Field) -> str:
    shape = " x ".join(field.shape) if field.shape else "scalar"
    return f"| `{field.name}` | {field.kind} | {shape} | {field.unit} | {field.meaning} |"


def test_the_page_lists_exactly_the_fields_of_the_table() -> None:
    for name, table in MESSAGES.items():
        section = re.split(r"\n##+ ", PAGE.split(f"### pbrg.{name}\n")[1])[0]
        rows = [line for line in section.splitlines() if line.startswith("| `")]
        assert rows == [row(field) for field in table], name


def test_the_page_names_channels_and_what_is_embedded() -> None:
    section = PAGE.split("## Channels\n")[1].split("\n## ")[0]
    topics = set(re.findall(r"^\| `([^`]+)`", section, flags=re.MULTILINE))
    names = ("TICK", "OPTIMUM", "TIMING", "TRANSFORMS", "SCENE", "TEAM_SCENE", "P_POSES", "M_POSES", "EVENTS")
    own = {getattr(channels, name) for name in names}
    assert topics == own | {channels.scan_channel(1).replace("1", "<k>")}
    embedded = PAGE.split("## Embedded\n")[1].split("\n## ")[0]
    for name in (channels.SCENARIO_ATTACHMENT, channels.MODEL_ATTACHMENT):
        assert f"| attachment | `{name}` |" in embedded
    for name in (channels.RUN_METADATA, channels.VERSIONS_METADATA, channels.CERTIFICATE_METADATA):
        assert f"| metadata | `{name}` |" in embedded
    assert f"now {SCHEMA_VERSION}" in embedded
    assert f"at most {CHUNK_SECONDS} simulated seconds" in PAGE
    assert f"up to {BLOCK_TICKS} ticks" in PAGE
    assert f"longer than {BLOCK_SECONDS} s" in PAGE
