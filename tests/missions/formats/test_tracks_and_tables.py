"""GPX, tables of positions, shapefiles and GeoPackages; old lists of MAVProxy; exclusions with holes."""

from __future__ import annotations

import json
import random
import re
import sys
import types
import warnings
import zipfile
from contextlib import nullcontext
from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from pymavlink import mavwp
from shapely import LineString, MultiPolygon, Point, Polygon, box, union_all

from missions.errors import MissionFormatError
from missions.fence import CircleZone, PolygonZone, ZoneKind
from missions.formats import (
    Choices,
    geojson,
    gpx,
    kml,
    read_mission,
    read_situation,
    waypoints,
    write_situation,
)
from missions.formats.features import Role
from missions.geo import LatLon
from missions.items import Command, MissionItem, waypoint
from missions.situation import Known, Mission, Situation

if TYPE_CHECKING:
    from pathlib import Path

A, B, C = LatLon(48.1, 11.5), LatLon(48.101, 11.501), LatLon(48.102, 11.5)


def gpx_of(*parts: str) -> str:
    return f'<?xml version="1.0"?><gpx version="1.1" xmlns="http://www.topografix.com/GPX/1/1">{"".join(parts)}</gpx>'


def points(tag: str, *places: LatLon, name: str = "") -> str:
    inside = f"<ele>512</ele><name>{name}</name>"
    return "".join(f'<{tag} lat="{place.lat_deg}" lon="{place.lon_deg}">{inside}</{tag}>' for place in places)


def places_of(situation: Situation) -> list[LatLon]:
    return [item.position for item in situation.mission.value.items]


def test_the_one_route_of_a_gpx_file_is_the_mission():
    text = gpx_of(points("wpt", C, name="Home"), f"<rte><name>r</name>{points('rtept', A, B)}</rte>")
    situation = gpx.read(text, "f")
    assert places_of(situation) == [A, B]
    assert situation.home.value == C
    assert situation.remarks == ()


def test_a_route_of_one_waypoint_is_read_as_it_is_written():
    one = Situation(mission=Known(Mission((waypoint(A),), C), None, "f"))
    found = gpx.read(gpx.write(one), "f")
    assert (places_of(found), found.home.value) == ([A], C)


def test_tracks_of_one_position_hinder_nothing():
    """As receivers write them where they are switched on and off."""
    lone = f"<trk><name>ACTIVE LOG 003</name><trkseg>{points('trkpt', C)}</trkseg></trk>"
    assert places_of(gpx.read(gpx_of(f"<rte>{points('rtept', A, B)}</rte>", lone), "f")) == [A, B]
    drive = f"<trk><trkseg>{points('trkpt', A, B)}</trkseg><trkseg>{points('trkpt', C)}</trkseg></trk>"
    assert places_of(gpx.read(gpx_of(lone, drive), "f")) == [A, B]


def test_times_without_a_place_hinder_nothing_in_a_track():
    """`gx:Track` has an empty `gx:coord` for each; OpenTracks writes them."""
    coords = "".join(f"<coord>{text}</coord>" for text in ("", "11.5 48.1 500", " ", "11.501 48.101 500"))
    text = f"<kml><Placemark><name>t</name><Track>{coords}</Track></Placemark></kml>"
    assert places_of(kml.read(text, "f", Choices(roles={"t": Role.ROUTE}))) == [A, B]


def test_a_lone_track_is_taken_for_the_route_and_it_is_said():
    text = gpx_of(f"<trk><name>t</name><trkseg>{points('trkpt', A, B, C)}</trkseg></trk>")
    situation = gpx.read(text, "f")
    assert places_of(situation) == [A, B, C]
    assert situation.remarks == ("f: the recorded track is used as the route",)


def test_way_points_alone_are_the_mission_and_it_is_said():
    situation = gpx.read(gpx_of(points("wpt", A, B, name="x")), "f")
    assert places_of(situation) == [A, B]
    assert situation.remarks == ("f: 2 waypoints are used as the mission, in file order",)


