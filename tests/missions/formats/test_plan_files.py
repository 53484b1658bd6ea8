"""QGroundControl's .plan, by documents written by hand after its documentation (docs.qgroundcontrol.com, "Plan File Format")."""

from __future__ import annotations

import copy
import json
import math
import re
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import fences, wire_lat_lons

from missions.errors import MissionFormatError
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.formats import qgc_plan
from missions.geo import LatLon
from missions.items import MissionItem, waypoint
from missions.rally import RallyPoint
from missions.situation import Known, MadeFor, Mission, Reading, Situation

PLAN: dict[str, Any] = {
    "fileType": "Plan",
    "geoFence": {
        "circles": [
            {"circle": {"center": [47.39756, 8.54557], "radius": 61.64}, "inclusion": False, "version": 1}
        ],
        "polygons": [
            {
                "inclusion": True,
                "polygon": [
                    [47.39807, 8.54373],
                    [47.39837, 8.54689],
                    [47.39627, 8.54703],
                    [47.39631, 8.54380],
                ],
                "version": 1,
            }
        ],
        "breachReturn": [47.397, 8.545, 50],
        "version": 2,
    },
    "groundStation": "QGroundControl",
    "mission": {
        "cruiseSpeed": 15,
        "firmwareType": 3,
        "globalPlanAltitudeMode": 1,
        "hoverSpeed": 5,
        "items": [
            {
                "AMSLAltAboveTerrain": None,
                "Altitude": 50,
                "AltitudeMode": 0,
                "autoContinue": True,
                "command": 16,
                "doJumpId": 1,
                "frame": 3,
                "params": [0, 0, 0, None, 47.39775218, 8.5458765, 50],
                "type": "SimpleItem",
            },
            {
                "autoContinue": True,
                "command": 178,
                "doJumpId": 2,
                "frame": 2,
                "params": [1, 2.5, -1, 0, 0, 0, 0],
                "type": "SimpleItem",
            },
        ],
        "plannedHomePosition": [47.3977419, 8.545594, 487.989],
        "vehicleType": 10,
        "version": 2,
    },
    "rallyPoints": {"points": [[47.39760401, 8.5509154, 50]], "version": 2},
    "version": 1,
}


def read(document: Any) -> Situation:
    return qgc_plan.read(json.dumps(document), "f.plan")


def changed(path: str, value: Any) -> dict[str, Any]:
    """Return the plan with the value at a path like ``mission.items.0.params`` changed."""
    document = copy.deepcopy(PLAN)
    *steps, last = [int(step) if step.isdigit() else step for step in path.split(".")]
    node: Any = document
    for step in steps:
        node = node[step]
    if value is ...:
        del node[last]
    else:
        node[last] = value
    return document


def test_a_plan_as_documented() -> None:
    situation = read(PLAN)
    assert situation.fence is not None
    assert situation.fence.value == Fence(
        (
            PolygonZone(
                ZoneKind.INCLUSION,
                (LatLon(47.39807, 8.54373), LatLon(47.39837, 8.54689), LatLon(47.39627, 8.54703), LatLon(47.39631, 8.5438)),
            ),
            CircleZone(ZoneKind.EXCLUSION, LatLon(47.39756, 8.54557), 61.64),
        ),
        LatLon(47.397, 8.545),
    )  # fmt: skip
    assert situation.mission is not None
    first, second = situation.mission.value.items
    assert (first.command, first.frame, first.lat_e7, first.lon_e7, first.alt_m) == (
        16,
        3,
        473977522,
        85458765,
        50,
    )
    assert math.isnan(first.params[3])
    assert (second.command, second.frame, second.params) == (178, 2, (1, 2.5, -1, 0))
    assert situation.home is not None
    assert situation.home.value == situation.mission.value.home == LatLon(47.3977419, 8.545594)
    assert situation.rally is not None
    assert situation.rally.value == (RallyPoint(47.39760401, 8.5509154, 50.0),)
    assert situation.fence.source == "f.plan"


def test_parts_may_be_missing_or_empty() -> None:
    assert read({"fileType": "Plan"}) == Situation()
    nothing = {
        "fileType": "Plan",
        "mission": {"items": [], "plannedHomePosition": [0, 0, 0]},
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "rallyPoints": {"points": []},
    }
    assert read(nothing) == Situation()
    mission = read(changed("mission.plannedHomePosition", ...)).mission
    assert mission is not None
    assert mission.value.home is None
    item = read(changed("mission.items.0.autoContinue", False)).mission
    assert item is not None
    assert [one.autocontinue for one in item.value.items] == [False, True]
    fence = read(changed("geoFence.breachReturn", ...)).fence
    assert fence is not None
    assert fence.value.return_point is None


