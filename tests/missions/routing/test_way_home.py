"""Ways home against a visibility graph of the tests' own, over random fields."""

from __future__ import annotations

import math
import random
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely

sys.path.insert(0, str(Path(__file__).parents[2] / "pbpp"))

from visibility_graph import shortest_length

from missions.fence import Fence, PolygonZone, ZoneKind
from missions.geo import LatLon, distance_m
from missions.rally import RallyPoint
from missions.routing.way_home import places_of, ways_home
from missions.routing.ways_along import along, way_remarks
from missions.situation import Known, Situation
from missions.vehicle import vehicle_from_parameters

ORIGIN = LatLon(48.1, 11.5)
_FLAT = 1 - 0.00669438 * math.sin(math.radians(48.1)) ** 2
EAST_M = math.radians(6_378_137.0 * math.cos(math.radians(48.1)) / math.sqrt(_FLAT))
NORTH_M = math.radians(6_378_137.0 * (1 - 0.00669438) / _FLAT**1.5)
"""Metres of a degree on the ellipsoid of WGS 84."""
VEHICLE = vehicle_from_parameters({"WP_SPEED": 2.0})


def at(east_m: float, north_m: float) -> LatLon:
    return LatLon(ORIGIN.lat_deg + north_m / NORTH_M, ORIGIN.lon_deg + east_m / EAST_M)


def flat(position: LatLon) -> tuple[float, float]:
    return (position.lon_deg - ORIGIN.lon_deg) * EAST_M, (position.lat_deg - ORIGIN.lat_deg) * NORTH_M


def polygon(kind: ZoneKind, *points: tuple[float, float]) -> PolygonZone:
    return PolygonZone(kind, tuple(at(*point) for point in points))


BOX = polygon(ZoneKind.INCLUSION, (0, 0), (100, 0), (100, 80), (0, 80))


def situation(*zones, home=(10, 10), rally=()) -> Situation:
    points = tuple(RallyPoint(*at(*point)) for point in rally)
    return Situation(
        fence=Known(Fence((BOX, *zones)), None, ""),
        home=Known(at(*home), None, "") if home else None,
        rally=Known(points, None, ""),
    )


def found(known: Situation, path, clearance_m=1.0, **given):
    return ways_home(known, VEHICLE, clearance_m, places_of(known, given), path)


def random_field(seed: int):
    chance = random.Random(seed)
    zones = []
    for _ in range(chance.randint(1, 6)):
        east_m, north_m, radius_m = chance.uniform(10, 90), chance.uniform(10, 70), chance.uniform(3, 15)
        turns = sorted(chance.uniform(0, 2 * math.pi) for _ in range(chance.randint(3, 6)))
        zones.append(
            polygon(
                ZoneKind.EXCLUSION,
                *((east_m + radius_m * math.cos(a), north_m + radius_m * math.sin(a)) for a in turns),
            )
        )
    places = [(chance.uniform(3, 97), chance.uniform(3, 77)) for _ in range(chance.randint(1, 5))]
    points = [(chance.uniform(3, 97), chance.uniform(3, 77)) for _ in range(5)]
    return zones, places, points


def lengths(free, point, places) -> list[float]:
    return [
        shortest_length(free, point, place) if free.covers(shapely.Point(place)) else np.inf
        for place in places
    ]


@pytest.mark.parametrize("seed", range(25))
def test_the_way_leads_to_the_nearest_place_that_can_be_reached(seed):
    zones, (home, *rally), points = random_field(seed)
    known = situation(*zones, home=home, rally=rally)
    path = [at(*point) for point in points]
    ways = found(known, path)
    allowed = shapely.Polygon([flat(place) for place in BOX.vertices])
    for zone in zones:
        allowed = allowed.difference(shapely.Polygon([flat(place) for place in zone.vertices]).buffer(0))
    # The planner cuts its mitred corners: its ways lie between those around round corners and around whole mitres.
    free = allowed.buffer(-1.0, join_style="mitre", mitre_limit=100.0)
    wider = allowed.buffer(-1.0, quad_segs=4)
    for point, position in zip(points, path, strict=True):
        here = shapely.Point(point)
        if abs(here.distance(free.boundary)) < 0.05 or not free.covers(here):
            continue  # which way it leads out is another test's
        most_m = lengths(free, point, (home, *rally))
        way = ways.nearest(position)
        if way is None:
            assert min(most_m) == np.inf
            continue
        number = [place.name for place in ways.places].index(way.place.name)
        least_m = lengths(wider, point, [(home, *rally)[number]])[0]
        assert least_m * 0.999 - 0.02 <= way.length_m <= most_m[number] * 1.001 + 0.02
        assert way.length_m <= 1.1 * min(most_m) * 1.001 + 0.02
        line = shapely.LineString([flat(place) for place in way.path])
        assert allowed.covers(line)
        assert line.distance(allowed.boundary) >= 1.0 - 0.02
        assert way.path[0] == pytest.approx(position, abs=1e-9)