def test_pins_beside_a_route_are_asked_for():
    text = gpx_of(points("wpt", C, name="Gate"), f"<rte>{points('rtept', A, B)}</rte>")
    with pytest.raises(MissionFormatError, match="unclear what point 'Gate' is"):
        gpx.read(text, "f")
    assert places_of(gpx.read(text, "f", Choices(ignores_points=True))) == [A, B]


def test_of_several_tracks_one_is_chosen():
    track = "<trk><name>{}</name><trkseg>{}</trkseg></trk>"
    text = gpx_of(track.format("one", points("trkpt", A, B)), track.format("two", points("trkpt", B, C)))
    with pytest.raises(MissionFormatError, match="track 'one' is a recorded track, not a planned route"):
        gpx.read(text, "f")
    chosen = Choices({"Two": Role.ROUTE, "one": Role.DRAWING})
    assert places_of(gpx.read(text, "f", chosen)) == [B, C]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<kml/>", "f: line 1: <kml>; expected <gpx>"),
        (gpx_of(), "f: contains no features"),
        (gpx_of('<wpt lat="north" lon="2"/>'), "f: line 1: 'north' is not a number; expected lat and lon"),
        (gpx_of('<wpt lat="48,1" lon="2"/>'), "f: line 1: '48,1' has a decimal comma"),
        (gpx_of('<wpt lon="2"/>'), "f: line 1: '' is not a number"),
        (gpx_of('<wpt lat="91" lon="2"/>'), "f: line 1: latitude 91° is beyond"),
        (gpx_of(f"<trk><trkseg>{points('trkpt', A)}</trkseg></trk>"), "f: contains no features"),
    ],
)
def test_gpx_that_is_none(text, problem):
    with pytest.raises(MissionFormatError, match=re.escape(problem)):
        gpx.read(text, "f")


@pytest.mark.parametrize("suffix", [".gpx", ".csv"])
@given(st.lists(st.integers(-800_000_000, 800_000_000).filter(bool), min_size=2, max_size=6))
def test_routes_come_back(tmp_path_factory, suffix, values_e7):
    items = tuple(waypoint(LatLon(value / 1e7, value / 5e6)) for value in values_e7)
    path = tmp_path_factory.mktemp("routes") / f"x{suffix}"
    write_situation(Situation(mission=Known(Mission(items), None, "")), path)
    assert [item.position for item in read_mission(path).items] == [item.position for item in items]


# Tables


@pytest.mark.parametrize(
    "text",
    [
        "lat,lon\n48.1,11.5\n48.101,11.501\n",
        "name;Longitude;Latitude\na;11.5;48.1\nb;11.501;48.101\n",
        '\ufeff"LAT"\t"LNG"\r\n48.1\t11.5\r\n\r\n48.101\t11.501\r\n',
    ],
)
def test_positions_of_a_table(tmp_path, text):
    path = tmp_path / "p.csv"
    path.write_bytes(text.encode())
    assert [item.position for item in read_mission(path).items] == [A, B]


def test_roles_and_circles_of_a_table(tmp_path):
    path = tmp_path / "p.csv"
    path.write_text("lat,lon,role,radius_m\n48.1,11.5,home,\n48.101,11.501,exclusion,4\n48.102,11.5,,\n")
    situation = read_situation(path)
    assert situation.home.value == A
    assert situation.fence.value.zones == (CircleZone(ZoneKind.EXCLUSION, B, 4.0),)
    assert places_of(situation) == [C]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "the file is empty"),
        ("48.1,11.5\n", "line 1: 0 columns named lat or latitude; the first line names the columns"),
        ("lat,lat,lon\n1,2,3\n", "line 1: 2 columns named lat or latitude"),
        ("lat,lon\n1\n", "line 2: 1 columns; expected 2"),
        ("lat;lon\n48,1;11,5\n", "line 2: '48,1' has a decimal comma"),
        ("lat,lon\nx,11\n", "line 2: 'x' is not a number; expected decimal degrees"),
        ("lat,lon\n149.1,-35.3\n", "line 2: latitude 149.1° is beyond ±90°; expected latitude and longitude as line 1 names them: are they swapped?"),
        ('lat,lon\n"1,2', "line 2: 1 columns; expected 2"),
    ],
)  # fmt: skip
def test_tables_that_are_none(tmp_path, text, problem):
    path = tmp_path / "p.csv"
    path.write_text(text)
    with pytest.raises(MissionFormatError, match=re.escape(problem)):
        read_situation(path)


