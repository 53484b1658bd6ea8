"""Bodies of requests turned into what the planner takes: requests, fences, missions; and files into what they hold."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from mavlink_bridge.console.view.fields import fence_view
from mavlink_bridge.console.view.places import place, places
from mavlink_bridge.console.wire import Imported, Item
from missions.errors import FenceError, InvalidPositionError, MissionFormatError, RequestError
from missions.fence import CircleZone, Fence, PolygonZone, ZoneKind
from missions.formats import NO_CHOICES, parts_of, read_situation, write_situation
from missions.geo import LatLon, checked_lat_lon
from missions.items import MissionItem, waypoint
from missions.picture import draw_plan
from missions.request import GoTo, RepairMission, Request, Tour, conditions
from missions.situation import Known, Mission, Situation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.console.view.sections import Place
    from mavlink_bridge.console.wire import CheckRequest, DrawnFence, DrawnZone, PlanRequest
    from missions.formats.parts import Part
    from missions.planned import Plan

_MOST_PLACES = 1000  # targets or waypoints in one request; chosen: more than any vehicle holds items of a mission that a person draws
_DRAWN = "drawn on the page"


def position(value: Place) -> LatLon:
    """Return a place as a position.

    Raises
    ------
    InvalidPositionError
        It is not on Earth.
    """
    return checked_lat_lon(value[1], value[0])


def _positions(values: Sequence[Place]) -> tuple[LatLon, ...]:
    if len(values) > _MOST_PLACES:
        raise RequestError(
            f"{len(values)} places: at most {_MOST_PLACES}", field="targets", value=len(values)
        )
    return tuple(map(position, values))


def plan_request(body: PlanRequest, own: Request) -> Tour:
    """Return what a page asks of a plan; what it does not say is as the command line said.

    Raises
    ------
    RequestError, InvalidPositionError
        It makes no sense.
    """
    asked: dict[str, Any] = {**conditions(own), "start": None}
    asked |= {"clearance_m": body.clearance_m, "widest": body.widest, "snap_m": body.snap_m}
    if body.clearance_m is None and not body.widest:
        asked |= {"clearance_m": own.clearance_m, "widest": own.widest}
    if body.start is not None:
        asked["start"] = position(body.start)
    if body.speed_mps is not None:
        asked["speed_mps"] = body.speed_mps
    if body.reserve_m is not None:
        asked["reserve_m"] = body.reserve_m
    return Tour(
        **asked,
        targets=_positions(body.targets),
        order=body.order,  # type: ignore[arg-type] # made the word's kind there
        end=body.end,  # type: ignore[arg-type]
        comes_back=body.comes_back,
    )


def check_request(body: CheckRequest, own: Request) -> GoTo:
    """Return what a page asks a mission's legs to keep."""
    asked: dict[str, Any] = {**conditions(own), "start": None, "widest": False}
    if body.clearance_m is not None:
        asked["clearance_m"] = body.clearance_m
    if body.reserve_m is not None:
        asked["reserve_m"] = body.reserve_m
    if body.start is not None:
        asked["start"] = position(body.start)
    return GoTo(**asked)


def repair_request(body: CheckRequest, own: Request, mission: Mission) -> RepairMission:
    """Return what a page asks of a repair."""
    asked = check_request(body, own)
    kept = {
        name: value
        for name, value in conditions(asked).items()
        if name not in ("accepts_less", "corner_allowance_m", "speed_mps", "escape", "widest")
    }
    return RepairMission(**kept, mission=mission)


def mission_of(body: CheckRequest, situation: Situation) -> Mission:
    """Return the mission that a page asks about: its items, its places, or the one that the situation holds.

    Raises
    ------
    RequestError
        There is none.
    """
    home = position(body.home) if body.home is not None else None
    if body.items:
        return Mission(tuple(map(item_of, body.items)), home)
    if body.points:
        return Mission(tuple(map(waypoint, _positions(body.points))), home)
    if situation.mission is None:
        raise RequestError(
            "no mission: draw waypoints, drop a file, or read one from the vehicle", field="items"
        )
    return situation.mission.value


def item_of(item: Item) -> MissionItem:
    """Return a mission item."""
    params = tuple(math.nan if value is None else value for value in item.params)
    a, b, c, d = params
    return MissionItem(item.command, item.frame, (a, b, c, d), item.lat_e7, item.lon_e7, item.alt_m)


