"""Files that cannot be used: each ends in one clear error that names the file and the place, and says what was expected."""

from __future__ import annotations

import json
import re
import zipfile
from typing import TYPE_CHECKING, Any

import pytest

from missions.errors import MissionFormatError
from missions.formats import read_situation, write_situation
from missions.situation import Situation

if TYPE_CHECKING:
    from pathlib import Path

RING = [[-105.0, 40.0], [-104.999, 40.0], [-104.999, 40.001], [-105.0, 40.0]]
POLYGON = {"type": "Polygon", "coordinates": [RING]}
POINT = {"type": "Point", "coordinates": [-105.0, 40.0]}
LINE = {"type": "LineString", "coordinates": [[-105.0, 40.0], [-104.9, 40.0]]}


def feature(geometry: Any, **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def collection(*features: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": list(features)}


GEOJSON = [
    ("", "line 1: not JSON"),
    ('{"type": "FeatureCollection",\n"features": [', "line 2: not JSON"),
    ("[]", "type: missing"),
    ({}, "type: missing"),
    ({"type": "Topology"}, "type: 'Topology' is not supported; expected Point, LineString, Polygon, MultiPoint, MultiLineString, MultiPolygon or GeometryCollection"),
    (collection("x"), "features[0].type: missing"),
    ({"type": "FeatureCollection", "features": {}}, "features: expected a list"),
    ({"type": "FeatureCollection"}, "features: missing"),
    (collection(collection()), "features[0].type: 'FeatureCollection'; expected 'Feature'"),
    (collection(feature(POLYGON), feature({"type": "GeometryCollection", "geometries": []})), "features[1].geometry.geometries: expected geometries, found none"),
    (feature({"type": "MultiPoint", "coordinates": []}), "geometry.coordinates: expected parts, found none"),
    (feature({"type": "Circle", "coordinates": []}), "geometry.type: 'Circle' is not supported; expected Point, LineString"),
    (feature({"type": "Polygon"}), "geometry.coordinates: missing"),
    (feature({"type": "Polygon", "coordinates": []}), "geometry.coordinates: expected rings, found none"),
    (feature({"type": "Polygon", "coordinates": RING}), "geometry.coordinates[0][0]: expected [longitude, latitude]"),
    (feature({"type": "Polygon", "coordinates": [RING[:2]]}), "geometry.coordinates[0]: 2 positions; expected at least 3"),
    (feature({"type": "Polygon", "coordinates": [[RING[0], RING[1], RING[0]]]}), "geometry.coordinates[0]: 2 vertices; a polygon needs at least 3"),
    (feature({"type": "MultiPolygon", "coordinates": [[RING], [[[0, 91], *RING]]]}), "geometry.coordinates[1][0][0]: latitude 91° is beyond"),
    (feature({"type": "Polygon", "coordinates": [[[500000.0, 4428000.0], *RING]]}), "geometry.coordinates[0][0]: latitude 4.428e+06° is beyond"),
    (feature({"type": "Polygon", "coordinates": [[["-105", 40.0], *RING]]}), "geometry.coordinates[0][0][0]: expected a number"),
    (feature({"type": "Point", "coordinates": [1]}, role="home"), "geometry.coordinates: expected [longitude, latitude]"),
    (feature({"type": "LineString", "coordinates": [[1, 2]]}), "geometry.coordinates: 1 positions; expected at least 2"),
    (collection(feature(POLYGON, role="keep calm")), "features[0]: role 'keep calm'; expected one of inclusion, exclusion"),
    (collection(feature(POLYGON, fence=True)), "features[0]: fence True; expected one of inclusion, exclusion"),
    (collection(feature(POLYGON, inclusion="perhaps")), "features[0]: inclusion 'perhaps'; expected true or false"),
    (collection(feature(POLYGON, inclusion=True, fence="exclusion")), "features[0]: marked as exclusion and inclusion at once"),
    (collection(feature(POLYGON), feature(POLYGON, fence="exclusion")), "features[0]: unclear whether polygon 1 is an inclusion or an exclusion"),
    (collection(feature(POLYGON, name="keep in, keep out")), "features[0]: the name 'keep in, keep out' could mean exclusion or inclusion"),
    (collection(feature(POLYGON, role="home")), "features[0]: a polygon cannot be home; expected drawing, exclusion, inclusion"),
    (collection(feature(LINE, fence="exclusion")), "features[0]: a line cannot be exclusion; a line has no inside; expected drawing, route"),
    (collection(feature(LINE, name="exclusion")), "features[0]: a line cannot be exclusion; a line has no inside; expected drawing, route"),
    (collection(feature(LINE), feature(LINE)), "features[1]: a second line, line 2; expected one route"),
    (collection(feature(POINT)), "features[0]: unclear what point 1 is"),
    (collection(feature(POINT, fence="exclusion")), "features[0]: a point cannot be exclusion; a circle is a point with a radius"),
    (collection(feature(POINT, radius=0, fence="exclusion")), "features[0]: radius 0; a circle's radius must be positive"),
    (collection(feature(POINT, radius_m="wide", fence="exclusion")), "features[0]: radius_m 'wide'; expected a number"),
    (collection(feature(POINT, radius_m=5, role="home")), "features[0]: a point cannot be home"),
    (collection(feature(POINT, role="home"), feature(POINT, role="home")), "features[1]: a second home; expected one at most"),
    (collection(feature(POINT, role="return point"), feature(POINT, role="return point")), "features[1]: a second return point"),
    (collection(feature({"type": "Polygon", "coordinates": [RING, RING]}, role="exclusion")), "features[0]: an exclusion whose rings cross or touch"),
    (collection(feature(None, role="waypoint")), "features[0]: a waypoint without a position"),
    (collection(feature(None, role="exclusion")), "features[0]: a feature without a geometry cannot be exclusion"),
    (collection(feature(None, role="waypoint", command=16, param5=91)), "features[0]: latitude 91° is beyond"),
    (collection(feature(POINT, role="waypoint", command="go")), "features[0]: command 'go'; expected a number"),
    (collection(feature(POINT, role="waypoint", command=1.5)), "features[0]: command 1.5 is not a whole number"),
    (collection(feature(POINT, role="waypoint", seq=1), feature(POINT, role="waypoint", seq=1)), "features[1]: seq 1 is used twice"),
    (feature(POLYGON) | {"properties": [1]}, "properties: expected an object or null"),
    (collection(feature(POLYGON)) | {"crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::25832"}}}, "crs.properties.name: 'urn:ogc:def:crs:EPSG::25832'; expected longitude and latitude in WGS 84"),
    (collection(feature(POLYGON)) | {"crs": {"type": "link"}}, "crs.properties: missing"),
]  # fmt: skip