# Old lists


def test_version_100_is_read_as_pymavlink_reads_it(tmp_path):
    path = tmp_path / "old.txt"
    rows = [
        "0 0 25 0 0 0 0 1 11.5 48.1 0 0 1",
        "1 3 25 3 4 1 2 0 11.501 48.101 5 0 1",
        "2 3 27 0 30 0 0 0 11.5 48.102 5 0 0",
    ]
    path.write_text("\n".join(["QGC WPL 100", *rows, ""]))
    loader = mavwp.MAVWPLoader()
    loader.load(str(path))
    situation = read_situation(path)
    theirs = [loader.wp(i) for i in range(1, loader.count())]
    for item, their in zip(situation.mission.value.items, theirs, strict=True):
        assert (item.command, item.frame, item.params) == (
            their.command, their.frame, (their.param1, their.param2, their.param3, their.param4)
        )  # fmt: skip
        assert item.position == LatLon(their.x, their.y)
        assert item.autocontinue == bool(their.autocontinue)
    assert situation.home.value == LatLon(loader.wp(0).x, loader.wp(0).y)
    path.write_text("QGC WPL 100\n0 0 99 0 0 0 0 1 11.5 48.1 0 0 1\n")
    with pytest.raises(MissionFormatError, match="line 2: action 99 of QGC WPL 100; supported: 2, 3, 4"):
        read_situation(path)


def test_rally_lines_are_read_as_pymavlink_reads_them(tmp_path):
    path = tmp_path / "rally.txt"
    path.write_text("RALLY 48.1\t11.5\t12.0\t40.0\t90.0\t1\n# x\nRALLY 48.101 11.501 0 40 0 0\n")
    loader = mavwp.MAVRallyLoader()
    loader.load(str(path))
    theirs = [(p.lat / 1e7, p.lng / 1e7, p.alt) for p in (loader.rally_point(i) for i in range(2))]
    assert [tuple(point) for point in read_situation(path).rally.value] == theirs
    for line in (
        "RALLY 48.1 11.5",
        "48.1 11.5",
        "RALLY a b c d e f",
        "RALLY 91 0 0 0 0 0",
        "RALLY 1 2 nan 0 0 0",
    ):
        path.write_text(f"RALLY 48.1 11.5 0 0 0 0\n{line}\n")
        with pytest.raises(MissionFormatError, match=r"rally\.txt: line 2: "):
            read_situation(path)


# How lines are numbered


def wpl(*rows: tuple[int, int]) -> str:
    return "QGC WPL 110\n" + "".join(
        f"{seq}\t0\t3\t{command}\t1\t0\t0\t0\t48.10{line}\t11.5\t0\t1\n" if command == 16 else f"{seq}\t0\t3\t{command}\t1\t0\t0\t0\t0\t0\t0\t1\n"
        for line, (seq, command) in enumerate(rows)
    )  # fmt: skip


def test_gaps_are_said_and_refused_where_a_jump_goes_by_number():
    situation = waypoints.read(wpl((0, 16), (1, 16), (3, 16)), "f")
    assert len(situation.mission.value.items) == 2
    assert situation.remarks == ("f: line 4: seq 3 follows seq 1: items are read in line order",)
    with pytest.raises(
        MissionFormatError, match="line 4: seq 3 follows seq 1, but line 5 jumps to an item by its seq"
    ):
        waypoints.read(wpl((0, 16), (1, 16), (3, 16), (4, 177)), "f")
    with pytest.raises(MissionFormatError, match=r"line 2: seq 7; expected seq 0 \(home\) or 1"):
        waypoints.read(wpl((7, 16), (8, 16)), "f")


