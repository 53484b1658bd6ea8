"""A fence laid out in the plane: where the vehicle may be, and which zone stands near.

Everything errs to the safe side: exclusion circles become polygons drawn around them, inclusion circles polygons drawn inside, each at
the worse of the true metre and the autopilot's. Rings that cross themselves are read by the even-odd rule, as the autopilot tests them.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LinearRing, MultiPolygon, Point, Polygon
from shapely.ops import nearest_points

from missions.errors import FenceError, SituationError
from missions.fence import CircleZone, Obstacles, PolygonZone, Zone, ZoneKind
from missions.geo import distance_m, upper_distance_m
from missions.ground.frame import LocalFrame, autopilot_line, autopilot_scale, bow_m

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.fence import Fence
    from missions.geo import LatLon

Area = Polygon | MultiPolygon

_NO_OBSTACLES = Obstacles()

CIRCLE_TOLERANCE_M = 0.05
"""How far a circle's polygon may stand off the circle."""

EDGE_BOW_M = 1e-3
"""How far a fence's line may stand off the autopilot's."""

COMMON_GROUND = "the autopilot allows only the intersection of all inclusions"
COMMON_GROUND_ADVICE = "draw the area as one inclusion polygon (pbpp fence merge makes it)"
_COMMON_GROUND = f"{COMMON_GROUND}: {COMMON_GROUND_ADVICE}"
_WALL_M = 1e-3  # thickness of a line made an area: a millimetre, below degE7's 11 mm
_CIRCLE_PAD_M = 1e-4  # what the autopilot's flat metres lose on a circle of kilometres
_OPEN_GROUND_M = 500.0  # of ground around everything where no inclusion bounds it; chosen, not measured
_MOST_RADIUS_M = (
    1_000_000.0  # ten times the farthest that can be planned to; the autopilot's flat metres end before
)


@dataclass(frozen=True, eq=False)
class Barrier:
    """A fence zone in the plane: its name as people count it, and its area in local metres; or a reported obstacle, of which the vehicle does not know."""

    name: str
    kind: ZoneKind
    area: Area
    is_reported: bool = False
    is_home_circle: bool = False


