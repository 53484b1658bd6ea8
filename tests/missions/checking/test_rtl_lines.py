"""Where RTL leads: the autopilot's choice, and that no place that it may choose is overlooked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.checking.mission_end import return_warnings
from missions.checking.rtl_lines import (
    RALLY_ONLY,
    Metric,
    ReturnRule,
    RoutePieces,
    chosen_place,
    may_choose,
    return_place,
    swept,
)
from missions.errors import VehicleError
from missions.fence import Fence, PolygonZone, ZoneKind
from missions.geo import LatLon, LocalPoint
from missions.ground.frame import autopilot_distance_m, frame_around
from missions.ground.from_situation import ground_for
from missions.rally import RallyPoint
from missions.situation import Known, Situation
from missions.vehicle import vehicle_from_parameters

ORIGIN = LatLon(48.1, 11.5)
FRAME = frame_around([ORIGIN])
metres = st.floats(-300, 300)
points = st.tuples(metres, metres)


def at(east_m: float, north_m: float) -> LatLon:
    return FRAME.to_lat_lon(LocalPoint(east_m, north_m))


def polygon(kind: ZoneKind, *corners: tuple[float, float]) -> PolygonZone:
    return PolygonZone(kind, tuple(at(*corner) for corner in corners))


FIELD = polygon(ZoneKind.INCLUSION, (-400, -400), (400, -400), (400, 400), (-400, 400))
BARN = polygon(ZoneKind.EXCLUSION, (40, 10), (60, 10), (60, 30), (40, 30))


def known(*rally: tuple[float, float], home=(0.0, 0.0), **parameters: float) -> Situation:
    return Situation(
        fence=Known(Fence((FIELD, BARN)), None, ""),
        home=Known(at(*home), None, ""),
        rally=Known(tuple(RallyPoint(*at(*point)) for point in rally), None, ""),
        parameters=parameters,
    )


def leads_to(situation: Situation, here: tuple[float, float]) -> LatLon | None:
    return return_place(situation, at(*here), situation.home.value)


def test_the_nearest_counts_and_home_is_one_of_them_unless_it_was_changed():
    situation = known((100, 0), (0, 100))
    assert leads_to(situation, (90, 0)) == at(100, 0)
    assert leads_to(situation, (20, 30)) == at(0, 0)
    alone = replace(situation, parameters={"RALLY_INCL_HOME": 0.0})
    assert leads_to(alone, (20, 30)) == at(0, 100)


def test_beyond_the_limit_it_is_home_however_far():
    situation = known((100, 0), home=(-390, 0), RALLY_LIMIT_KM=0.05, RALLY_INCL_HOME=0.0)
    assert leads_to(situation, (60, 0)) == at(100, 0)
    assert leads_to(situation, (40, 0)) == at(-390, 0)
    assert leads_to(replace(situation, parameters={"RALLY_LIMIT_KM": 0.0}), (300, 0)) == at(100, 0)
    with pytest.raises(VehicleError, match="RALLY_LIMIT_KM"):
        leads_to(replace(situation, parameters={"RALLY_LIMIT_KM": -1.0}), (0, 0))


def test_without_rally_points_it_is_home_and_without_home_the_nearest_point():
    assert leads_to(known(), (5, 5)) == at(0, 0)
    situation = known((100, 0), (0, 100))
    assert return_place(situation, at(90, 0), None) == at(100, 0)
    assert return_place(Situation(), at(90, 0), None) is None


@given(
    rally=st.lists(points, max_size=4),
    home=points | st.none(),
    leg=st.tuples(points, points),
    includes_home=st.booleans(),
    limit_m=st.sampled_from([0.0, 50.0, 200.0]),
    piece_m=st.sampled_from([60.0, 1000.0]),
)
@settings(max_examples=80, deadline=None)
def test_no_place_that_may_be_chosen_is_overlooked(rally, home, leg, includes_home, limit_m, piece_m):
    rule = ReturnRule(includes_home, limit_m)
    pieces = RoutePieces.of(np.array(leg), piece_m, 1000)
    ground = ground_for(known(), vehicle_from_parameters({}), [ORIGIN])
    metric = Metric.of(ground, 900.0)
    middles = (pieces.starts + pieces.ends) / 2
    within_m = pieces.lengths_m * metric.steepest + metric.slack_m
    frame = ground.frame
    places = [frame.to_local(at(*point)) for point in rally]
    rally_m = metric.distances_m(np.array(places).reshape(-1, 2), middles)
    home_m = None
    if home is not None:
        home_m = metric.distances_m(np.array([frame.to_local(at(*home))]), middles)[0]
    chosen = may_choose(rally_m, home_m, rule, within_m)
    assert chosen.shape == (len(rally) + 1, len(pieces))
    if home is None:
        return
    goals = [*(at(*point) for point in rally), at(*home)]
    for piece in range(len(pieces)):
        for share in (0.0, 0.3, 0.5, 1.0):
            east_m, north_m = pieces.starts[piece] + share * (pieces.ends[piece] - pieces.starts[piece])
            here = frame.to_lat_lon(LocalPoint(float(east_m), float(north_m)))
            place = chosen_place(goals[:-1], here, goals[-1], rule)
            assert any(chosen[number, piece] for number, goal in enumerate(goals) if goal == place)


@given(a=points, b=points, c=points)
@settings(max_examples=200, deadline=None)
def test_the_planes_distances_differ_from_the_autopilots_by_no_more_than_is_said(a, b, c):
    ground = ground_for(known(), vehicle_from_parameters({}), [ORIGIN])
    metric = Metric.of(ground, 900.0)
    here, one, other = (at(*point) for point in (a, b, c))
    local = [np.array([ground.frame.to_local(place)]) for place in (here, one, other)]
    ours_m = metric.distances_m(local[1], local[0]) - metric.distances_m(local[2], local[0])
    theirs_m = autopilot_distance_m(here, one) - autopilot_distance_m(here, other)
    assert abs(float(ours_m[0, 0]) - theirs_m) <= metric.slack_m


def test_pieces_are_the_route_and_no_longer_than_asked():
    route = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 0.0), (10.0, 3.0)])
    pieces = RoutePieces.of(route, 2.0, 1000)
    assert pieces.legs.tolist() == [0] * 5 + [1] + [2] * 2
    assert pieces.lengths_m.max() <= 2.0 + 1e-9
    np.testing.assert_allclose(pieces.starts[1:], pieces.ends[:-1])
    assert len(RoutePieces.of(route, 0.001, 50)) <= 50
    hulls, place, piece = swept(pieces, np.array([(0.0, 9.0)]), np.array([[True] + [False] * 7]))
    assert (place.tolist(), piece.tolist(), hulls[0].area) == ([0], [0], pytest.approx(9.0))


def warned(situation: Situation, *path: tuple[float, float]) -> list[str]:
    vehicle = vehicle_from_parameters(situation.parameters)
    route = [at(*point) for point in path]
    ground = ground_for(situation, vehicle, [*route, situation.home.value])
    return return_warnings(situation, vehicle, ground, route)


def test_a_rally_point_that_is_nearest_only_from_the_middle_of_a_leg_is_looked_at():
    """From both ends of the leg RTL is free; from its middle the nearest point stands behind the barn."""
    situation = known((-60, 0), (160, 0), (50, 40), home=(-390, 0))
    (text,) = warned(situation, (-60, -10), (160, -10))
    assert "to the nearest rally point or home" in text
    assert "exclusion polygon 1" in text
    assert "from 1 of 1 legs" in text
    assert warned(known((-60, 0), (160, 0), home=(-390, 0)), (-60, -10), (160, -10)) == []


def test_home_counts_where_nothing_says_otherwise():
    situation = known((50, 60), home=(50, 40))
    assert warned(situation, (50, 0), (50, -5))
    assert (
        warned(
            replace(known((50, -60), home=(50, 40)), parameters={"RALLY_INCL_HOME": 0.0}), (50, 0), (50, -5)
        )
        == []
    )


def test_without_a_place_nothing_is_warned_of():
    situation = replace(known(), home=None)
    vehicle = vehicle_from_parameters({})
    ground = ground_for(situation, vehicle, [ORIGIN])
    assert return_warnings(situation, vehicle, ground, [at(0, 0), at(5, 0)]) == []
    nothing = replace(situation, rally=None)
    assert return_warnings(nothing, vehicle, ground, [at(0, 0), at(5, 0)]) == []
    assert ReturnRule.of({"RALLY_INCL_HOME": 0.0, "RALLY_LIMIT_KM": 0.0}) == RALLY_ONLY
