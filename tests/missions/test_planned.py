"""A plan by itself: in a word, in files, in pictures."""

from __future__ import annotations

from dataclasses import replace

import pytest
from charts import FIELD, HOME, WALL, place, situation_of

from missions import GoTo, plan, read_fence, read_mission, read_situation
from missions.errors import MissionFormatError
from missions.fence import Fence
from missions.geo import LatLon
from missions.rally import RallyPoint
from missions.situation import Known, Situation

WEST = place(-50, 0)


@pytest.fixture(scope="module")
def made():
    return plan(situation_of(FIELD, WALL), GoTo(start=WEST, target=place(50, 0), clearance_m=2.0))


def test_it_is_short_to_print(made):
    assert (
        repr(made)
        == f"<Plan: {len(made.items)} items, {made.length_m:.1f} m, {made.duration_s:.0f} s, 2 m promised>"
    )
    drawn = plan(situation_of(FIELD), GoTo(start=HOME, target=place(50, 0), corner_allowance_m=0.0))
    assert repr(drawn).endswith(", drawn lines only>")


@pytest.mark.parametrize("name", ["a.plan", "a.geojson", "a.kml"])
def test_it_writes_its_mission_with_the_fence(made, tmp_path, name):
    made.write(tmp_path / name)
    written = read_mission(tmp_path / name)
    assert [item.position for item in written.items if item.is_placed] == list(made.path[1:])
    assert len(read_fence(tmp_path / name).zones) == len(Fence((FIELD, WALL)).zones)


def test_it_writes_the_mission_alone_where_a_format_holds_no_more(made, tmp_path):
    made.write(str(tmp_path / "a.waypoints"))
    read = read_situation(tmp_path / "a.waypoints")
    assert read.mission is not None
    assert [item.position for item in read.mission.value.items] == [item.position for item in made.items]
    assert read.mission.value.home == HOME
    made.write(tmp_path / "a.gpx")
    assert (tmp_path / "a.gpx").read_bytes().startswith(b"<?xml")
    with pytest.raises(MissionFormatError, match="contains no mission"):
        made.write(tmp_path / "a.poly")
    assert not (tmp_path / "a.poly").exists()


def test_what_else_is_known_goes_into_the_file_too(made, tmp_path):
    rally = (RallyPoint(*place(5, 5)),)
    made.write(tmp_path / "a.plan", Situation(rally=Known(rally, None, "test")))
    found = read_situation(tmp_path / "a.plan").rally
    assert found is not None
    assert len(found.value) == 1


@pytest.mark.parametrize(("name", "begin"), [("a.png", b"\x89PNG"), ("a.svg", b"<?xml")])
def test_it_draws_itself(made, tmp_path, name, begin):
    made.plot(tmp_path / name, title="Round the wall", blocks=True)
    assert (tmp_path / name).read_bytes().lstrip()[: len(begin)] == begin
    with pytest.raises(MissionFormatError, match="is not a supported picture format"):
        made.plot(tmp_path / "a.jpeg")


@pytest.mark.parametrize(
    ("metres_north_east", "turns"),
    [
        ([(0, 0), (10, 0)], 0),
        ([(0, 0), (10, 0), (20, 0)], 0),  # a long line in pieces
        ([(0, 0), (10, 0), (10, 10)], 1),
        ([(0, 0), (10, 0), (10, 0), (10, 10), (0, 10)], 2),  # one place twice
        ([(0, 0), (10, 0), (0, 0)], 1),
        ([(0, 0), (10, 5), (20, 0), (30, 5)], 2),
    ],
)
def test_turns_are_counted_where_the_lines_bend(made, metres_north_east, turns):
    path = tuple(
        LatLon(WEST.lat_deg + north_m / 111_000, WEST.lon_deg + east_m / 85_000)
        for north_m, east_m in metres_north_east
    )
    assert replace(made, path=path).turn_count == turns
