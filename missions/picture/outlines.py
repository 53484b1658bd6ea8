"""A field and a route as outlines on Earth, for maps: rings of positions, and how much room there is along the route."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LineString, Polygon

from missions.geo import LocalPoint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.geo import LatLon
    from missions.ground.frame import LocalFrame
    from missions.ground.ground import Ground
    from missions.planned import Plan

Rings = tuple[tuple["LatLon", ...], ...]
"""A polygon: its outer ring and its holes, each closed."""

Outline = tuple[Rings, ...]
"""Polygons."""

_MOST_SAMPLES = 400  # along a route; chosen: a profile on a screen shows no more
_STEP_M = 0.25  # between samples at the least: below what a position is good for; chosen, not measured
_EVEN_M = 0.01  # what may be left out of a ring that is only looked at: a pixel at any scale of a map; chosen
_ASIDE_M = 0.1  # beyond the corridor's sides, so that a section reaches across it


def outline(frame: LocalFrame, area: BaseGeometry, even_m: float = _EVEN_M) -> Outline:
    """Return the polygons of an area in local metres as rings on Earth, outer ones counter-clockwise, as GeoJSON wants them.

    Parameters
    ----------
    frame : LocalFrame
        The plane.
    area : shapely geometry
        What is no polygon in it is left out.
    even_m : float
        How far a ring may be moved to have fewer points.
    """
    plain = area.simplify(even_m) if even_m else area
    parts = [part for part in shapely.get_parts(plain) if isinstance(part, Polygon) and not part.is_empty]
    return tuple(
        tuple(
            _on_earth(frame, shapely.get_coordinates(ring)) for ring in (polygon.exterior, *polygon.interiors)
        )
        for polygon in shapely.orient_polygons(parts)
    )


def line_on_earth(frame: LocalFrame, points: NDArray[np.float64]) -> tuple[LatLon, ...]:
    """Return points in local metres, shape (n, 2), as positions."""
    return _on_earth(frame, points)


def allowed_outline(ground: Ground) -> Outline:
    """Return where the fence, as the autopilot means it, lets the vehicle be; bounds that stand in for an inclusion are part of it."""
    return outline(ground.frame, ground.allowed)


def kept_outline(ground: Ground, clearance_m: float) -> Outline:
    """Return what of the allowed area keeps a clearance to every fence."""
    return outline(ground.frame, ground.allowed.difference(ground.edge.buffer(clearance_m)))


@dataclass(frozen=True, slots=True)
class RouteSample:
    """One place along a route.

    Parameters
    ----------
    along_m : float
        How far along the drawn lines.
    time_s : float
        When the drive model expects the vehicle there, between two points of the route in proportion to the way.
    drawn_m : float
        The drawn line's distance to the nearest fence there; infinite without a fence, 0 on forbidden ground.
    driven_m : float
        The same of the predicted corridor, across the line there.
    speed_mps : float
        The speed that the drive model expects there.
    """

    along_m: float
    time_s: float
    drawn_m: float
    driven_m: float
    speed_mps: float


def route_samples(plan: Plan) -> tuple[RouteSample, ...]:
    """Return how much room a plan leaves along its route, at some hundred places at the most; none for a route of no length."""
    points = plan.points
    lengths_m = np.hypot(*np.diff(points, axis=0).T)
    marks_m = np.concatenate(([0.0], np.cumsum(lengths_m)))
    whole_m = float(marks_m[-1])
    if not whole_m:
        return ()
    count = max(2, min(_MOST_SAMPLES, math.ceil(whole_m / _STEP_M) + 1))
    along_m = np.linspace(0.0, whole_m, count)
    leg = np.clip(np.searchsorted(marks_m, along_m, side="right") - 1, 0, len(lengths_m) - 1)
    places = shapely.line_interpolate_point(LineString(points), along_m)
    drawn_m = _room_m(plan.ground, places)
    driven_m = np.minimum(drawn_m, _room_m(plan.ground, _sections(plan, places, leg)))
    times_s = np.interp(along_m, marks_m, plan.envelope.arrivals_s)
    speeds_mps = plan.envelope.speeds_mps(along_m)
    columns = (along_m, times_s, drawn_m, driven_m, speeds_mps)
    return tuple(RouteSample(*map(float, row)) for row in zip(*columns, strict=True))


def _room_m(ground: Ground, shapes: NDArray[np.object_]) -> NDArray[np.float64]:
    """Return the distance of each shape to the fence; 0 on forbidden ground."""
    if ground.edge.is_empty:
        return np.full(len(shapes), math.inf)
    room_m: NDArray[np.float64] = shapely.distance(shapes, ground.edge)
    return np.where(shapely.covers(ground.allowed, shapes), room_m, 0.0)


def _sections(plan: Plan, places: NDArray[np.object_], leg: NDArray[np.int64]) -> NDArray[np.object_]:
    """Return the corridor's section across the route at each place."""
    points, envelope = plan.points, plan.envelope
    reach_m = np.array([max(one.left_m, one.right_m, one.half_width_m) for one in envelope.legs] or [0.0])
    corners_m = [max(one.inside_cut_m, one.outside_overshoot_m) for one in envelope.corners]
    half_m = float(max([reach_m.max(), *corners_m])) + _ASIDE_M
    ways = np.diff(points, axis=0)[leg]
    ways = ways / np.maximum(np.hypot(*ways.T), 1e-9)[:, None]
    across = np.column_stack((-ways[:, 1], ways[:, 0])) * half_m
    middle = shapely.get_coordinates(places)
    lines = shapely.linestrings(np.stack((middle - across, middle + across), axis=1))
    sections = np.asarray(shapely.intersection(lines, envelope.area), dtype=object)
    # A route that passes by itself has several corridors on one line: the one at the place is meant.
    near = [_part_at(section, place) for section, place in zip(sections, places, strict=True)]
    return np.array(near, dtype=object)