def test_jumps_of_a_list_without_home_keep_their_numbers():
    situation = waypoints.read(wpl((1, 16), (2, 16), (3, 177)), "f")
    assert situation.home is None
    assert [item.command for item in situation.mission.value.items] == [16, 16, Command.DO_JUMP]
    assert situation.mission.value.items[2].params[0] == 1


# Exclusions with holes


def fence_of(feature: dict[str, object]) -> list[PolygonZone]:
    return list(geojson.read(json.dumps(feature), "f").fence.value.zones)


@given(st.integers(0, 10**6), st.sampled_from([0.0, 11.5, 179.9995, -180.0]))
def test_an_exclusion_with_holes_is_cut_into_zones_that_cover_the_same(seed, west):
    chance = random.Random(seed)
    holes = []
    for column in range(chance.randint(1, 3)):
        x, y = 10 + 30 * column + chance.randint(0, 5), chance.randint(10, 60)
        holes.append(box(x, y, x + chance.randint(2, 15), y + chance.randint(2, 25)))
    drawn = box(0, 0, 100, 100).difference(union_all(holes))

    def ring(coords):
        return [[(west + x * 1e-5 + 180) % 360 - 180, 48.1 + y * 1e-5] for x, y in coords]

    geometry = {
        "type": "Polygon",
        "coordinates": [ring(drawn.exterior.coords), *(ring(r.coords) for r in drawn.interiors)],
    }
    zones = fence_of({"type": "Feature", "properties": {"role": "exclusion"}, "geometry": geometry})
    assert {zone.kind for zone in zones} == {ZoneKind.EXCLUSION}
    rounded = [
        Polygon(
            [
                (round(((p.lon_deg - west + 180) % 360 - 180) * 1e7), round((p.lat_deg - 48.1) * 1e7))
                for p in zone.vertices
            ]
        )
        for zone in zones
    ]
    whole = union_all(
        [
            Polygon(
                [(x * 100, y * 100) for x, y in drawn.exterior.coords],
                [[(x * 100, y * 100) for x, y in r.coords] for r in drawn.interiors],
            )
        ]
    )
    assert (
        union_all(rounded).symmetric_difference(whole).area < 1e-3 * whole.area
    )  # rounding: 1e-7 of a side of 1e-3 degrees
    seams = union_all(rounded)
    assert len(seams.interiors if hasattr(seams, "interiors") else []) == len(
        drawn.interiors
    )  # no slit along a cut


# Shapefiles and GeoPackages


@pytest.fixture
def pyogrio():
    return pytest.importorskip("pyogrio", reason="the extra gis is not installed")


def made(path: Path, pyogrio, crs: str | None, shapes: list, names: list[str], driver: str) -> Path:
    import numpy as np
    import shapely
    from pyproj import Transformer

    if crs not in (None, "EPSG:4326"):
        move = Transformer.from_crs("EPSG:4326", crs, always_xy=True)
        shapes = [
            shapely.transform(shape, lambda xy: np.column_stack(move.transform(xy[:, 0], xy[:, 1])))
            for shape in shapes
        ]
    with pytest.warns(UserWarning, match="crs") if crs is None else nullcontext():
        pyogrio.raw.write(
            path, geometry=shapely.to_wkb(np.array(shapes)), field_data=[np.array(names, dtype=object)], fields=["name"], crs=crs,
            geometry_type="Polygon", driver=driver,
        )  # fmt: skip
    return path


FIELD, TREE = box(11.5, 48.1, 11.501, 48.101), box(11.5004, 48.1004, 11.5006, 48.1006)


