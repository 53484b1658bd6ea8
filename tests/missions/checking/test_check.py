"""Checks of missions, against distances measured in a map of the test's own."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapely
from pyproj import Proj
from shapely import LineString, Point, Polygon
from strategies import GEOD, offset

from missions.checking.check import MissionCheck, check_mission, plan_of
from missions.errors import FenceMissingError, SituationError
from missions.fence import CircleZone, Fence, PolygonZone, Zone, ZoneKind
from missions.firmware import Firmware
from missions.formats import read_fence, read_mission
from missions.geo import LatLon, rounded
from missions.items import CoordinateFrame, MissionItem, waypoint
from missions.picture import draw_plan
from missions.planning.plan import plan
from missions.rally import RallyPoint
from missions.request import Request
from missions.situation import Known, Mission, Pose, Situation
from missions.vehicle import Footprint

HOME = LatLon(40.071374, -105.22993)
IN, OUT = ZoneKind.INCLUSION, ZoneKind.EXCLUSION
MAP = Proj(proj="tmerc", ellps="WGS84", lat_0=HOME.lat_deg, lon_0=HOME.lon_deg, k=1)


def plane(places: Sequence[LatLon]) -> np.ndarray:
    lat_lon = np.array(places)
    return np.column_stack(MAP(lat_lon[:, 1].tolist(), lat_lon[:, 0].tolist()))


def place(east_m: float, north_m: float) -> LatLon:
    return rounded(offset(HOME, east_m, north_m))


def ring(kind: ZoneKind, *east_north_m: tuple[float, float]) -> PolygonZone:
    return PolygonZone(kind, tuple(place(*point) for point in east_north_m))


def box(kind: ZoneKind, west_m: float, south_m: float, east_m: float, north_m: float) -> PolygonZone:
    return ring(kind, (west_m, south_m), (east_m, south_m), (east_m, north_m), (west_m, north_m))


FIELD = box(IN, -50, -50, 150, 100)
BARN = box(OUT, 40, 20, 60, 40)


def situation_of(*zones: Zone, **parameters: float) -> Situation:
    return Situation(fence=Known(Fence(zones), None, "test"), parameters=parameters, firmware=Firmware(4, 6))


def mission_of(*items: MissionItem | tuple[float, float], home: LatLon | None = HOME) -> Mission:
    made = (one if isinstance(one, MissionItem) else waypoint(place(*one)) for one in items)
    return Mission(tuple(made), home)


def do(command: int, *params: float) -> MissionItem:
    return MissionItem(command, CoordinateFrame.MISSION, (*params, 0.0, 0.0, 0.0, 0.0)[:4])


def checked(
    *items: MissionItem | tuple[float, float], clearance_m: float = 2.0, **parameters: float
) -> MissionCheck:
    return check_mission(
        mission_of(*items), situation_of(FIELD, BARN, **parameters), Request(clearance_m=clearance_m)
    )


RTL = do(20)


def test_the_leg_through_the_barn_of_the_recorded_mission_is_found(fields):
    mission = read_mission(fields / "yard-mission.waypoints")
    fence = read_fence(fields / "yard-fence.waypoints")
    found = check_mission(mission, Situation(fence=Known(fence, None, "file")), Request(clearance_m=2.0))

    first, second = (
        LineString(plane(leg)) for leg in pairwise((mission.home, *(i.position for i in mission.items)))
    )
    outer, barn, shed = (Polygon(plane(zone.vertices)) for zone in fence.zones[:3])
    circle = Point(plane([fence.zones[3].centre])[0]).buffer(fence.zones[3].radius_m, quad_segs=200)
    assert barn.crosses(second)
    assert shed.crosses(second)
    assert outer.covers(second)

    assert [leg.breaks for leg in found.legs] == [False, True]
    assert not found.holds
    assert found.broken == found.legs[1:]
    through = found.legs[1]
    assert through.crosses == ("exclusion polygon 1", "exclusion polygon 2")
    assert (through.drawn_clearance_m, through.driven_clearance_m) == (0.0, 0.0)
    entry = second.intersection(barn).coords[0]
    assert math.dist(plane([through.at])[0], entry) < 0.01
    clear = found.legs[0]
    expected_m = min(first.distance(area) for area in (barn, shed, circle, outer.exterior))
    assert clear.drawn_clearance_m == pytest.approx(expected_m, abs=2e-3)
    assert clear.fence == "exclusion polygon 1"
    assert clear.driven_clearance_m < clear.drawn_clearance_m
    for leg, line in zip(found.legs, (first, second), strict=True):
        assert leg.length_m == pytest.approx(line.length, abs=0.01)
    assert found.duration_s == pytest.approx(sum(leg.time_s for leg in found.legs))


@pytest.mark.parametrize("gap_m", [1.0, 2.0, 3.5])
def test_clearances_are_those_of_the_map(gap_m):
    found = checked((-10.0, 20.0 - gap_m), (100.0, 20.0 - gap_m))
    line = LineString(plane([found.legs[1].leg.start, found.legs[1].leg.end]))
    barn = Polygon(plane(BARN.vertices))
    along = found.legs[1]
    assert along.drawn_clearance_m == pytest.approx(line.distance(barn), abs=2e-3)
    assert along.fence == "exclusion polygon 1"
    # A straight leg at 2 m/s stays within 0.3 m of its line; the first corner's swing may add to that.
    assert gap_m - 0.6 < along.driven_clearance_m <= gap_m - 0.29
    assert along.breaks == (along.driven_clearance_m < 1.99)
    assert Point(plane([along.at])[0]).distance(barn) == pytest.approx(line.distance(barn), abs=0.01)


def test_driven_clearance_is_that_of_the_band():
    found = checked((20.0, 10.0), (63.5, 10.0), (63.5, 60.0), (0.0, 60.0))
    edge = found.ground.edge
    assert found.driven_clearance_m == pytest.approx(found.envelope.area.distance(edge), abs=0.05)
    assert found.drawn_clearance_m == min(leg.drawn_clearance_m for leg in found.legs)


def test_a_plan_of_this_program_passes():
    situation = replace(situation_of(FIELD, BARN), home=Known(HOME, None, "test"))
    planned = plan(situation, Request(HOME, (place(100, 60),), 2.0))
    found = check_mission(Mission(planned.items, HOME), situation, Request(clearance_m=2.0))
    assert found.holds
    assert found.driven_clearance_m == pytest.approx(planned.driven_clearance_m, abs=0.01)
    assert found.duration_s == pytest.approx(planned.duration_s)


def test_speeds_and_stops_reach_the_drive_model():
    slow = checked((30.0, 0.0), do(178, 1, 0.5), (60.0, 0.0))
    fast = checked((30.0, 0.0), do(178, 1, 4.0), (60.0, 0.0))
    assert slow.legs[1].time_s == pytest.approx(60, abs=8)
    assert fast.legs[1].time_s < slow.legs[1].time_s / 2
    waiting = checked(replace(waypoint(place(30, 0)), params=(25.0, 0.0, 0.0, 0.0)), (60.0, 0.0))
    driving = checked((30.0, 0.0), (60.0, 0.0))
    assert waiting.duration_s - driving.duration_s == pytest.approx(25, abs=6)


def test_a_leg_out_of_the_field_crosses_the_inclusion():
    found = checked((0.0, 120.0))
    assert found.legs[0].crosses == ("inclusion polygon 1",)
    assert plane([found.legs[0].at])[0][1] == pytest.approx(100, abs=0.05)


def test_a_leg_wholly_within_an_exclusion_keeps_nothing():
    found = checked((45.0, 25.0), (55.0, 35.0))
    assert found.legs[1].crosses == ("exclusion polygon 1",)
    assert found.legs[1].driven_clearance_m == 0.0


def test_a_jump_is_checked_where_it_leads():
    found = checked((30.0, 10.0), (70.0, 50.0), do(177, 4, 1), (30.0, 45.0))
    assert [leg.name for leg in found.legs] == ["start → 1", "1 → 2", "2 → 4 (jump 3)"]
    back = checked((30.0, 30.0), (30.0, 60.0), (80.0, 60.0), (80.0, 30.0), do(177, 1, 3), (100.0, 30.0))
    assert [leg.name for leg in back.broken] == ["4 → 1 (jump 5)"] * 3


def test_a_start_near_a_fence_has_to_keep_what_it_has():
    situation = situation_of(FIELD, BARN)
    near = check_mission(mission_of((0.0, 0.0)), situation, Request(place(39.2, 30.0), clearance_m=2.0))
    assert near.holds
    assert 0.4 < near.legs[0].asked_m < 0.8
    kept_m = near.legs[0].driven_clearance_m
    assert any(
        f"while leaving it, the rover keeps at least {kept_m:.2f} m" in warning for warning in near.warnings
    )
    nearer = check_mission(mission_of((39.6, 60.0)), situation, Request(place(38.8, 10.0), clearance_m=2.0))
    assert [leg.name for leg in nearer.broken] == ["start → 1"]


def test_a_first_leg_that_comes_near_a_fence_again_breaks():
    # From near the barn away and, still on the first leg, as near past another fence.
    situation = situation_of(FIELD, BARN, box(OUT, 0, 32, 10, 50))
    again = check_mission(mission_of((-20.0, 30.8)), situation, Request(place(38.8, 30.8), clearance_m=2.0))
    assert again.broken
    assert again.legs[0].asked_m == 2.0
    away = check_mission(mission_of((20.0, 30.8)), situation, Request(place(38.8, 30.8), clearance_m=2.0))
    assert away.holds


def test_a_start_that_is_not_known_is_said():
    found = check_mission(
        mission_of((0.0, 0.0), (10.0, 0.0), home=None), situation_of(FIELD), Request(clearance_m=2.0)
    )
    assert [leg.name for leg in found.legs] == ["1 → 2"]
    assert any("start position unknown" in warning for warning in found.warnings)


def test_the_vehicles_own_place_comes_before_home():
    pose = Pose(place(0.0, 60.0), 90.0)
    situation = replace(situation_of(FIELD, BARN), pose=Known(pose, None, "test"))
    found = check_mission(mission_of((20.0, 60.0)), situation, Request(clearance_m=2.0))
    assert found.legs[0].leg.start == pose.position
    assert not any("heads" in warning for warning in found.warnings)


def test_what_is_not_understood_does_not_hold():
    found = checked((10.0, 0.0), replace(waypoint(place(20, 0)), command=82), (30.0, 0.0))
    assert not found.broken
    assert not found.holds
    assert "item 2 is command 82" in found.troubles[0]


def test_rtl_of_the_mission_is_a_leg_of_it():
    through = checked((100.0, 60.0), RTL)
    assert through.legs[-1].crosses == ("exclusion polygon 1",)
    assert through.legs[-1].name == "1 → home"
    assert not through.holds
    round_it = checked((0.0, 60.0), RTL)
    assert round_it.holds
    assert round_it.legs[-1].leg.end == HOME


def rtl_warning(found: MissionCheck) -> str | None:
    return next((text for text in found.warnings if text.startswith("RTL")), None)


def test_rtl_through_a_fence_is_a_warning():
    found = checked((100.0, -10.0), (100.0, 80.0))
    assert found.holds
    text = rtl_warning(found)
    assert text is not None
    assert "exclusion polygon 1" in text
    # Straight home crosses from the second leg only.
    barn = Polygon(plane(BARN.vertices))
    crossing = [
        shapely.MultiPoint(plane([HOME, leg.leg.start, leg.leg.end])).convex_hull.intersects(barn)
        for leg in found.legs
    ]
    assert crossing == [False, True]
    assert "from 1 of 2 legs" in text
    assert rtl_warning(checked((0.0, 60.0))) is None


def test_what_calls_for_rtl_is_named():
    found = checked((100.0, -10.0), (100.0, 80.0), FENCE_ENABLE=1, FENCE_TYPE=4, FENCE_ACTION=1, FS_ACTION=2)
    assert "(FENCE_ACTION 1)" in rtl_warning(found)
    assert rtl_warning(checked((100.0, 80.0), OA_TYPE=2)) is None


def test_rtl_goes_to_the_nearest_rally_point():
    rally = tuple(RallyPoint(*position) for position in (place(110.0, 80.0), place(-40.0, 60.0)))
    situation = replace(situation_of(FIELD, BARN), rally=Known(rally, None, "test"))
    found = check_mission(mission_of((100.0, -10.0), (100.0, 80.0), RTL), situation, Request(clearance_m=2.0))
    assert found.legs[-1].leg.end == rally[0].position
    home_too = replace(situation, parameters={"RALLY_INCL_HOME": 1.0})
    back = check_mission(mission_of((10.0, -10.0), RTL), home_too, Request(clearance_m=2.0))
    assert back.legs[-1].leg.end == HOME
    far = replace(situation, parameters={"RALLY_LIMIT_KM": 0.005})
    assert (
        check_mission(mission_of((10.0, -10.0), RTL), far, Request(clearance_m=2.0)).legs[-1].leg.end == HOME
    )
    no_home = check_mission(
        mission_of((100.0, -10.0), (100.0, 80.0), RTL, home=None), situation, Request(clearance_m=2.0)
    )
    assert no_home.legs[-1].leg.end == rally[0].position


def test_the_mode_after_the_mission_is_said():
    said = [text for text in checked((0.0, 60.0), MIS_DONE_BEHAVE=3).warnings if "MIS_DONE_BEHAVE" in text]
    assert "Manual" in said[0]
    assert not any("MIS_DONE" in text for text in checked((0.0, 60.0)).warnings)


def test_circles_are_checked_as_discs():
    circle = replace(waypoint(place(70.0, 30.0)), command=18, params=(1.0, 0.0, 12.0, 0.0))
    hits = checked((100.0, 0.0), circle, (100.0, 60.0))
    assert "exclusion polygon 1" in hits.legs[1].crosses
    small = replace(circle, params=(1.0, 0.0, 6.0, 0.0))
    keeps = checked((100.0, 0.0), small, (100.0, 60.0))
    assert keeps.holds
    assert keeps.legs[1].drawn_clearance_m == pytest.approx(10 - 6, abs=0.1)
    assert keeps.legs[1].driven_clearance_m <= keeps.legs[1].drawn_clearance_m - 0.29
    assert keeps.legs[2].drawn_clearance_m == pytest.approx(10 - 6, abs=0.1)


def test_places_on_one_another_are_one():
    alone = checked((50.0, 17.0), (30.0, 0.0))
    twice = checked((50.0, 17.0), (50.0, 17.0), (30.0, 0.0), (30.0, 0.0))
    first, again, _, last = twice.legs
    assert (again.length_m, last.length_m) == (0, 0)
    assert first.driven_clearance_m == again.driven_clearance_m <= alone.legs[0].driven_clearance_m < 2.8
    assert last.driven_clearance_m < math.inf
    start = check_mission(
        mission_of((0.0, 0.0), (30.0, 0.0)), situation_of(FIELD, BARN), Request(place(0, 0), clearance_m=2.0)
    )
    assert start.holds


def test_sharp_turns_between_short_legs_are_named():
    found = checked((10.0, 0.0), (4.0, 0.5), (10.0, 3.0))
    assert any(text.startswith("item 1: ") for text in found.warnings)


def test_without_a_fence_nearby_everything_is_far():
    found = check_mission(
        mission_of((10.0, 0.0)), situation_of(box(OUT, 400, 400, 500, 500)), Request(clearance_m=2.0)
    )
    assert found.holds
    assert found.legs[0].drawn_clearance_m > 500


def test_a_home_far_away_does_not_stand_in_the_way():
    away = LatLon(-35.363262, 149.165237)
    situation = replace(situation_of(FIELD, BARN), pose=Known(Pose(HOME, 0.0), None, "test"))
    found = check_mission(mission_of((10.0, 0.0), home=away), situation, Request(clearance_m=2.0))
    assert found.holds


def test_the_home_circle_counts():
    found = check_mission(
        mission_of((100.0, 0.0)),
        situation_of(FIELD, FENCE_ENABLE=1, FENCE_TYPE=6, FENCE_RADIUS=60),
        Request(clearance_m=2.0),
    )
    assert found.legs[0].crosses == ("home circle (FENCE_RADIUS 60 m)",)


def test_a_mission_that_drives_nowhere_and_a_missing_fence():
    with pytest.raises(SituationError, match="no leg to check"):
        checked(do(178, 1, 2))
    with pytest.raises(FenceMissingError, match="no fence was uploaded or downloaded"):
        check_mission(mission_of((10.0, 0.0)), Situation())


def test_a_check_can_be_drawn(tmp_path):
    found = checked((30.0, 0.0), (100.0, 60.0))
    picture = tmp_path / "check.svg"
    draw_plan(plan_of(found, situation_of(FIELD, BARN)), picture)
    assert picture.stat().st_size > 5000
    made = plan_of(found, situation_of(FIELD, BARN))
    assert made.path == (HOME, place(30, 0), place(100, 60))
    assert made.length_m == pytest.approx(
        sum(GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)[2] for a, b in pairwise(made.path))
    )


def test_a_circle_zone_is_measured_too():
    pond = CircleZone(OUT, place(50, 0), 8.0)
    found = check_mission(
        mission_of((30.0, 12.0), (70.0, 12.0)), situation_of(FIELD, pond), Request(clearance_m=2.0)
    )
    centre = Point(plane([pond.centre])[0])
    line = LineString(plane([leg.leg.end for leg in found.legs]))
    assert found.legs[1].drawn_clearance_m == pytest.approx(line.distance(centre) - 8, abs=0.12)
    assert found.legs[1].fence == "exclusion circle 1"


def test_reserve_position_error_and_size_count_as_for_plans():
    mission, situation = mission_of((0.0, 0.0), (30.0, 0.0)), situation_of(FIELD, BARN)
    plain = check_mission(mission, situation, Request(clearance_m=1.0))
    more = check_mission(mission, situation, Request(clearance_m=1.0, reserve_m=0.5, position_error_m=0.25))
    wide = check_mission(mission, situation, Request(clearance_m=1.0, footprint=Footprint(3.0, 4.0)))
    assert [found.legs[-1].asked_m for found in (plain, more, wide)] == pytest.approx([1.0, 1.75, 2.5])


def test_the_points_of_a_path_are_found_by_items_also_where_they_are_driven_to_twice():
    delay = do(93, 1.0)
    items = ((0.0, 0.0), delay, (20.0, 0.0), (20.0, -10.0), do(177, 1, 1))
    planned = plan_of(check_mission(mission_of(*items), situation_of(FIELD)), situation_of(FIELD))
    assert planned.seqs == (0, 1, 3, 4, 1, 3, 4)
    assert [planned.path_index(seq) for seq in (1, 3, 4)] == [1, 2, 3]
    assert [planned.path_index(seq, 4) for seq in (1, 3, 4)] == [4, 5, 6]
    # The delay belongs to the place after it.
    assert (planned.path_index(2), planned.path_index(2, 4)) == (2, 5)
    assert planned.path_index(3, 6) == 2  # set back by somebody
    assert planned.path_index(9) == 6


def test_a_boat_drifts_about_the_places_where_it_stops() -> None:
    wait = replace(waypoint(place(20, 0)), params=(60.0, 0.0, 0.0, 0.0))
    rover, boat = (
        checked(wait, (-30, 0), clearance_m=2.0, FRAME_CLASS=frame, LOIT_RADIUS=30.0) for frame in (1.0, 2.0)
    )
    assert rover.holds
    assert [leg.breaks for leg in boat.legs] == [True, True]
    assert boat.legs[0].crosses == ("exclusion polygon 1",)
    assert "a boat (FRAME_CLASS 2) drifts within LOIT_RADIUS 30 m of item 1 for 60 s" in boat.warnings
    assert "the drive model was measured on wheels, not on a boat" in boat.extrapolated


def test_what_was_not_measured_is_said_of_a_check() -> None:
    usual, dijkstra, unknown = (
        check_mission(mission_of((20, 0), (20, -40)), situation, Request(clearance_m=2.0))
        for situation in (
            situation_of(FIELD, BARN),
            situation_of(FIELD, BARN, OA_TYPE=2.0),
            replace(situation_of(FIELD, BARN, WP_SPEED=2.0, WP_RADIUS=4.0), firmware=None),
        )
    )
    assert usual.extrapolated == ()
    assert dijkstra.extrapolated == (
        "OA_TYPE 2: ArduPilot plans its own way around fences and may leave the route; set OA_TYPE 0",
    )
    assert len(unknown.extrapolated) == 1
    assert "firmware unknown" in unknown.extrapolated[0]
    assert "WP_RADIUS 4 m was not measured before ArduPilot 4.6" in unknown.extrapolated[0]
    assert usual.is_promised
    assert dijkstra.holds
    assert not dijkstra.is_promised
    trusting = Request(clearance_m=2.0, trusts_model=True)
    assert check_mission(dijkstra.mission, situation_of(FIELD, BARN, OA_TYPE=2.0), trusting).is_promised
    assert set(dijkstra.extrapolated) <= set(dijkstra.warnings)