def _part_at(section: BaseGeometry, place: BaseGeometry) -> BaseGeometry:
    parts = shapely.get_parts(section)
    if len(parts) < 2:
        return place if section.is_empty else section
    nearest: BaseGeometry = parts[int(np.argmin(shapely.distance(parts, place)))]
    return nearest


def _on_earth(frame: LocalFrame, points: NDArray[np.float64]) -> tuple[LatLon, ...]:
    return tuple(frame.to_lat_lon(LocalPoint(float(east_m), float(north_m))) for east_m, north_m in points)


@dataclass(frozen=True, slots=True)
class DrivenSample:
    """A place that was driven over.

    Parameters
    ----------
    along_m : float
        How far had been driven.
    clearance_m : float
        To the nearest fence; infinite without one, 0 on forbidden ground.
    deviation_m, outside_m : float
        From the drawn line, and from the predicted corridor; 0 within it.
    """

    along_m: float
    clearance_m: float
    deviation_m: float
    outside_m: float


def driven_samples(plan: Plan, positions: Sequence[LatLon]) -> tuple[DrivenSample, ...]:
    """Return what each place of a drive kept of its plan; against the fence alone, without obstacles that were reported."""
    points = plan.ground.frame.to_local_array(positions)
    places = np.asarray(shapely.points(points), dtype=object)
    steps_m = np.hypot(*np.diff(points, axis=0).T)
    along_m = np.concatenate(([0.0], np.cumsum(steps_m)))
    clearances_m = _room_m(plan.ground.enforced, places)
    deviations_m = np.asarray(shapely.distance(places, LineString(plan.points)))
    outside_m = np.asarray(shapely.distance(places, plan.envelope.area))
    columns = (along_m, clearances_m, deviations_m, outside_m)
    return tuple(DrivenSample(*map(float, row)) for row in zip(*columns, strict=True))