@pytest.mark.parametrize(
    ("suffix", "driver"), [(".shp", "ESRI Shapefile"), (".gpkg", "GPKG"), (".zip", "ESRI Shapefile")]
)
@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:25832"])
def test_polygons_of_any_projection(tmp_path, pyogrio, suffix, driver, crs):
    path = made(
        tmp_path / f"f{'.shp' if suffix == '.zip' else suffix}",
        pyogrio,
        crs,
        [FIELD, TREE],
        ["Field", "Tree"],
        driver,
    )
    if suffix == ".zip":
        with zipfile.ZipFile(tmp_path / "f.zip", "w") as archive:
            for part in tmp_path.glob("f.*"):
                if part.suffix != ".zip":
                    archive.write(part, part.name)
        path = tmp_path / "f.zip"
    with pytest.raises(MissionFormatError, match="unclear whether polygon 'Field', polygon 'Tree' are"):
        read_situation(path)
    zones = read_situation(path, Choices(outermost_is_inclusion=True)).fence.value.zones
    assert [zone.kind for zone in zones] == ["inclusion", "exclusion"]
    for zone, drawn in zip(zones, (FIELD, TREE), strict=True):
        read = Polygon([(p.lon_deg, p.lat_deg) for p in zone.vertices])
        assert read.symmetric_difference(drawn).area < 1e-6 * drawn.area


def test_a_shapefile_that_does_not_say_its_projection(tmp_path, pyogrio):
    path = made(tmp_path / "f.shp", pyogrio, None, [FIELD], ["Field"], "ESRI Shapefile")
    with pytest.raises(MissionFormatError, match="projection unknown"):
        read_situation(path)


def test_a_shapefile_is_named_where_the_extra_is_missing_or_it_is_broken(tmp_path):
    for name in ("f.shp", "f.gpkg"):
        (tmp_path / name).write_bytes(b"junk")
        with pytest.raises(
            MissionFormatError, match=r"is a (shapefile|GeoPackage); reading it needs|cannot be read"
        ):
            read_situation(tmp_path / name)
    with zipfile.ZipFile(tmp_path / "x.zip", "w") as archive:
        archive.writestr("readme.txt", "nothing")
    with pytest.raises(MissionFormatError, match=r"a zip archive without a shapefile \(\.shp\) in it"):
        read_situation(tmp_path / "x.zip")
    (tmp_path / "y.zip").write_bytes(b"junk")
    with pytest.raises(MissionFormatError, match="is not a readable zip file"):
        read_situation(tmp_path / "y.zip")
    with pytest.raises(MissionFormatError, match=r"none\.shp cannot be read: No such file"):
        read_situation(tmp_path / "none.shp")


class Library(types.ModuleType):
    """What pyogrio gives for one layer, where it is not installed."""

    def __init__(self, crs: str | None, shapes: list, names: list[str | None], warning: str = "") -> None:
        super().__init__("pyogrio")
        self.errors = types.SimpleNamespace(
            DataSourceError=type("DataSourceError", (Exception,), {}),
            DataLayerError=type("DataLayerError", (Exception,), {}),
        )
        self.raw = types.SimpleNamespace(read=self._read)
        self._held = crs, shapes, names, warning

    def list_layers(self, _path):
        return [("layer", "Polygon")]

    def _read(self, path, *, layer, force_2d, max_features):
        crs, shapes, names, warning = self._held
        assert (layer, force_2d) == ("layer", True)
        assert len(shapes) <= max_features
        if warning:
            warnings.warn(warning, UserWarning, stacklevel=1)
        if "broken" in path.name:
            raise self.errors.DataSourceError("no such thing")
        if "table" in path.name:
            return {"crs": None, "fields": []}, None, None, []
        return (
            {"crs": crs, "fields": ["NAME", "id"]},
            None,
            shapely.to_wkb(shapes),
            [names, np.arange(len(names))],
        )


LINE = LineString([(11.5001, 48.1001), (11.5008, 48.1008)])


def test_features_of_a_library_are_features_of_ours(tmp_path, monkeypatch):
    shapes = [MultiPolygon([FIELD]), TREE, LINE, None, Point(11.5, 48.1)]
    names = ["Field", None, "Path", "nothing", "Home"]
    monkeypatch.setitem(sys.modules, "pyogrio", Library("EPSG:4326", shapes, names, "half of it"))
    path = tmp_path / "f.gpkg"
    path.write_bytes(b"x")
    situation = read_situation(path, Choices(outermost_is_inclusion=True))
    assert [zone.kind for zone in situation.fence.value.zones] == ["inclusion", "exclusion"]
    assert places_of(situation) == [LatLon(48.1001, 11.5001), LatLon(48.1008, 11.5008)]
    assert situation.home.value == LatLon(48.1, 11.5)
    assert situation.remarks == (f"{path}: half of it",)
    for name, problem in (
        ("broken.gpkg", "a GeoPackage that cannot be read: no such thing"),
        ("table.gpkg", "contains no features"),
    ):
        (tmp_path / name).write_bytes(b"x")
        with pytest.raises(MissionFormatError, match=problem):
            read_situation(tmp_path / name)


