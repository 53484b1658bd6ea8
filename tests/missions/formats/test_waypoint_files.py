"""QGC WPL 110: missions, fences and rally points a line at a time."""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import fences, wire_lat_lons

from missions.errors import FenceMissingError, MissionFormatError
from missions.fence import Fence, PolygonZone, ZoneKind, fence_to_items
from missions.formats import read_fence, read_mission, read_situation, waypoints, write_mission
from missions.geo import LatLon
from missions.items import MissionItem, waypoint
from missions.rally import RallyPoint
from missions.situation import Known, Mission, Situation

if TYPE_CHECKING:
    from pathlib import Path

HOME_LINE = "0\t1\t0\t16\t0\t0\t0\t0\t40.071374\t-105.229930\t1584.2\t1"
FENCE_LINES = [
    f"{seq}\t0\t0\t5002\t3\t0\t0\t0\t{lat}\t{lon}\t0\t1"
    for seq, (lat, lon) in enumerate([("40.07164349", "-105.23028217"), ("40.07157163", "-105.23002391"), ("40.07176926", "-105.23007087")])
]  # fmt: skip


def text_of(*lines: str, header: str = "QGC WPL 110", end: str = "\n") -> str:
    return end.join([header, *lines]) + end


mission_items = st.builds(
    MissionItem,
    command=st.sampled_from([16, 17, 18, 19, 20, 93, 177, 178, 194, 300]),
    frame=st.sampled_from([0, 2, 3, 10]),
    params=st.tuples(*[st.floats(-1e6, 1e6, width=32)] * 4),
    lat_e7=st.integers(-900_000_000, 900_000_000),
    lon_e7=st.integers(-1_800_000_000, 1_800_000_000),
    alt_m=st.integers(-100_000, 100_000).map(lambda centimetres: centimetres / 100),
    autocontinue=st.booleans(),
)


def as_on_the_wire(value: float) -> float:
    return struct.unpack("<f", struct.pack("<f", value))[0]


@given(st.lists(mission_items, max_size=5).map(tuple), wire_lat_lons)
def test_missions_round_trip(items: tuple[MissionItem, ...], home: LatLon) -> None:
    written = waypoints.write(Situation(mission=Known(Mission(items, home), None, "")))
    again = waypoints.read(written, "f").mission
    assert again is not None
    read = [replace(item, params=tuple(map(as_on_the_wire, item.params))) for item in again.value.items]
    assert read == list(items)
    assert again.value.home == (None if home == (0, 0) else home)


@given(fences.filter(lambda fence: fence.zones or fence.return_point))
def test_fences_round_trip(fence: Fence) -> None:
    again = waypoints.read(waypoints.format_items(fence_to_items(fence)), "f").fence
    assert again is not None
    zones = [
        zone if isinstance(zone, PolygonZone) else replace(zone, radius_m=as_on_the_wire(zone.radius_m))
        for zone in again.value.zones
    ]
    assert Fence(tuple(zones), again.value.return_point) == fence


def test_frames_are_written_as_ground_stations_write_them() -> None:
    text = waypoints.write(Situation(mission=Known(Mission((waypoint(LatLon(1, 2)),)), None, "")))
    assert text.splitlines()[2].split("\t")[:4] == ["1", "0", "3", "16"]


def test_home_is_written_first_from_the_mission_else_from_the_situation_else_as_0() -> None:
    items = (waypoint(LatLon(1, 2)),)
    home = Known(LatLon(3, 4), None, "")
    for situation, lat in (
        (Situation(mission=Known(Mission(items, LatLon(5, 6)), None, ""), home=home), "5.00000000"),
        (Situation(mission=Known(Mission(items), None, ""), home=home), "3.00000000"),
        (Situation(mission=Known(Mission(items), None, "")), "0.00000000"),
    ):
        assert waypoints.write(situation).splitlines()[1].split("\t")[8] == lat