@pytest.mark.parametrize(("document", "problem"), GEOJSON)
def test_geojson(tmp_path: Path, document: Any, problem: str) -> None:
    check(tmp_path / "x.geojson", document if isinstance(document, str) else json.dumps(document), problem)


KML_RING = "<LinearRing><coordinates>-105,40 -104.999,40\n-104.999,40.001 -105,40</coordinates></LinearRing>"
KML_POLYGON = f"<Polygon><outerBoundaryIs>{KML_RING}</outerBoundaryIs></Polygon>"


def placemark(inside: str) -> str:
    return f"<kml>\n<Document>\n<Placemark>\n{inside}\n</Placemark>\n</Document>\n</kml>"


def data(name: str, value: str) -> str:
    return f'<ExtendedData><Data name="{name}"><value>{value}</value></Data></ExtendedData>'


KML = [
    ("", "line 1: not XML: no element found"),
    ("<kml>\n<Document></kml>", "line 2: not XML: mismatched tag"),
    ("<kml>&lol;</kml>", "line 1: not XML: undefined entity"),
    ("<gpx/>", "line 1: <gpx>; expected <kml>"),
    ('<!DOCTYPE kml [<!ENTITY lol "lol"><!ENTITY more "&lol;&lol;">]>\n<kml>&more;</kml>', "line 1: a document type (<!DOCTYPE …>) is not supported"),
    ('<?xml version="1.0"?>\n<!DOCTYPE kml SYSTEM "file:///etc/passwd">\n<kml/>', "line 2: a document type (<!DOCTYPE …>) is not supported"),
    ("<kml>" + "<Folder>" * 200 + "</Folder>" * 200 + "</kml>", "line 1: nested more than 100 levels deep"),
    ("<kml>\n<NetworkLink><Link><href>http://example.com/x.kml</href></Link></NetworkLink></kml>", "line 2: a NetworkLink, which is not followed"),
    (placemark("<Model/>"), "line 4: a Model is not supported; expected one of Point, LineString"),
    (placemark("<Polygon/>"), "line 4: 0 outer rings; expected one <outerBoundaryIs><LinearRing>"),
    (placemark(f"<Polygon><outerBoundaryIs>{KML_RING * 2}</outerBoundaryIs></Polygon>"), "line 4: 2 outer rings"),
    (placemark("<LineString></LineString>"), "line 4: a LineString without <coordinates>"),
    (placemark("<LineString><coordinates>1,2</coordinates></LineString>"), "line 4: 1 positions; expected at least 2"),
    (placemark("<LinearRing><coordinates>1,2 3,4 1,2</coordinates></LinearRing>"), "line 4: 2 vertices; a polygon needs at least 3"),
    (placemark("<Point><coordinates></coordinates></Point>"), "line 4: 0 positions; expected at least 1"),
    (placemark("<Point><coordinates>1,2 3,4</coordinates></Point>"), "line 4: 2 positions; a point has one"),
    (placemark("<Point><coordinates>-105</coordinates></Point>"), "line 4: '-105'; expected longitude,latitude"),
    (placemark("<Point><coordinates>-105,40,1,2</coordinates></Point>"), "line 4: '-105,40,1,2'; expected longitude,latitude"),
    (placemark("<Point><coordinates>-10_5,40</coordinates></Point>"), "line 4: '-10_5,40'; expected longitude,latitude"),
    (placemark("<Point><coordinates>40,-105</coordinates></Point>"), "line 4: latitude -105° is beyond ±90°"),
    (placemark("<Point><coordinates>-105,nan</coordinates></Point>"), "line 4: position nan,-105.0 is not a pair"),
    (placemark("<Point><coordinates>-105,40</coordinates></Point>"), "line 4: unclear what point 1 is"),
    (placemark(data("role", "gate") + KML_POLYGON), "line 4: role 'gate'; expected one of inclusion"),
    (placemark("<name>No-go along the road</name><LineString><coordinates>1,2 3,4</coordinates></LineString>"), "line 4: a line cannot be exclusion"),
    (placemark(KML_POLYGON + KML_POLYGON), "line 4: unclear whether polygon 1, polygon 2 are inclusions or exclusions"),
    (placemark("<name>Exclusion</name>"), "line 3: a feature without a geometry cannot be exclusion"),
    (placemark("<name>exclusion</name>" + KML_POLYGON.replace("</outerBoundaryIs>", f"</outerBoundaryIs><innerBoundaryIs>{KML_RING}</innerBoundaryIs>")), "line 4: an exclusion whose rings cross or touch"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "problem"), KML)
