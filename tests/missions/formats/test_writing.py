"""Which part goes into which file, and what is said where it cannot."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import shapely
from formats.making import SQUARE, known
from pyproj import Geod

from missions.errors import MissionFormatError
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.formats import (
    FORMATS,
    Part,
    check_writable_format,
    kml,
    read_fence,
    read_parameters,
    read_situation,
    write_fence,
    write_mission,
    write_parameters,
    write_situation,
)
from missions.geo import LatLon
from missions.items import MissionItem, waypoint
from missions.rally import RallyPoint
from missions.situation import Mission, Situation

INCLUSION = PolygonZone(ZoneKind.INCLUSION, SQUARE)
CIRCLE = CircleZone(ZoneKind.EXCLUSION, LatLon(40.0005, -104.9995), 20.0)
MISSION = Mission((replace(waypoint(LatLon(40.0001, -104.9991)), frame=3),), LatLon(40.0, -105.0))
ALL = Situation(
    fence=known(Fence((INCLUSION, CIRCLE))),
    mission=known(MISSION),
    rally=known((RallyPoint(40.0002, -104.9992, 30.0),)),
    home=known(MISSION.home),
    parameters={"CRUISE_SPEED": 3.5, "WP_RADIUS": 2.0},
)


@pytest.mark.parametrize(
    ("suffix", "part", "written"),
    [
        (".plan", None, "mission fence rally"),
        (".plan", Part.FENCE, "fence"),
        (".geojson", None, "mission fence rally"),
        (".kml", None, "mission fence rally"),
        (".kml", Part.RALLY, "rally"),
        (".waypoints", Part.FENCE, "fence"),
        (".waypoints", Part.MISSION, "mission"),
        (".txt", Part.RALLY, "rally"),
        (".parm", None, "parameters"),
        (".param", Part.PARAMETERS, "parameters"),
    ],
)
def test_what_is_written_is_read(tmp_path: Path, suffix: str, part: Part | None, written: str) -> None:
    path = tmp_path / f"x{suffix}"
    assert write_situation(ALL, path, part) == tuple(written.split())
    again = read_situation(path)
    for one in Part:
        expected = getattr(ALL, one) if one in written.split() else None
        found = getattr(again, one) or None
        assert getattr(found, "value", found) == getattr(expected, "value", expected)


def test_paths_may_be_plain_strings(tmp_path: Path) -> None:
    fence = Fence((INCLUSION, CIRCLE))
    write_fence(fence, str(tmp_path / "yard.plan"))
    assert read_fence(str(tmp_path / "yard.plan")).zones == fence.zones
    write_parameters({"WP_RADIUS": 2.0}, str(tmp_path / "rover.parm"))
    assert read_parameters(str(tmp_path / "rover.parm")) == {"WP_RADIUS": 2.0}


def test_a_plan_of_one_part_keeps_home_and_speed(tmp_path: Path) -> None:
    path = tmp_path / "x.plan"
    write_situation(ALL, path, Part.MISSION)
    assert '"cruiseSpeed": 3.5' in path.read_text()
    assert read_situation(path).home.value == MISSION.home


def test_write_mission_takes_the_fence_along_where_the_format_holds_both(tmp_path: Path) -> None:
    for suffix, has_fence in ((".plan", True), (".geojson", True), (".kml", True), (".waypoints", False)):
        path = tmp_path / f"x{suffix}"
        write_mission(ALL, path)
        again = read_situation(path)
        assert again.mission.value == MISSION
        assert (again.fence is not None) == has_fence


@pytest.mark.parametrize("suffix", [".fen", ".poly"])
def test_one_polygon_formats(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"x{suffix}"
    fence = Fence((INCLUSION,), LatLon(40.0005, -104.9995))
    write_fence(fence, path)
    assert read_fence(path).zones == fence.zones
    assert path.read_text().splitlines()[0] == (
        "40.00050000 -104.99950000" if suffix == ".fen" else "40.00000000 -105.00000000"
    )


def test_parameters(tmp_path: Path) -> None:
    path = tmp_path / "x.param"
    write_parameters(ALL.parameters, path)
    assert path.read_text() == "CRUISE_SPEED     3.5\nWP_RADIUS        2\n"
    assert read_parameters(path) == ALL.parameters


@pytest.mark.parametrize(
    ("situation", "name", "part", "problem"),
    [
        (ALL, "x.waypoints", None, "a .waypoints file contains one list, but there are mission and fence and rally; choose one"),
        (ALL, "x.fen", None, "a .fen file contains exactly one inclusion polygon; the fence has 1 inclusion polygon, 1 exclusion circle"),
        (Situation(fence=known(Fence((INCLUSION,)))), "x.fen", None, "a .fen file needs a return point, but the fence has none"),
        (Situation(fence=known(Fence((INCLUSION, INCLUSION)))), "x.poly", None, "a .poly file contains exactly one inclusion polygon; the fence has 2 inclusion polygons"),
        (Situation(fence=known(Fence((replace(INCLUSION, kind=ZoneKind.EXCLUSION),)))), "x.poly", None, "a .poly file contains exactly one inclusion polygon; the fence has 1 exclusion polygon"),
        (Situation(fence=known(Fence())), "x.poly", None, "a .poly file contains exactly one inclusion polygon; the fence has no zone"),
        (ALL, "x.fen", Part.MISSION, "a .fen file contains no mission; it contains fence"),
        (replace(ALL, mission=None), "x.gpx", None, "there is no mission to write"),
        (replace(ALL, mission=None), "x.plan", Part.MISSION, "there is no mission to write"),
        (Situation(), "x.plan", None, "nothing to write: no mission, fence, rally points or parameters"),
        (replace(ALL, mission=known(Mission((MissionItem(178),)))), "x.gpx", None, "a .gpx file contains a route, but no mission item has a position"),
        (ALL, "x.bin", None, "cannot write files with extension '.bin'; supported: .plan, .waypoints,"),
    ],
)  # fmt: skip
def test_what_cannot_be_written_is_said(
    tmp_path: Path, situation: Situation, name: str, part: Part | None, problem: str
) -> None:
    path = tmp_path / name
    with pytest.raises(MissionFormatError, match="^" + re.escape(f"{path}: {problem}")):
        write_situation(situation, path, part)
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_written_is_known_before_any_work() -> None:
    for suffix, format_ in FORMATS.items():
        for part in Part:
            if part in format_.holds:
                check_writable_format(Path(f"x{suffix}"), part)
            else:
                reason = f"a {suffix} file contains no {part}; supported: "
                if format_.write is None:
                    reason = f"cannot write files with extension '{suffix}'; supported: "
                with pytest.raises(MissionFormatError, match=reason):
                    check_writable_format(Path(f"x{suffix}"), part)
    with pytest.raises(
        MissionFormatError, match=r"cannot write files with extension '\.tlog'; supported: \.plan"
    ):
        check_writable_format(Path("x.tlog"))


@pytest.mark.parametrize("kind", ZoneKind)
@pytest.mark.parametrize("lat_deg", [0.0, 47.0, -80.0])
def test_circles_drawn_in_kml_err_to_the_safe_side(kind: ZoneKind, lat_deg: float) -> None:
    """By geodesics: no edge of an exclusion's drawing comes nearer to the centre than the radius, none of an inclusion's goes farther."""
    circle = CircleZone(kind, LatLon(lat_deg, 8.0), 50.0)
    text = kml.write(Situation(fence=known(Fence((circle,)))))
    words = text.rpartition("<coordinates>")[2].partition("</coordinates>")[0].split()
    ring = [tuple(map(float, word.split(","))) for word in words]
    edge = shapely.LineString(ring).segmentize(1e-5)
    geod = Geod(ellps="WGS84")
    distances_m = [geod.inv(8.0, lat_deg, lon, lat)[2] for lon, lat in edge.coords]
    assert len(distances_m) > 72
    if kind is ZoneKind.EXCLUSION:
        assert 50.0 - 0.002 <= min(distances_m) < max(distances_m) < 50.1
    else:
        assert 49.9 < min(distances_m) < max(distances_m) <= 50.0 + 0.002


def test_reading_a_plan_loads_no_library_of_other_formats(fields: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from missions.formats import read_fence;"
        f"read_fence(Path({str(fields / 'yard-fence.waypoints')!r}));"
        "print([name for name in ('matplotlib', 'pyexpat', 'xml', 'pyproj', 'shapely', 'pymavlink') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_infinite_parameters_are_null_in_geojson(tmp_path: Path) -> None:
    path = tmp_path / "x.geojson"
    item = replace(MISSION.items[0], params=(math.inf, 0.0, 0.0, 0.0))
    write_situation(Situation(mission=known(Mission((item,)))), path)
    assert '"param1": null' in path.read_text()
