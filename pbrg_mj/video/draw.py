"""The drawing process: a job on stdin, raw pictures on stdout, one line on stderr if the input is wrong."""

from __future__ import annotations

import os
import pickle
import sys
from typing import TYPE_CHECKING, BinaryIO

from pbrg_mj.errors import InputError

if TYPE_CHECKING:
    from pbrg_mj.video.job import Job

WRONG_INPUT = 2


def draw_all(job: Job, out: BinaryIO) -> None:
    """Draw the job's frames, one after the other, rows from the bottom up, RGB."""
    from pbrg_mj.video.stage import Stage

    with Stage(job) as stage:
        for time in job.times.tolist():
            out.write(stage.draw(time).data)
        out.flush()


def main() -> int:
    """Do the one job; started by `pbrg_mj.video.frames` with MUJOCO_GL set."""
    # Nothing that a library prints may come between the pictures.
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)
    job = pickle.load(sys.stdin.buffer)
    try:
        draw_all(job, out)
    except InputError as error:
        print(error, file=sys.stderr)
        return WRONG_INPUT
    except BrokenPipeError:
        pass  # whoever wanted pictures has gone away
    return 0


if __name__ == "__main__":
    sys.exit(main())
