"""One number for what a log says: the same wherever the same run was made."""

from __future__ import annotations

import hashlib
from pathlib import Path

from mcap.records import Attachment

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.header import open_mcap
from pbrg_mj.log.read.mcap_records import DamageError, read_records
from pbrg_mj.log.schema import channels
from pbrg_mj.log.schema.message import LogMessage


def message_digest(path: Path) -> str:
    """Return the SHA-256 of a log's scenario, model and messages in hexadecimal digits, /timing left out.

    Versions, machine, and how messages are packed into chunks are no part of it. Raises InputError for a file that is
    no log, or that is not whole.
    """
    digest = hashlib.sha256()
    with open_mcap(path) as (file, size):
        try:
            for item in read_records(file, size):
                if isinstance(item, Attachment):
                    name, time, data = item.name, 0, item.data
                elif isinstance(item, LogMessage) and item.topic != channels.TIMING:
                    name, time, data = item.topic, item.log_time, item.data
                else:
                    continue
                digest.update(f"{len(name)} {name} {time} {len(data)}\n".encode() + data)
        except DamageError as error:
            raise InputError(str(error), file=str(path)) from error
    return digest.hexdigest()