def test_the_recorded_fence_files(fields: Path) -> None:
    maze = read_fence(fields / "maze-fence.waypoints")
    assert [len(zone.vertices) for zone in maze.zones if isinstance(zone, PolygonZone)] == [
        13,
        4,
        4,
        3,
        4,
        4,
        5,
    ]
    assert [zone.radius_m for zone in maze.zones if not isinstance(zone, PolygonZone)] == [10, 12]
    assert maze.zones[0].vertices[0] == LatLon(40.0711045, -105.2303996)
    assert len(read_fence(fields / "yard2-fence.waypoints").zones) == 6


def test_the_recorded_mission_and_rally_files(fields: Path) -> None:
    mission = read_mission(fields / "yard-mission.waypoints")
    assert mission.home == LatLon(40.071374, -105.22993)
    assert [item.position for item in mission.items] == [
        LatLon(40.071464, -105.22996),
        LatLon(40.0720926, -105.2286152),
    ]
    rally = read_situation(fields / "union-rally.waypoints").rally
    assert rally is not None
    assert rally.value == (RallyPoint(40.0720926, -105.2301648), RallyPoint(40.0721376, -105.22858))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("bom", ["", "\ufeff"])
def test_line_ends_bom_comments_and_blank_lines(tmp_path: Path, end: str, bom: str) -> None:
    path = tmp_path / "f.TXT"
    path.write_bytes((bom + text_of("# a remark", *FENCE_LINES[:2], "", FENCE_LINES[2], end=end)).encode())
    fence = read_fence(path)
    assert len(fence.zones) == 1
    assert fence.zones[0].kind is ZoneKind.EXCLUSION


def test_columns_may_stand_apart_by_spaces() -> None:
    situation = waypoints.read(text_of(*(line.replace("\t", "  ") for line in FENCE_LINES)), "f")
    assert situation.fence is not None


@pytest.mark.parametrize("command", ["16", "0"])
def test_fence_and_rally_files_with_a_home_line(command: str) -> None:
    home = HOME_LINE.replace("\t16\t", f"\t{command}\t")
    situation = waypoints.read(text_of(home, *FENCE_LINES), "f")
    assert situation.fence is not None
    assert len(situation.fence.value.zones) == 1
    assert situation.home is not None
    assert situation.home.value == LatLon(40.071374, -105.22993)
    rally = waypoints.read(text_of(home, "1\t0\t3\t5100\t0\t0\t0\t0\t40.07\t-105.2\t0\t1"), "f")
    assert rally.rally is not None
    assert rally.rally.value == (RallyPoint(40.07, -105.2),)
    assert rally.home == situation.home


def test_mission_planners_padded_home() -> None:
    """Mission Planner writes zeros where it knows no home, with command 0 or 16."""
    home = "0\t1\t0\t0\t0\t0\t0\t0\t0.00000000\t0.00000000\t0.000000\t1"
    situation = waypoints.read(text_of(home, "1\t0\t3\t16\t0\t0\t0\t0\t40.07\t-105.2\t100\t1"), "f")
    assert situation.home is None
    assert situation.mission is not None
    assert situation.mission.value.home is None
    assert [item.position for item in situation.mission.value.items] == [LatLon(40.07, -105.2)]


def test_a_mission_of_home_alone() -> None:
    situation = waypoints.read(text_of(HOME_LINE), "f")
    assert situation.mission is not None
    assert situation.mission.value == Mission((), LatLon(40.071374, -105.22993))


