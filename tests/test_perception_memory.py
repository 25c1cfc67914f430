"""Which sighting is which wall."""

import numpy as np
import pytest

from pbrg_mj.perception.frames import WorldLine
from pbrg_mj.perception.memory import RememberedWall, Slots, forget, remember

ORIGIN = np.zeros(2)


def seen(angle_deg: float, offset: float, along: float = 0.0) -> WorldLine:
    angle = np.deg2rad(angle_deg)
    n, t = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    return WorldLine(float(angle), offset, np.eye(2), n, offset * n + along * t, 1.0, offset)


def lines(slots: Slots) -> list[float | None]:
    return [None if wall is None else wall.line.offset for wall in slots]


def test_a_wall_seen_again_keeps_its_slot_and_takes_the_new_line() -> None:
    slots = remember((None,) * 3, [seen(0, 1.0), seen(90, 2.0)], ORIGIN, 0.0)
    again = remember(slots, [seen(92, 1.95), seen(1, 1.05)], ORIGIN, 0.1)
    assert lines(slots) == [1.0, 2.0, None] and lines(again) == [1.05, 1.95, None]
    assert again[0] == RememberedWall(again[0].line, 0.1)  # type: ignore[union-attr]


@pytest.mark.parametrize("other", [seen(0, 1.2), seen(12, 1.0), seen(180, -1.0), seen(0, 0.8)])
def test_another_wall_takes_another_slot(other: WorldLine) -> None:
    slots = remember((None,) * 3, [seen(0, 1.0)], ORIGIN, 0.0)
    assert lines(remember(slots, [other], ORIGIN, 0.1)) == [1.0, other.offset, None]


def test_two_sightings_are_two_walls() -> None:
    slots = remember((None,) * 3, [seen(0, 1.0)], ORIGIN, 0.0)
    assert lines(remember(slots, [seen(0, 1.02), seen(0, 1.1)], ORIGIN, 0.1)) == [1.02, 1.1, None]


def test_a_sighting_goes_to_the_nearest_wall() -> None:
    slots = remember((None,) * 3, [seen(0, 1.0), seen(0, 1.1)], ORIGIN, 0.0)
    assert lines(remember(slots, [seen(0, 1.09)], ORIGIN, 0.1)) == [1.0, 1.09, None]


def test_the_offset_is_compared_where_the_wall_was_seen() -> None:
    # 5 degrees apart, and both through the place 4 m along the wall that is in sight.
    turned = np.deg2rad(5.0)
    there = np.array([1.0, 4.0])
    offset = float(np.array([np.cos(turned), np.sin(turned)]) @ there)
    along = float(np.array([-np.sin(turned), np.cos(turned)]) @ there)
    slots = remember((None,) * 2, [seen(0, 1.0)], ORIGIN, 0.0)
    assert abs(offset - 1.0) > 0.3
    assert lines(remember(slots, [seen(5, offset, along)], ORIGIN, 0.1)) == [offset, None]


def test_full_slots_keep_the_nearest() -> None:
    slots = remember((None,) * 2, [seen(0, 1.0), seen(90, 2.0)], ORIGIN, 0.0)
    assert lines(remember(slots, [seen(200, 3.0)], ORIGIN, 0.1)) == [1.0, 2.0]
    assert lines(remember(slots, [seen(200, 1.5)], ORIGIN, 0.1)) == [1.0, 1.5]
    # Nearness is from where the robot is now: 3 m up, the second wall is the one to keep.
    assert lines(remember(slots, [seen(180, 0.5)], np.array([-3.0, 1.9]), 0.1)) == [0.5, 2.0]


def test_walls_are_forgotten_after_the_memory_only() -> None:
    slots = remember((None,), [seen(0, 1.0)], ORIGIN, 0.1)
    assert lines(forget(slots, 0.1 + 0.3, 0.3)) == [1.0]
    assert lines(forget(slots, 0.41, 0.3)) == [None]
    assert lines(forget(slots, 0.1, 0.0)) == [1.0]
