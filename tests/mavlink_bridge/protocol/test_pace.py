"""How long a transfer may take."""

from __future__ import annotations

import pytest

from mavlink_bridge.protocol.pace import Pace, bound_s


@pytest.mark.parametrize(("items", "longest_s"), [(0, 60.0), (20, 80.0), (540, 600.0), (65535, 600.0)])
def test_a_minute_and_a_second_an_item_at_most_ten_minutes(items, longest_s):
    assert bound_s(items) == longest_s


@pytest.mark.parametrize(
    ("every_s", "ends_s"), [(None, 60.0), (2.0, 120.0), (1.25, 300.0), (1.0, 600.0), (0.5, 600.0)]
)
def test_the_slower_the_items_the_sooner_it_is_over(every_s, ends_s):
    pace = Pace()
    pace.start(100.0)
    done, now_s = 0, 100.0
    while not pace.is_over(now_s):
        now_s += 0.25
        if every_s is not None and (now_s - 100.0) % every_s == 0:
            done += 1
            pace.advance(done, now_s)
    assert now_s - 100.0 == pytest.approx(ends_s, abs=5.0)


def test_what_is_done_again_gives_no_time():
    pace = Pace()
    pace.start(0.0)
    pace.advance(10, 10.0)
    assert pace.deadline_s == 70.0
    pace.advance(3, 20.0)
    pace.advance(10, 30.0)
    assert pace.deadline_s == 70.0
    pace.advance(11, 30.0)
    assert pace.deadline_s == 71.0


def test_a_burst_gives_no_more_than_there_was_at_first():
    pace = Pace()
    pace.start(0.0)
    pace.advance(500, 5.0)
    assert pace.deadline_s == 65.0


def test_a_shorter_time_counts_too():
    pace = Pace(most_s=30.0)
    pace.start(0.0)
    pace.advance(100, 20.0)
    assert pace.deadline_s == 30.0
    assert pace.is_over(30.0)


@pytest.mark.parametrize(
    ("done", "count", "is_hopeless"),
    [
        (10, 300, True),
        (10, 40, False),
        (40, 655, False),
        (11, 655, True),
        (2000, 65535, True),
        (3000, 65535, False),
    ],
)
def test_a_list_that_cannot_come_in_time_is_known_early(done, count, is_hopeless):
    pace = Pace()
    pace.start(0.0)
    pace.advance(done, 20.0)
    assert not pace.is_hopeless(done, count, 0.0, 19.9)
    assert pace.is_hopeless(done, count, 0.0, 20.0) is is_hopeless