@dataclass(frozen=True, eq=False)
class Ground:
    """The field in the plane.

    Parameters
    ----------
    frame : LocalFrame
        The plane.
    barriers : tuple of Barrier
        Every zone, the home circle included.
    union : bool
        Whether one inclusion is enough (else all inclusions at once).
    bounds : Polygon
        A box around everything, the stand-in for an inclusion where the fence has none.
    warnings : tuple of str
        What was found odd in the fence.
    obstacles : Obstacles
        What was reported beside the fence, with the time for which it is laid out.
    """

    frame: LocalFrame
    barriers: tuple[Barrier, ...]
    union: bool
    bounds: Polygon
    warnings: tuple[str, ...]
    obstacles: Obstacles = _NO_OBSTACLES

    def areas(self, kind: ZoneKind) -> list[Area]:
        """Return the areas of one kind; the bounds where there is no inclusion."""
        found = [barrier.area for barrier in self.barriers if barrier.kind is kind]
        return found or ([self.bounds] if kind is ZoneKind.INCLUSION else [])

    @cached_property
    def keep_in(self) -> BaseGeometry:
        """The inclusions, met or joined."""
        inclusions = self.areas(ZoneKind.INCLUSION)
        if self.union:
            return shapely.union_all(inclusions)
        area: BaseGeometry = inclusions[0]
        for inclusion in inclusions[1:]:
            area = _polygons(area.intersection(inclusion))
        return area

    @cached_property
    def allowed(self) -> BaseGeometry:
        """Where the fence lets the vehicle be."""
        return self.keep_in.difference(shapely.union_all(self.areas(ZoneKind.EXCLUSION)))

    @cached_property
    def edge(self) -> BaseGeometry:
        """The line the vehicle must keep off, without the bounds."""
        return self.allowed.boundary.difference(self.bounds.boundary.buffer(_WALL_M))

    @cached_property
    def enforced(self) -> Ground:
        """What of it the vehicle knows: the fence, without reported obstacles."""
        fence = tuple(barrier for barrier in self.barriers if not barrier.is_reported)
        return self if len(fence) == len(self.barriers) else replace(self, barriers=fence)

    @property
    def avoided_edge(self) -> BaseGeometry:
        """The edge that the vehicle's own avoidance sees."""
        return self.enforced.edge

    def clearance_m(self, shape: BaseGeometry) -> float:
        """Return a shape's least distance to forbidden ground; 0 where it touches it, infinite without any."""
        if not self.allowed.covers(shape):
            return 0.0
        return math.inf if self.edge.is_empty else float(shape.distance(self.edge))

    def nearest(self, shape: BaseGeometry) -> tuple[Barrier | None, float]:
        """Return the barrier nearest to a shape and its distance in metres."""
        distances = [(self.distance_m(barrier, shape), i) for i, barrier in enumerate(self.barriers)]
        if not distances:
            return None, math.inf
        distance_m, index = min(distances)
        return self.barriers[index], distance_m

    def distance_m(self, barrier: Barrier, shape: BaseGeometry) -> float:
        """Return a shape's distance to a barrier: to an exclusion's area, to an inclusion's edge."""
        if barrier.kind is ZoneKind.EXCLUSION:
            return float(barrier.area.distance(shape))
        if self.union:  # an inclusion's edge inside another one is no edge
            edge = barrier.area.boundary.intersection(self.keep_in.boundary.buffer(_WALL_M))
            return math.inf if edge.is_empty else float(edge.distance(shape))
        return float(barrier.area.boundary.distance(shape))

    def forbidding(self, point: Point) -> list[Barrier]:
        """Return the barriers that forbid a point: exclusions around it, inclusions it is outside of."""
        outside = [b for b in self.barriers if b.kind is ZoneKind.INCLUSION and not b.area.covers(point)]
        inclusions = sum(barrier.kind is ZoneKind.INCLUSION for barrier in self.barriers)
        if self.union and len(outside) < inclusions:
            outside = []
        return [b for b in self.barriers if b.kind is ZoneKind.EXCLUSION and b.area.covers(point)] + outside

    def is_in_some_inclusions_only(self, point: Point) -> bool:
        """Return whether a point is forbidden although a drawn inclusion covers it, because other drawn ones do not."""
        inclusions = [b for b in self.barriers if b.kind is ZoneKind.INCLUSION and not b.is_home_circle]
        covered = sum(barrier.area.covers(point) for barrier in inclusions)
        return not self.union and 0 < covered < len(inclusions)

    def nearest_point(self, area: BaseGeometry, point: Point) -> Point:
        """Return the point of an area nearest to a point."""
        return nearest_points(area, point)[0]


def lay_out(
    fence: Fence,
    frame: LocalFrame,
    *,
    union: bool = False,
    home: LatLon | None = None,
    home_radius_m: float | None = None,
    home_radius_name: str = "FENCE_RADIUS",
    around: Sequence[LatLon] = (),
) -> Ground:
    """Lay a fence out in the plane.

    Parameters
    ----------
    fence : Fence
        The zones.
    frame : LocalFrame
        The plane.
    union : bool
        FENCE_OPTIONS bit 1 (value 2): inside one inclusion is enough.
    home : LatLon, optional
        The centre of the home circle.
    home_radius_m : float, optional
        FENCE_RADIUS where the autopilot enforces it; it holds whatever ``union`` is.
    home_radius_name : str
        The parameter that sets it.
    around : sequence of LatLon
        Places that must lie within the bounds where the fence has no inclusion.

    Raises
    ------
    SituationError
        The home circle is enforced and home is not known.
    FenceError
        An inclusion without area, a circle wider than any field, or a union with none of it within the home circle.
    """
    warnings: list[str] = []
    barriers = [
        Barrier(name, zone.kind, _area(zone, name, frame, warnings))
        for name, zone in zip(fence.zone_names(), fence.zones, strict=True)
    ]
    inclusions = sum(zone.kind is ZoneKind.INCLUSION for zone in fence.zones)
    if inclusions > 1 and not union:
        warnings.append(f"the fence has {inclusions} inclusions; {_COMMON_GROUND}")
    if home_radius_m is not None:
        circle = _home_circle(home, home_radius_m, home_radius_name)
        name = f"home circle ({home_radius_name} {home_radius_m:g} m)"
        area = _area(circle, name, frame, warnings)
        if union and any(barrier.kind is ZoneKind.INCLUSION for barrier in barriers):
            barriers = _within(barriers, area, name)
        else:
            barriers.append(Barrier(name, ZoneKind.INCLUSION, area, is_home_circle=True))
    points = frame.to_local_array(around)
    extent = shapely.union_all([*(b.area.envelope for b in barriers), shapely.MultiPoint(points)])
    bounds = extent.envelope.buffer(_OPEN_GROUND_M, join_style="mitre")
    return Ground(frame, tuple(barriers), union, bounds, tuple(warnings))