def test_null_places_are_0() -> None:
    mission = read(changed("mission.items.1.params", [None] * 7)).mission
    assert mission is not None
    item = mission.value.items[1]
    assert (item.lat_e7, item.lon_e7, item.alt_m) == (0, 0, 0)
    assert all(math.isnan(param) for param in item.params)


def test_params_5_and_6_of_commands_without_a_place_may_be_anything_that_fits() -> None:
    mission = read(changed("mission.items.1.params", [0, 0, 0, 0, 120.5, 200, 0])).mission
    assert mission is not None
    assert (mission.value.items[1].lat_e7, mission.value.items[1].lon_e7) == (0, 200)


@given(fences, st.lists(wire_lat_lons.map(lambda place: RallyPoint(*place, 12.0)), max_size=3).map(tuple))
def test_fences_and_rally_points_round_trip(fence: Fence, rally: tuple[RallyPoint, ...]) -> None:
    text = qgc_plan.write(Situation(fence=Known(fence, None, ""), rally=Known(rally, None, "")))
    again = qgc_plan.read(text, "f")
    if fence.zones:
        assert again.fence is not None
        # a plan lists polygons before circles
        assert sorted(again.fence.value.zones, key=repr) == sorted(fence.zones, key=repr)
        assert again.fence.value.return_point == fence.return_point
    else:
        assert again.fence is None
    assert (again.rally.value if again.rally else ()) == rally


@given(
    st.lists(
        st.builds(
            MissionItem,
            command=st.sampled_from([16, 17, 19, 93, 178]),
            frame=st.sampled_from([0, 2, 3, 10]),
            params=st.tuples(*[st.floats(-1e6, 1e6)] * 4),
            lat_e7=st.integers(-900_000_000, 900_000_000),
            lon_e7=st.integers(-1_800_000_000, 1_800_000_000),
            alt_m=st.floats(-100, 100),
            autocontinue=st.booleans(),
        ),
        min_size=1,
        max_size=5,
    ).map(tuple),
    wire_lat_lons.filter(any),
)
def test_missions_round_trip(items: tuple[MissionItem, ...], home: LatLon) -> None:
    again = qgc_plan.read(qgc_plan.write(Situation(mission=Known(Mission(items, home), None, ""))), "f")
    assert again.mission is not None
    assert again.mission.value == Mission(items, home)


@pytest.mark.parametrize(
    ("on_the_wire", "in_the_file"), [(0, 0), (2, 2), (3, 3), (5, 0), (6, 3), (10, 10), (11, 10), (77, 77)]
)
def test_frames_are_written_as_qgroundcontrol_writes_them(on_the_wire: int, in_the_file: int) -> None:
    items = (MissionItem(16, on_the_wire, lat_e7=1),)
    document = json.loads(qgc_plan.write(Situation(mission=Known(Mission(items), None, ""))))
    assert document["mission"]["items"][0]["frame"] == in_the_file


def test_a_written_plan_has_what_qgroundcontrol_asks_for() -> None:
    item = MissionItem(16, params=(0, 0, 0, math.nan), lat_e7=473977522, lon_e7=85458765)
    home = Known(LatLon(47.3977419, 8.545594), None, "")
    text = qgc_plan.write(
        Situation(mission=Known(Mission((item, waypoint(LatLon(1, 2)))), None, ""), home=home)
    )
    document = json.loads(text, parse_constant=pytest.fail)
    assert document["fileType"] == "Plan"
    assert document["version"] == 1
    mission = document["mission"]
    assert {key: mission[key] for key in ("version", "firmwareType", "vehicleType")} == {
        "version": 2, "firmwareType": 3, "vehicleType": 10
    }  # fmt: skip
    assert mission["plannedHomePosition"] == [47.3977419, 8.545594, 0]
    assert mission["items"][0] == {
        "type": "SimpleItem", "autoContinue": True, "command": 16, "doJumpId": 1, "frame": 3,
        "params": [0, 0, 0, None, 47.3977522, 8.5458765, 0],
    }  # fmt: skip
    assert mission["items"][1]["doJumpId"] == 2
    assert document["geoFence"] == {"version": 2, "polygons": [], "circles": []}
    assert document["rallyPoints"] == {"version": 2, "points": []}


