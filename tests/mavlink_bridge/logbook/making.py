"""Logs made row by row, for tests: a rover, its ground station, a field near the equator where a degree is easily metres."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.wire import item_to_message
from mavlink_bridge.tlog import SENT_LINK, TlogWriter
from missions.fence import Fence, PolygonZone, ZoneKind, fence_to_items
from missions.geo import LatLon, LocalPoint
from missions.ground.frame import LocalFrame
from missions.items import Command, MissionItem, waypoint, with_home

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

ROVER, STATION = (1, 1), (255, 230)
ORIGIN = LatLon(40.0, -105.0)
FRAME = LocalFrame(ORIGIN)
BEGIN_S = 1_700_000_000.0
PARAMETERS = {"FENCE_ENABLE": 0.0, "WP_SPEED": 2.0, "WP_RADIUS": 2.0, "ATC_ACCEL_MAX": 1.0}


def place(east_m: float, north_m: float) -> LatLon:
    return FRAME.to_lat_lon(LocalPoint(east_m, north_m))


def square(west_m: float, south_m: float, east_m: float, north_m: float, kind: ZoneKind) -> PolygonZone:
    corners = ((west_m, south_m), (east_m, south_m), (east_m, north_m), (west_m, north_m))
    return PolygonZone(kind, tuple(place(*corner) for corner in corners))


FIELD = Fence(
    (square(-50, -50, 50, 50, ZoneKind.INCLUSION), square(10, 10, 20, 20, ZoneKind.EXCLUSION)),
)


@dataclass
class Log:
    """Rows in the making."""

    rows: list[tuple[float, tuple[int, int], m.Message]] = field(default_factory=list)
    now_s: float = 0.0

    def row(self, sender: tuple[int, int], message: m.Message, after_s: float = 0.01) -> None:
        self.rows.append((self.now_s, sender, message))
        self.now_s += after_s

    def heartbeat(self, mode: int = 0, *, armed: bool = False, mav_type: int = 10) -> None:
        self.row(ROVER, m.Heartbeat(mav_type, 3, 128 * armed + 1, mode))

    def parameters(self, values: dict[str, float] | None = None) -> None:
        for name, value in (PARAMETERS if values is None else values).items():
            self.row(ROVER, m.ParamValue(name, value, 9, 1, 0))

    def upload(self, kind: m.MissionType, items: Sequence[MissionItem], result: int | None = 0) -> None:
        self.row(STATION, m.MissionCount(*ROVER, len(items), kind))
        for seq, item in enumerate(items):
            self.row(ROVER, m.MissionRequest(*STATION, seq, kind))
            self.row(STATION, item_to_message(item, seq, Peer(*ROVER, *STATION), kind))
        if result is not None:
            self.row(ROVER, m.MissionAck(*STATION, result, kind))

    def read_back(self, kind: m.MissionType, items: Sequence[MissionItem]) -> None:
        self.row(STATION, m.MissionRequestList(*ROVER, kind))
        self.row(ROVER, m.MissionCount(*STATION, len(items), kind))
        for seq, item in enumerate(items):
            self.row(STATION, m.MissionRequestInt(*ROVER, seq, kind))
            self.row(ROVER, item_to_message(item, seq, Peer(*STATION, *ROVER), kind))

    def fence(self, fence: Fence = FIELD) -> None:
        self.upload(m.MissionType.FENCE, fence_to_items(fence))

    def mission(self, points: Sequence[tuple[float, float]]) -> None:
        items = with_home([waypoint(place(*point)) for point in points], ORIGIN)
        self.upload(m.MissionType.MISSION, items)

    def position(self, east_m: float, north_m: float, speed_mps: float = 0.0, hdg: int = 65535) -> None:
        lat_e7, lon_e7 = (round(value * 1e7) for value in place(east_m, north_m))
        boot_ms = round(self.now_s * 1000)
        vx = round(speed_mps * 100)
        self.row(ROVER, m.GlobalPositionInt(boot_ms, lat_e7, lon_e7, vx=vx, hdg=hdg))

    def change_speed(self, speed_mps: float, result: int = 0) -> None:
        self.row(STATION, m.CommandLong(*ROVER, Command.DO_CHANGE_SPEED, param2=speed_mps))
        self.row(ROVER, m.CommandAck(Command.DO_CHANGE_SPEED, result))

    def drive(
        self,
        points: Sequence[tuple[float, float]],
        speed_mps: float = 2.0,
        mode: int = Mode.AUTO,
        first_item: int = 1,
        asked_mps: float | None = None,
    ) -> None:
        """Stand, asked for another speed or not, then drive along lines; each end of a line reaches the next item."""
        self.heartbeat(mode, armed=True)
        self.row(ROVER, m.MissionCurrent(first_item))
        if asked_mps is not None:
            self.change_speed(asked_mps)
        self.position(*points[0])
        self.now_s += 0.2
        for item, (a, b) in enumerate(itertools.pairwise(points), start=first_item):
            self.row(ROVER, m.MissionCurrent(item), 0.0)
            length_m = math.dist(a, b)
            steps = max(1, round(length_m / speed_mps / 0.25))
            for step in range(1, steps + 1):
                share = step / steps
                self.position(a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, speed_mps)
                self.now_s += length_m / steps / speed_mps - 0.01
                if step % 4 == 0:
                    self.heartbeat(mode, armed=True)
            self.row(ROVER, m.MissionItemReached(item), 0.0)

    def write(self, path: Path) -> Path:
        codecs = {sender: Codec(*sender) for _, sender, _ in self.rows}
        with TlogWriter(path) as writer:
            for time_s, sender, message in self.rows:
                link = 0 if sender[0] == ROVER[0] else SENT_LINK
                writer.write(BEGIN_S + time_s, codecs[sender].encode(message), link)
        return path
