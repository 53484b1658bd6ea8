"""What a picture of two files that differ shows: the second one as it is, the first one's route and changed zones beside it, and where they differ."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from missions.errors import SituationError
from missions.fence import CircleZone, Fence
from missions.ground.frame import frame_around
from missions.ground.ground import lay_out
from missions.picture.scene import Mark, PictureScene, TrackLine, no_points

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.geo import LatLon
    from missions.situation import Situation

_MOST_NAMES = 30  # chosen: more names cannot be read in a picture


def differences_scene(
    a: Situation, b: Situation, title: Sequence[str], marks: Sequence[tuple[LatLon, str]]
) -> PictureScene:
    """Return the scene of two files.

    Parameters
    ----------
    a, b : Situation
        What they hold; B is drawn as it is, of A what B has otherwise.
    title : sequence of str
        Its lines.
    marks : sequence of (LatLon, str)
        The places where they differ, each with a name.

    Raises
    ------
    SituationError
        There is no place in either.
    """
    fences = [one.fence.value if one.fence else Fence() for one in (a, b)]
    routes = [_route(one) for one in (a, b)]
    places = [*fences[0].places, *fences[1].places, *routes[0], *routes[1], *(place for place, _ in marks)]
    if not places:
        raise SituationError("there is no place to draw in either file")
    frame = frame_around(places)
    ground = lay_out(fences[1], frame, around=places)
    local = frame.to_local_array
    old = lay_out(fences[0], frame, around=places)
    kept = {(*tuple(zone.places), _radius(zone)) for zone in fences[1].zones}
    changed = [
        barrier
        for barrier, zone in zip(old.barriers, fences[0].zones, strict=True)
        if (*zone.places, _radius(zone)) not in kept
    ]
    tracks = [
        TrackLine("fence in A", np.array(part.exterior.coords))
        for barrier in changed
        for part in getattr(barrier.area, "geoms", [barrier.area])
    ]
    legs = set(pairwise(routes[1]))
    gone = [leg for leg in pairwise(routes[0]) if leg not in legs]
    tracks += [TrackLine("route in A", local(leg)) for leg in gone]
    numbers = _numbers(b)
    return PictureScene(
        title=tuple(title),
        ground=ground,
        zone_count=len(fences[1].zones),
        route_name="route in B",
        route=local(routes[1]) if routes[1] else no_points(),
        numbers=numbers,
        point_texts=tuple(
            f"item {number}\n{place}" for number, place in zip(numbers, routes[1], strict=True)
        ),
        marks_name="differs",
        marks=tuple(
            Mark(local([place])[0], name if len(marks) <= _MOST_NAMES else "") for place, name in marks
        ),
        tracks=tuple(tracks),
    )


def _route(situation: Situation) -> list[LatLon]:
    items = situation.mission.value.items if situation.mission else ()
    return [item.position for item in items if item.is_placed]


def _numbers(situation: Situation) -> tuple[int, ...]:
    items = situation.mission.value.items if situation.mission else ()
    return tuple(number for number, item in enumerate(items, start=1) if item.is_placed)


def _radius(zone: object) -> float:
    return zone.radius_m if isinstance(zone, CircleZone) else 0.0
