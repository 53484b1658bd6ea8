"""Files as they are met in the field, each standing for its kind: what is read, refused, and said of them."""

from __future__ import annotations

import json
import math
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app, load
from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.mavlink.stored_form import is_same_item
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.wire import item_from_message, item_to_message
from mavlink_bridge.simulator.item_rules import kept_mission_item, mission_item_result
from missions.errors import MissionFormatError
from missions.fence import ZoneKind
from missions.formats import Choices, read_fence, read_mission, read_parameters, read_situation
from missions.geo import LatLon

CASES = Path(__file__).parent / "cases"
PEER = Peer(1, 1, 245, 190)


@pytest.fixture(autouse=True)
def _commands():
    load("convert")


def convert(case: str, tmp_path: Path, *options: str, out: str = "out.plan"):
    return CliRunner().invoke(app, ["convert", str(CASES / case), str(tmp_path / out), *options])


def kinds(path: Path) -> list[str]:
    return [str(zone.kind) for zone in read_fence(path).zones]


# Text files


def test_decimal_commas_are_named(tmp_path):
    result = convert("01-wpl-decimal-commas/m.waypoints", tmp_path)
    assert result.exit_code == 3
    assert "line 2: '48,10000' has a decimal comma" in result.stderr


def test_a_version_that_is_not_known_is_named(tmp_path):
    result = convert("02-wpl-120/m.waypoints", tmp_path)
    assert result.exit_code == 3
    assert "unknown version QGC WPL 120; supported: 110 and 100" in result.stderr


def test_a_second_home_line_before_a_fence_is_passed_over(tmp_path):
    result = convert("08-mp-fence-extra-home/f.waypoints", tmp_path)
    assert result.exit_code == 0
    assert "line 3: second home line skipped" in result.stderr
    assert len(read_fence(tmp_path / "out.plan").zones[0].vertices) == 4


def test_tabs_and_blanks_may_be_mixed():
    assert len(read_mission(CASES / "12-wpl-mixed-tab-space" / "m.waypoints").items) == 1


def test_a_fence_of_points_is_read_under_both_suffixes():
    folder = CASES / "13-fence-txt-latlon"
    assert read_fence(folder / "fence.txt") == read_fence(folder / "fence.fen")


def test_a_rally_list_of_mavproxy():
    rally = read_situation(CASES / "14-rally-txt" / "rally.txt").rally
    assert [tuple(point) for point in rally.value] == [(48.1005, 11.5005, 0.0)]


def test_a_first_line_of_seq_1_is_no_home():
    situation = read_situation(CASES / "76-first-seq-1" / "m.waypoints")
    assert situation.home is None
    assert len(situation.mission.value.items) == 2
    assert situation.mission.value.home is None


@pytest.mark.parametrize("name", ["f.waypoints", "only.waypoints"])
def test_a_circle_around_home_is_named(tmp_path, name):
    result = convert(f"78-fence-5005/{name}", tmp_path)
    assert result.exit_code == 3
    assert (
        "command 5005 is a circle around home, which ArduPilot Rover does not accept as a fence item"
        in result.stderr
    )


def test_parameter_files():
    assert read_parameters(CASES / "50-param-px4-hash" / "mav.parm") == {
        "RO_SPEED_LIM": 1.5,
        "CA_AIRFRAME": 6,
    }
    assert read_parameters(CASES / "51-param-hex" / "a.parm") == {"CAN_D1_UC_ESC_BM": 15, "FENCE_MARGIN": 1}


# Plans


@pytest.mark.parametrize("name", ["a.plan", "b-nofence-version.plan"])
def test_old_and_empty_parts_of_a_plan_are_passed_over(tmp_path, name):
    result = convert(f"03-plan-geofence-v1/{name}", tmp_path)
    assert result.exit_code == 0
    assert result.stderr.count("skipped") == 2
    assert len(read_mission(tmp_path / "out.plan").items) == 1


def test_a_landing_pattern_is_refused_with_the_way_out(tmp_path):
    result = convert("04-plan-fwlanding/a.plan", tmp_path)
    assert result.exit_code == 3
    assert "'fwLandingPattern'" in result.stderr
    assert "upload the plan from QGroundControl" in result.stderr
    assert "pbpp download mission" in result.stderr


