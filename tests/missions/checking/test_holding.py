"""Where a HOLD ends: in plans and checks, and from where the vehicle is now."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from missions.checking.check import check_mission
from missions.checking.holding import TAKES_S, hold_now, resting_pose
from missions.fence import Fence, PolygonZone, ZoneKind
from missions.firmware import Firmware
from missions.geo import LatLon, LocalPoint, distance_m
from missions.ground.frame import LocalFrame
from missions.planning.plan import plan
from missions.request import GoTo
from missions.situation import Known, Mission, Pose, Situation
from missions.stops import Rolling, Stop, Stops

FRAME = LocalFrame(LatLon(40.0, -105.0))
NO_AVOIDANCE = {
    "AVOID_ENABLE": 0.0,
    "FENCE_MARGIN": 1.0,
    "WP_SPEED": 3.0,
    "FENCE_ENABLE": 1.0,
    "FENCE_TYPE": 4.0,
}
REQUEST = GoTo(clearance_m=1.0)


def at(east_m: float, north_m: float) -> LatLon:
    return FRAME.to_lat_lon(LocalPoint(east_m, north_m))


def zone(kind: ZoneKind, west_m: float, south_m: float, east_m: float, north_m: float) -> PolygonZone:
    corners = ((west_m, south_m), (east_m, south_m), (east_m, north_m), (west_m, north_m))
    return PolygonZone(kind, tuple(at(*corner) for corner in corners))


YARD = zone(ZoneKind.INCLUSION, -100.0, -100.0, 100.0, 100.0)


def field(*zones: PolygonZone, start: tuple[float, float] = (0.0, 0.0), **parameters: float) -> Situation:
    return Situation(
        fence=Known(Fence((YARD, *zones)), None, "test"),
        pose=Known(Pose(at(*start), 0.0), None, "test"),
        parameters={**NO_AVOIDANCE, **parameters},
        firmware=Firmware(4, 6),
    )


def straight_at_the_edge(**parameters: float) -> Situation:
    return field(start=(0.0, 40.0), **parameters)


def test_a_plan_tells_which_hold_would_end_beyond_the_fence():
    planned = plan(straight_at_the_edge(), replace(REQUEST, target=at(0.0, 94.0)))
    hold = planned.hold
    assert (hold.speed_mps, hold.stopping_m) == (pytest.approx(3.0, abs=0.01), pytest.approx(6.2, abs=0.05))
    # By hand: at 3 m/s until v²/2a + v a/2j = 6 m before the target at 94 m; from there it rolls 6.2 m, to 94.2 m; and slower from later.
    assert hold.worst is None
    assert not [text for text in planned.warnings if "HOLD" in text]
    wet = replace(straight_at_the_edge(), stops=Stops(given=(Stop(3.0, 15.0),)))
    warned = plan(wet, replace(REQUEST, target=at(0.0, 94.0)))
    worst = warned.hold.worst
    assert worst.fence == "inclusion polygon 1"
    assert worst.to_fence_m == pytest.approx(100.0 - FRAME.to_local(worst.at).north_m, abs=0.01)
    assert worst.beyond_m >= 15.0 - 12.0 - 0.8  # from 88 m to 103 m, at most one sample before
    [text] = [text for text in warned.warnings if "HOLD does not brake" in text]
    assert f"{worst.beyond_m:.1f} m beyond inclusion polygon 1" in text
    assert "(from --stopping)" in text


def test_avoidance_keeps_the_vehicle_slow_enough_before_the_fence():
    avoiding = straight_at_the_edge(AVOID_ENABLE=3.0, FENCE_MARGIN=2.0)
    assert plan(avoiding, GoTo(target=at(0.0, 94.0))).hold.worst is None


def test_a_check_tells_the_same_as_the_plan():
    wet = replace(straight_at_the_edge(), stops=Stops(given=(Stop(3.0, 15.0),)))
    planned = plan(wet, replace(REQUEST, target=at(0.0, 94.0)))
    checked = check_mission(Mission(planned.items), wet, REQUEST)
    assert checked.hold.worst.beyond_m == pytest.approx(planned.hold.worst.beyond_m, abs=0.02)
    assert checked.hold.sentence in checked.warnings
    assert checked.holds  # a HOLD is nobody's promise


def driving(situation: Situation, here: tuple[float, float], velocity_mps: tuple[float, float]) -> Situation:
    return replace(situation, pose=Known(Pose(at(*here), None, velocity_mps), 0.0, "test"))


def round_the_corner() -> tuple[Situation, object]:
    """A route north along a wall and then east round its end."""
    wall = zone(ZoneKind.EXCLUSION, 3.0, -60.0, 60.0, 20.0)
    situation = field(wall, start=(0.0, -50.0))
    planned = plan(situation, replace(REQUEST, target=at(50.0, 25.0)))
    return situation, planned


def with_block(situation: Situation, *block: float) -> Situation:
    fence = situation.fence.value
    return replace(
        situation, fence=Known(Fence((*fence.zones, zone(ZoneKind.EXCLUSION, *block))), 0.0, "test")
    )


def test_a_hold_that_ends_before_the_fence_is_no_matter():
    situation, planned = round_the_corner()
    now = driving(with_block(situation, -5.0, 30.0, 5.0, 40.0), (0.0, 10.0), (0.0, 3.0))
    assert hold_now(now, REQUEST, planned, item=1) is None  # 6.2 m and half a second of 3 m/s, of 20 m
    assert hold_now(driving(now, (0.0, 25.0), (0.0, 0.0)), REQUEST, planned, item=1) is None


def test_a_fence_straight_ahead_and_across_the_route_asks_for_hold_at_once():
    situation, planned = round_the_corner()
    now = driving(with_block(situation, -5.0, 0.0, 2.9, 5.0), (0.0, -3.0), (0.0, 3.0))
    found = hold_now(now, REQUEST, planned, item=1)
    assert found.go_on_m is None
    assert found.roll_out.fence == "exclusion polygon 2"
    assert found.roll_out.to_fence_m == pytest.approx(3.0, abs=0.01)
    assert found.roll_out.stopping_m == pytest.approx(6.2 + 3.0 * TAKES_S, abs=0.05)
    late = hold_now(now, REQUEST, planned, item=1, age_s=1.0)
    assert late.roll_out.stopping_m == pytest.approx(found.roll_out.stopping_m + 3.0)


def test_a_route_that_turns_away_before_the_fence_is_better_gone_on_with():
    situation, planned = round_the_corner()
    corner = planned.path[1]
    north_m = FRAME.to_local(corner).north_m
    now = driving(with_block(situation, -20.0, north_m + 1.2, 2.5, 40.0), (0.0, north_m - 6.0), (0.0, 3.0))
    found = hold_now(now, REQUEST, planned, item=1)
    assert found.roll_out.beyond_m > 0
    # Past the corner, where straight on leads east: by no more than what is left of this leg and the blend of the corner after it.
    assert 1.0 < found.go_on_m < 15.0
    assert hold_now(now, REQUEST, None, item=1).go_on_m is None


def test_a_route_that_ends_before_the_fence_is_better_gone_on_with():
    situation = field(start=(0.0, 0.0))
    planned = plan(situation, replace(REQUEST, target=at(0.0, 50.0)))
    beyond = with_block(situation, -5.0, 52.0, 5.0, 60.0)
    now = driving(replace(beyond, stops=Stops(given=(Stop(3.0, 20.0),))), (0.0, 40.0), (0.0, 3.0))
    found = hold_now(now, REQUEST, planned, item=1)
    assert found.roll_out.to_fence_m == pytest.approx(12.0, abs=0.02)
    left_m = distance_m(now.pose.value.position, planned.path[-1])
    assert 0.0 < found.go_on_m <= left_m


def test_what_is_not_known_is_not_foretold():
    situation, planned = round_the_corner()
    assert hold_now(replace(situation, pose=None), REQUEST, planned, item=1) is None
    moving = driving(situation, (0.0, 99.0), (0.0, 3.0))
    assert hold_now(moving, REQUEST, None, item=1).roll_out.fence == "inclusion polygon 1"
    assert hold_now(replace(moving, fence=None), REQUEST, None, item=1) is None


# Where it will stand, as its roll tells


def rolled(kind: str, first_mps: float, share: float) -> list[tuple[float, float]]:
    """Return speeds and ways of a stop, four a second: by how measured rovers' speeds fell, ``share`` times as far."""
    rows = {
        "steered": [(0.0, 0.0), (8.0, 16.4)],
        "skid": [(0.0, 0.0), (1.0, 0.42), (2.0, 1.09), (3.0, 2.0), (4.0, 3.18)],
    }[kind]
    speeds, ways = zip(*rows, strict=True)
    found, speed_mps, way_m, dt_s = [(first_mps, 0.0)], first_mps, 0.0, 0.005
    while speed_mps > 0.25:
        for _ in range(50):
            moved_m = speed_mps * dt_s
            left_m = max(0.0, share * np.interp(speed_mps, speeds, ways) - moved_m)
            way_m += moved_m
            speed_mps = float(np.interp(left_m / share, ways, speeds))
        found.append((speed_mps, way_m))
    return found


