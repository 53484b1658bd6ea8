"""A little of the soak (see `soak`), in every run of the tests; its command goes on with other seeds, for hours."""

from __future__ import annotations

import pytest
from director.soak import SETTINGS, soak


def test_a_few_minutes_keep_every_promise():
    run = soak(0, hours=0.08)  # `make soak` of CI goes on for minutes
    assert run.violations == []
    assert run.counts["target"] > 1


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.campaign)])
def test_everything_at_once_keeps_every_promise(seed):
    """Something new about every second: in the middle of every step of the bridge's own."""
    run = soak(seed, hours=0.05, **SETTINGS["dense"])
    assert run.violations == []
    assert run.counts["target"] > 10


@pytest.mark.parametrize("orders", [{"arm": False}, {"drive": False}, {"upload": False, "drive": False}])
def test_nothing_is_done_beyond_the_orders(orders):
    run = soak(7, hours=0.04, **SETTINGS["dense"], **orders)
    assert run.violations == []
    assert run.counts["target"] > 10


def test_coming_home_breaks_no_promise():
    run = soak(3, hours=0.08, **SETTINGS["home"])
    assert run.violations == []
    assert run.counts["called_home"] > 0


@pytest.mark.parametrize("seed", [0, pytest.param(3, marks=pytest.mark.campaign)])
def test_coming_home_among_obstacles_breaks_no_promise(seed):
    run = soak(seed, hours=0.06, **SETTINGS["obstacles"])
    assert run.violations == []
    assert run.counts["called_home"] + run.counts["obstacle_across"] + run.counts["waiting"] > 0