def test_a_heading_that_is_not_set_is_0_in_a_waypoints_file(tmp_path):
    assert convert("71-plan-to-waypoints-nan/a.plan", tmp_path, out="m.waypoints").exit_code == 0
    assert "nan" not in (tmp_path / "m.waypoints").read_text().lower()


def test_a_heading_that_is_not_set_reaches_the_vehicle_as_it_takes_it():
    items = read_mission(CASES / "72-plan-null-param4-loiter" / "a.plan").items
    assert all(math.isnan(item.params[3]) for item in items)
    sent = [item_to_message(item, seq, PEER, MissionType.MISSION) for seq, item in enumerate(items, start=1)]
    assert sent[1].param4 == 0
    taken = [mission_item_result(item_from_message(message), 3) for message in sent]
    assert taken == [MissionResult.ACCEPTED] * 2


@pytest.mark.parametrize(
    ("name", "command", "place"),
    [
        ("a.plan", 203, (1, 0)),
        ("mp.waypoints", 203, (1, 0)),
        ("mount300.plan", 205, (300, 0)),
    ],
)
def test_params_5_and_6_without_a_place_are_sent_as_they_are(tmp_path, name, command, place):
    items = read_mission(CASES / "81-digicam-param5" / name).items
    item = next(one for one in items if one.command == command)
    message = item_to_message(item, 1, PEER, MissionType.MISSION)
    assert (message.x, message.y) == place
    for out in ("o.plan", "o.waypoints", "o.geojson", "o.kml"):
        assert convert(f"81-digicam-param5/{name}", tmp_path, out=out).exit_code == 0
        again = next(one for one in read_mission(tmp_path / out).items if one.command == command)
        assert (again.lat_e7, again.lon_e7) == place


@pytest.mark.parametrize(
    "path", sorted((CASES / "73-sim-mower-commands").iterdir()), ids=lambda path: path.name
)
def test_what_mowers_do_is_read_and_taken(path):
    items = read_mission(path).items
    assert [mission_item_result(item, 4) for item in items] == [MissionResult.ACCEPTED] * 3


@pytest.mark.parametrize(
    "path",
    [*sorted((CASES / "73-sim-mower-commands").iterdir()), *sorted((CASES / "81-digicam-param5").iterdir())],
    ids=lambda path: path.name,
)
def test_what_the_vehicle_keeps_of_it_reads_back_as_the_same(path):
    for item in read_mission(path).items:
        assert is_same_item(item, kept_mission_item(item), MissionType.MISSION)


# Maps


@pytest.mark.parametrize(
    "path", sorted((CASES / "30-lone-exclusion-words").iterdir()), ids=lambda path: path.name
)
def test_a_lone_zone_to_keep_out_of_never_becomes_an_inclusion(tmp_path, path):
    result = convert(f"30-lone-exclusion-words/{path.name}", tmp_path)
    if result.exit_code == 0:
        assert kinds(tmp_path / "out.plan") == ["exclusion"]
        return
    assert result.exit_code == 3
    option = result.stderr.partition("add to the command: ")[2].partition(" (or")[0]
    assert convert(f"30-lone-exclusion-words/{path.name}", tmp_path, *shlex.split(option)).exit_code == 0
    assert kinds(tmp_path / "out.plan") == ["exclusion"]


GOOD = {
    "31-geojson-habits/bare-geometry.json": ["inclusion"],
    "31-geojson-habits/crs-4979.geojson": ["inclusion"],
    "31-geojson-habits/crs-epsg-code.geojson": ["inclusion"],
    "31-geojson-habits/osm-fence.geojson": ["inclusion"],
    "31-geojson-habits/qgis-3d-hole.geojson": ["inclusion", "exclusion"],
    "31-geojson-habits/role-exclusion-zone.geojson": ["exclusion"],
    "31-geojson-habits/swapped.geojson": ["inclusion"],
    "31-geojson-habits/geojsonio-poly-and-pin.geojson --ignore-points": ["inclusion"],
    "31-geojson-habits/names-wp1.geojson --ignore-points": ["inclusion"],
    "31-geojson-habits/osm-fence-yes.geojson --role 'polygon 1=inclusion'": ["inclusion"],
    "32-kml-habits/coords-with-spaces.kml": ["inclusion"],
    "32-kml-habits/folders-with-label-pin.kml --ignore-points": ["exclusion", "inclusion"],
    "32-kml-habits/ge-boundary-and-tree.kml --outermost inclusion": ["inclusion", "exclusion"],
    "32-kml-habits/ge-boundary-and-tree.kml --role 'Tree 1=exclusion' --role boundary=inclusion": ["inclusion", "exclusion"],
    "32-kml-habits/ge-one-polygon.kml": ["inclusion"],
    "32-kml-habits/ge-polygon-and-pin.kml --ignore-points": ["inclusion"],
    "32-kml-habits/hidden-second.kml": ["inclusion"],
    "32-kml-habits/latin1.kml": ["inclusion"],
    "32-kml-habits/multigeometry-label-point.kml --ignore-points": ["inclusion"],
    "32-kml-habits/no-namespace.kml": ["inclusion"],
    "32-kml-habits/overlay.kml": ["inclusion"],
    "32-kml-habits/prefixed.kml": ["inclusion"],
}  # fmt: skip


