"""Situations from recorded logs, by the facts written down beside them."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import pytest

from mavlink_bridge.errors import LogError
from mavlink_bridge.logbook.log_situation import situation_from_log
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.tlog import TlogWriter
from missions.fence import CircleZone, PolygonZone, ZoneKind
from missions.formats import read_fence, read_mission, read_situation
from missions.geo import LatLon, distance_m, rounded

if TYPE_CHECKING:
    from pathlib import Path

    from missions.fence import Fence

HOME = LatLon(40.071374, -105.22993)
YARD_TARGET = LatLon(40.0720926, -105.2286152)
IN, OUT = ZoneKind.INCLUSION, ZoneKind.EXCLUSION


def counts(fence: Fence) -> tuple[int, int, int, int]:
    return tuple(fence.count(kind, shape) for kind in (IN, OUT) for shape in (PolygonZone, CircleZone))


@pytest.mark.parametrize(
    ("name", "zones", "target", "source", "mode"),
    [
        ("guided-maze", (1, 0, 6, 2), LatLon(40.0726316, -105.2290497), "DO_REPOSITION", 4),
        ("mission-yard", (1, 0, 2, 1), None, None, 4),
        ("position-target-yard", (1, 0, 2, 1), YARD_TARGET, "SET_POSITION_TARGET_GLOBAL_INT", None),
        ("fence-change-yard", (1, 0, 3, 2), LatLon(40.072092, -105.228615), None, None),
        ("union-rally", (2, 0, 1, 0), LatLon(40.0721374, -105.2284626), "DO_REPOSITION", None),
        ("island-unreachable", None, None, None, None),
        ("no-fence", None, None, None, None),
    ],
)
def test_what_each_log_holds(
    logs: Path, name: str, zones: tuple | None, target: LatLon | None, source: str | None, mode: int | None
) -> None:
    found = situation_from_log(str(logs / f"{name}.tlog"))
    assert (found.system, found.component, found.vehicle_type, found.ardupilot) == (1, 1, 10, True)
    assert found.fence_trouble is None
    assert not found.transfers
    if zones is not None:
        assert found.fence is not None
        assert counts(found.fence.value) == zones
    if target is not None:
        assert found.target is not None
        assert distance_m(found.target.value, target) < 0.2
        assert source in (None, found.target.source)
    if name == "mission-yard":
        assert found.target is None
    assert mode in (None, found.mode)
    assert found.home is not None
    assert distance_m(found.home.value, HOME) < 0.5
    assert found.pose is not None  # although each log begins with positions at 0, 0
    assert distance_m(found.pose.value.position, HOME) < 400
    assert found.pose.value.heading_deg is not None


@pytest.mark.parametrize(
    ("name", "file"),
    [("guided-maze", "maze"), ("mission-yard", "yard"), ("position-target-yard", "yard"), ("fence-change-yard", "yard2"), ("union-rally", "union"), ("island-unreachable", "island")],
)  # fmt: skip
def test_fences_are_those_of_the_files(logs: Path, fields: Path, name: str, file: str) -> None:
    found = situation_from_log(logs / f"{name}.tlog").fence
    assert found is not None
    drawn = read_fence(fields / f"{file}-fence.waypoints")
    assert found.source == "fence read-back"
    assert len(found.value.zones) == len(drawn.zones)
    for one, other in zip(found.value.zones, drawn.zones, strict=True):
        assert one.kind is other.kind
        places = [
            (zone.vertices if isinstance(zone, PolygonZone) else (zone.centre,)) for zone in (one, other)
        ]
        # MAVProxy cuts degE7 where we round
        assert all(distance_m(a, b) < 0.015 for a, b in zip(*places, strict=True))


def test_the_mission_and_the_rally_points(logs: Path, fields: Path) -> None:
    found = situation_from_log(logs / "mission-yard.tlog").mission
    assert found is not None
    drawn = read_mission(fields / "yard-mission.waypoints")
    assert len(found.value.items) == len(drawn.items) == 2
    assert distance_m(found.value.items[-1].position, YARD_TARGET) < 0.02
    assert found.value.home is not None
    assert distance_m(found.value.home, HOME) < 0.5
    rally = situation_from_log(logs / "union-rally.tlog").rally
    drawn_rally = read_situation(fields / "union-rally.waypoints").rally
    assert rally is not None
    assert drawn_rally is not None
    assert all(
        distance_m(a.position, rounded(b.position)) < 0.02
        for a, b in zip(rally.value, drawn_rally.value, strict=True)
    )


def test_no_fence_was_transferred(logs: Path) -> None:
    found = situation_from_log(logs / "no-fence.tlog")
    assert found.fence is None
    assert found.target is not None


def test_parameters_stand_in_the_rows_of_the_ground_station(logs: Path) -> None:
    for path in logs.glob("*.tlog"):
        parameters = situation_from_log(path).parameters
        assert {"FENCE_ENABLE", "FENCE_TYPE", "FENCE_MARGIN", "WP_RADIUS", "WP_SPEED"} <= set(parameters), (
            path.name
        )
    union = situation_from_log(logs / "union-rally.tlog").parameters
    assert (union["FENCE_OPTIONS"], union["FENCE_TYPE"]) == (2, 4)
    assert situation_from_log(logs / "mission-yard.tlog").parameters["FENCE_ENABLE"] == 0


def write_log(path: Path, *told: tuple[tuple[int, int], m.Message]) -> Path:
    with TlogWriter(path) as log:
        for number, (sender, message) in enumerate(told):
            log.write(1.7e9 + number, Codec(*sender).encode(message))
    return path


def heartbeat(kind: int, autopilot: int = 3) -> m.Heartbeat:
    return m.Heartbeat(kind, autopilot)


def test_which_vehicle_is_meant(tmp_path: Path) -> None:
    place = m.GlobalPositionInt(0, 400713740, -1052299300)
    two = write_log(
        tmp_path / "two.tlog",
        ((1, 1), heartbeat(10)),
        ((2, 1), heartbeat(11)),
        ((2, 1), place),
        ((255, 190), heartbeat(6, 8)),
    )
    with pytest.raises(
        LogError,
        match=r"two\.tlog: several vehicles were heard \(system 1 \(MAV_TYPE 10\), system 2 .*--system N",
    ):
        situation_from_log(two)
    assert situation_from_log(two, 1).pose is None
    chosen = situation_from_log(two, 2)
    assert chosen.pose is not None
    assert chosen.vehicle_type == 11
    with pytest.raises(LogError, match=r"two\.tlog: system 7 was not heard, only system 1 "):
        situation_from_log(two, 7)
    copter = write_log(tmp_path / "copter.tlog", ((1, 1), heartbeat(2)), ((1, 1), place))
    with pytest.raises(LogError, match=r"system 1 \(MAV_TYPE 2\) is not a rover or boat .*--any-vehicle"):
        situation_from_log(copter)
    assert situation_from_log(copter, any_vehicle=True).pose is not None
    beside = write_log(tmp_path / "beside.tlog", ((1, 1), heartbeat(10)), ((2, 1), heartbeat(2)))
    assert situation_from_log(beside).system == 1
    nobody = write_log(tmp_path / "nobody.tlog", ((1, 1), place), ((255, 190), heartbeat(6, 8)))
    with pytest.raises(LogError, match=r"nobody\.tlog: no vehicle's HEARTBEAT was heard"):
        situation_from_log(nobody)


def test_logs_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(LogError, match=r"none\.tlog"):
        situation_from_log(tmp_path / "none.tlog")
    for name, data in (
        ("empty", b""),
        ("random", random.Random(1).randbytes(50_000)),
        ("text", b"hello\n" * 1000),
    ):
        path = tmp_path / f"{name}.tlog"
        path.write_bytes(data)
        with pytest.raises(LogError, match=rf"{name}\.tlog"):
            situation_from_log(path)


@pytest.mark.parametrize("share", [0.05, 0.3, 0.6, 0.9])
def test_a_log_cut_anywhere_is_read_as_far_as_it_goes(logs: Path, tmp_path: Path, share: float) -> None:
    whole = (logs / "guided-maze.tlog").read_bytes()
    path = tmp_path / "cut.tlog"
    path.write_bytes(whole[: int(share * len(whole)) + 3])
    found = situation_from_log(path)
    if share >= 0.3:
        assert found.fence is not None
        assert counts(found.fence.value) == (1, 0, 6, 2)
