"""The columns of a long log lie in a temporary file: all that reads them gives the same, in less memory."""

from __future__ import annotations

import pickle
import tracemalloc
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

import pbrg_mj as pbrg
from pbrg_mj.analysis.export import MAT_HEADER_LENGTH, RunArrays
from pbrg_mj.analysis.metrics import per_tick
from pbrg_mj.analysis.metrics.run_metrics import metrics
from pbrg_mj.log.read import column_store
from pbrg_mj.log.read.column_store import ColumnStore
from pbrg_mj.log.read.columns import BLOCK_MESSAGES
from pbrg_mj.log.read.run import Run, open_run
from tests.test_log_bounds import agree, written

FEW, MANY = BLOCK_MESSAGES + 20, 3 * BLOCK_MESSAGES + 20  # ticks; as many wait for the end of a block
PER_TICK = 500  # bytes; a tick of these logs has 1.0 kB of values


@pytest.fixture
def little_memory(monkeypatch) -> None:
    """What is done some megabytes at a time is done some kilobytes at a time."""
    monkeypatch.setattr(column_store, "MOST_HELD", 2**14)
    monkeypatch.setattr(per_tick, "BLOCK_BYTES", 100_000)


@pytest.fixture(scope="module")
def logs(tmp_path_factory) -> tuple[Path, Path]:
    """A log and one that is longer."""
    folder = tmp_path_factory.mktemp("logs")
    return written(folder / "few.mcap", FEW), written(folder / "many.mcap", MANY)


@pytest.fixture
def both(logs: tuple[Path, Path], request) -> tuple[Run, Run]:
    """A run whose columns are in memory, and the same one from a file."""
    held = open_run(logs[1])
    request.getfixturevalue("little_memory")
    return held, open_run(logs[1])


def test_columns_are_the_same_bit_for_bit(both: tuple[Run, Run]) -> None:
    held, stored = both
    for name in ("ticks", "optima", "timings"):
        ours, theirs = getattr(stored, name), getattr(held, name)
        for field in fields(ours):
            one, other = getattr(ours, field.name), getattr(theirs, field.name)
            assert (one.dtype, one.shape, one.tobytes()) == (other.dtype, other.shape, other.tobytes()), field.name
            assert getattr(ours, field.name) is one  # held from the first time on
            some = getattr(ours.rows(7, BLOCK_MESSAGES + 9), field.name)
            assert some.tobytes() == other[7 : BLOCK_MESSAGES + 9].tobytes()
        with pytest.raises(AttributeError, match="no attribute 'index_of'"):
            _ = ours.index_of


def test_metrics_are_the_same(both: tuple[Run, Run]) -> None:
    held, stored = both
    agree(metrics(stored).as_dict(), metrics(held).as_dict())
    assert set(vars(stored.ticks)) <= {"_store", "index", "time"}  # no other column is left behind


def test_a_copy_in_another_process_holds_its_columns(both: tuple[Run, Run]) -> None:
    held, stored = both
    copy = pickle.loads(pickle.dumps(stored))
    assert copy.ticks.multipliers.tobytes() == held.ticks.multipliers.tobytes()
    assert copy.part(3, 9).ticks.m.shape == (6, 3, 2)


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".csv"])
def test_files_are_those_that_whole_arrays_make(
    both: tuple[Run, Run], tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    held, stored = both
    monkeypatch.setattr("pbrg_mj.analysis.export.MAT_BLOCK", 0)  # all arrays are written in columns
    path = pbrg.Run(stored).export(tmp_path / f"stored{suffix}")
    other, arrays = tmp_path / f"other{suffix}", dict(RunArrays(held))
    if suffix == ".npz":
        np.savez_compressed(other, allow_pickle=False, **arrays)
        assert path.read_bytes() == other.read_bytes()
    elif suffix == ".mat":
        savemat(other, arrays, do_compression=True, oned_as="column")
        assert path.read_bytes()[MAT_HEADER_LENGTH:] == other.read_bytes()[MAT_HEADER_LENGTH:]
    else:
        assert path.read_bytes() == pbrg.Run(held).export(other).read_bytes()


def metrics_and_an_array(run: pbrg.Run, _: Path) -> None:
    assert run.metrics.ticks == len(run.q_true_m)


def export_npz(run: pbrg.Run, folder: Path) -> None:
    run.export(folder / "run.npz")


def export_mat(run: pbrg.Run, folder: Path) -> None:
    run.export(folder / "run.mat")


def export_csv(run: pbrg.Run, folder: Path) -> None:
    run.export(folder / "run.csv")


@pytest.mark.parametrize("use", [metrics_and_an_array, export_npz, export_mat, export_csv])
@pytest.mark.usefixtures("little_memory")
def test_a_log_takes_memory_for_what_is_looked_at(
    logs: tuple[Path, Path], tmp_path: Path, use: Callable[[pbrg.Run, Path], object]
) -> None:
    use(pbrg.open(logs[0]), tmp_path)  # what is made once
    peaks = []
    for path in logs:
        tracemalloc.start()
        use(pbrg.open(path), tmp_path)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert (peaks[1] - peaks[0]) / (MANY - FEW) < PER_TICK


def test_a_store_reads_what_was_put_into_it(monkeypatch) -> None:
    rng = np.random.default_rng(5)
    monkeypatch.setattr(column_store, "MOST_HELD", 300)
    store, blocks = ColumnStore(), []
    for count, word in ((3, "ok"), (1, "infeasible"), (0, ""), (7, "capped"), (2, "")):
        block = {"q": rng.normal(size=(count, 2, 3)), "none": np.zeros((count, 0)), "word": np.full(count, word)}
        store.append(block)
        blocks.append(block)
    assert (store.rows, list(store), "q" in store, "p" in store) == (13, ["q", "none", "word"], True, False)
    whole = {name: np.concatenate([one[name] for one in blocks]) for name in store}
    for name, values in whole.items():
        for first, last in ((0, 13), (2, 5), (4, 4), (12, 99), (0, 1)):
            found = store.read(name, first, last)
            assert (found.dtype, found.shape) == (values.dtype, values[first:last].shape)
            np.testing.assert_array_equal(found, values[first:last])
    store["q"][:] = 0.0
    np.testing.assert_array_equal(store["q"], whole["q"])  # every array is its reader's own
