"""Fences as drawn: inclusion and exclusion zones, from and to mission items; and reported obstacles, which are exclusions for a while."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from enum import StrEnum

from missions.errors import FenceError, InvalidPositionError
from missions.geo import LatLon, checked_lat_lon, to_e7
from missions.items import Command, CoordinateFrame, MissionItem


class ZoneKind(StrEnum):
    """Stay in, or keep out."""

    INCLUSION = "inclusion"
    EXCLUSION = "exclusion"


@dataclass(frozen=True, slots=True)
class PolygonZone:
    """A fence polygon; the ring is open (its first vertex is not repeated)."""

    kind: ZoneKind
    vertices: tuple[LatLon, ...]

    @property
    def places(self) -> tuple[LatLon, ...]:
        """The positions by which it is drawn: its vertices."""
        return self.vertices


@dataclass(frozen=True, slots=True)
class CircleZone:
    """A fence circle, its radius in metres."""

    kind: ZoneKind
    centre: LatLon
    radius_m: float

    @property
    def places(self) -> tuple[LatLon, ...]:
        """The positions by which it is drawn: its centre."""
        return (self.centre,)


Zone = PolygonZone | CircleZone


@dataclass(frozen=True, slots=True)
class Fence:
    """All zones in the order in which the autopilot holds them, and the return point if there is one."""

    zones: tuple[Zone, ...] = ()
    return_point: LatLon | None = None

    @property
    def places(self) -> list[LatLon]:
        """The positions by which its zones are drawn: vertices and centres."""
        return [place for zone in self.zones for place in zone.places]

    @property
    def vertex_count(self) -> int:
        """How many polygon vertices the fence has."""
        return sum(len(zone.vertices) for zone in self.zones if isinstance(zone, PolygonZone))

    def count(self, kind: ZoneKind, shape: type[Zone]) -> int:
        """Count the zones of one kind and shape."""
        return sum(zone.kind is kind and isinstance(zone, shape) for zone in self.zones)

    def zone_names(self) -> tuple[str, ...]:
        """Name each zone as people count them: ``exclusion polygon 2``."""
        counts: dict[str, int] = {}
        names = []
        for zone in self.zones:
            name = f"{zone.kind} {'polygon' if isinstance(zone, PolygonZone) else 'circle'}"
            counts[name] = counts.get(name, 0) + 1
            names.append(f"{name} {counts[name]}")
        return tuple(names)


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Something that was reported to stand or move in the field: an exclusion circle that grows, and ends.

    Parameters
    ----------
    position : LatLon
        Its middle, as it was seen last.
    radius_m : float
        Its size, as it was seen last.
    growth_mps : float
        How fast it may move, in any direction: its circle grows so until it is seen again.
    seen_s : float
        When it was seen last.
    time_to_live_s : float
        So long after that it is forgotten.
    source : str
        Who reported it.
    reported_s : float
        When it was reported first, in seconds since 1970; None where it is given beside a file, without a clock.
    """

    position: LatLon
    radius_m: float
    growth_mps: float
    seen_s: float
    time_to_live_s: float
    source: str
    reported_s: float | None

    @property
    def name(self) -> str:
        """What it is called: by when it was reported, in local time, by whom, and how large it is."""
        size = f"(radius {self.radius_m:.1f} m)"
        if self.reported_s is None:
            return f"{OBSTACLE} from {self.source} {size}"
        clock = datetime.fromtimestamp(self.reported_s, tz=UTC).astimezone()
        return f"{OBSTACLE} reported at {clock:%H:%M:%S} by {self.source} {size}"

    @property
    def ends_s(self) -> float:
        """When it is forgotten."""
        return self.seen_s + self.time_to_live_s

    def radius_at(self, time_s: float) -> float:
        """Return how far from its middle it may be at a time."""
        return self.radius_m + self.growth_mps * max(0.0, time_s - self.seen_s)


OBSTACLE = "obstacle"
"""How an obstacle's name begins; no zone's does."""


@dataclass(frozen=True, slots=True)
class Obstacles:
    """Obstacles as they may be at one time; nothing behind this reads a clock.

    Parameters
    ----------
    known : tuple of Obstacle
        Each as it was seen last.
    at_s : float
        The time.
    margin_m : float
        So much wider than that each is.
    """

    known: tuple[Obstacle, ...] = ()
    at_s: float = 0.0
    margin_m: float = 0.0

    def later(self, by_s: float, margin_m: float) -> Obstacles:
        """Return them as they may be some time later, with a margin."""
        return replace(self, at_s=self.at_s + by_s, margin_m=margin_m)

    def radius_m(self, obstacle: Obstacle) -> float:
        """Return how far from its middle one of them may be at that time."""
        return obstacle.radius_at(self.at_s) + self.margin_m


