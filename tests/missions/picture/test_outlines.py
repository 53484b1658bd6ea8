"""Outlines and samples for maps, against shapely and pyproj alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyproj
import pytest
import shapely

from missions.fence import CircleZone, Fence, ZoneKind
from missions.formats import read_situation
from missions.geo import LatLon
from missions.picture.outlines import (
    allowed_outline,
    driven_samples,
    kept_outline,
    outline,
    route_samples,
)
from missions.planning.plan import plan
from missions.request import Tour
from missions.situation import Known

MAZE = read_situation(Path(__file__).parents[2] / "fields" / "maze-fence.waypoints")
START, TARGET = LatLon(40.071374, -105.229930), LatLon(40.0726316, -105.2290497)


@pytest.fixture(scope="module")
def planned():
    return plan(MAZE, Tour(start=START, targets=(TARGET,), clearance_m=2.5))


@pytest.fixture(scope="module")
def flat():
    """Metres by a projection that the code under test does not use."""
    project = pyproj.Transformer.from_crs(
        "EPSG:4326", f"+proj=tmerc +lat_0={START.lat_deg} +lon_0={START.lon_deg} +ellps=WGS84", always_xy=True
    )
    return lambda places: np.column_stack(
        project.transform([at.lon_deg for at in places], [at.lat_deg for at in places])
    )


def polygons(found, flat):
    return shapely.union_all(
        [shapely.Polygon(flat(rings[0]), [flat(hole) for hole in rings[1:]]) for rings in found]
    )


@pytest.fixture(scope="module")
def fence(flat):
    """What the maze allows: its one inclusion less the exclusions."""
    areas = {ZoneKind.INCLUSION: [], ZoneKind.EXCLUSION: []}
    for zone in MAZE.fence.value.zones:
        if isinstance(zone, CircleZone):
            areas[zone.kind].append(shapely.Point(flat([zone.centre])[0]).buffer(zone.radius_m, quad_segs=64))
        else:
            areas[zone.kind].append(shapely.Polygon(flat(zone.vertices)))
    return areas[ZoneKind.INCLUSION][0].difference(shapely.union_all(areas[ZoneKind.EXCLUSION]))


def test_what_is_allowed_and_what_keeps_the_clearance_are_drawn_where_they_are(planned, flat, fence):
    free = polygons(allowed_outline(planned.ground), flat)
    assert free.symmetric_difference(fence).area < 0.002 * fence.area
    kept = polygons(kept_outline(planned.ground, 2.5), flat)
    assert kept.symmetric_difference(fence.buffer(-2.5)).area < 0.005 * fence.area
    assert fence.buffer(-2.3).covers(kept)
    for rings in allowed_outline(planned.ground):
        assert shapely.LinearRing(flat(rings[0])).is_ccw
        assert not any(shapely.LinearRing(flat(hole)).is_ccw for hole in rings[1:])


def test_an_outline_of_nothing_is_empty(planned):
    assert outline(planned.ground.frame, shapely.Polygon()) == ()


def test_samples_along_a_route_are_its_room(planned, flat, fence):
    samples = route_samples(planned)
    line = shapely.LineString(flat(planned.path))
    assert 2 <= len(samples) <= 400
    assert samples[-1].along_m == pytest.approx(line.length, rel=1e-3)
    assert samples[-1].time_s == pytest.approx(planned.duration_s)
    corridor = polygons(outline(planned.ground.frame, planned.envelope.area, 0.0), flat)
    for sample in samples[::20]:
        place = line.interpolate(sample.along_m * line.length / samples[-1].along_m)
        assert sample.drawn_m == pytest.approx(place.distance(fence.boundary), abs=0.15)
        near = corridor.intersection(place.buffer(0.05)).distance(fence.boundary)
        assert sample.driven_m <= near + 0.1
        assert 0.0 <= sample.speed_mps <= planned.vehicle.speed_mps + 1e-9
    assert min(sample.driven_m for sample in samples) >= planned.driven_clearance_m - 0.01
    assert planned.driven_clearance_m >= 2.5
    # From rest to rest, and slower in a corner than on the way to it.
    speeds_mps = [sample.speed_mps for sample in samples]
    assert (speeds_mps[0], speeds_mps[-1]) == pytest.approx((0.0, 0.0), abs=0.01)
    corner_m = shapely.LineString(flat(planned.path[:2])).length
    (at_corner,) = {min(samples, key=lambda one: abs(one.along_m - corner_m)).speed_mps}
    assert at_corner < max(speeds_mps) - 0.05


def test_a_drive_is_measured_against_line_corridor_and_fence(planned, flat, fence):
    aside = [LatLon(at.lat_deg + 3e-5, at.lon_deg) for at in planned.path]
    found = driven_samples(planned, aside)
    line, corridor = (
        shapely.LineString(flat(planned.path)),
        polygons(outline(planned.ground.frame, planned.envelope.area), flat),
    )
    for sample, at in zip(found, flat(aside), strict=True):
        point = shapely.Point(at)
        room_m = point.distance(fence.boundary) if fence.covers(point) else 0.0
        assert sample.clearance_m == pytest.approx(room_m, abs=0.1)
        assert sample.deviation_m == pytest.approx(point.distance(line), abs=0.02)
        assert sample.outside_m == pytest.approx(point.distance(corridor), abs=0.03)
    assert found[-1].along_m == pytest.approx(line.length, rel=1e-2)


def test_without_a_fence_near_there_is_room_without_end():
    far = Fence((CircleZone(ZoneKind.EXCLUSION, LatLon(40.08, -105.2299), 1.0),))
    situation = replace(MAZE, fence=Known(far, None, "test"))
    made = plan(situation, Tour(start=START, targets=(TARGET,), clearance_m=2.5))
    assert route_samples(made)[0].drawn_m > 500.0
