"""MuJoCo's warnings, such as that of an unstable simulation, as Python log messages.

Left alone, MuJoCo prints them and writes a MUJOCO_LOG.TXT wherever the program was started.
"""

# MuJoCo ships no type stubs for its compiled modules.
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

import logging

import mujoco

_LOG = logging.getLogger(__name__)


def log_first_warning() -> None:
    """Log MuJoCo's next warning in this process and none after it: the others follow from the first."""
    logged = False

    def log_once(warning: str) -> None:
        nonlocal logged
        if not logged:
            logged = True
            _LOG.warning("MuJoCo: %s", " ".join(warning.split()))

    mujoco.set_mju_user_warning(log_once)