_VERTEX_KINDS = {
    Command.FENCE_POLYGON_VERTEX_INCLUSION: ZoneKind.INCLUSION,
    Command.FENCE_POLYGON_VERTEX_EXCLUSION: ZoneKind.EXCLUSION,
}
_CIRCLE_KINDS = {
    Command.FENCE_CIRCLE_INCLUSION: ZoneKind.INCLUSION,
    Command.FENCE_CIRCLE_EXCLUSION: ZoneKind.EXCLUSION,
}
_HOME_CIRCLE = 5005  # MAV_CMD_NAV_FENCE_HOME_CIRCLE_INCLUSION, in MAVLink's development dialect
_VERTEX_COMMANDS = {kind: command for command, kind in _VERTEX_KINDS.items()}
_CIRCLE_COMMANDS = {kind: command for command, kind in _CIRCLE_KINDS.items()}


def fence_from_items(items: Sequence[MissionItem]) -> Fence:
    """Read a fence from its mission items (MAV_CMD 5000 to 5004).

    A polygon is exactly the number of vertices that its ``param1`` gives: two neighbours of the same kind and count stay two.

    Raises
    ------
    FenceError
        With the item's number: an unknown command, a polygon of fewer than three vertices or with vertices missing, a radius that
        is not positive, an invalid position, two return points.
    """
    zones: list[Zone] = []
    return_point = None
    seq = 0
    while seq < len(items):
        item = items[seq]
        if item.command in _VERTEX_KINDS:
            polygon = _polygon(items, seq)
            zones.append(polygon)
            seq += len(polygon.vertices)
            continue
        if item.command in _CIRCLE_KINDS:
            zones.append(_circle(item, seq))
        elif item.command == Command.FENCE_RETURN_POINT:
            if return_point is not None:
                raise FenceError(f"fence item {seq}: second return point; a fence has one at most", item=seq)
            return_point = _position(item, seq)
        else:
            what = f"fence item {seq}: command {item.command}"
            if item.command == _HOME_CIRCLE:
                raise FenceError(
                    f"{what} is a circle around home, which ArduPilot Rover does not accept as a fence item",
                    item=seq,
                    advice="draw a circle with a centre of its own instead, or set FENCE_RADIUS on the vehicle",
                )
            raise FenceError(f"{what} is not a fence item", item=seq)
        seq += 1
    return Fence(tuple(zones), return_point)


def fence_to_items(fence: Fence) -> tuple[MissionItem, ...]:
    """Return a fence as mission items, as ArduPilot reads them back (frame 0, z 0)."""
    items: list[MissionItem] = []
    for zone in fence.zones:
        if isinstance(zone, PolygonZone):
            command = _VERTEX_COMMANDS[zone.kind]
            items += [_item(command, vertex, float(len(zone.vertices))) for vertex in zone.vertices]
        else:
            items.append(_item(_CIRCLE_COMMANDS[zone.kind], zone.centre, zone.radius_m))
    if fence.return_point is not None:
        items.append(_item(Command.FENCE_RETURN_POINT, fence.return_point, 0.0))
    return tuple(items)


def _item(command: Command, position: LatLon, param1: float) -> MissionItem:
    lat_e7, lon_e7 = to_e7(position)
    return MissionItem(command, CoordinateFrame.GLOBAL, (param1, 0.0, 0.0, 0.0), lat_e7, lon_e7)


def _polygon(items: Sequence[MissionItem], first: int) -> PolygonZone:
    command, param1 = items[first].command, items[first].params[0]
    kind = _VERTEX_KINDS[Command(command)]
    if math.isfinite(param1) and param1 != int(param1):
        raise FenceError(f"fence item {first}: vertex count {param1:g} is not a whole number", item=first)
    count = int(param1) if math.isfinite(param1) else 0
    if count < 3:
        raise FenceError(
            f"fence item {first}: {kind} polygon with {count} vertices; at least 3 are needed", item=first
        )
    run = items[first : first + count]
    for offset, item in enumerate(run):
        if item.command != command or item.params[0] != count:
            run = run[:offset]
            break
    if len(run) < count:
        raise FenceError(
            f"fence item {first}: {kind} polygon with {param1:g} vertices, but only {len(run)} are given",
            item=first,
        )
    return PolygonZone(kind, tuple(_position(item, first + offset) for offset, item in enumerate(run)))


def _circle(item: MissionItem, seq: int) -> CircleZone:
    radius_m = item.params[0]
    if not (math.isfinite(radius_m) and radius_m > 0):
        raise FenceError(
            f"fence item {seq}: circle radius {radius_m:g} m; it must be greater than 0", item=seq
        )
    return CircleZone(_CIRCLE_KINDS[Command(item.command)], _position(item, seq), radius_m)


def _position(item: MissionItem, seq: int) -> LatLon:
    try:
        return checked_lat_lon(*item.position)
    except InvalidPositionError as error:
        raise FenceError(f"fence item {seq}: {error}", item=seq) from None