def check_ground(ground: Ground) -> None:
    """Refuse a fence that leaves no ground.

    Raises
    ------
    FenceError
        No allowed ground is left; the message names the zones.
    """
    if not ground.allowed.is_empty:
        return
    inclusions = [barrier.name for barrier in ground.barriers if barrier.kind is ZoneKind.INCLUSION]
    names = " and ".join(inclusions)
    if not ground.keep_in.is_empty:
        raise FenceError(f"the exclusions cover all of {names}", zones=inclusions)
    drawn = [b.area for b in ground.barriers if b.kind is ZoneKind.INCLUSION and not b.is_home_circle]
    is_circle_apart = len(drawn) < len(inclusions) and not shapely.intersection_all(drawn).is_empty
    why = "set home inside the fence, or a larger radius" if is_circle_apart else _COMMON_GROUND
    raise FenceError(f"{names} have no area in common; {why}", zones=inclusions)


def _within(barriers: list[Barrier], circle: Area, name: str) -> list[Barrier]:
    """Cut a union's inclusions to the home circle, which limits even the union; inclusions beyond it are left out."""
    found = []
    for barrier in barriers:
        area = _polygons(barrier.area.intersection(circle))
        if barrier.kind is ZoneKind.EXCLUSION:
            found.append(barrier)
        elif not area.is_empty:
            found.append(Barrier(f"{barrier.name} within the {name}", barrier.kind, area))
    if not any(barrier.kind is ZoneKind.INCLUSION for barrier in found):
        raise FenceError(f"no inclusion overlaps the {name}: there is no allowed area", zone=name)
    return found


def _home_circle(home: LatLon | None, radius_m: float, name: str) -> CircleZone:
    if home is None:
        raise SituationError(
            f"the autopilot enforces a circle of {name} {radius_m:g} m around home, but home is unknown; "
            "use --home LAT,LON",
            fence_radius_m=radius_m,
        )
    return CircleZone(ZoneKind.INCLUSION, home, radius_m)


def _area(zone: Zone, name: str, frame: LocalFrame, warnings: list[str]) -> Area:
    if isinstance(zone, CircleZone):
        if not zone.radius_m <= _MOST_RADIUS_M:
            raise FenceError(
                f"{name} has a radius of {zone.radius_m:g} m; the limit is {_MOST_RADIUS_M:g} m",
                zone=name,
                radius_m=zone.radius_m,
            )
        return _circle(zone, frame)
    return _polygon(zone, name, frame, warnings)


def _polygon(zone: PolygonZone, name: str, frame: LocalFrame, warnings: list[str]) -> Area:
    ring = frame.to_local_array(_autopilot_ring(zone.vertices))
    plain = Polygon(ring)
    # Of what is thinner than a wall, rounding decides whether it has an area at all.
    thin = plain.area <= _WALL_M * plain.length
    if plain.is_valid and plain.area > 0 and not (thin and zone.kind is ZoneKind.EXCLUSION):
        return plain
    area = _even_odd(ring)
    warnings.append(
        f"{name} has no area"
        if thin and area.area <= _WALL_M * plain.length
        else f"{name} crosses or touches itself; its inside is found by the even-odd rule, as on the autopilot"
    )
    if zone.kind is ZoneKind.EXCLUSION:  # its lines were drawn to keep something out: they stay walls
        return _polygons(area.union(_walls(ring)))
    if area.is_empty:
        raise FenceError(f"{name} has no area: there is no allowed area", zone=name)
    return area