@pytest.mark.parametrize(("command", "wanted"), GOOD.items(), ids=GOOD)
def test_maps_that_are_read(tmp_path, command, wanted):
    case, *options = shlex.split(command)
    result = convert(case, tmp_path, *options)
    assert result.exit_code == 0, result.stderr
    assert kinds(tmp_path / "out.plan") == wanted
    nothing_says = (
        wanted[0] == "inclusion" and "role" not in (CASES / case).read_text() and "--" not in command
    )
    assert ("has no role: used as an inclusion" in result.stderr) >= nothing_says


BAD = {
    "31-geojson-habits/qgis-utm.geojson": ("EPSG::25832", "CRS EPSG:4326"),
    "31-geojson-habits/empty-polygon.geojson": ("features[0].geometry.coordinates: expected rings, found none",),
    "31-geojson-habits/empty.geojson": ("contains no features",),
    "31-geojson-habits/geojsonio-pins-only.geojson": ("point 1, point 2", "--ignore-points"),
    "31-geojson-habits/geojsonio-poly-and-pin.geojson": ("point 1", "--ignore-points"),
    "31-geojson-habits/names-wp1.geojson": ("'WP1'", "--ignore-points"),
    "31-geojson-habits/line-obstacle.geojson": ("a line has no inside", "draw a polygon around it", "--role 'line 1=ignore'"),
    "31-geojson-habits/osm-fence-yes.geojson": (
        "unclear whether polygon 1 is an inclusion or an exclusion (fence 'yes' is not a role)", "--role 'polygon 1=exclusion'", "=inclusion"
    ),
    "31-geojson-habits/strings.geojson": ("features[0].geometry", "without quotation marks"),
    "32-kml-habits/folders-with-label-pin.kml": ("a point cannot be exclusion", "--ignore-points"),
    "32-kml-habits/ge-boundary-and-tree.kml": ("'Boundary'", "'Tree 1'", "--outermost inclusion"),
    "32-kml-habits/ge-polygon-and-pin.kml": ("'Gate'", "--ignore-points"),
    "32-kml-habits/multigeometry-label-point.kml": ("point 'multi'", "--ignore-points"),
    "32-kml-habits/gx-track.kml": ("track 'track' is a recorded track", "--role track=route"),
    "32-kml-habits/shapefile.zip": ("a zipped shapefile",),
}  # fmt: skip


@pytest.mark.parametrize(("case", "words"), BAD.items(), ids=BAD)
def test_maps_that_are_refused_name_what_settles_it(tmp_path, case, words):
    result = convert(case, tmp_path)
    assert result.exit_code == 3
    assert all(word in result.stderr for word in words), result.stderr


def test_a_key_of_openstreetmap_is_skipped_where_the_name_says_the_role(tmp_path):
    ring = json.loads((CASES / "31-geojson-habits" / "osm-fence-yes.geojson").read_text())["features"][0]
    ring["properties"] |= {"name": "No-go pond", "fence": "no"}
    source = tmp_path / "m.geojson"
    source.write_text(json.dumps(ring))
    result = convert(str(source), tmp_path)
    assert result.exit_code == 0, result.stderr
    assert kinds(tmp_path / "out.plan") == ["exclusion"]
    assert "fence 'no' of polygon 'No-go pond' is not a role: skipped" in result.stderr


def test_paths_of_maps(tmp_path):
    assert convert("32-kml-habits/ge-path.kml", tmp_path).exit_code == 0
    assert len(read_mission(tmp_path / "out.plan").items) == 2
    assert convert("32-kml-habits/gx-track.kml", tmp_path, "--role", "track=route").exit_code == 0
    assert [item.position for item in read_mission(tmp_path / "out.plan").items] == [
        LatLon(48.1, 11.5),
        LatLon(48.1, 11.501),
    ]


