"""What a log holds before any tick: what it takes to run it again, and its channels."""

from __future__ import annotations

import hashlib
import platform
import re
from collections.abc import Callable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from google.protobuf.message import Message
from mcap_protobuf.schema import build_file_descriptor_set

from pbrg_mj.governor.certificate.description import describe
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.fields import SCHEMA_VERSION, Dims
from pbrg_mj.log.write.mcap_writer import McapWriter
from pbrg_mj.scenario.load import LoadedScenario

CENTRALIZED = "centralized"  # key of the run's metadata
PROCESSES = "processes"  # another one, of runs whose robots were processes of their own
PACKAGES = (
    "pbrg-mj",
    "mujoco",
    "numpy",
    "scipy",
    "numba",
    "cvxpy",
    "clarabel",
    "pydantic",
    "ruamel.yaml",
    "mcap",
    "foxglove-sdk",
    "lz4",
    "zstandard",
    "protobuf",
    "foxglove-schemas-protobuf",
)


def versions() -> dict[str, str]:
    """Return name -> version of Python, the platform, the processor and the packages a run's numbers depend on."""
    found = {"python": platform.python_version(), "platform": platform.platform(), "processor": processor()}
    found |= {package.replace("pbrg-mj", "pbrg_mj"): _installed(package) for package in PACKAGES}
    found["pbrg_mj.code"] = code_digest()
    return found


@cache
def _installed(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:  # a checkout that was never installed
        return "not installed"


@cache
def code_digest() -> str:
    """Return a digest of this package's own code: a checkout changes without a new version. It is read once."""
    folder = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*.py")):
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def processor() -> str:
    """Return the processor's name as the system names it: compiled code takes other paths on another one."""
    try:
        named = re.search(r"^model name\s*:\s*(.+)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE)
    except OSError:  # not a Linux
        named = None
    return named[1] if named else platform.processor() or platform.machine()


def embed_provenance(
    writer: McapWriter, loaded: LoadedScenario, model_xml: str, dims: Dims, centralized: bool, processes: bool
) -> None:
    """Write what it takes to run again, before any tick and outside of chunks: a log cut short still has it."""
    attachments = (
        (channels.SCENARIO_ATTACHMENT, "application/yaml", loaded.yaml_text),
        (channels.MODEL_ATTACHMENT, "application/xml", model_xml),
    )
    for name, media_type, text in attachments:
        if text:
            # time 0, never the clock's: the same run makes the same bytes
            writer.add_attachment(0, 0, name, media_type, text.encode())
    run = run_metadata(loaded.name, loaded.scenario.seed, dims, centralized, processes)
    writer.add_metadata(channels.RUN_METADATA, run)
    writer.add_metadata(channels.VERSIONS_METADATA, versions())
    writer.add_metadata(channels.CERTIFICATE_METADATA, describe(loaded.scenario).as_metadata())


def run_metadata(name: str, seed: int, dims: Dims, centralized: bool, processes: bool) -> dict[str, str]:
    """Return the metadata that identify the run, and say what its governor was: see `docs/log.md`."""
    numbers = {"schema": SCHEMA_VERSION, "seed": seed, "robots": dims["n"], "slots": dims["K"], "rows": dims["R"]}
    kind = {CENTRALIZED: str(centralized).lower()} | ({PROCESSES: "true"} if processes else {})
    return {"name": name} | {key: str(value) for key, value in numbers.items()} | kind


def add_channels(writer: McapWriter, types: dict[str, type[Message]]) -> dict[str, Callable[..., None]]:
    """Add a channel for each topic; return topic -> what adds a message, called with its data and `log_time` [ns]."""
    schemas = {kind: build_file_descriptor_set(kind).SerializeToString() for kind in set(types.values())}
    return {topic: writer.add_channel(topic, kind.DESCRIPTOR.full_name, schemas[kind]) for topic, kind in types.items()}