def test_kml(tmp_path: Path, text: str, problem: str) -> None:
    check(tmp_path / "x.kml", text, problem)


FEN = [
    ("", "0 points; expected the return point, at least 3 vertices"),
    ("# nothing\n", "0 points; expected the return point"),
    ("40 -105\n40 -105\n40.1 -105\n40 -105\n", "4 points; expected the return point"),
    ("40 -105\n40 -105\n40.1 -105\n40.1 -105.1\n40 -105.1\n", "line 5: the polygon is not closed: expected the point of line 2 again"),
    ("# x\n40;-105\n", "line 2: '40;-105'; expected latitude and longitude in decimal degrees with a space or a comma between"),
    ("40 -105 12\n", "line 1: '40 -105 12'; expected latitude and longitude"),
    ("40\n", "line 1: '40'; expected latitude and longitude"),
    ("forty -105\n", "line 1: 'forty -105'; expected latitude and longitude"),
    ("4_0 -105\n", "line 1: '4_0 -105'; expected latitude and longitude"),
    ("40 -105\n\n-105 40\n", "line 3: latitude -105° is beyond ±90°"),
    ("nan -105\n", "line 1: position nan,-105.0 is not a pair of numbers"),
    ("QGC WPL 110\n0\t0\t0\t5002\t3\n", "line 2: 5 columns; expected 12"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "problem"), FEN)
def test_fen(tmp_path: Path, text: str, problem: str) -> None:
    check(tmp_path / "x.fen", text, problem)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "0 vertices; a polygon needs at least 3"),
        ("40 -105\n40.1 -105\n40 -105\n", "2 vertices; a polygon needs at least 3"),
        ("40 -105\n40.1 200\n", "line 2: longitude 200° is beyond ±180°"),
        ("lat lon\n", "line 1: 'lat lon'; expected latitude and longitude"),
    ],
)
def test_poly(tmp_path: Path, text: str, problem: str) -> None:
    check(tmp_path / "x.poly", text, problem)


def plan(**mission: Any) -> str:
    return json.dumps({"fileType": "Plan", "version": 1, "mission": {"version": 2, "items": []} | mission})


def simple(command: int, jump_id: int | None, *params: Any) -> dict[str, Any]:
    ids = {} if jump_id is None else {"doJumpId": jump_id}
    return {"type": "SimpleItem", "command": command, "frame": 3, "params": list(params), **ids}


