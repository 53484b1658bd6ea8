"""Files as other programs and people write them, by hand after their documentation, habits included."""

from __future__ import annotations

import json
import zipfile
from typing import TYPE_CHECKING

import pytest

from missions.errors import MissionFormatError
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.formats import fen, geojson, kml, qgc_plan, read_fence, read_situation
from missions.geo import LatLon
from missions.items import Command

if TYPE_CHECKING:
    from pathlib import Path

MAVPROXY_FEN = """# return point, then the ring, the first vertex again at its end
-35.363720 149.163651
-35.358738 149.164223
-35.359295\t149.154434
-35.372292 149.157135 # corner by the gate

-35.368290 149.166809
-35.358738 149.164223
"""
FEN_RING = (
    LatLon(-35.358738, 149.164223),
    LatLon(-35.359295, 149.154434),
    LatLon(-35.372292, 149.157135),
    LatLon(-35.368290, 149.166809),
)


@pytest.mark.parametrize("bom", ["", "\ufeff"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_mavproxy_fence_file(tmp_path: Path, bom: str, end: str) -> None:
    path = tmp_path / "field.fen"
    path.write_bytes((bom + MAVPROXY_FEN).replace("\n", end).encode())
    assert read_fence(path) == Fence(
        (PolygonZone(ZoneKind.INCLUSION, FEN_RING),), LatLon(-35.363720, 149.163651)
    )


def test_mavproxy_saves_its_newer_fences_as_waypoints_whatever_the_suffix() -> None:
    text = "QGC WPL 110\r\n" + "".join(
        f"{seq}\t0\t0\t5002\t3.000000\t0.000000\t0.000000\t0.000000\t{lat:.6f}\t149.160000\t0.000000\t0\r\n"
        for seq, lat in enumerate((-35.36, -35.37, -35.38))
    )
    fence = fen.read(text, "field.fen").fence
    assert fence is not None
    assert [zone.kind for zone in fence.value.zones] == [ZoneKind.EXCLUSION]


@pytest.mark.parametrize("closed", [True, False])
def test_a_mission_planner_polygon(tmp_path: Path, closed: bool) -> None:
    path = tmp_path / "field.POLY"
    rows = [f"{p.lat_deg} {p.lon_deg}" for p in (*FEN_RING, *FEN_RING[: 1 if closed else 0])]
    path.write_text("\r\n".join(["#saved by Mission Planner 1.3.82", *rows, ""]))
    assert read_fence(path) == Fence((PolygonZone(ZoneKind.INCLUSION, FEN_RING),))


MISSION_PLANNER_WAYPOINTS = (
    "QGC WPL 110\r\n"
    "0\t1\t0\t0\t0\t0\t0\t0\t0.000000\t0.000000\t0.000000\t1\r\n"
    "1\t0\t3\t16\t0.00000000\t0.00000000\t0.00000000\t0.00000000\t-35.36372000\t149.16365100\t100.000000\t1\r\n"
    "2\t0\t3\t178\t0.00000000\t2.50000000\t0.00000000\t0.00000000\t0.00000000\t0.00000000\t0.000000\t1\r\n"
    "3\t0\t3\t177\t1.00000000\t3.00000000\t0.00000000\t0.00000000\t0.00000000\t0.00000000\t0.000000\t1\r\n"
)


def test_a_mission_planner_waypoint_file(tmp_path: Path) -> None:
    path = tmp_path / "mission.waypoints"
    path.write_bytes(MISSION_PLANNER_WAYPOINTS.encode("utf-8-sig"))
    situation = read_situation(path)
    assert situation.home is None
    assert situation.mission is not None
    first, speed, jump = situation.mission.value.items
    assert (first.lat_e7, first.lon_e7, first.alt_m) == (-353637200, 1491636510, 100)
    assert (speed.command, speed.params[1]) == (Command.DO_CHANGE_SPEED, 2.5)
    assert (jump.command, jump.params[:2]) == (Command.DO_JUMP, (1, 3))


def simple(command: int, jump_id: int, *params: float | None) -> dict[str, object]:
    return {
        "autoContinue": True, "command": command, "doJumpId": jump_id, "frame": 3, "params": list(params), "type": "SimpleItem"
    }  # fmt: skip


SURVEY = {
    "TransectStyleComplexItem": {
        "CameraCalc": {
            "AdjustedFootprintFrontal": 25,
            "CameraName": "Manual (no camera specs)",
            "version": 2,
        },
        "CameraShots": 0,
        "Items": [
            simple(16, 3, 0, 0, 0, None, 47.3984, 8.5450, 0),
            simple(206, 4, 25, 0, 1, 0, 0, 0, 0),
            simple(16, 5, 0, 0, 0, None, 47.3985, 8.5460, 0),
        ],
        "VisualTransectPoints": [[47.3984, 8.5450], [47.3985, 8.5460]],
        "version": 2,
    },
    "angle": 0,
    "complexItemType": "survey",
    "polygon": [[47.3983, 8.5449], [47.3986, 8.5449], [47.3986, 8.5461]],
    "type": "ComplexItem",
    "version": 5,
}


def test_a_qgroundcontrol_survey_is_kept_as_its_own_items_and_jumps_find_their_goals() -> None:
    document = {
        "fileType": "Plan",
        "groundStation": "QGroundControl",
        "mission": {
            "items": [
                simple(16, 1, 0, 0, 0, None, 47.3980, 8.5440, 0),
                simple(178, 20, 1, 2, -1, 0, 0, 0, 0),
                SURVEY,
                simple(177, 6, 5, 2, None, None, None, None, None),
                simple(177, 7, 20, 2, None, None, None, None, None),
            ],
            "plannedHomePosition": [47.3977419, 8.545594, 487.989],
            "version": 2,
        },
        "version": 1,
    }
    mission = qgc_plan.read(json.dumps(document), "f").mission
    assert mission is not None
    items = mission.value.items
    assert [item.command for item in items] == [16, 178, 16, 206, 16, 177, 177]
    assert items[4].position == LatLon(47.3985, 8.5460)
    assert items[5].params[0] == 5  # seq 0 is home: the survey's last waypoint is seq 5
    assert items[6].params[0] == 2


QGIS = """{
"type": "FeatureCollection",
"name": "field",
"crs": { "type": "name", "properties": { "name": "urn:ogc:def:crs:OGC:1.3:CRS84" } },
"features": [
{ "type": "Feature", "properties": { "fid": 1, "fence": "inclusion", "radius": null, "seq": null }, "geometry": { "type": "MultiPolygon", "coordinates": [ [
 [ [ 8.54, 47.39, 400.0 ], [ 8.55, 47.39, 400.0 ], [ 8.55, 47.40, 400.0 ], [ 8.54, 47.39, 400.0 ] ],
 [ [ 8.545, 47.391 ], [ 8.547, 47.391 ], [ 8.547, 47.393 ], [ 8.545, 47.391 ] ] ] ] } },
{ "type": "Feature", "properties": { "fid": 2, "fence": "Exclusion", "radius": 12.5 }, "geometry": { "type": "Point", "coordinates": [ 8.549, 47.392 ] } }
]
}"""


def test_geojson_of_a_map_program_with_a_hole_and_nulls() -> None:
    fence = geojson.read(QGIS, "f").fence
    assert fence is not None
    assert fence.value.zones == (
        PolygonZone(ZoneKind.INCLUSION, (LatLon(47.39, 8.54), LatLon(47.39, 8.55), LatLon(47.40, 8.55))),
        PolygonZone(
            ZoneKind.EXCLUSION, (LatLon(47.391, 8.545), LatLon(47.391, 8.547), LatLon(47.393, 8.547))
        ),
        CircleZone(ZoneKind.EXCLUSION, LatLon(47.392, 8.549), 12.5),
    )


TRIANGLE = {"type": "Polygon", "coordinates": [[[8.0, 47.0], [8.1, 47.0], [8.1, 47.1]]]}


@pytest.mark.parametrize(
    ("properties", "kind"),
    [
        (None, ZoneKind.INCLUSION),
        ({"type": "meadow"}, ZoneKind.INCLUSION),
        ({"role": ""}, ZoneKind.INCLUSION),
        ({"fence": "keep-out"}, ZoneKind.EXCLUSION),
        ({"fence": "Keep_In"}, ZoneKind.INCLUSION),
        ({"Fence": "no go"}, ZoneKind.EXCLUSION),
        ({"fence_type": "exclude"}, ZoneKind.EXCLUSION),
        ({"type": "exclusion"}, ZoneKind.EXCLUSION),
        ({"kind": "exclusion", "type": "barn"}, ZoneKind.EXCLUSION),
        ({"zone": "forbidden"}, ZoneKind.EXCLUSION),
        ({"inclusion": False}, ZoneKind.EXCLUSION),
        ({"inclusion": 1}, ZoneKind.INCLUSION),
        ({"exclusion": "true"}, ZoneKind.EXCLUSION),
        ({"exclusion": True, "fence": "exclusion"}, ZoneKind.EXCLUSION),
        ({"name": "Exclusion 3"}, ZoneKind.EXCLUSION),
        ({"Name": "the old obstacles"}, ZoneKind.EXCLUSION),
        ({"name": "not excluded from anything", "fence": "inclusion"}, ZoneKind.INCLUSION),
        ({"name": "conclusion field"}, ZoneKind.INCLUSION),
        ({"name": 7}, ZoneKind.INCLUSION),
    ],
)
def test_words_for_inclusion_and_exclusion(properties: object, kind: ZoneKind) -> None:
    feature = {"type": "Feature", "properties": properties, "geometry": TRIANGLE}
    fence = geojson.read(json.dumps(feature), "f").fence
    assert fence is not None
    assert [zone.kind for zone in fence.value.zones] == [kind]


def test_a_bare_geometry_and_an_open_ring() -> None:
    fence = geojson.read(json.dumps(TRIANGLE), "f").fence
    assert fence is not None
    assert fence.value.zones == (
        PolygonZone(ZoneKind.INCLUSION, (LatLon(47.0, 8.0), LatLon(47.0, 8.1), LatLon(47.1, 8.1))),
    )


def test_waypoints_without_seq_stand_as_in_the_file_and_drawings_are_left_out() -> None:
    points = [(8.2, {"role": "waypoint"}), (8.1, {"name": "Waypoint 1", "altitude_m": None, "param4": None})]
    features = [
        {
            "type": "Feature",
            "properties": properties,
            "geometry": {"type": "Point", "coordinates": [lon, 47.0]},
        }
        for lon, properties in points
    ]
    features += [
        {"type": "Feature", "properties": {"role": "drawing"}, "geometry": TRIANGLE},
        {"type": "Feature", "properties": {"role": "drawing"}, "geometry": None},
        {"type": "Feature", "properties": {"about": "nothing"}, "geometry": None},
    ]
    situation = geojson.read(json.dumps({"type": "FeatureCollection", "features": features}), "f")
    assert situation.fence is None
    assert situation.mission is not None
    items = situation.mission.value.items
    assert [item.position for item in items] == [LatLon(47.0, 8.2), LatLon(47.0, 8.1)]
    assert [(item.command, item.frame, item.alt_m) for item in items] == [(16, 3, 0.0)] * 2
    assert str(items[1].params[3]) == "nan"


GOOGLE_EARTH = """<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2" xmlns:kml="http://www.opengis.net/kml/2.2">
<Document>
\t<name>Home farm.kml</name>
\t<gx:CascadingStyle kml:id="__managed_style"/>
\t<Folder>
\t\t<name>Keep in</name>
\t\t<Placemark>
\t\t\t<name>North field</name>
\t\t\t<Polygon>
\t\t\t\t<tessellate>1</tessellate>
\t\t\t\t<outerBoundaryIs>
\t\t\t\t\t<LinearRing>
\t\t\t\t\t\t<coordinates>
\t\t\t\t\t\t\t8.54,47.39,0 8.55,47.39,0 8.55,47.40,0 8.54,47.39,0
\t\t\t\t\t\t</coordinates>
\t\t\t\t\t</LinearRing>
\t\t\t\t</outerBoundaryIs>
\t\t\t\t<innerBoundaryIs><LinearRing><coordinates>8.545,47.391 8.547,47.391 8.547,47.393 8.545,47.391</coordinates></LinearRing></innerBoundaryIs>
\t\t\t</Polygon>
\t\t</Placemark>
\t</Folder>
\t<Folder>
\t\t<name>No-go areas</name>
\t\t<Placemark><name>Barn &amp; yard</name><MultiGeometry>
\t\t\t<Polygon><outerBoundaryIs><LinearRing><coordinates>8.5481,47.392 8.5485,47.392 8.5485,47.3925</coordinates></LinearRing></outerBoundaryIs></Polygon>
\t\t</MultiGeometry></Placemark>
\t\t<Placemark><name>Well</name><ExtendedData><SchemaData schemaUrl="#x"><SimpleData name="radius">4</SimpleData></SchemaData></ExtendedData>
\t\t\t<Point><coordinates>8.549,47.394,0</coordinates></Point></Placemark>
\t</Folder>
\t<Placemark><name>Untitled Path</name><LineString><coordinates>8.541,47.3905 8.542,47.391</coordinates></LineString></Placemark>
\t<Placemark><name>home</name><Point><coordinates>8.541,47.3905,0</coordinates></Point></Placemark>
</Document>
</kml>
"""


def test_kml_of_google_earth_by_folders(tmp_path: Path) -> None:
    path = tmp_path / "farm.kml"
    path.write_bytes(GOOGLE_EARTH.replace("\n", "\r\n").encode("utf-8-sig"))
    situation = read_situation(path)
    assert situation.fence is not None
    assert situation.fence.value.zones == (
        PolygonZone(ZoneKind.INCLUSION, (LatLon(47.39, 8.54), LatLon(47.39, 8.55), LatLon(47.40, 8.55))),
        PolygonZone(
            ZoneKind.EXCLUSION, (LatLon(47.391, 8.545), LatLon(47.391, 8.547), LatLon(47.393, 8.547))
        ),
        PolygonZone(
            ZoneKind.EXCLUSION, (LatLon(47.392, 8.5481), LatLon(47.392, 8.5485), LatLon(47.3925, 8.5485))
        ),
        CircleZone(ZoneKind.EXCLUSION, LatLon(47.394, 8.549), 4.0),
    )
    assert situation.mission is not None
    assert [item.position for item in situation.mission.value.items] == [
        LatLon(47.3905, 8.541),
        LatLon(47.391, 8.542),
    ]
    assert situation.home is not None
    assert situation.home.value == LatLon(47.3905, 8.541)


def test_the_innermost_name_of_a_kml_placemark_counts() -> None:
    ring = "<LinearRing><coordinates>8,47 8.1,47 8.1,47.1 8,47</coordinates></LinearRing>"
    text = (
        "<kml><Folder><name>inclusions</name>"
        f"<Placemark>{ring}</Placemark>"
        f"<Placemark><name>obstacle</name>{ring}</Placemark>"
        f'<Placemark><ExtendedData><Data name="role"><value>exclusion</value></Data></ExtendedData>{ring}</Placemark>'
        "</Folder></kml>"
    )
    fence = kml.read(text, "f").fence
    assert fence is not None
    assert [zone.kind for zone in fence.value.zones] == ["inclusion", "exclusion", "exclusion"]


def test_a_zipped_kml_is_read_as_the_kml_in_it(tmp_path: Path) -> None:
    plain, packed = tmp_path / "farm.kml", tmp_path / "farm.KMZ"
    plain.write_text(GOOGLE_EARTH)
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("files/icon.png", b"\x89PNG")
        archive.writestr("doc.kml", GOOGLE_EARTH)
    assert read_fence(packed) == read_fence(plain)


def test_kml_in_the_encoding_that_it_declares(tmp_path: Path) -> None:
    path = tmp_path / "farm.kml"
    text = '<?xml version="1.0" encoding="ISO-8859-1"?>' + GOOGLE_EARTH.partition("?>")[2].replace(
        "Barn", "Bärn"
    )
    path.write_bytes(text.encode("latin-1"))
    assert len(read_fence(path).zones) == 4
    path.write_bytes(text.replace("ISO-8859-1", "unicode_escape").encode("latin-1"))
    with pytest.raises(MissionFormatError, match="the encoding 'unicode_escape' is not supported"):
        read_situation(path)
    path.write_bytes(text.replace("ISO-8859-1", "utf-8").encode("latin-1"))
    with pytest.raises(MissionFormatError, match=r"is not a text file .*expected UTF-8"):
        read_situation(path)


def test_a_pin_in_a_folder_of_drawings_is_left_out() -> None:
    ring = "<LinearRing><coordinates>8,47 8.1,47 8.1,47.1 8,47</coordinates></LinearRing>"
    pin = "<Placemark><name>Gate</name><Point><coordinates>8.05,47.05,450</coordinates></Point></Placemark>"
    text = f"<kml><Placemark>{ring}</Placemark><Folder><name>Drawings</name>{pin}</Folder></kml>"
    situation = kml.read(text, "f")
    assert situation.fence is not None
    assert len(situation.fence.value.zones) == 1
    with pytest.raises(MissionFormatError, match="unclear what point 'Gate' is"):
        kml.read(text.replace("Drawings", "Drawings of the gate"), "f")


def test_geometries_as_map_programs_bundle_them() -> None:
    corners = [[8.0, 47.0, 450.5], [8.1, 47.0, 450.5], [8.1, 47.1, 450.5], [8.0, 47.0, 450.5]]
    line = [[8.01, 47.001], [8.02, 47.002]]
    document = {
        "type": "FeatureCollection",
        "features": [
            {
                "type": "Feature",
                "properties": {"fid": 1},
                "geometry": {
                    "type": "GeometryCollection",
                    "geometries": [{"type": "MultiPolygon", "coordinates": [[corners]]}],
                },
            },
            {
                "type": "Feature",
                "properties": {"fid": 2, "name": None},
                "geometry": {"type": "MultiLineString", "coordinates": [line]},
            },
        ],
    }
    situation = geojson.read(json.dumps(document), "f")
    assert situation.fence is not None
    assert situation.mission is not None
    assert situation.fence.value.zones == (
        PolygonZone(ZoneKind.INCLUSION, (LatLon(47.0, 8.0), LatLon(47.0, 8.1), LatLon(47.1, 8.1))),
    )
    route = [item.position for item in situation.mission.value.items]
    assert route == [LatLon(47.001, 8.01), LatLon(47.002, 8.02)]
    bundle = {"type": "MultiPoint", "coordinates": line}
    points = {"type": "Feature", "properties": {"role": "waypoint"}, "geometry": bundle}
    again = geojson.read(json.dumps(points), "f").mission
    assert again is not None
    assert [item.position for item in again.value.items] == route


@pytest.mark.parametrize("order", ["utf-16-le", "utf-16-be"])
def test_a_file_that_notepad_saved_as_unicode(tmp_path: Path, order: str) -> None:
    path = tmp_path / "field.poly"
    path.write_bytes("\ufeff# field\r\n47.0, 8.0\r\n47.0,8.1\r\n47.1\t8.1\r\n".encode(order))
    assert read_fence(path).zones[0] == PolygonZone(
        ZoneKind.INCLUSION, (LatLon(47.0, 8.0), LatLon(47.0, 8.1), LatLon(47.1, 8.1))
    )
