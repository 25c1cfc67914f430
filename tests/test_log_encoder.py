"""The encoder against protobuf's own classes, filled value by value."""

from __future__ import annotations

from dataclasses import replace
from operator import attrgetter

import numpy as np
import pytest

from pbrg_mj.log.schema.fields import MESSAGES
from pbrg_mj.log.schema.protobuf import CLASSES, encoder
from pbrg_mj.loop.record import TickRecord
from tests.records import records

DIMS = {"n": 3, "K": 2, "R": 6}


def by_the_runtime(name: str, record: TickRecord) -> bytes:
    held = {field.name: attrgetter(field.source)(record) for field in MESSAGES[name]}
    flat = {field.name: np.ravel(held[field.name]).tolist() for field in MESSAGES[name] if field.shape}
    return CLASSES[name](**{**held, **flat}).SerializeToString(deterministic=True)


def through_the_runtime(name: str, data: bytes) -> bytes:
    """The same message as the runtime writes it: it leaves scalars out that are 0."""
    return CLASSES[name].FromString(data).SerializeToString(deterministic=True)


@pytest.mark.parametrize("name", MESSAGES)
def test_messages_are_those_of_the_runtime(name: str) -> None:
    encode = encoder(name, DIMS)
    told = [record for record in records(100) if name != "Optimum" or record.optimum is not None]
    encoded = [encode(record) for record in told]
    assert [through_the_runtime(name, data) for data in encoded] == [by_the_runtime(name, record) for record in told]
    assert len(set(encoded)) == len(told)


def test_without_zeros_and_texts_the_bytes_are_those_of_the_runtime() -> None:
    encode = encoder("Timing", DIMS)
    for record in records(20)[1:]:  # index 0 is left out by the runtime
        assert encode(record) == by_the_runtime("Timing", record)


def test_a_message_does_not_depend_on_those_before() -> None:
    told = records(30)
    encode = encoder("Tick", DIMS)
    forward = [encode(record) for record in told]
    assert [encode(record) for record in reversed(told)] == forward[::-1]


def test_arrays_in_another_order_mean_the_same() -> None:
    record = records(1)[0]
    turned = np.asfortranarray(record.solution.multipliers)
    given = record._replace(solution=replace(record.solution, multipliers=turned))
    assert encoder("Tick", DIMS)(given) == encoder("Tick", DIMS)(record)


@pytest.mark.parametrize("shape", [(2, 6), (17,), (3, 5), (4, 6, 1)])
def test_the_field_of_another_shape_is_named(shape: tuple[int, ...]) -> None:
    record = records(1)[0]
    wrong = record._replace(solution=replace(record.solution, multipliers=np.zeros(shape)))
    with pytest.raises(ValueError, match=r"^multipliers: shape \(.*\), not \(3, 6\)$"):
        encoder("Tick", DIMS)(wrong)
