"""MuJoCo's warnings, such as that of an unstable simulation, as log messages of Python's.

Left alone, MuJoCo prints them and writes a MUJOCO_LOG.TXT wherever the program was started.
"""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import logging

import mujoco

_LOG = logging.getLogger(__name__)


def listen() -> None:
    """Tell the next warning of MuJoCo's in this process, and none after it: the others follow from the first."""
    told = False

    def tell(warning: str) -> None:
        nonlocal told
        if not told:
            told = True
            _LOG.warning("MuJoCo: %s", " ".join(warning.split()))

    mujoco.set_mju_user_warning(tell)
