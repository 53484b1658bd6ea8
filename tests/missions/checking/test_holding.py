"""Where a HOLD ends: in plans and checks, and from where the vehicle is now."""

from __future__ import annotations

from dataclasses import replace

import pytest

from missions.checking.check import check_mission
from missions.checking.holding import TAKES_S, hold_now
from missions.fence import Fence, PolygonZone, ZoneKind
from missions.firmware import Firmware
from missions.geo import LatLon, LocalPoint, distance_m
from missions.ground.frame import LocalFrame
from missions.planning.plan import plan
from missions.request import GoTo
from missions.situation import Known, Mission, Pose, Situation
from missions.stops import Stop, Stops

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