WAYPOINT = "1\t0\t3\t16\t0\t0\t0\t0\t40.07\t-105.2\t0\t1"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "line 1: expected 'QGC WPL 110'"),
        ("hello\n", "line 1: expected 'QGC WPL 110'"),
        (text_of(WAYPOINT, header="QGC WPL 120"), "line 1: unknown version QGC WPL 120; supported: 110 and 100"),
        (text_of(), "no items after the first line"),
        (text_of("# nothing"), "no items after the first line"),
        (text_of(HOME_LINE, WAYPOINT[:-2]), "line 3: 11 columns; expected 12"),
        (text_of("", HOME_LINE, WAYPOINT + "\t7"), "line 4: 13 columns; expected 12"),
        (text_of(HOME_LINE, WAYPOINT.replace("40.07", "north")), "line 3: 'north' is not a number"),
        (text_of(HOME_LINE, WAYPOINT.replace("16", "sixteen")), "line 3: 'sixteen' is not a number"),
        (text_of(HOME_LINE, WAYPOINT.replace("40.07", "nan")), "line 3: position nan,-105.2 is not"),
        (text_of(HOME_LINE, WAYPOINT.replace("40.07", "91")), "line 3: latitude 91° is beyond"),
        (text_of(HOME_LINE, WAYPOINT.replace("-105.2", "-190")), "line 3: longitude -190° is beyond"),
        (text_of(HOME_LINE, WAYPOINT[:-1] + "inf"), "line 3: autocontinue inf is not a whole number"),
        (text_of(HOME_LINE, WAYPOINT.replace("\t16\t", "\t70000\t")), "line 3: command 70000"),
        (text_of(HOME_LINE, WAYPOINT.replace("\t3\t", "\t-1\t")), "line 3: frame -1"),
        (text_of("0\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1"), "line 2: .*command 20.*home"),
        (text_of(*FENCE_LINES[:2]), "line 2: fence item 0: exclusion polygon with 3 vertices, but only 2 are given"),
        (text_of(HOME_LINE, "# x", *FENCE_LINES[:2]), "line 4: fence item 0: .* only 2 are given"),
        (text_of(*FENCE_LINES, FENCE_LINES[0].replace("5002\t3", "5004\t0")), "line 5: fence item 3: circle radius 0"),
        (text_of(*FENCE_LINES, WAYPOINT), "line 5: fence item 3: command 16 is not a fence item"),
        (text_of(HOME_LINE, WAYPOINT, *FENCE_LINES), "line 3: fence item 0: command 16 is not a fence item"),
    ],
)  # fmt: skip
def test_unusable_files_name_the_line(text: str, problem: str) -> None:
    with pytest.raises(MissionFormatError, match=rf"^f: {problem}"):
        waypoints.read(text, "f")


def test_what_a_file_does_not_hold(tmp_path: Path) -> None:
    mission, fence = tmp_path / "m.waypoints", tmp_path / "f.waypoints"
    mission.write_text(text_of(HOME_LINE, WAYPOINT))
    fence.write_text(text_of(*FENCE_LINES))
    with pytest.raises(FenceMissingError, match=r"m\.waypoints contains no fence"):
        read_fence(mission)
    with pytest.raises(MissionFormatError, match=r"f\.waypoints contains no mission"):
        read_mission(fence)


def test_files_that_cannot_be_read_or_written(tmp_path: Path) -> None:
    situation = Situation(mission=Known(Mission((waypoint(LatLon(1, 2)),)), None, ""))
    with pytest.raises(MissionFormatError, match=r"none\.plan cannot be read: No such file"):
        read_situation(tmp_path / "none.plan")
    with pytest.raises(
        MissionFormatError, match=r"is a telemetry log; supported: \.plan, \.waypoints, \.txt"
    ):
        read_situation(tmp_path / "x.tlog")
    with pytest.raises(MissionFormatError, match="cannot write files with extension ''"):
        write_mission(situation, tmp_path / "x")
    with pytest.raises(MissionFormatError, match="cannot be written: No such file"):
        write_mission(situation, tmp_path / "no" / "x.waypoints")
    (tmp_path / "bytes.txt").write_bytes(b"QGC WPL 110\n\xff\xfe")
    with pytest.raises(MissionFormatError, match=r"bytes\.txt is not a text file \(byte 12\)"):
        read_situation(tmp_path / "bytes.txt")
    (tmp_path / "dir.plan").mkdir()
    with pytest.raises(MissionFormatError, match=r"dir\.plan cannot be read: Is a directory"):
        read_situation(tmp_path / "dir.plan")


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    situation = Situation(mission=Known(Mission((waypoint(LatLon(1, 2)),)), None, ""))
    path = tmp_path / "x.waypoints"
    path.write_text("old")
    write_mission(situation, path)
    assert path.read_text().startswith("QGC WPL 110\n0\t1\t0\t16\t")
    for unwritable in (tmp_path / "dir.plan", path / "under-a-file.plan"):
        if unwritable.parent == tmp_path:
            unwritable.mkdir()
        with pytest.raises(MissionFormatError, match="cannot be written"):
            write_mission(situation, unwritable)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["dir.plan", "x.waypoints"]
