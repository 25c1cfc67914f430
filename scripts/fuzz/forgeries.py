"""Damaged logs, and forged ones whose checksums are right."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence

import numpy as np
from google.protobuf.message import DecodeError

from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.protobuf import CLASSES
from scripts.fuzz import mcap
from scripts.fuzz.damage import LENGTHS, damaged
from scripts.fuzz.mcap import CHANNEL, MESSAGE, MESSAGE_HEAD, METADATA, SCHEMA, Chunk, File, Record
from scripts.fuzz.mutants import mutant
from scripts.fuzz.values import NUMBERS, TEXTS, Rng, pick

DIMENSIONS = (
    "0",
    "1",
    "2",
    "-1",
    "5",
    "6",
    "1000000",
    "99999999999999999999",
    "9" * 5000,
    "",
    "a",
    "1.5",
    "NaN",
    " 5",
    "٥",
)
TIMES = (0, 1, 10**9, 2**63 - 1, 2**63, 2**64 - 1)


def forgery(seed: int, originals: Sequence[bytes]) -> bytes:
    """Return the log of that number, made from one of the originals."""
    rng = np.random.default_rng((14, seed))
    content = pick(rng, originals)
    if rng.random() < 0.3:
        for _ in range(rng.integers(1, 4)):
            content = damaged(rng, content)
        return content
    file = mcap.take_apart(content)
    for _ in range(rng.integers(1, 4)):
        pick(rng, FORGE)(rng, file)
    content = file.bytes()
    return damaged(rng, content) if rng.random() < 0.05 else content


def _chunk(rng: Rng, file: File) -> Chunk:
    chunks = [part for part in file.parts if isinstance(part, Chunk) and part.records]
    return pick(rng, chunks) if chunks else Chunk([Record(MESSAGE, bytes(22))], "lz4")


def _run_metadata(rng: Rng, file: File) -> None:
    """Change what the log says of its dimensions, version or seed."""
    for k, part in enumerate(file.parts):
        if isinstance(part, Record) and part.opcode == METADATA:
            try:
                name, entries = mcap.metadata_entries(part)
            except (struct.error, UnicodeDecodeError):  # another accident made this record
                continue
            if name != channels.RUN_METADATA or not entries:
                continue
            wanted = int(rng.integers(len(entries)))
            entries[wanted] = (entries[wanted][0], pick(rng, DIMENSIONS))
            if rng.random() < 0.1:
                del entries[wanted]
            file.parts[k] = mcap.metadata(name, entries)


def _shuffled_records(rng: Rng, file: File) -> None:
    """Remove, repeat, move or swap records, in a chunk or outside."""
    some: list = file.parts if rng.random() < 0.4 else _chunk(rng, file).records
    if not some:
        return
    k, j = (int(rng.integers(len(some))) for _ in range(2))
    match rng.integers(5):
        case 0:
            del some[k]
        case 1:
            some.insert(j, some[k])
        case 2:
            some[k], some[j] = some[j], some[k]
        case 3:
            del some[k:]
        case _:
            some[k:k] = [some[k]] * int(10 ** rng.uniform(0, 3))


def _strange_record(rng: Rng, file: File) -> None:
    """Insert a record of any kind with any body, perhaps with a length that is a lie."""
    some: list = file.parts if rng.random() < 0.5 else _chunk(rng, file).records
    lie = pick(rng, LENGTHS) if rng.random() < 0.4 else None
    body = rng.bytes(int(10 ** rng.uniform(0, 3))) if rng.random() < 0.5 else struct.pack("<Q", pick(rng, LENGTHS)) * 4
    some.insert(int(rng.integers(len(some) + 1)), Record(int(rng.integers(0, 20)), body, lie))


def _strange_chunk(rng: Rng, file: File) -> None:
    chunk = _chunk(rng, file)
    match rng.integers(4):
        case 0:
            chunk.size = pick(rng, LENGTHS)
        case 1:
            chunk.compression = pick(rng, ("", "zstd", "lz4"))
        case 2:  # a chunk in a chunk
            chunk.records.append(Record(mcap.CHUNK, chunk.bytes()[mcap.PREFIX.size :]))
        case _:
            chunk.records = []


def _bomb(rng: Rng, file: File) -> None:
    """Insert very many records, or a very large one: in the file it is small."""
    count = int(10 ** rng.uniform(3, 6))
    chunk = _chunk(rng, file)
    ticks = [record for record in chunk.records if record.opcode == MESSAGE]
    one = pick(rng, ticks) if ticks and rng.random() < 0.3 else Record(int(rng.integers(0, 20)), b"")
    most = 2**27 // (len(one.body) + mcap.PREFIX.size)
    extra = [one] * min(count, most) if rng.random() < 0.7 else [Record(int(rng.integers(0, 20)), bytes(10 * count))]
    chunk.records.extend(extra)


def _million_ticks(rng: Rng, file: File) -> None:
    """Let the log hold very many ticks of robots that are not there: a few bytes each."""
    count = int(10 ** rng.uniform(4, 6))
    dims = {"robots": pick(rng, ("0", "1", "5")), "slots": "0", "rows": "0", "schema": "1", "seed": "1", "name": "x"}
    number, found = _channels(file).get(channels.TICK, 1), file.parts
    declared = [record for record in _chunk(rng, file).records if record.opcode in (SCHEMA, CHANNEL)]
    tick = CLASSES["Tick"]()
    records = []
    for k in range(count):
        tick.index, tick.time = k, 0.01 * k  # type: ignore[attr-defined]
        records.append(Record(MESSAGE, MESSAGE_HEAD.pack(number, k, k, k) + tick.SerializeToString()))
    kept = [part for part in found if isinstance(part, Record) and part.opcode != METADATA]
    file.parts = [*kept, mcap.metadata(channels.RUN_METADATA, dims.items()), Chunk([*declared, *records], "lz4")]


def _attachment(rng: Rng, file: File) -> None:
    """Embed another scenario or model."""
    name = pick(rng, (channels.SCENARIO_ATTACHMENT, channels.SCENARIO_ATTACHMENT, channels.MODEL_ATTACHMENT))
    data = pick(
        rng, (mutant(int(rng.integers(10**6))).content, b"", b"\xff\xfe", b"<mujoco/>", b"<mujoco", bytes(10**6))
    )
    for k, part in enumerate(file.parts):
        if isinstance(part, Record) and part.opcode == mcap.ATTACHMENT and mcap.attachment_name(part) == name:
            file.parts[k] = mcap.attachment(name, data)


def _channels(file: File) -> dict[str, int]:
    """Return the numbers of the channels by their topics."""
    found = {}
    for part in file.parts:
        for one in part.records if isinstance(part, Chunk) else ():
            if one.opcode == CHANNEL and len(one.body) > 8:
                length = struct.unpack_from("<I", one.body, 4)[0]
                found[one.body[8 : 8 + length].decode("utf-8", "replace")] = struct.unpack_from("<H", one.body)[0]
    return found


def _declaration(rng: Rng, file: File) -> None:
    """Damage a schema or a channel, wherever it is declared."""
    for part in file.parts:
        some = [one for one in part.records if one.opcode in (SCHEMA, CHANNEL)] if isinstance(part, Chunk) else []
        if some:
            one = pick(rng, some)
            one.body = (
                damaged(rng, one.body) if rng.random() < 0.5 else one.body.replace(b"/", pick(rng, (b"x", b"\xff")))
            )


def _message_head(rng: Rng, file: File) -> None:
    """Forge a message's channel, number or time."""
    some = [one for one in _chunk(rng, file).records if one.opcode == MESSAGE and len(one.body) >= MESSAGE_HEAD.size]
    if some:
        one = pick(rng, some)
        head = list(MESSAGE_HEAD.unpack_from(one.body))
        head[int(rng.integers(4))] = pick(rng, TIMES)
        head[0], head[1] = min(head[0], 2**16 - 1), min(head[1], 2**32 - 1)
        one.body = MESSAGE_HEAD.pack(*head) + one.body[MESSAGE_HEAD.size :]