@pytest.mark.parametrize("name", ["two.kmz", "order.kmz"])
def test_of_two_documents_in_a_kmz_both_are_named(tmp_path, name):
    result = convert(f"32-kml-habits/{name}", tmp_path)
    assert result.exit_code == 0
    assert "only doc.kml is read, not files/a.kml" in result.stderr


def test_hidden_placemarks_are_told_and_can_be_asked_for(tmp_path):
    result = convert("32-kml-habits/hidden-second.kml", tmp_path)
    assert "polygon 'old' is hidden (visibility 0): skipped" in result.stderr
    options = ("--role", "old=exclusion", "--role", "Field=inclusion")
    result = convert("32-kml-habits/hidden-second.kml", tmp_path, *options)
    assert kinds(tmp_path / "out.plan") == ["inclusion", "exclusion"]
    assert "hidden" not in result.stderr


# Other files


@pytest.mark.parametrize(("name", "kind"), [("a.bin", "DataFlash log"), ("a.ulg", "PX4 ULog")])
@pytest.mark.parametrize(
    "command",
    [("convert",), ("log",), ("plan", "--fence"), ("plan", "--target", "1,2", "--log"), ("replay",)],
)
def test_other_logs_are_named(tmp_path, name, kind, command):
    for known in ("plan", "log", "replay"):
        load(known)
    after = [str(tmp_path / "x.plan")] if command == ("convert",) else []
    result = CliRunner().invoke(app, [*command, str(CASES / "80-other-logs" / name), *after])
    assert result.exit_code == 3
    assert kind in result.stderr
    assert ".tlog" in result.stderr or "use --log FILE.bin" in result.stderr


@pytest.mark.parametrize("name", ["p.csv", "r.gpx"])
def test_positions_of_other_programs_are_a_mission(name):
    assert [item.position for item in read_mission(CASES / "80-other-logs" / name).items] == [
        LatLon(48.1, 11.5),
        LatLon(48.101, 11.501),
    ]


# Vehicles, as plans, checks and replays take them


def command(name: str, *words: object):
    load(name)
    return CliRunner().invoke(app, [name, *map(str, words)])


def test_whole_numbers_of_px4_come_bytewise():
    """CA_AIRFRAME 6 and GF_ACTION 2 were read as tiny floats."""
    log = CASES / "20-px4-int-params" / "px4.tlog"
    planned = command("plan", "--log", log, "--target", "48.1008,11.5008")
    assert planned.exit_code == 0, planned.stderr
    assert "FENCE_ENABLE" not in planned.stderr
    assert "CA_AIRFRAME" not in planned.stderr


def test_a_boat_drifts_beside_the_fence():
    folder = CASES / "21-loit-radius-near-fence"
    checked = command(
        "check",
        "--mission", folder / "m.waypoints", "--fence", folder / "f.waypoints", "--vehicle", folder / "boat.parm",
    )  # fmt: skip
    assert checked.exit_code == 8
    assert "a boat (FRAME_CLASS 2) drifts within LOIT_RADIUS 10 m of item 1 for 60 s" in checked.stderr
    assert "crosses inclusion polygon 1" in checked.stdout


def test_planning_of_the_autopilots_own_is_warned_of(tmp_path):
    folder = CASES / "22-dijkstra-and-simple-avoid"
    fence = ("--fence", folder / "f.waypoints", "--vehicle", folder / "v.parm")
    out = tmp_path / "m.waypoints"
    planned = command("plan", *fence, "--start", "48.1005,11.5005", "--target", "48.1008,11.5008", "-o", out)
    assert planned.exit_code == 0, planned.stderr
    checked = command("check", "--mission", out, *fence)
    for result in (planned, checked):
        assert (
            "warning: OA_TYPE 2: ArduPilot plans its own way around fences and may leave the route"
            in result.stderr
        )


def test_a_position_with_longitude_first_is_recognised_by_where_the_fence_is():
    fence = ("--fence", CASES / "22-dijkstra-and-simple-avoid" / "f.waypoints")
    swapped = command("plan", *fence, "--start", "48.1005,11.5005", "--target", "11.5008,48.1008")
    assert swapped.exit_code == 4
    assert "latitude comes first: did you mean 48.1008000,11.5008000?" in swapped.stderr
    far = command("plan", *fence, "--start", "48.1005,11.5005", "--target", "12.5008,58.1008")
    assert "did you mean" not in far.stderr


