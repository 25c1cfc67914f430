"""A log as it was written before: zstd chunks, ticks as sequence numbers, all channels declared at the start."""

from __future__ import annotations

import shutil
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest

from pbrg_mj.errors import InputError
from pbrg_mj.log.read.run import open_run
from pbrg_mj.log.read.scans import read_scans
from pbrg_mj.log.read.ticks import LoggedTicks, open_mcap
from pbrg_mj.log.repair import repair
from pbrg_mj.log.schema.fields import MESSAGES
from tests.records import TICK, loaded, records

EARLIER = Path(__file__).parent / "data" / "log_zstd.mcap"
TICKS = 25  # in chunks of ten


def test_it_opens_bit_for_bit() -> None:
    run, written = open_run(EARLIER), records(TICKS)
    assert (run.damage, len(run.ticks.time)) == (None, TICKS)
    assert run.scenario == loaded(timings=True).scenario
    assert run.absent == {"moving_margin", "moving_contact", "robot_contact"}
    for field in MESSAGES["Tick"]:
        if field.name in run.absent:
            unknown = np.full((TICKS, 3), np.nan if field.kind == "double" else False)
            np.testing.assert_array_equal(getattr(run.ticks, field.name), unknown)
            continue
        truth = np.array([attrgetter(field.source)(record) for record in written])
        read = getattr(run.ticks, field.name)
        assert read.astype(truth.dtype).tobytes() == truth.tobytes(), field.name
    scans = read_scans(EARLIER, 3)
    assert scans[2].ranges.tolist() == [record.readings.ranges[1].tolist() for record in written[::10]]


def test_its_ticks_are_found() -> None:
    with open_mcap(EARLIER) as (file, size):
        times = [{message.log_time for message in tick} for tick in LoggedTicks(file, size, "earlier")]
    assert times == [{round(number * TICK * 1e9)} for number in range(TICKS)]


def test_repaired_it_is_its_own_copy(tmp_path: Path) -> None:
    found = repair(EARLIER, tmp_path / "copy.mcap")
    assert (tmp_path / "copy.mcap").read_bytes() == EARLIER.read_bytes()
    assert (found.ticks, found.chunks) == ([(0, TICKS - 1)], 3)


@pytest.mark.parametrize("length", [0.3, 0.5, 0.9, 0.99])
def test_cut_and_repaired_it_holds_what_it_held(tmp_path: Path, length: float) -> None:
    cut = tmp_path / "cut.mcap"
    shutil.copy(EARLIER, cut)
    with cut.open("r+b") as file:
        file.truncate(int(EARLIER.stat().st_size * length))
    try:
        held = open_run(cut)
    except InputError:
        with pytest.raises(InputError):
            repair(cut, tmp_path / "clean.mcap")
        return
    repair(cut, tmp_path / "clean.mcap")
    run = open_run(tmp_path / "clean.mcap")
    assert (run.damage, len(run.ticks.time)) == (None, len(held.ticks.time))
    assert run.ticks.multipliers.tobytes() == held.ticks.multipliers.tobytes()
