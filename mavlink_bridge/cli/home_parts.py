"""Ways home inside a mission for the command line: the JSON document, the lines in pictures."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

from missions.checking.home_part import home_parts
from missions.geo import distance_m
from missions.picture.scene import TrackLine

if TYPE_CHECKING:
    from collections.abc import Sequence

    from missions.checking.home_part import HomePart
    from missions.checking.home_ways import CheckedWay
    from missions.geo import LatLon
    from missions.items import MissionItem
    from missions.picture.scene import PictureScene


def parts_document(items: Sequence[MissionItem]) -> list[dict[str, object]] | None:
    """Return the ways home inside a mission for the JSON document; null where it has none."""
    return [_part_document(part) for part in home_parts(items)] or None


def ways_document(ways: Sequence[CheckedWay]) -> list[dict[str, object]] | None:
    """Return checked ways for the JSON document; null where there are none."""
    return [
        {
            **_part_document(way.part),
            "length_m": round(way.length_m, 3),
            "time_s": round(way.time_s, 1),
            "driven_clearance_m": None
            if way.driven_clearance_m == float("inf")
            else round(way.driven_clearance_m, 4),
            "trouble": way.trouble or None,
        }
        for way in ways
    ] or None


def with_parts(scene: PictureScene, items: Sequence[MissionItem]) -> PictureScene:
    """Return a scene with the ways home inside a mission."""
    local = scene.ground.frame.to_local_array
    lines = [TrackLine("way home inside", local(_path(part))) for part in home_parts(items)]
    return replace(scene, tracks=(*scene.tracks, *lines))


def _part_document(part: HomePart) -> dict[str, object]:
    path = _path(part)
    return {
        "from_item": part.leg_item,
        "item": part.item,
        "to": list(part.place),
        "path": [list(position) for position in path],
        "path_m": round(sum(distance_m(a, b) for a, b in pairwise(path)), 3),
    }


def _path(part: HomePart) -> list[LatLon]:
    return [item.position for item in part.items if item.is_placed]