@pytest.mark.parametrize(
    ("crs", "shape", "problem"),
    [
        (None, FIELD, "projection unknown"),
        ("EPSG:4326", box(11, 91, 12, 92), "layer layer, feature 1: latitude 91° is beyond"),
        ("EPSG:0", FIELD, "a shapefile that cannot be read"),
    ],
)
def test_what_a_library_gives_is_checked(tmp_path, monkeypatch, crs, shape, problem):
    monkeypatch.setitem(sys.modules, "pyogrio", Library(crs, [shape], ["Field"]))
    (tmp_path / "f.shp").write_bytes(b"x")
    with pytest.raises(MissionFormatError, match=problem):
        read_situation(tmp_path / "f.shp")


def test_where_the_library_is_missing_it_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyogrio", None)
    (tmp_path / "f.shp").write_bytes(b"x")
    with pytest.raises(MissionFormatError, match="is a shapefile; reading it needs the gis extra") as caught:
        read_situation(tmp_path / "f.shp")
    assert "pbpp-rover[gis]" in str(caught.value.details["advice"])


@pytest.mark.parametrize(
    ("text", "suffix", "problem"),
    [
        ('{"type":"Feature","properties":{"role":"waypoint","command":178},"geometry":{"type":"Point","coordinates":[1,2]}}', ".geojson", "a point, but command 178 has no position"),
        ("<kml><Placemark><Track><coord>1 2</coord><coord>1 x</coord></Track></Placemark></kml>", ".kml", "line 1: '1 x'; expected longitude latitude altitude"),
        ("<kml><Placemark><Track><coord>1 2</coord><coord>100 -120</coord></Track></Placemark></kml>", ".kml", "latitude -120° is beyond"),
        ("<kml><Placemark><Point><coordinates>-35.3,149.1</coordinates></Point></Placemark></kml>", ".kml", "latitude 149.1° is beyond ±90°; expected longitude, latitude: are they swapped?"),
        ('lat,lon\n1,2\n"' + "x" * 140_000 + '",1\n', ".csv", "line 3: field larger than field limit"),
        ('{"fileType":"Plan","version":1,"geoFence":[]}', ".plan", "geoFence: expected an object"),
    ],
)  # fmt: skip
def test_more_that_is_refused(tmp_path, text, suffix, problem):
    path = tmp_path / f"x{suffix}"
    path.write_text(text)
    with pytest.raises(MissionFormatError, match=re.escape(problem)):
        read_situation(path)


def test_what_is_not_set_is_refused_where_it_means_something(tmp_path):
    nan = float("nan")
    items = (waypoint(A), MissionItem(Command.DO_CHANGE_SPEED, 2, (1.0, nan, nan, nan)))
    situation = Situation(mission=Known(Mission(items), None, ""))
    with pytest.raises(MissionFormatError, match=r"item 2: param2 of command 178 is not set \(NaN\)"):
        write_situation(situation, tmp_path / "x.waypoints")
    items = (waypoint(A), MissionItem(Command.DO_JUMP, 2, (1.0, 2.0, nan, nan)))
    write_situation(Situation(mission=Known(Mission(items), None, "")), tmp_path / "x.waypoints")
    assert read_mission(tmp_path / "x.waypoints").items[1].params == (1.0, 2.0, 0.0, 0.0)
    placeless = Situation(mission=Known(Mission(items[1:]), None, ""))
    with pytest.raises(
        MissionFormatError, match=r"a \.csv file contains positions, but no mission item has one"
    ):
        write_situation(placeless, tmp_path / "x.csv")