@pytest.mark.parametrize("kind", ["steered", "skid"])
@pytest.mark.parametrize("first_mps", [1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize("share", [0.3, 1.0, 1.6])
def test_a_roll_tells_where_it_ends(kind, first_mps, share):
    skid = {"SERVO1_FUNCTION": 73.0, "SERVO3_FUNCTION": 74.0} if kind == "skid" else {}
    situation = field(**skid)
    east, north = math.sin(0.7), math.cos(0.7)
    rolling = Rolling(0.0)
    seen = rolled(kind, first_mps, share)
    stands_m = next(way_m for speed_mps, way_m in seen if speed_mps <= 0.3)
    told = 0
    for number, (speed_mps, way_m) in enumerate(seen):
        place = at(east * way_m, north * way_m)
        pose = Pose(place, 40.0, (east * speed_mps, north * speed_mps))
        rolling = rolling.moved(place, speed_mps, 0.25 * number)
        expected = resting_pose(replace(situation, pose=Known(pose, 0.25 * number, "test")), REQUEST, rolling)
        if speed_mps > 0.85 * first_mps or speed_mps <= 0.3:
            assert expected is None
            continue
        told += 1
        assert expected.heading_deg == 40.0
        assert expected.speed_mps == 0.0
        # The stop is looked at four times a second, so that it is passed by as much as that.
        assert distance_m(expected.position, at(east * stands_m, north * stands_m)) < 0.08 + 0.06 * stands_m
    assert told or seen[1][0] <= 0.3


def test_what_does_not_slow_down_or_is_not_known_tells_nothing():
    pose = Pose(at(0.0, 5.0), 0.0, (0.0, 2.0))
    situation = replace(field(), pose=Known(pose, 1.0, "test"))
    begun = Rolling(0.0).moved(at(0.0, 0.0), 2.1, 0.0)
    assert resting_pose(situation, REQUEST, begun) is None
    assert resting_pose(situation, REQUEST, Rolling(0.0)) is None
    assert resting_pose(replace(situation, pose=None), REQUEST, begun) is None
    slower = replace(situation, pose=Known(Pose(at(0.0, 5.0), 0.0, (0.0, 1.0)), 1.0, "test"))
    assert resting_pose(slower, REQUEST, begun) is not None
    unusable = replace(slower, parameters={**slower.parameters, "TURN_RADIUS": -1.0, "WP_SPEED": -3.0})
    assert resting_pose(unusable, REQUEST, begun) is None
    assert resting_pose(replace(slower, ardupilot=False), REQUEST, begun) is None, "PX4's HOLD is a loop"