@pytest.mark.parametrize(
    ("parameters", "speed_mps"),
    [({}, 2.0), ({"RO_SPEED_LIM": 3.0}, 3.0), ({"RA_MISS_VEL_DEF": 1.0, "RO_SPEED_LIM": 3.0}, 1.0), ({"RO_SPEED_LIM": -1.0}, 2.0), ({"CRUISE_SPEED": 3.0}, 3.0), ({"WP_SPEED": 1.5, "CRUISE_SPEED": 3.0}, 1.5), ({"WP_SPEED": 0.0, "CRUISE_SPEED": 3.0}, 3.0)],
)  # fmt: skip
def test_cruise_speed_is_the_vehicles(parameters: dict[str, float], speed_mps: float) -> None:
    assert json.loads(qgc_plan.write(Situation(parameters=parameters)))["mission"]["cruiseSpeed"] == speed_mps


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan])
def test_numbers_json_has_not_are_null(value: float) -> None:
    text = qgc_plan.write(
        Situation(mission=Known(Mission((MissionItem(16, params=(value, 0, 0, 0), lat_e7=1),)), None, ""))
    )
    assert json.loads(text, parse_constant=pytest.fail)["mission"]["items"][0]["params"][0] is None


@pytest.mark.parametrize(
    ("document", "problem"),
    [
        ([], 'top level: expected a QGroundControl plan ("fileType": "Plan")'),
        ({}, "top level: expected a QGroundControl plan"),
        (changed("fileType", "Mission"), "top level: expected a QGroundControl plan"),
        (changed("mission", 7), "mission.items: missing"),
        (changed("mission.items", {}), "mission.items: expected a list"),
        (changed("mission.items", ...), "mission.items: missing"),
        (changed("mission.items.0", "x"), "mission.items[0].type: missing"),
        (changed("mission.items.0.type", "ComplexItem"), "mission.items[0].type: pattern 'ComplexItem', which QGroundControl saves without its items"),
        (changed("mission.items.0.params", [1, 2]), "mission.items[0].params: 2 params; expected 7"),
        (changed("mission.items.0.params.1", "x"), "mission.items[0].params[1]: expected a number"),
        (changed("mission.items.0.params.4", 91), "mission.items[0].params: latitude 91° is beyond"),
        (changed("mission.items.0.params.5", 1e999), "mission.items[0].params: position 47.39775218,inf is not"),
        (changed("mission.items.0.params.0", 10**400), "mission.items[0].params[0]: expected a number of less"),
        (changed("mission.items.0.command", "16"), "mission.items[0].command: expected a number"),
        (changed("mission.items.0.command", True), "mission.items[0].command: expected a number"),
        (changed("mission.items.0.command", 1e999), "mission.items[0].command: command inf is not a whole number"),
        (changed("mission.items.0.frame", 3.5), "mission.items[0].frame: frame 3.5 is not a whole number"),
        (changed("mission.items.0.frame", ...), "mission.items[0].frame: missing"),
        (changed("mission.plannedHomePosition", [1]), "mission.plannedHomePosition: expected [latitude, longitude]"),
        (changed("mission.plannedHomePosition", "home"), "mission.plannedHomePosition: expected [latitude, longitude]"),
        (changed("mission.plannedHomePosition.0", None), "mission.plannedHomePosition[0]: expected a number"),
        (changed("geoFence.version", 3), "geoFence.version: geoFence version 3; expected 2"),
        (changed("geoFence.version", ...), "geoFence.version: missing"),
        (changed("geoFence", [1]), "geoFence: expected an object"),
        (changed("geoFence.polygons.0.polygon", [[1, 2], [3, 4]]), "geoFence.polygons[0].polygon: 2 vertices; a polygon needs"),
        (changed("geoFence.polygons.0.polygon.2", [1, "x"]), "geoFence.polygons[0].polygon[2][1]: expected a number"),
        (changed("geoFence.polygons.0.polygon.1", [91, 8]), "geoFence.polygons[0].polygon[1]: latitude 91° is beyond"),
        (changed("geoFence.polygons.0.polygon.1", [math.nan, 8]), "geoFence.polygons[0].polygon[1]: position nan,8"),
        (changed("geoFence.polygons.0.inclusion", 1), "geoFence.polygons[0].inclusion: expected true or false"),
        (changed("geoFence.circles.0.circle.radius", 0), "geoFence.circles[0].circle.radius: 0; a circle's radius"),
        (changed("geoFence.circles.0.circle.radius", math.nan), "geoFence.circles[0].circle.radius: nan; a circle's"),
        (changed("geoFence.circles.0.circle.center", ...), "geoFence.circles[0].circle.center: missing"),
        (changed("rallyPoints.points.0", [1]), "rallyPoints.points[0]: expected [latitude, longitude]"),
    ],
)  # fmt: skip
def test_unusable_plans_name_the_place(document: Any, problem: str) -> None:
    with pytest.raises(MissionFormatError, match="^" + re.escape(f"f.plan: {problem}")):
        read(document)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "line 1: not JSON"),
        ('{"fileType": "Plan",\n"mission": {', "line 2: not JSON"),
        ("[" * 100_000, "not JSON: nested too deeply"),
        ('{"fileType": ' + "1" * 5000 + "}", "not JSON: "),
    ],
)
def test_text_that_is_not_json(text: str, problem: str) -> None:
    with pytest.raises(MissionFormatError, match=rf"^f: {problem}"):
        qgc_plan.read(text, "f")


