"""Plans and checks of PX4's rover with steered wheels: its promise, its fence, its waits and its HOLD."""

from __future__ import annotations

from dataclasses import replace

import pytest
from drive_model.test_pursuit import AIRFRAME
from shapely import Point

from missions.checking.check import check_mission
from missions.checking.holding import hold_now
from missions.checking.px4_waits import WAIT_M
from missions.errors import VehicleError
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.firmware import Firmware
from missions.geo import LatLon, LocalPoint
from missions.ground.frame import LocalFrame
from missions.items import Command, CoordinateFrame, MissionItem, waypoint
from missions.planning.plan import plan
from missions.request import End, GoTo, Tour
from missions.situation import Known, Mission, Pose, Situation

FRAME = LocalFrame(LatLon(40.0, -105.0))
OLD, NEW = Firmware(1, 17, 0), Firmware(1, 18, 0, 0)


def at(east_m, north_m):
    return FRAME.to_lat_lon(LocalPoint(east_m, north_m))


def box(kind, west_m, south_m, east_m, north_m):
    corners = ((west_m, south_m), (east_m, south_m), (east_m, north_m), (west_m, north_m))
    return PolygonZone(kind, tuple(at(*corner) for corner in corners))


YARD = box(ZoneKind.INCLUSION, -60, -60, 60, 60)
WALL = box(ZoneKind.EXCLUSION, -20, 15, 20, 25)


def field(*zones, home=(0.0, 0.0), firmware=OLD, speed=(0.0, 0.0), **parameters):
    return Situation(
        fence=Known(Fence(zones or (YARD, WALL)), None, "test"),
        pose=Known(Pose(at(0, 0), 0.0, velocity_mps=speed), None, "test"),
        home=None if home is None else Known(at(*home), None, "test"),
        parameters={**AIRFRAME, **parameters},
        firmware=firmware,
        mission=None,
    )


def way(*places, hold_s=0.0):
    return tuple(replace(waypoint(at(*place)), params=(hold_s, 0.0, 0.0, 0.0)) for place in places)


def delay(seconds, command=Command.NAV_DELAY):
    return MissionItem(command, params=(seconds, -1.0, -1.0, -1.0), frame=CoordinateFrame.MISSION)


