"""What robots of the certified layer send, byte by byte: floods, verdicts, the optimizer's message."""

from __future__ import annotations

import struct
from collections.abc import Sequence

import numpy as np

from pbrg_mj.governor.certified.flood import COUNT, ItemSize
from pbrg_mj.governor.problem.rows import Rows

STATE = struct.Struct("<7d?")  # p, xi, held m, heading, whether rows are asked for
CANDIDATE = struct.Struct("<2d")  # the first leader's candidate
ROW = struct.Struct("<4d")  # a, C, d
OF_STATE, OF_CANDIDATE, OF_ROWS = 0, 1, 2
SIZES = {OF_STATE: ItemSize(STATE.size), OF_CANDIDATE: ItemSize(CANDIDATE.size), OF_ROWS: ItemSize(0, ROW.size)}
PARTS = struct.Struct("<IB")  # lengths of a message's floods and verdict; the optimizer's message follows


def packed_parts(floods: bytes, verdict: bytes, iteration: bytes) -> bytes:
    """Return a message of floods, a verdict and the optimizer's message, any of which may be empty."""
    return PARTS.pack(len(floods), len(verdict)) + floods + verdict + iteration


def unpacked_parts(content: bytes) -> tuple[bytes, bytes, bytes]:
    """Return the floods, the verdict and the optimizer's message that a message holds."""
    floods, verdict = PARTS.unpack_from(content)
    after = PARTS.size + floods
    return content[PARTS.size : after], content[after : after + verdict], content[after + verdict :]


def packed_rows(rows: Rows) -> bytes:
    """Return a robot's rows as they are flooded."""
    active = rows.active
    entries = zip(rows.a[active].tolist(), rows.C[active].tolist(), rows.d[active].tolist(), strict=True)
    packed = [ROW.pack(a, *C, d) for a, C, d in entries]
    return COUNT.pack(len(packed)) + b"".join(packed)


def unpacked_rows(floods: Sequence[bytes]) -> Rows:
    """Return the rows of all robots, (1, R)."""
    data = np.array([row for flood in floods for row in ROW.iter_unpack(flood[COUNT.size :])]).reshape(1, -1, 4)
    return Rows(data[:, :, 0], data[:, :, 1:3], data[:, :, 3], np.ones(data.shape[:2], dtype=bool))