@pytest.mark.parametrize(
    ("firmware", "vehicle", "made_for"),
    [
        (3, 10, MadeFor("f.plan", True, 10)),
        (12, 11, MadeFor("f.plan", False, 11)),
        (0, 10, MadeFor("f.plan", None, 10)),
        (..., 10, MadeFor("f.plan", None, 10)),
        (12, ..., MadeFor("f.plan", False, None)),
        (12, None, MadeFor("f.plan", False, None)),
        (..., ..., None),
    ],
)
def test_a_plan_says_for_which_vehicle_it_is_made(
    firmware: Any, vehicle: Any, made_for: MadeFor | None
) -> None:
    document = changed("mission.firmwareType", firmware)
    if vehicle is ...:
        del document["mission"]["vehicleType"]
    else:
        document["mission"]["vehicleType"] = vehicle
    found = read(document)
    assert found.reading.made_for == made_for
    assert found.ardupilot is None  # that is a vehicle's word, not a file's
    assert found.remarks == ()
    again = json.loads(qgc_plan.write(found))["mission"]
    is_px4, is_boat = firmware == 12, vehicle == 11
    assert (again["firmwareType"], again["vehicleType"]) == (12 if is_px4 else 3, 11 if is_boat else 10)


def test_a_mission_that_is_no_rovers_is_said() -> None:
    assert read(changed("mission.vehicleType", 2)).remarks == (
        "f.plan is made for vehicle type 2 (vehicleType), not for a rover (10): its mission is read as a rover's",
    )
    document = changed("mission.vehicleType", 2)
    document["mission"]["items"] = []  # a fence is a fence
    assert read(document).remarks == ()


@pytest.mark.parametrize("key", ["firmwareType", "vehicleType"])
@pytest.mark.parametrize("value", ["PX4", 1.5, -1, 300, True])
def test_what_is_no_autopilot_or_vehicle_is_refused(key: str, value: Any) -> None:
    with pytest.raises(MissionFormatError, match=f"f.plan: mission.{key}: "):
        read(changed(f"mission.{key}", value))


@pytest.mark.parametrize(
    ("situation", "firmware"),
    [
        (Situation(), 3),
        (Situation(ardupilot=False), 12),
        (Situation(ardupilot=True, parameters={"RO_SPEED_LIM": 3.0}), 3),
        (Situation(parameters={"RO_SPEED_LIM": 3.0}), 12),
        (Situation(parameters={"WP_SPEED": 3.0}, reading=Reading(made_for=MadeFor("f.plan", False))), 3),
    ],
)
def test_a_plan_is_written_for_the_vehicle(situation: Situation, firmware: int) -> None:
    assert json.loads(qgc_plan.write(situation))["mission"]["firmwareType"] == firmware


def test_items_as_qgroundcontrol_wrote_them_in_2016_are_read_as_it_reads_them():
    """Its place stands beside four parameters (`MissionItem::_convertJsonV2ToV3`)."""
    plan = copy.deepcopy(PLAN)
    plan["mission"]["items"] = [
        {
            "type": "SimpleItem",
            "autoContinue": True,
            "command": 16,
            "frame": 3,
            "params": [1, 0, 0, None],
            "coordinate": [47.5, -122.25, 20],
        }
    ]
    (item,) = qgc_plan.read(json.dumps(plan), "f").mission.value.items
    assert (item.lat_e7, item.lon_e7, item.alt_m, item.params[0]) == (475_000_000, -1_222_500_000, 20.0, 1.0)
    assert math.isnan(item.params[3])
    plan["mission"]["items"][0]["coordinate"] = [47.5, -122.25]
    with pytest.raises(MissionFormatError, match="6 params; expected 7"):
        qgc_plan.read(json.dumps(plan), "f")