def test_of_two_about_as_long_the_sooner_counts():
    """Around the wall's end it is 44.6 m, straight ahead 45.0 m: no corner is driven there."""
    wall = polygon(ZoneKind.EXCLUSION, (40, 38), (44, 38), (44, 80), (40, 80))
    behind, ahead, here = (46, 66.1), (3, 4), (30, 40)
    free = shapely.box(0, 0, 100, 80).difference(shapely.box(39, 37, 45, 81))
    behind_m, ahead_m = lengths(free, here, [behind, ahead])
    assert behind_m < ahead_m < 1.1 * behind_m
    way = found(situation(wall, home=behind, rally=[ahead]), [at(*here)]).nearest(at(*here))
    assert (way.place.name, way.length_m) == ("rally point 1", pytest.approx(ahead_m, abs=0.01))


def test_places_that_are_no_way_home_are_named_with_the_reason():
    barn = polygon(ZoneKind.EXCLUSION, (40, 30), (60, 30), (60, 50), (40, 50))
    known = situation(barn, home=(50, 40), rally=[(200, 10), (61.2, 40), (90, 10)])
    ways = found(known, [at(5, 5)], 2.0, shed=at(39.9, 0.5), abroad=LatLon(50.0, 11.0))
    assert ways.blocked["home"] == "it is inside exclusion polygon 1"
    assert ways.blocked["rally point 1"] == "it is outside inclusion polygon 1"
    assert ways.blocked["rally point 2"].startswith("it is 1.2")
    assert "exclusion polygon 1, and a way home keeps 2.00 m" in ways.blocked["rally point 2"]
    assert ways.blocked["abroad"] == "it is too far from the fence"
    assert "inclusion polygon 1" in ways.blocked["shed"]
    assert ways.nearest(at(5, 5)).place.name == "rally point 3"
    spike = polygon(ZoneKind.EXCLUSION, (20, 38), (50, 40), (20, 42))
    (why,) = found(situation(spike, home=(51.5, 40)), [at(5, 5)]).blocked.values()
    assert why.startswith("it is too close to a sharp corner of exclusion polygon 1")


def test_ground_without_a_way_home_is_found_on_the_route():
    wall = polygon(ZoneKind.EXCLUSION, (60, -5), (62, -5), (62, 85), (60, 85))
    known = situation(wall)
    path = [at(10, 10), at(50, 40), at(80, 40), at(80, 60)]
    ways = found(known, path)
    route = along(ways, path)
    assert [ways.nearest(position) is None for position in path] == [False, False, True, True]
    assert route.without_m == pytest.approx(18 + 20, abs=5)
    assert route.first_leg == 2
    assert distance_m(route.first_without, at(64, 40)) < 4
    (remark,) = way_remarks(ways, route, (0, 3, 5, 6))
    assert "first on the leg to item 5" in remark
    assert "none of 1 place " in remark
    closed = found(situation(wall, home=(61, 40)), path)
    assert along(closed, path).without_m == pytest.approx(along(closed, path).length_m, abs=12)
    assert closed.nearest(path[0]) is None


def test_near_a_fence_the_way_leads_straight_off_it_first():
    ways = found(situation(), [at(0.4, 40)], 2.0)
    way = ways.nearest(at(0.4, 40))
    assert way.path[0] == pytest.approx(at(0.4, 40))
    assert flat(way.path[1])[0] == pytest.approx(2.0, abs=0.05)
    assert ways.nearest(at(-3, 40)) is None
    assert ways.nearest(at(10, 10)).length_m == pytest.approx(0.0, abs=0.01)


def test_without_a_place_there_is_nothing():
    known = situation(home=None)
    assert places_of(known, {}) == ()
    assert found(known, [at(5, 5)]).nearest(at(5, 5)) is None


def test_without_an_inclusion_ways_begin_far_away_too():
    barn = polygon(ZoneKind.EXCLUSION, (40, 30), (60, 30), (60, 50), (40, 50))
    known = Situation(
        fence=Known(Fence((barn,)), None, ""), home=Known(at(-900, 40), None, ""), rally=Known((), None, "")
    )
    path = [at(400, 40), at(700, 40)]
    ways = found(known, path, shed=at(50, 800))
    assert ways.blocked == {}
    assert ways.nearest(path[0]).place.name == "shed"
    assert ways.nearest(path[0]).length_m == pytest.approx(math.hypot(350, 760), abs=0.5)
    assert along(ways, path).without_m == 0
