"""A plan from where the vehicle stands by now: the same mission, or none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from checking.test_holding import at, field, zone

from missions.checking.from_here import from_here
from missions.fence import Fence, ZoneKind
from missions.geo import distance_m
from missions.planning.plan import plan
from missions.request import GoTo
from missions.situation import Known, Pose

POND = zone(ZoneKind.EXCLUSION, -10.0, 20.0, 10.0, 40.0)
REQUEST = GoTo(target=at(0.0, 60.0), clearance_m=2.0)
SITUATION = field(POND, start=(0.0, 0.0), WP_SPEED=2.0)
PLAN = plan(SITUATION, REQUEST)


def standing(east_m: float, north_m: float, heading_deg: float = 0.0):
    return replace(SITUATION, pose=Known(Pose(at(east_m, north_m), heading_deg), None, "test"))


def test_from_where_it_was_planned_it_is_the_same():
    found = from_here(PLAN, SITUATION, REQUEST)
    assert (found.items, found.path, found.seqs) == (PLAN.items, PLAN.path, PLAN.seqs)
    assert found.driven_clearance_m == pytest.approx(PLAN.driven_clearance_m, abs=0.01)
    assert (found.clearance_m, found.asked_m) == (PLAN.clearance_m, PLAN.asked_m)


def test_from_nearby_it_is_the_same_mission_with_its_own_corridor_or_none():
    chance = np.random.default_rng(3)
    found = 0
    for _ in range(25):
        east_m, north_m = chance.uniform(-6, 6, 2)
        here = from_here(PLAN, standing(east_m, north_m, chance.uniform(-60, 60)), REQUEST)
        if here is None:
            continue
        found += 1
        assert here.items == PLAN.items
        assert distance_m(here.start, at(east_m, north_m)) < 0.02
        assert here.path[1:] == PLAN.path[1:]
        pond = shapely.Polygon(here.ground.frame.to_local_array(POND.vertices))
        assert here.envelope.area.distance(pond) >= PLAN.asked_m - 0.02
        assert pond.distance(shapely.LineString(here.points)) >= PLAN.asked_m - 0.02
    assert found > 3


def test_from_across_an_exclusion_there_is_none():
    side = -1 if PLAN.points[1][0] > 0 else 1
    assert from_here(PLAN, standing(side * 12.5, 30.0), REQUEST) is None


def test_with_another_fence_across_it_or_none_there_is_none():
    wall = zone(ZoneKind.EXCLUSION, -40.0, 10.0, 40.0, 12.0)
    walled = replace(SITUATION, fence=Known(Fence((*SITUATION.fence.value.zones, wall)), None, "test"))
    assert from_here(PLAN, walled, REQUEST) is None
    assert from_here(PLAN, replace(SITUATION, fence=None), REQUEST) is None


def test_nothing_that_promises_nothing_is_driven_from_elsewhere():
    unpromised = replace(PLAN, keeps=replace(PLAN.keeps, promised_m=None))
    assert from_here(unpromised, SITUATION, REQUEST) is None
    assert from_here(PLAN, SITUATION, replace(REQUEST, corner_allowance_m=1.0)) is None


def test_facing_away_where_there_is_no_room_to_turn_there_is_none():
    near = zone(ZoneKind.EXCLUSION, -30.0, -9.0, 30.0, -5.0)
    tight = replace(SITUATION, fence=Known(Fence((*SITUATION.fence.value.zones, near)), None, "test"))
    planned = plan(tight, REQUEST)
    assert from_here(planned, tight, REQUEST) is not None
    turned = replace(tight, pose=Known(Pose(at(0.0, -2.6), 180.0), None, "test"))
    assert from_here(planned, turned, REQUEST) is None