@pytest.mark.parametrize("log", sorted((CASES / "40-tlog-zero-times").iterdir()), ids=lambda log: log.name)
def test_logs_with_odd_times_are_read_and_what_was_not_seen_is_not_learnt(log):
    assert command("log", log).exit_code == 0
    replayed = command("replay", log)
    assert replayed.exit_code == 0
    assert "learnt: no fence seen, no mission seen" in replayed.stdout
    assert "0 zones" not in replayed.stdout


def test_a_skid_steered_rover_is_not_made_to_pivot_beside_a_fence():
    """On the real autopilot it stood 0.7 m short of such a pivot (tests/missions/ground/test_start_hazard.py has the warning)."""
    folder = CASES / "90-pivot-stall"
    planned = command(
        "plan",
        "--fence", folder / "fence.waypoints", "--vehicle", folder / "skid.parm", "--firmware", "4.6",
        "--start", "52.1000000,9.7000000", "--target", "52.1015367,9.7004038", "--clearance", "2",
    )  # fmt: skip
    assert planned.exit_code == 0, planned.stderr
    assert "at least 2.1 m while driving" in planned.stdout
    assert "turns on the spot" not in planned.stderr


# Start and home of a mission that is repaired or checked


def test_a_mission_starts_at_its_own_home_whatever_the_fence_file_says(tmp_path):
    folder = CASES / "61-two-homes"
    load("plan")
    load("check")
    fence = [
        "--fence",
        str(folder / "f.waypoints"),
        "--vehicle",
        str(folder / "mower.parm"),
        "--clearance",
        "1",
    ]
    mission, out = str(folder / "m.waypoints"), tmp_path / "new.waypoints"
    planned = CliRunner().invoke(app, ["plan", "--via-mission", mission, *fence, "-o", str(out), "--json"])
    assert planned.exit_code == 0, planned.stderr
    home = read_mission(Path(mission)).home
    assert json.loads(planned.stdout)["start"] == list(home)
    assert read_mission(out).home == home
    checked = CliRunner().invoke(app, ["check", "--mission", mission, *fence, "--json"])
    assert json.loads(checked.stdout)["legs"][0]["start"] == list(home)


# Options


@pytest.mark.parametrize(
    ("options", "code", "problem"),
    [
        (("--role", "Tree 1"), 2, "--role 'Tree 1': expected NAME=ROLE"),
        (("--role", "=inclusion"), 2, "expected NAME=ROLE"),
        (("--role", "Tree 1=obstacle"), 2, "where ROLE is one of inclusion, exclusion"),
        (("--outermost", "exclusion"), 2, "--outermost 'exclusion': expected inclusion"),
        (
            ("--role", "Tree=exclusion"),
            3,
            "--role 'Tree': no feature has that name; names in the file: 'Boundary'",
        ),
        (("--role", "Tree 1=home"), 3, "a polygon cannot be home; expected drawing, exclusion, inclusion"),
    ],
)
def test_options_that_cannot_be(tmp_path, options, code, problem):
    result = convert("32-kml-habits/ge-boundary-and-tree.kml", tmp_path, *options)
    assert result.exit_code == code
    assert problem in result.stderr


def test_roles_are_for_maps(tmp_path):
    result = convert("71-plan-to-waypoints-nan/a.plan", tmp_path, "--role", "x=inclusion")
    assert result.exit_code == 3
    assert "--role is for map files" in result.stderr


def test_a_role_may_be_that_of_a_folder(tmp_path):
    case = "32-kml-habits/ge-boundary-and-tree.kml"
    result = convert(case, tmp_path, "--role", "field=exclusion", "--role", "polygon 1=inclusion")
    assert result.exit_code == 0
    assert kinds(tmp_path / "out.plan") == ["inclusion", "exclusion"]


def test_outermost_needs_one_zone_around_all_others(tmp_path):
    ring = [[11.5, 48.1], [11.501, 48.1], [11.501, 48.101], [11.5, 48.1]]
    features = [
        {
            "type": "Feature",
            "properties": {"name": f"N{dx}"},
            "geometry": {"type": "Polygon", "coordinates": [[[x + dx, y] for x, y in ring]]},
        }
        for dx in (0, 0.0005)
    ]
    path = tmp_path / "two.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    result = CliRunner().invoke(
        app, ["convert", str(path), str(tmp_path / "o.plan"), "--outermost", "inclusion"]
    )
    assert result.exit_code == 3
    assert "none of these zones contains all others: polygon 'N0', polygon 'N0.0005'" in result.stderr


