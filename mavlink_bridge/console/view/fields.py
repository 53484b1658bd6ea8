"""What is shown of a field: the fence as held and as meant, home, rally points, the mission that the vehicle holds."""

from __future__ import annotations

import math
from dataclasses import replace
from hashlib import blake2s
from typing import TYPE_CHECKING, Any, Literal

from mavlink_bridge.console.view.places import multi_polygon, place, places
from mavlink_bridge.console.view.sections import (
    AskedView,
    FenceMeant,
    FenceView,
    HomeCircle,
    MissionView,
    ObstacleView,
    Polygon,
    VehicleView,
    ZoneFacts,
    ZoneFeature,
    Zones,
)
from missions.errors import MissionError
from missions.fence import CircleZone, Obstacles
from missions.geo import destination
from missions.ground.from_situation import ground_for
from missions.ground.known_fence import fence_trouble, fence_warnings
from missions.picture.outlines import allowed_outline, kept_outline
from missions.promise import known_vehicle, promise
from missions.request import Tour

if TYPE_CHECKING:
    from missions.fence import Zone
    from missions.geo import LatLon
    from missions.request import Request
    from missions.situation import Situation

Where = Literal["none", "vehicle", "file", "log", "drawn"]

_CORNERS = 72  # of a circle that is only looked at; chosen


def identity(*parts: object) -> str:
    """Return a short name for facts: another one for others."""
    return blake2s(repr(parts).encode(), digest_size=6).hexdigest()


def circle(centre: LatLon, radius_m: float) -> Polygon:
    """Return a circle as a polygon for drawing."""
    ring = [destination(centre, radius_m, -360.0 * n / _CORNERS) for n in range(_CORNERS)]
    return Polygon((places([*ring, ring[0]]),))


def _zone(index: int, name: str, zone: Zone) -> ZoneFeature:
    kind: Literal["inclusion", "exclusion"] = "inclusion" if zone.kind == "inclusion" else "exclusion"
    if isinstance(zone, CircleZone):
        facts = ZoneFacts(
            index=index,
            name=name,
            kind=kind,
            shape="circle",
            radius_m=zone.radius_m,
            centre=place(zone.centre),
        )
        return ZoneFeature(circle(zone.centre, zone.radius_m), facts)
    ring = places([*zone.vertices, zone.vertices[0]])
    return ZoneFeature(Polygon((ring,)), ZoneFacts(index=index, name=name, kind=kind, shape="polygon"))


def fence_view(situation: Situation, request: Request, where: Where) -> FenceView:
    """Return the fence of a situation, and what it comes to for its vehicle and the asked clearance.

    Parameters
    ----------
    situation : Situation
        What is known.
    request : Request
        What is asked of plans.
    where : str
        Where the fence is: on the vehicle, in a file, in a log, or drawn on the page alone.
    """
    known = situation.fence
    obstacles = _obstacles(situation)
    if known is None or not known.value.zones:
        trouble = fence_trouble(situation) or "no fence is known"
        return FenceView(id="none", trouble=trouble, obstacles=obstacles)
    fence = known.value
    features = tuple(
        _zone(index, name, zone)
        for index, (name, zone) in enumerate(zip(fence.zone_names(), fence.zones, strict=True))
    )
    view = FenceView(
        held=Zones(features),
        return_point=place(fence.return_point) if fence.return_point else None,
        obstacles=obstacles,
        where=where,
        source=known.source,
        time_s=known.time_s,
    )
    try:
        vehicle = known_vehicle(situation, request)
        view = replace(
            view,
            enabled=vehicle.fence.enforces_zones if situation.parameters else None,
            warnings=tuple(fence_warnings(vehicle, situation)),
        )
        view = replace(view, meant=_meant(situation, request))
    except MissionError as error:
        view = replace(view, trouble=str(error))
    return replace(view, id=identity(fence, view.meant, view.trouble, view.obstacles))


def _meant(situation: Situation, request: Request) -> FenceMeant:
    vehicle = known_vehicle(situation, request)
    margin_m = promise(situation, request, vehicle).promised_m
    near = [one.value.position for one in (situation.pose,) if one is not None]
    ground = ground_for(replace(situation, obstacles=Obstacles()), vehicle, near)
    home_circle = None
    if vehicle.fence.enforces_home_circle and situation.home is not None:
        home, radius_m = situation.home.value, vehicle.fence.radius_m
        home_circle = HomeCircle(place(home), radius_m, circle(home, radius_m))
    return FenceMeant(
        free=multi_polygon(allowed_outline(ground)),
        margin=multi_polygon(kept_outline(ground, margin_m)),
        margin_m=round(margin_m, 4),
        union=ground.union,
        home_circle=home_circle,
        is_bounded=any(barrier.kind == "inclusion" for barrier in ground.barriers),
    )


def _obstacles(situation: Situation) -> tuple[ObstacleView, ...]:
    known = situation.obstacles
    return tuple(
        ObstacleView(
            name=one.name,
            position=place(one.position),
            radius_m=round(known.radius_m(one), 2),
            ends_s=one.ends_s if math.isfinite(one.ends_s) else None,
        )
        for one in known.known
    )


def field_sections(situation: Situation, request: Request, where: Where) -> dict[str, Any]:
    """Return the sections that a file's field fills."""
    rally, pose = situation.rally, situation.pose
    return {
        "vehicle": VehicleView(position=place(pose.value.position)) if pose else VehicleView(),
        "fence": fence_view(situation, request, where),
        "rally": places(point.position for point in rally.value) if rally else (),
        "home": place(situation.home.value) if situation.home else None,
        "request": asked_view(request),
    }


def asked_view(request: Request) -> AskedView:
    """Return what is asked of plans."""
    plain = AskedView(
        targets=places(request.targets),
        clearance_m=request.clearance_m,
        widest=request.widest,
        speed_mps=request.speed_mps,
        reserve_m=request.reserve_m,
    )
    if not isinstance(request, Tour):
        return plain
    return replace(plain, order=str(request.order), end=str(request.end), comes_back=request.comes_back)


def mission_view(situation: Situation, *, matches_plan: bool, current_seq: int | None) -> MissionView | None:
    """Return the mission that the vehicle is known to hold; None where that is not known."""
    known = situation.mission
    if known is None:
        return None
    items = known.value.items
    return MissionView(
        id=identity(items),
        items=known.value.item_count(),
        points=places(item.position for item in items if item.is_placed),
        matches_plan=matches_plan,
        time_s=known.time_s,
        current_seq=current_seq,
    )
