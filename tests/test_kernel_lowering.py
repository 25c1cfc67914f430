"""What kernels are compiled to is what Python does: elements of arrays, tuples that are borrowed, references."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba.core.runtime import _nrt_python, rtsys

from pbrg_mj.kernel import kernel
from pbrg_mj.kernel.compiler import IS_TESTED

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT) or not IS_TESTED, reason="numba compiles as it does")


class Pair(NamedTuple):
    """Arrays with names."""

    first: np.ndarray
    second: np.ndarray


RECORD = np.dtype([("x", np.float64), ("n", np.int64)])


@kernel
def sums(array, places):
    total = 0.0
    for i in range(len(places)):
        total += array[places[i], -1] - array[-2, places[i]]
        total *= array[0, 1]
    return total


ARRAY = np.random.default_rng(1).normal(size=(7, 9))


@pytest.mark.parametrize(
    "array",
    [ARRAY, np.asfortranarray(ARRAY), ARRAY[::2, ::-1], ARRAY.T, ARRAY.astype(np.float32), ARRAY > 0.0],
    ids=["C", "F", "strided", "transposed", "single", "bool"],
)
@pytest.mark.parametrize("kind", [np.int64, np.int32, np.uint8])
def test_elements_are_those_that_numpy_takes(array, kind):
    """Variables count from the start; constants may count from the end, too."""
    places = np.arange(min(array.shape)).astype(kind)
    plain = array.astype(float)
    assert sums(array, places) == pytest.approx(sums.py_func(plain, places), rel=1e-6)


@kernel
def fill(array, steps):
    for i in range(len(array)):
        for c in range(array.shape[1]):
            array[i, c] = i - c
            array[i, c] += steps[0] * array[i, -1]
        array[i, 0], array[-1, 1] = array[-1, 1], array[i, 0]
    array[0, 0] = 3
    array[1, -1] = True


def test_elements_are_stored_where_numpy_stores_them():
    for array in (np.zeros((4, 5)), np.zeros((4, 10))[:, ::2], np.zeros((5, 4)).T, np.zeros((4, 5), np.int32)):
        want = np.array(array)
        fill(array, (2,))
        fill.py_func(want, (2,))
        np.testing.assert_array_equal(array, want)


@kernel
def choose(array, i, j):
    place = (i, j) if array[i, j] > array[j, i] else (j, i)  # an index of two assignments
    kept = (i, j)  # an index that is returned as well
    return array[place], array[kept], kept


def test_an_index_may_be_used_otherwise():
    assert choose(ARRAY, 1, 3) == (max(ARRAY[1, 3], ARRAY[3, 1]), ARRAY[1, 3], (1, 3))


@kernel
def count_records(records):
    for i in range(len(records)):
        records[i]["n"] += 1
        if records[i]["x"] > records[-1]["x"]:
            records[i] = records[0]
    return records[1]["n"]


def test_records_are_changed_in_place():
    records = np.zeros(4, RECORD)
    records["x"], records["n"] = [0.5, 2.0, 0.1, 1.0], range(4)
    want = records.copy()
    assert count_records(records) == count_records.py_func(want)
    np.testing.assert_array_equal(records, want)


@kernel
def swapped(pair, flag):
    first, second = pair
    if flag:
        pair = Pair(second, first)  # an argument that is assigned again
    both = pair
    return both.first, pair[1], (first, flag)


@kernel
def of_swapped(pair, flag):
    first, second, (third, said) = swapped(pair, flag)
    return first[0] + 10.0 * second[0] + 100.0 * third[0], said


def test_parts_of_arguments_go_through_calls():
    pair = Pair(np.array([1.0]), np.array([2.0]))
    assert of_swapped(pair, True) == (112.0, True)
    assert of_swapped(pair, False) == (121.0, False)
    first, second, _ = swapped(pair, True)
    assert first is not pair.first
    assert (first[0], second[0]) == (2.0, 1.0)


@kernel
def made(n):
    pair = Pair(np.ones(n), np.zeros(n))
    for _ in range(3):
        other = (pair.second, pair.first)
        pair = Pair(other[0], other[1] + 1.0)
        row = pair.first[1:]
        row[0] = 5.0
    return pair


@kernel
def use_made(n):
    pair = made(n)
    view = pair.second[: n - 1]
    return tails(pair, view), pair


@kernel
def tails(pair, view):
    kept = pair.first[1:]  # made from what is borrowed, and counted
    return kept[0] + view[0] + pair[0][0]


def test_every_reference_is_given_back():
    rtsys.initialize(use_made.targetctx)
    _nrt_python.memsys_enable_stats()
    want = use_made.py_func(5)
    use_made(5)
    before = rtsys.get_allocation_stats()
    for _ in range(10):
        number, pair = use_made(5)
        assert number == want[0]
        np.testing.assert_array_equal(pair.first, want[1].first)
        np.testing.assert_array_equal(pair.second, want[1].second)
    del pair
    after = rtsys.get_allocation_stats()
    assert after.alloc > before.alloc
    assert after.alloc - before.alloc == after.free - before.free


def test_numba_itself_is_left_as_it_was():
    @kernel
    def ours(n):
        return np.full(n, 2.0).sum() + min(n, 3)

    @numba.njit
    def theirs(n):
        return np.full(n, 2.0).sum() + min(n, 3)

    assert ours(4) == theirs(4) == 11.0
    assert ours(4) == 11.0