WAYPOINT = simple(16, 1, 0, 0, 0, None, 40.0, -105.0, 0)
UNKNOWN_PATTERN = {"type": "ComplexItem", "complexItemType": "StructureScan", "version": 3}


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (json.dumps({"fileType": "Plan", "version": 2}), "version: version 2; expected 1"),
        (plan(version=1), "mission.version: version 1; expected 2"),
        (json.dumps({"fileType": "Plan", "rallyPoints": {"version": 3, "points": []}}), "rallyPoints.version: rallyPoints version 3; expected 2"),
        (plan(items=[UNKNOWN_PATTERN]), "mission.items[0].type: pattern 'StructureScan', which QGroundControl saves without its items"),
        (plan(items=[{"type": "ComplexItem", "TransectStyleComplexItem": {"Items": {}}}]), "mission.items[0].TransectStyleComplexItem.Items: expected a list"),
        (plan(items=[{"type": "ComplexItem", "TransectStyleComplexItem": {"Items": [simple(16, 1, 0)]}}]), "mission.items[0].TransectStyleComplexItem.Items[0].params: 1 params; expected 7"),
        (plan(items=[WAYPOINT, simple(177, 2, 9, 1, 0, 0, 0, 0, 0)]), "mission.items[1].params[0]: expected the doJumpId of exactly one item; 9 belongs to none or several"),
        (plan(items=[WAYPOINT, WAYPOINT, simple(177, 2, 1, 1, 0, 0, 0, 0, 0)]), "mission.items[2].params[0]: expected the doJumpId of exactly one item; 1 belongs to none or several"),
        (plan(items=[WAYPOINT, simple(177, 2, None, 1, 0, 0, 0, 0, 0)]), "mission.items[1].params[0]: expected a number"),
        (plan(items=[simple(16, -1, 0, 0, 0, None, 40.0, -105.0, 0)]), "mission.items[0].doJumpId: doJumpId -1 is not a whole number"),
    ],
)  # fmt: skip
def test_plan(tmp_path: Path, text: str, problem: str) -> None:
    check(tmp_path / "x.plan", text, problem)


HOME = "0\t1\t0\t16\t0\t0\t0\t0\t40\t-105\t0\t1"


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("1\t0\t2\t203\t1\t2\t0\t0\tinf\t0\t0\t1", "line 3: param5 is inf; command 203 has no position"),
        ("1\t0\t3\t16\t0\t0\t0\t0\t4_0\t-105\t0\t1", "line 3: '4_0' is not a number"),
        ("QGC WPL 110", "line 3: 3 columns; expected 12"),
    ],
)  # fmt: skip
def test_waypoints(tmp_path: Path, line: str, problem: str) -> None:
    check(tmp_path / "x.waypoints", f"QGC WPL 110\n{HOME}\n{line}\n", problem)


@pytest.mark.parametrize("suffix", [".plan", ".waypoints", ".fen", ".poly", ".geojson", ".kml", ".parm"])
def test_bytes_that_are_no_text(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"x{suffix}"
    path.write_bytes(b"\x88PNG\r\n\x1a\n")
    with pytest.raises(MissionFormatError, match=r"is not a text file \(byte 0\); expected UTF-8"):
        read_situation(path)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"PK no zip", "is not a readable zip file: File is not a zip file"),
        (None, "contains no .kml"),
    ],
)
def test_kmz(tmp_path: Path, content: bytes | None, problem: str) -> None:
    path = tmp_path / "x.kmz"
    if content is None:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("readme.txt", "nothing")
    else:
        path.write_bytes(content)
    with pytest.raises(MissionFormatError, match=re.escape(problem)):
        read_situation(path)
    with pytest.raises(
        MissionFormatError, match=r"cannot write files with extension '\.kmz'; supported: \.plan"
    ):
        write_situation(Situation(), path)


def test_a_kmz_that_holds_too_much_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("missions.formats.texts.MOST_BYTES", 200)
    path = tmp_path / "x.kmz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("doc.kml", "<kml>" + " " * 1000 + "</kml>", zipfile.ZIP_DEFLATED)
    with pytest.raises(MissionFormatError, match=r"doc\.kml: more than 0 MB, the limit"):
        read_situation(path)


def check(path: Path, text: str, problem: str) -> None:
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MissionFormatError, match="^" + re.escape(f"{path}: {problem}")) as caught:
        read_situation(path)
    assert "\n" not in str(caught.value).replace(str(path), "")
