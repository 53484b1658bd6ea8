"""One page holds control: taking it over is one step that all see, a page that is gone has left it."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mavlink_bridge.console.control import AWAY_S, ControlDesk

ONE, TWO = "a" * 12, "b" * 12


def test_the_first_that_wants_to_change_something_gets_it_and_others_do_not():
    desk = ControlDesk()
    assert (desk.connect(ONE), desk.connect(TWO)) == ("page 1", "page 2")
    assert desk.view(0.0).holder is None  # looking alone takes nothing
    assert desk.may_write(TWO, 1.0)
    assert not desk.may_write(ONE, 2.0)
    assert desk.view(2.0).holder == "page 2"
    assert desk.view(2.0).pages == ("page 1", "page 2")
    assert desk.view(2.0).since_s == 1.0


def test_taking_over_is_one_step_and_giving_back_frees_it():
    desk = ControlDesk()
    desk.connect(ONE), desk.connect(TWO)
    desk.take(ONE, 0.0)
    desk.take(TWO, 5.0)
    assert not desk.may_write(ONE, 5.0)
    desk.give(ONE)  # not its to give
    assert desk.view(5.0).holder == "page 2"
    desk.give(TWO)
    assert desk.view(5.0).holder is None
    assert desk.may_write(ONE, 6.0)


def test_a_reload_keeps_control_and_a_page_that_is_gone_loses_it():
    desk = ControlDesk()
    desk.connect(ONE), desk.connect(TWO)
    desk.take(ONE, 0.0)
    desk.disconnect(ONE, 10.0)
    assert desk.view(12.0).is_away
    assert not desk.may_write(TWO, 12.0)
    assert desk.connect(ONE) == "page 1"  # the same tab, loaded again
    assert desk.may_write(ONE, 14.0)
    assert not desk.view(14.0).is_away
    desk.disconnect(ONE, 20.0)
    assert desk.may_write(TWO, 20.0 + AWAY_S + 0.1)


def test_a_page_that_still_asks_keeps_control_and_name_without_a_connection():
    desk = ControlDesk()
    desk.connect(ONE), desk.connect(TWO)
    desk.take(ONE, 0.0)
    desk.disconnect(ONE, 1.0)
    for now_s in (9.0, 18.0, 27.0):  # it plans, and looks for backups
        desk.note_seen(ONE, now_s)
    desk.connect("c" * 12), desk.disconnect("c" * 12, 30.0)  # who has gone is forgotten
    assert not desk.may_write(TWO, 30.0)
    assert desk.connect(ONE) == "page 1"
    assert desk.view(30.0).holder == "page 1"


def test_a_page_that_was_never_heard_of_is_not_kept_for_asking():
    desk = ControlDesk()
    desk.note_seen(ONE, 0.0)
    assert desk.connect(TWO) == "page 1"
    for number in range(100):
        desk.may_write(f"stranger-{number}", 20.0 * number)
    assert len(desk._pages) <= 3


def test_a_page_twice_connected_is_there_until_both_are_gone():
    desk = ControlDesk()
    desk.connect(ONE), desk.connect(ONE)
    desk.take(ONE, 0.0)
    desk.disconnect(ONE, 1.0)
    assert not desk.view(100.0).is_away
    assert desk.view(100.0).holder == "page 1"


@given(st.lists(st.tuples(st.sampled_from("cdtgw"), st.sampled_from((ONE, TWO, "c" * 12))), max_size=40))
def test_whatever_pages_do_at_most_one_may_write(deeds):
    desk, now_s = ControlDesk(), 0.0
    connected = dict.fromkeys((ONE, TWO, "c" * 12), 0)
    for deed, page in deeds:
        now_s += 3.0
        if deed == "c":
            desk.connect(page)
            connected[page] += 1
        elif deed == "d" and connected[page]:
            desk.disconnect(page, now_s)
            connected[page] -= 1
        elif deed == "t":
            desk.take(page, now_s)
        elif deed == "g":
            desk.give(page)
        elif deed == "w" and desk.may_write(page, now_s):
            others = [one for one in connected if one != page]
            assert not any(desk.may_write(one, now_s) for one in others)