def _autopilot_ring(vertices: Sequence[LatLon]) -> list[LatLon]:
    """Put points on long edges, so that they bow as the autopilot's do: straight in latitude and longitude."""
    ring: list[LatLon] = []
    for a, b in itertools.pairwise([*vertices, vertices[0]]):
        lat_deg = max(abs(a.lat_deg), abs(b.lat_deg))
        if bow_m(upper_distance_m(a, b), lat_deg) <= EDGE_BOW_M:  # most edges are short
            pieces = 1
        else:
            bowed_m = bow_m(distance_m(a, b), lat_deg)
            pieces = max(
                1, math.ceil(math.sqrt(bowed_m / EDGE_BOW_M))
            )  # a bow shrinks with the square of the length
        ring += autopilot_line(a, b, pieces)[:-1]
    return ring


def _even_odd(ring: NDArray[np.float64]) -> Area:
    """Return the area of a self-crossing ring that a ray from a point crosses an odd number of times to leave."""
    lines = shapely.union_all([LinearRing(ring)])
    faces = shapely.get_parts(shapely.polygonize([lines]))
    inside = [face for face in faces if _crossings(ring, face.representative_point()) % 2]
    return _polygons(shapely.union_all(inside))


def _walls(ring: NDArray[np.float64]) -> BaseGeometry:
    """Return a ring's line as a thin wall, edge by edge: buffered whole, a line that doubles back can lose an end."""
    edges = shapely.linestrings(np.stack((ring, np.roll(ring, -1, axis=0)), axis=1))
    return shapely.union_all(shapely.buffer(edges, _WALL_M, cap_style="square"))


def _polygons(shape: BaseGeometry) -> Area:
    """Leave of a shape what has an area."""
    return MultiPolygon([part for part in shapely.get_parts(shape) if isinstance(part, Polygon)])


def _crossings(ring: NDArray[np.float64], point: Point) -> int:
    """Count the ring's edges that a ray from a point to the east crosses."""
    a, b = ring, np.roll(ring, -1, axis=0)
    spans = (a[:, 1] > point.y) != (b[:, 1] > point.y)
    a, b = a[spans], b[spans]
    crossing_east_m = a[:, 0] + (point.y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return int((crossing_east_m > point.x).sum())


def _circle(zone: CircleZone, frame: LocalFrame) -> Polygon:
    """Return a polygon around an exclusion circle, or inside an inclusion circle."""
    half_deg = zone.radius_m / 1.1e5
    south_deg, north_deg = zone.centre.lat_deg - half_deg, zone.centre.lat_deg + half_deg
    # The autopilot's metre grows towards the poles: it is least and most at the circle's ends, or on the equator.
    scales = [
        *autopilot_scale(south_deg),
        *autopilot_scale(north_deg),
        *autopilot_scale(max(south_deg, min(0.0, north_deg))),
    ]
    corners = max(16, math.ceil(math.pi / math.acos(1 - CIRCLE_TOLERANCE_M / max(zone.radius_m, 1.0))))
    if zone.kind is ZoneKind.EXCLUSION:
        radius_m = zone.radius_m * max(1.0, *scales) / math.cos(math.pi / corners) + _CIRCLE_PAD_M
    else:
        radius_m = max(zone.radius_m * min(1.0, *scales) - _CIRCLE_PAD_M, _WALL_M)
    angles_rad = (np.arange(corners) + 0.5) * (2 * math.pi / corners)
    centre = frame.to_local(zone.centre)
    ring = np.column_stack((np.cos(angles_rad), np.sin(angles_rad))) * radius_m + centre
    return Polygon(ring)
