"""Processes that make the runs of a study."""

from __future__ import annotations

import warnings
from typing import Any

import pytest

from pbrg_mj.studies.backends import in_processes


def square(number: int, **_: Any) -> int:
    """Square a number in a process that then seems to have grown too large."""
    from joblib.externals.loky import process_executor

    process_executor._MAX_MEMORY_LEAK_SIZE, process_executor._MEMORY_LEAK_CHECK_DELAY = -1, 0.0
    return number * number


def test_processes_that_have_grown_too_large_make_room_for_others_without_a_warning():
    """Their results are there."""
    pytest.importorskip("psutil")  # without it no process is told to be too large
    numbers = range(12)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")  # as an error it would end the thread of loky that tells it
        found = sorted(in_processes(square, [(number,) for number in numbers], 2))
    assert found == [number**2 for number in numbers]
    assert [str(one.message) for one in told] == []
