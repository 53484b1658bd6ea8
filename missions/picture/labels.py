"""Names of zones in an image, where there is room: inside the zone, off the route, off the edges, off each other."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import shapely
from shapely import LineString, Point, Polygon, affinity

from missions.fence import ZoneKind
from missions.picture.scene import polygons

if TYPE_CHECKING:
    from collections.abc import Iterator

    from shapely.geometry.base import BaseGeometry

    from missions.ground.ground import Barrier
    from missions.picture.scene import Scene

_FONT_SIZE = 8  # points
_GAP_PX = 3.0  # around a name
_MARKER_PX = 16.0  # radius kept free around start and targets
_BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0}


def place_labels(axes: Any, scene: Scene) -> None:  # noqa: ANN401 - matplotlib is untyped
    """Put names on zones: every exclusion with room for one, and inclusions where there are several."""
    figure = axes.figure
    figure.draw_without_rendering()  # lays the figure out, so that metres and pixels are known of each other
    m_per_px = 1 / abs(axes.transData.transform((1, 0))[0] - axes.transData.transform((0, 0))[0])
    taken = _lines(scene, m_per_px)
    for zone, room in _zones_with_room(scene, m_per_px):
        free = room.difference(taken)
        for words in _spellings(zone.name):
            text = axes.text(
                0, 0, words, ha="center", va="center", fontsize=_FONT_SIZE, bbox=_BOX, zorder=9.5, gid="zone"
            )
            box = text.get_window_extent()
            size_m = (box.width + 2 * _GAP_PX) * m_per_px, (box.height + 2 * _GAP_PX) * m_per_px
            place = _place(free, *size_m)
            if place is None:
                text.remove()
                continue
            text.set_position((place.x, place.y))
            taken = taken.union(_box(place, *size_m))
            break


def _spellings(name: str) -> Iterator[str]:
    """Return a zone's name in ever fewer letters."""
    kind, _, rest = name.partition(" ")
    yield name
    yield f"{kind}\n{rest}"
    yield rest
    if rest.count(" ") == 1:
        shape, _, number = rest.partition(" ")
        yield f"{shape[0].upper()}{number}"


def short_name(name: str) -> str:
    """Return a zone's name in the fewest letters."""
    return list(_spellings(name))[-1]


def _zones_with_room(scene: Scene, m_per_px: float) -> Iterator[tuple[Barrier, BaseGeometry]]:
    """Return the zones to name, each with the ground that its name may stand on."""
    zones = scene.plan.ground.barriers
    gap_m = _GAP_PX * m_per_px
    for zone in zones:
        if zone.kind is ZoneKind.EXCLUSION:
            yield zone, zone.area.intersection(scene.frame).buffer(-gap_m)
    inclusions = [zone for zone in zones if zone.kind is ZoneKind.INCLUSION]
    for zone in inclusions if len(inclusions) > 1 else ():
        others = shapely.union_all([other.area for other in zones if other is not zone])
        yield zone, zone.area.intersection(scene.frame).difference(others).buffer(-gap_m)


def _lines(scene: Scene, m_per_px: float) -> BaseGeometry:
    """Return the ground that lines and markers take up."""
    legs = [LineString(leg) for leg in pairwise(scene.route)]
    track = [LineString(scene.track)] if len(scene.track) > 1 else []
    lines = shapely.union_all([*legs, *track]).buffer(2 * _GAP_PX * m_per_px)
    ends = shapely.MultiPoint([scene.route[0], *scene.targets]).buffer(_MARKER_PX * m_per_px)
    return shapely.union_all([lines, ends, scene.envelope])


def _place(free: BaseGeometry, width_m: float, height_m: float) -> Point | None:
    """Find a place for a box: the middle, else where the widest circle fits in once the ground is squeezed as the box is flat."""
    squeeze = height_m / width_m
    for part in sorted(polygons(free), key=lambda polygon: -polygon.area):
        squeezed = affinity.scale(part, squeeze, 1.0, origin=(0, 0))
        radius = shapely.maximum_inscribed_circle(squeezed, tolerance=height_m / 8)
        x, y = radius.coords[0]
        for place in (part.centroid, Point(x / squeeze, y)):
            if part.covers(_box(place, width_m, height_m)):
                return place
    return None


def _box(middle: Point, width_m: float, height_m: float) -> Polygon:
    return shapely.box(
        middle.x - width_m / 2, middle.y - height_m / 2, middle.x + width_m / 2, middle.y + height_m / 2
    )