def _message_bytes(rng: Rng, file: File) -> None:
    """Damage a message's bytes."""
    some = [one for one in _chunk(rng, file).records if one.opcode == MESSAGE]
    if some:
        one = pick(rng, some)
        one.body = one.body[: MESSAGE_HEAD.size] + damaged(rng, one.body[MESSAGE_HEAD.size :])


def _message_fields(rng: Rng, file: File) -> None:
    """Give fields of one message, or of many in a chunk, values that no run has."""
    numbers = {number: topic for topic, number in _channels(file).items()}
    kinds = {channels.TICK: "Tick", channels.OPTIMUM: "Optimum", channels.TIMING: "Timing"}
    some = []
    for one in _chunk(rng, file).records:
        if one.opcode == MESSAGE and len(one.body) >= MESSAGE_HEAD.size:
            kind = kinds.get(numbers.get(MESSAGE_HEAD.unpack_from(one.body)[0], ""))
            some += [(one, kind)] if kind else []
    if not some:
        return
    chosen = some if rng.random() < 0.3 else [pick(rng, some)]
    field, value = int(rng.integers(100)), pick(rng, NUMBERS)
    for one, kind in chosen:
        one.body = one.body[: MESSAGE_HEAD.size] + _changed_field(
            rng, kind, one.body[MESSAGE_HEAD.size :], field, value
        )


def _changed_field(rng: Rng, kind: str, data: bytes, field: int, value: float) -> bytes:
    try:
        message = CLASSES[kind].FromString(data)
    except DecodeError:
        return data
    described = message.DESCRIPTOR.fields[field % len(message.DESCRIPTOR.fields)]
    old = getattr(message, described.name)
    if described.type == described.TYPE_STRING:
        setattr(message, described.name, pick(rng, (*TEXTS, "infeasible", "x" * 10**5)))
    elif not hasattr(old, "append"):
        setattr(message, described.name, _fitting(value, type(old)))
    elif old:
        where = int(rng.integers(len(old)))
        match rng.integers(4):
            case 0:
                del old[where:]
            case 1:
                old.extend([_fitting(value, type(old[0]))] * int(10 ** rng.uniform(0, 4)))
            case 2:
                old[where] = _fitting(value, type(old[0]))
            case _:
                old[:] = [_fitting(value, type(old[0]))] * len(old)
    return message.SerializeToString()


def _fitting(value: float, kind: type) -> float | int | bool:
    """Return the number as a field of that type holds it."""
    if kind is float:
        return float(value) if abs(value) < 2**1023 else math.copysign(1e308, value)
    if kind is bool:
        return bool(value)
    return max(min(int(value), 2**63 - 1), -(2**63)) if math.isfinite(value) else -(2**63)


Forge = Callable[[Rng, File], None]
COMMON: tuple[Forge, ...] = (_run_metadata, _shuffled_records, _strange_record, _strange_chunk, _attachment)
MESSAGES: tuple[Forge, ...] = (_declaration, _message_head, _message_bytes, _message_fields, _message_fields)
FORGE: tuple[Forge, ...] = (*(COMMON + MESSAGES) * 6, _bomb, _million_ticks)
