"""Who is answered on an open port: who speaks MAVLink, lately, and not too many."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mavlink_bridge.mavlink.callers import FORGOTTEN_AFTER_S, MOST_CALLERS, Callers

VEHICLE = ("10.0.0.1", 14555)


def stranger(number: int) -> tuple[str, int]:
    return ("10.0.0.2", number)


def test_who_spoke_is_answered_until_silent():
    callers = Callers()
    assert callers.answered(0.0) == []
    callers.heard(VEHICLE, 0.0)
    callers.heard(stranger(1), 5.0)
    assert callers.answered(FORGOTTEN_AFTER_S) == [VEHICLE, stranger(1)]
    assert callers.answered(FORGOTTEN_AFTER_S + 0.1) == [stranger(1)]
    callers.heard(VEHICLE, 20.0)
    assert callers.answered(20.0) == [VEHICLE]


def test_the_last_one_to_speak_is_called_on_and_on():
    callers = Callers()
    callers.heard(stranger(1), 0.0)
    callers.heard(VEHICLE, 1.0)
    assert callers.answered(1e6) == [VEHICLE]


def test_a_flood_of_addresses_does_not_drive_out_who_speaks_regularly():
    callers = Callers()
    for second in range(4):
        callers.heard(VEHICLE, float(second))
    for number in range(15_000):
        callers.heard(stranger(number), 3.0 + number * 1e-4)
    assert VEHICLE in callers.answered(4.5)
    assert len(callers.answered(4.5)) == MOST_CALLERS


def test_a_vehicle_that_comes_after_a_flood_finds_room_at_once():
    callers = Callers()
    for number in range(15_000):
        callers.heard(stranger(number), number * 1e-4)
    callers.heard(VEHICLE, 1.6)
    assert VEHICLE in callers.answered(1.6)


def test_where_all_speak_regularly_a_new_one_waits_until_one_is_silent():
    callers = Callers()
    for second in range(4):
        for number in range(MOST_CALLERS):
            callers.heard(stranger(number), float(second))
    callers.heard(VEHICLE, 3.5)
    assert VEHICLE not in callers.answered(3.5)
    callers.heard(VEHICLE, 3.5 + FORGOTTEN_AFTER_S)
    assert VEHICLE in callers.answered(3.5 + FORGOTTEN_AFTER_S)


@given(st.lists(st.tuples(st.integers(0, 100), st.floats(0, 3)), max_size=300))
def test_they_are_never_too_many_and_the_newest_that_was_taken_is_among_them(heard):
    callers, now_s = Callers(), 0.0
    for number, after_s in heard:
        now_s += after_s
        callers.heard(stranger(number), now_s)
        answered = callers.answered(now_s)
        assert 1 <= len(answered) <= MOST_CALLERS
        assert len(set(answered)) == len(answered)