def item_view(item: MissionItem) -> Item:
    """Return a mission item as it goes to the page."""
    a, b, c, d = (value if math.isfinite(value) else None for value in item.params)
    return Item(
        command=item.command,
        frame=item.frame,
        params=(a, b, c, d),
        lat_e7=item.lat_e7,
        lon_e7=item.lon_e7,
        alt_m=item.alt_m,
    )


def fence_of(drawn: DrawnFence) -> Fence:
    """Return a fence that was drawn on the page.

    Raises
    ------
    FenceError, InvalidPositionError
        A zone cannot be one.
    """
    zones = tuple(_zone(number, zone) for number, zone in enumerate(drawn.features, 1))
    return_point = position(drawn.return_point) if drawn.return_point is not None else None
    return Fence(zones, return_point)


def usable_zones(drawn: DrawnFence) -> Fence:
    """Return what of a drawn fence is a zone already."""
    zones = []
    for number, zone in enumerate(drawn.features, 1):
        with suppress(FenceError, InvalidPositionError):
            zones.append(_zone(number, zone))
    return Fence(tuple(zones))


def _zone(number: int, zone: DrawnZone) -> PolygonZone | CircleZone:
    facts = zone.properties
    kind = ZoneKind(facts.kind)
    if facts.shape == "circle":
        if facts.centre is None or facts.radius_m is None or not 0 < facts.radius_m < math.inf:
            raise FenceError(f"zone {number}: a circle needs a centre and a radius above 0", zone=number)
        return CircleZone(kind, position(facts.centre), facts.radius_m)
    ring = zone.geometry.coordinates[0] if zone.geometry and zone.geometry.coordinates else ()
    vertices = tuple(map(position, ring))
    if len(vertices) > 1 and vertices[0] == vertices[-1]:
        vertices = vertices[:-1]
    if len(vertices) < 3:
        raise FenceError(
            f"zone {number}: a polygon needs at least 3 corners, it has {len(vertices)}", zone=number
        )
    return PolygonZone(kind, vertices)


def with_fence(situation: Situation, drawn: DrawnFence | None) -> Situation:
    """Return a situation with the fence that is drawn on the page, where there is one."""
    if drawn is None:
        return situation
    return replace(situation, fence=Known(fence_of(drawn), None, _DRAWN))


# Files


def read_upload(name: str, data: bytes) -> Situation:
    """Return what a file holds that was dropped onto the page; its suffix chooses the format.

    Raises
    ------
    MissionFormatError
        It cannot be read.
    """
    plain = PurePath(name.replace("\\", "/")).name or "file"
    with TemporaryDirectory(prefix="pbpp-") as folder:
        path = Path(folder) / f"dropped{PurePath(plain).suffix}"
        path.write_bytes(data)
        try:
            return read_situation(path, NO_CHOICES)
        except MissionFormatError as error:  # by the name that the person knows
            details = {**error.details, "file": plain}
            raise MissionFormatError(str(error).replace(str(path), plain), **details) from None


def imported(name: str, held: Situation, situation: Situation, request: Request) -> Imported:
    """Return what a file holds as the page shows it; its fence as it comes to for the vehicle that is known."""
    fence = None
    if held.fence is not None:
        merged = replace(situation, fence=held.fence, home=situation.home or held.home)
        fence = fence_view(merged, request, "file")
    items = held.mission.value.items if held.mission else ()
    return Imported(
        name=name,
        parts=tuple(map(str, parts_of(held))),
        fence=fence,
        items=tuple(map(item_view, items)),
        points=places(item.position for item in items if item.is_placed),
        rally=places(point.position for point in held.rally.value) if held.rally else (),
        home=place(held.home.value) if held.home else None,
        parameters=len(held.parameters),
        remarks=held.remarks,
    )


def written(situation: Situation, suffix: str, part: Part | None = None) -> tuple[bytes, tuple[Part, ...]]:
    """Return a file's bytes and what of the situation is in them.

    Raises
    ------
    MissionFormatError
        The format is unknown, or does not hold it.
    """
    found: list[bytes] = []
    name = Path(f"export{suffix if suffix.startswith('.') else '.' + suffix}")
    try:
        parts = write_situation(situation, name, part, write=lambda _path, data: found.append(data))
    except MissionFormatError as error:
        details = {key: value for key, value in error.details.items() if key != "file"}
        raise MissionFormatError(str(error).removeprefix(f"{name}: "), **details) from None
    return found[0], parts


def picture(plan: Plan) -> bytes:
    """Return a picture of a plan, as ``--plot`` draws it."""
    found: list[bytes] = []
    draw_plan(plan, Path("plan.svg"), write=lambda _path, data: found.append(data))
    return found[0]
