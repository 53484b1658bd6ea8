"""A little of the soak (see `soak`), in every run of the tests."""

from __future__ import annotations

import pytest
from director.soak import soak

from mavlink_bridge.director.orders import Homing, ObstacleSource


@pytest.mark.parametrize("seed", [0])  # `make soak` of CI goes on for minutes
def test_a_few_minutes_keep_every_promise(seed):
    run = soak(seed, hours=0.08)
    assert run.violations == []
    assert run.counts["target"] > 1


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(1, 5))]
)
def test_everything_at_once_keeps_every_promise(seed):
    """Something new about every second: in the middle of every step of the bridge's own."""
    run = soak(seed, hours=0.05, pace_s=(0.05, 2.5))
    assert run.violations == []
    assert run.counts["target"] > 10


@pytest.mark.parametrize("orders", [{"arm": False}, {"drive": False}, {"upload": False, "drive": False}])
def test_nothing_is_done_beyond_the_orders(orders):
    run = soak(7, hours=0.04, pace_s=(0.05, 2.5), **orders)
    assert run.violations == []
    assert run.counts["target"] > 10


def test_coming_home_breaks_no_promise():
    homing = Homing(is_kept=True, by_route=True, gcs_timeout_s=20.0)
    run = soak(3, hours=0.08, pace_s=(0.3, 6.0), homing=homing)
    assert run.violations == []
    assert run.counts["called_home"] > 0


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(1, 5))]
)
def test_coming_home_among_obstacles_breaks_no_promise(seed):
    homing = Homing(is_kept=True, by_route=True, gcs_timeout_s=20.0, battery_percent=20)
    run = soak(seed, hours=0.06, pace_s=(0.3, 6.0), homing=homing, obstacle_sources=frozenset(ObstacleSource))
    assert run.violations == []
    assert run.counts["called_home"] + run.counts["obstacle_across"] + run.counts["waiting"] > 0
