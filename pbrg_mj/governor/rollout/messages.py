"""What robots send, byte by byte. Every message begins with the number of its exchange since the start, modulo 2^16."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from pbrg_mj.perception.half_spaces import HalfSpaces

HEADER = struct.Struct("<H")  # number of the exchange
NUMBERS = 1 << 16  # no message is so late that it could be taken for a later one
SUMMARY = struct.Struct("<7d")  # least and largest p, largest ||xi||, held m
HALF_SPACE = struct.Struct("<HB3d")  # owner, slot, G, h: of half-spaces that bind every robot
STATE = struct.Struct("<4d")  # (p, xi), or a change of them
VERDICT = struct.Struct("<HB2d")  # owner, slot, lowest and highest advance
NORMAL = struct.Struct("<2d")  # G, follows where the half-space binds its owner alone, so that no other robot knows it

Key = tuple[int, int]  # owner, slot


class HalfSpace(NamedTuple):
    """A half-space that a robot knows."""

    binds_all: bool  # binds every robot, not its owner alone
    Gx: float
    Gy: float
    h: float  # [m]


class Verdict(NamedTuple):
    """How far m may move along a half-space's normal, from where it is held."""

    Gx: float
    Gy: float
    low: float  # [m]
    high: float  # [m]


def own_half_spaces(half_spaces: HalfSpaces, row: int, robot: int) -> dict[Key, HalfSpace]:
    """Return a robot's half-spaces from a row of `half_spaces`; one that binds another robot binds every robot."""
    found = {}
    for slot in np.flatnonzero(half_spaces.active[row]).tolist():
        binds = half_spaces.binds[row, slot]
        others = np.delete(binds, robot).any()
        if others or binds[robot]:
            G = half_spaces.G[row, slot]
            found[robot, slot] = HalfSpace(bool(others), float(G[0]), float(G[1]), float(half_spaces.h[row, slot]))
    return found


def pack_rollout(v: np.ndarray, half_spaces: Mapping[Key, HalfSpace], keys: Iterable[Key]) -> bytes:
    """Return the content of a message of the rollout: v (4,), and the half-spaces `keys` on their way to all robots."""
    items = (HALF_SPACE.pack(*key, half_spaces[key].Gx, half_spaces[key].Gy, half_spaces[key].h) for key in keys)
    return STATE.pack(*v) + b"".join(items)


def unpack_rollout(content: bytes) -> tuple[np.ndarray, dict[Key, HalfSpace]]:
    """Return v (4,) and the half-spaces of a message of the rollout."""
    items = HALF_SPACE.iter_unpack(content[STATE.size :])
    half_spaces = {(owner, slot): HalfSpace(True, Gx, Gy, h) for owner, slot, Gx, Gy, h in items}
    return np.array(STATE.unpack_from(content)), half_spaces


def pack_verdicts(verdicts: Mapping[Key, Verdict], half_spaces: Mapping[Key, HalfSpace], keys: Iterable[Key]) -> bytes:
    """Return the content of a message of verdicts; of `half_spaces`, those that bind all robots are known to all."""
    content = b""
    for key in keys:
        one = verdicts[key]
        content += VERDICT.pack(*key, one.low, one.high)
        if not _known_to_all(half_spaces, key):
            content += NORMAL.pack(one.Gx, one.Gy)
    return content


def unpack_verdicts(content: bytes, half_spaces: Mapping[Key, HalfSpace]) -> dict[Key, Verdict]:
    """Return the verdicts of a message; of `half_spaces`, those that bind all robots are the sender's too."""
    verdicts, at = {}, 0
    while at < len(content):
        owner, slot, low, high = VERDICT.unpack_from(content, at)
        key, at = (owner, slot), at + VERDICT.size
        if _known_to_all(half_spaces, key):
            Gx, Gy = half_spaces[key].Gx, half_spaces[key].Gy
        else:
            Gx, Gy = NORMAL.unpack_from(content, at)
            at += NORMAL.size
        verdicts[key] = Verdict(Gx, Gy, low, high)
    return verdicts


def _known_to_all(half_spaces: Mapping[Key, HalfSpace], key: Key) -> bool:
    return key in half_spaces and half_spaces[key].binds_all