@pytest.mark.parametrize(
    ("field", "tree", "wanted"),
    [
        ("inclusion", None, ["inclusion", "exclusion"]),
        (None, "exclusion", ["inclusion", "exclusion"]),
        (None, None, ["inclusion", "exclusion"]),
        ("exclusion", None, ["exclusion", "inclusion"]),
    ],
)
def test_outermost_goes_by_all_zones_that_are_no_exclusions(tmp_path, field, tree, wanted):
    squares = [(11.5, 48.1, 0.001, field), (11.5004, 48.1004, 0.0002, tree)]
    features = [
        {
            "type": "Feature",
            "properties": {"role": role},
            "geometry": {
                "type": "Polygon",
                "coordinates": [[[x, y], [x + w, y], [x + w, y + w], [x, y + w]]],
            },
        }
        for x, y, w, role in squares
    ]
    features.append(
        {"type": "Feature", "properties": {}, "geometry": {"type": "Point", "coordinates": [11.5, 48.1]}}
    )
    path = tmp_path / "two.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    if None in (field, tree):
        with pytest.raises(MissionFormatError, match="unclear what point 1 is") as caught:
            read_situation(path, Choices(outermost_is_inclusion=True))
        assert "polygon" not in str(caught.value)
    situation = read_situation(path, Choices(outermost_is_inclusion=True, ignores_points=True))
    assert [zone.kind for zone in situation.fence.value.zones] == wanted


@pytest.mark.parametrize("radius_m", [3.0, 60.0])
def test_circles_are_sorted_by_outermost_too(tmp_path, radius_m):
    ring = [[11.5, 48.1], [11.501, 48.1], [11.501, 48.101], [11.5, 48.101], [11.5, 48.1]]
    features = [
        {"type": "Feature", "properties": {"radius_m": radius_m}, "geometry": {"type": "Point", "coordinates": [11.5005, 48.1005]}},
        {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}},
    ]  # fmt: skip
    path = tmp_path / "two.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    result = CliRunner().invoke(
        app, ["convert", str(path), str(tmp_path / "o.geojson"), "--outermost", "inclusion"]
    )
    if (
        radius_m > 50
    ):  # it reaches beyond the polygon to the east and west (37 m), and not around its corners (67 m)
        assert result.exit_code == 3
    else:
        assert kinds(tmp_path / "o.geojson") == ["exclusion", "inclusion"]


@pytest.mark.parametrize(
    ("properties", "kind"),
    [
        *[({"name": name}, ZoneKind.EXCLUSION) for name in ("NO-FLY ZONE", "nofly", "Keep off", "Stay away!", "off limits", "Flugverbotszone", "restricted")],
        *[({"name": name}, None) for name in ("Pond", "danger", "Schutzgebiet", "protected area", "no", "no crossing", "Field by the pond", "xyzzy", "Naturschutz", "Area not to mow", "Zone: don't go", "field without me", "Wiese nicht", "Rasen: nicht zu mähen", "never", "lawn, not it")],
        *[({"name": name}, ZoneKind.INCLUSION) for name in ("North field", "Boundary", "A1", "", "Untitled Polygon", "zone 3", "Wiese 2")],
        ({"natural": "water"}, None),
        ({"building": "yes"}, None),
        ({"landuse": "meadow"}, ZoneKind.INCLUSION),
        ({"Type": "Inclusive"}, ZoneKind.INCLUSION),
        ({"Type": "Exclusive"}, ZoneKind.EXCLUSION),
    ],
)  # fmt: skip
def test_words_of_lone_zones(tmp_path, properties, kind):
    ring = [[11.5, 48.1], [11.501, 48.1], [11.501, 48.101], [11.5, 48.1]]
    feature = {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }
    path = tmp_path / "lone.geojson"
    path.write_text(json.dumps(feature))
    if kind is None:
        with pytest.raises(MissionFormatError, match="unclear whether") as caught:
            read_situation(path)
        assert "--role" in str(caught.value.details["advice"])
    else:
        assert kinds(path) == [kind]
