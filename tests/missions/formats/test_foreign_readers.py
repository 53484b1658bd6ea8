"""Other programs' libraries read what we write, and we read what they write."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
import shapely
from formats.making import SQUARE, known
from pymavlink import mavwp

from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.formats import Part, read_situation, write_fence, write_situation
from missions.geo import LatLon
from missions.items import MissionItem, waypoint
from missions.situation import Mission, Situation

if TYPE_CHECKING:
    from pathlib import Path

HOLE = (LatLon(40.0002, -104.9998), LatLon(40.0002, -104.9996), LatLon(40.0004, -104.9996))
FENCE = Fence(
    (
        PolygonZone(ZoneKind.INCLUSION, SQUARE),
        CircleZone(ZoneKind.EXCLUSION, LatLon(40.0007, -104.9993), 12.25),
        PolygonZone(ZoneKind.EXCLUSION, HOLE),
    ),
    LatLon(40.0001, -104.9999),
)
MISSION = Mission(
    (
        waypoint(LatLon(40.0001234, -104.9991234)),
        MissionItem(178, 2, (1.0, 2.5, 0.0, 0.0)),
        waypoint(LatLon(40.0009, -104.9995)),
    ),
    LatLon(40.0001, -104.9999),
)
SITUATION = Situation(fence=known(FENCE), mission=known(MISSION), home=known(MISSION.home))


def test_pymavlink_reads_our_missions(tmp_path: Path) -> None:
    path = tmp_path / "m.waypoints"
    write_situation(SITUATION, path, Part.MISSION)
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(path)) == 4
    read = [loader.wp(seq) for seq in range(4)]
    assert [(item.command, item.frame) for item in read] == [(16, 0), (16, 3), (178, 2), (16, 3)]
    assert (read[1].x, read[1].y) == (40.0001234, -104.9991234)
    assert read[2].param2 == 2.5


def test_pymavlink_reads_our_fences(tmp_path: Path) -> None:
    path = tmp_path / "f.waypoints"
    write_fence(FENCE, path)
    code = (
        "import json, sys; from pymavlink import mavwp; loader = mavwp.MissionItemProtocol_Fence(); count = loader.load(sys.argv[1]);"
        "items = [loader.wp(seq) for seq in range(count)];"
        "print(json.dumps([[i.command, i.mission_type, i.param1, i.x, i.y] for i in items]))"
    )
    environment = {**os.environ, "MAVLINK20": "1"}  # read when pymavlink is loaded
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True, env=environment
    )
    read = json.loads(done.stdout)
    assert [item[0] for item in read] == [5001] * 4 + [5004] + [5002] * 3 + [5000]
    assert read[4] == [5004, 1, 12.25, 40.0007, -104.9993]


def test_pymavlink_reads_our_fen_files(tmp_path: Path) -> None:
    path = tmp_path / "f.fen"
    write_fence(Fence(FENCE.zones[:1], FENCE.return_point), path)
    loader = mavwp.MAVFenceLoader()
    assert loader.load(str(path)) == 6
    points = [(loader.point(i).lat, loader.point(i).lng) for i in range(6)]
    assert points == [FENCE.return_point, *SQUARE, SQUARE[0]]


def test_we_read_what_pymavlink_writes(tmp_path: Path) -> None:
    """Six decimals of everything, and sevenths lost: 0.11 m at most."""
    ours, theirs = tmp_path / "f.waypoints", tmp_path / "g.waypoints"
    for part in (Part.FENCE, Part.MISSION):
        write_situation(SITUATION, ours, part)
        loader = mavwp.MAVWPLoader()
        loader.load(str(ours))
        loader.save(str(theirs))
        again = read_situation(theirs)
        if part is Part.FENCE:
            assert again.fence is not None
            assert [type(zone) for zone in again.fence.value.zones] == [type(zone) for zone in FENCE.zones]
            assert again.fence.value.zones[1] == FENCE.zones[1]
        else:
            assert again.mission is not None
            assert [item.command for item in again.mission.value.items] == [16, 178, 16]
            assert again.mission.value.items[0].lat_e7 == pytest.approx(400001234, abs=5)


def test_we_read_fen_files_of_pymavlink(tmp_path: Path) -> None:
    loader = mavwp.MAVFenceLoader()
    for point in (FENCE.return_point, *SQUARE, SQUARE[0]):
        loader.add_latlon(*point)
    loader.save(str(tmp_path / "f.fen"))
    again = read_situation(tmp_path / "f.fen").fence
    assert again is not None
    assert again.value == Fence(FENCE.zones[:1], FENCE.return_point)


def test_shapely_reads_our_geojson_and_we_its(tmp_path: Path) -> None:
    path = tmp_path / "f.geojson"
    placed = replace(MISSION, items=(MISSION.items[0], MISSION.items[2]))
    write_situation(
        replace(SITUATION, mission=known(placed)), path
    )  # GEOS knows no feature without a geometry
    geometries = shapely.from_geojson(path.read_text())
    kinds = [geometry.geom_type for geometry in geometries.geoms]
    assert kinds == [
        "Polygon",
        "Point",
        "Polygon",
        "Point",
        "Point",
        "LineString",
        "Point",
        "Point",
    ]
    square = shapely.Polygon([(p.lon_deg, p.lat_deg) for p in SQUARE])
    assert geometries.geoms[0].equals(square)
    assert geometries.geoms[0].exterior.is_ccw
    holed = square.difference(shapely.Polygon([(p.lon_deg, p.lat_deg) for p in HOLE]))
    path.write_text(shapely.to_geojson(holed))
    fence = read_situation(path).fence
    assert fence is not None
    assert [(zone.kind, len(zone.vertices)) for zone in fence.value.zones] == [
        ("inclusion", 4),
        ("exclusion", 3),
    ]


def test_our_plans_are_strict_json(tmp_path: Path) -> None:
    path = tmp_path / "m.plan"
    write_situation(SITUATION, path)
    document = json.loads(path.read_text(), parse_constant=pytest.fail)
    assert document["geoFence"]["breachReturn"][:2] == list(FENCE.return_point)


def test_gpxpy_reads_our_routes(tmp_path: Path) -> None:
    gpxpy = pytest.importorskip("gpxpy")
    path = tmp_path / "m.gpx"
    assert write_situation(SITUATION, path) == (Part.MISSION,)
    gpx = gpxpy.parse(path.read_text())
    assert gpx.version == "1.1"
    assert [(p.latitude, p.longitude) for p in gpx.waypoints] == [MISSION.home]
    (route,) = gpx.routes
    assert [(p.latitude, p.longitude) for p in route.points] == [
        MISSION.items[0].position,
        MISSION.items[2].position,
    ]
    assert [p.name for p in route.points] == ["waypoint 1", "waypoint 3"]


def test_fastkml_reads_our_kml_and_we_its(tmp_path: Path) -> None:
    fastkml = pytest.importorskip("fastkml")
    path = tmp_path / "f.kml"
    write_situation(SITUATION, path)
    (document,) = fastkml.KML.from_string(path.read_text().partition("?>")[2]).features
    fence, mission = document.features
    assert [placemark.name for placemark in fence.features] == [
        "inclusion polygon 1", "exclusion circle 1", "exclusion polygon 1", "return point", "exclusion circle 1, drawn"
    ]  # fmt: skip
    ring = fence.features[0].geometry.exterior.coords
    assert [(lat, lon) for lon, lat, *_ in ring] == [*SQUARE, SQUARE[0]]
    circle = fence.features[4].geometry
    assert len(circle.exterior.coords) == 73
    assert mission.features[1].geometry.geom_type == "LineString"
    path.write_text(fastkml.KML(features=[document]).to_string())
    again = read_situation(path)
    assert again.fence is not None
    assert again.fence.value == FENCE
    assert again.mission is not None
    assert again.mission.value.items[1] == MISSION.items[1]
