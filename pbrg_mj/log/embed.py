"""What a log holds before any tick: what it takes to rerun it, and its channels."""

from __future__ import annotations

from google.protobuf.message import Message
from mcap_protobuf.schema import build_file_descriptor_set

from pbrg_mj.log import channels
from pbrg_mj.log.fields import SCHEMA_VERSION, Dims
from pbrg_mj.log.mcap_file import McapFile
from pbrg_mj.log.versions import versions
from pbrg_mj.scenario.load import Loaded


def embed(writer: McapFile, loaded: Loaded, model_xml: str, dims: Dims) -> None:
    """Write what it takes to rerun, before any tick and outside of chunks: a log cut short still has it."""
    attachments = (
        (channels.SCENARIO_ATTACHMENT, "application/yaml", loaded.yaml_text),
        (channels.MODEL_ATTACHMENT, "application/xml", model_xml),
    )
    for name, media_type, text in attachments:
        if text:
            # time 0, never the clock's: the same run makes the same bytes
            writer.add_attachment(0, 0, name, media_type, text.encode())
    writer.add_metadata(channels.RUN_METADATA, run_facts(loaded.name, loaded.scenario.seed, dims))
    writer.add_metadata(channels.VERSIONS_METADATA, versions())


def run_facts(name: str, seed: int, dims: Dims) -> dict[str, str]:
    """Return the metadata that tell which run a log holds."""
    numbers = {"schema": SCHEMA_VERSION, "seed": seed, "robots": dims["n"], "slots": dims["K"], "rows": dims["R"]}
    return {"name": name} | {key: str(value) for key, value in numbers.items()}


def register(writer: McapFile, types: dict[str, type[Message]]) -> dict[str, int]:
    """Register a channel for each topic, and each class's schema once; return topic -> channel number."""
    schemas = {
        kind: writer.register_schema(
            kind.DESCRIPTOR.full_name, "protobuf", build_file_descriptor_set(kind).SerializeToString()
        )
        for kind in dict.fromkeys(types.values())
    }
    return {topic: writer.register_channel(topic, "protobuf", schemas[kind], {}) for topic, kind in types.items()}