@pytest.mark.parametrize("speed_mps", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("clearance_m", [0.5, 1.0])
def test_a_plan_of_the_measured_rover_promises(speed_mps, clearance_m):
    planned = plan(field(RO_SPEED_LIM=speed_mps), GoTo(target=at(0, 45), clearance_m=clearance_m))
    assert planned.extrapolated == ()
    assert planned.clearance_m == clearance_m
    assert planned.driven_clearance_m >= clearance_m
    assert not any(item.command == Command.NAV_WAYPOINT and item.params[0] > 0 for item in planned.items)
    (text,) = (info for info in planned.info if "PX4 keeps no margin" in info)
    assert "GF_ACTION 2" in text
    assert "loop" in planned.hold.sentence


def test_what_gf_action_does_is_said():
    for action, words in ((0, "nothing stops"), (1, "only warns"), (3, "acts only after a breach")):
        planned = plan(field(GF_ACTION=action), GoTo(target=at(0, 45), clearance_m=1.0))
        assert any(words in info for info in planned.info)
    assert any(
        "does not enforce this fence (GF_ACTION is 0)" in text
        for text in plan(field(GF_ACTION=0), GoTo(target=at(0, 45))).warnings
    )


def test_the_circle_about_home_is_named_by_its_parameter():
    checked = check_mission(Mission(way((0, 10), (40, 10))), field(GF_MAX_HOR_DIST=30))
    assert checked.broken[0].crosses == ("home circle (GF_MAX_HOR_DIST 30 m)",)


def test_zones_that_are_not_enforced_are_told_in_plans_and_checks():
    yard = replace(YARD, kind=ZoneKind.INCLUSION)
    outside = field(yard, WALL, home=(0.0, 80.0))
    inside = field(yard, WALL, CircleZone(ZoneKind.EXCLUSION, at(30, 0), 5.0), home=(31.0, 0.0))
    for situation, zone, why in (
        (outside, "inclusion polygon 1", "home is outside it"),
        (inside, "exclusion circle 1", "home is inside it"),
    ):
        for warnings in (
            plan(situation, GoTo(target=at(0, 45), clearance_m=1.0)).warnings,
            check_mission(Mission(way((0, 10))), situation).warnings,
        ):
            told = [text for text in warnings if "will not enforce" in text]
            assert len(told) == 1
            assert zone in told[0]
            assert why in told[0]
    assert not any("will not enforce" in text for text in plan(field(), GoTo(target=at(0, 45))).warnings)
    assert any("home unknown" in text for text in plan(field(home=None), GoTo(target=at(0, 45))).warnings)


def test_an_ardupilot_rover_is_told_nothing_of_it():
    situation = replace(field(home=(0.0, 80.0)), parameters={"WP_SPEED": 2.0}, firmware=Firmware(4, 6))
    planned = plan(situation, GoTo(target=at(0, 45), clearance_m=1.0))
    assert not any("PX4" in text for text in (*planned.info, *planned.warnings))


def test_the_hold_time_of_a_waypoint_is_ignored():
    checked = check_mission(Mission(way((0, 10), (0, -10), hold_s=5.0)), field())
    assert checked.legs[0].leg.stop_s is None
    assert "item 1: PX4 ignores the hold time of a waypoint (5 s); the rover drives on" in checked.warnings


@pytest.mark.parametrize("firmware", [OLD, NEW, None])
def test_a_wait_at_loiter_time_needs_the_ground_of_a_circle(firmware):
    items = (
        replace(way((0, -20))[0], command=Command.NAV_LOITER_TIME, params=(10.0, 0.0, 0.0, 0.0)),
        *way((0, -40)),
    )
    checked = check_mission(Mission(items), field(firmware=firmware))
    assert checked.legs[0].leg.circle_m == WAIT_M
    assert any("item 1: a PX4 rover with steered wheels does not stand" in text for text in checked.warnings)
    # 5 m before a fence the wait leaves it, though its line does not.
    near = check_mission(
        Mission((replace(items[0], lat_e7=way((0, 10))[0].lat_e7), *way((0, -10)))), field(firmware=firmware)
    )
    assert not near.holds
    assert near.broken


@pytest.mark.parametrize("command", [Command.NAV_DELAY, Command.CONDITION_DELAY])
def test_a_delay_circles_before_1_18_and_stands_from_then_on(command):
    items = (*way((0, -20)), delay(10.0, command), *way((20, -40)))
    circles = check_mission(Mission(items), field(firmware=OLD))
    assert (circles.legs[0].leg.circle_m, circles.legs[0].leg.stop_s) == (WAIT_M, 10.0)
    stands = check_mission(Mission(items), field(firmware=NEW))
    assert (stands.legs[0].leg.circle_m, stands.legs[0].leg.stop_s) == (0.0, 10.0)
    assert stands.duration_s > 10.0


def test_the_ground_of_a_wait_holds_what_was_measured():
    """From 2 m before to 8.7 m past the waypoint, and 3 m to the side."""
    disc = Point(0, 0).buffer(WAIT_M)
    assert all(disc.covers(Point(place)) for place in ((3, 8.7), (-3, 8.7), (3, -2), (-3, -2)))


def test_no_plan_ends_in_a_loiter():
    with pytest.raises(VehicleError, match="circles"):
        plan(field(), Tour(targets=(at(0, 45),), clearance_m=1.0, end=End.LOITER))


def test_a_hold_now_takes_the_loop_into_account():
    # 4 m before the wall at 3 m/s: half a second until it is taken, then 2.3 m ahead: beyond by 0.2 m at least
    situation = replace(
        field(speed=(0.0, 3.0)), pose=Known(Pose(at(0, 11.4), 0.0, velocity_mps=(0.0, 3.0)), None, "test")
    )
    found = hold_now(situation, GoTo(), None, item=1)
    assert found is not None
    assert found.roll_out.fence == "exclusion polygon 1"
    assert found.roll_out.beyond_m == pytest.approx(11.4 + 1.5 + 2.3 - 15.0, abs=0.05)
    far = replace(situation, pose=Known(Pose(at(0, 11.0), 0.0, velocity_mps=(0.0, 3.0)), None, "test"))
    assert hold_now(far, GoTo(), None, item=1) is None


def test_a_hold_beside_a_fence_is_warned_of():
    checked = check_mission(Mission(way((0, 13.5), (15, 13.5))), field(), GoTo(clearance_m=0.5))
    assert checked.hold.worst is not None
    assert any("HOLD drives a loop" in text for text in checked.warnings)


def test_other_ends_of_a_wait():
    unlimited = replace(way((0, -20))[0], command=Command.NAV_LOITER_UNLIM)
    assert check_mission(Mission((unlimited,)), field()).legs[0].leg.circle_m == WAIT_M
    home = MissionItem(Command.NAV_RETURN_TO_LAUNCH, frame=CoordinateFrame.MISSION)
    back = check_mission(Mission((*way((0, -20)), home)), field())
    assert [leg.leg.circle_m for leg in back.legs] == [0.0, 0.0]
    # A DELAY behind a jump belongs to another place; one of no number waits for no time, and stops all the same.
    jump = MissionItem(Command.DO_JUMP, params=(1.0, 1.0, 0.0, 0.0), frame=CoordinateFrame.MISSION)
    items = (*way((0, -20), (0, -30)), jump, delay(5.0), *way((0, -40)), delay(float("nan")))
    legs = check_mission(Mission(items), field(firmware=NEW)).legs
    assert {leg.leg.stop_s for leg in legs if leg.leg.last_item == 2} == {None}
    assert legs[-1].leg.stop_s == 0.0
