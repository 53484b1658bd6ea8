"""Rally points on random fields, checked by `benchmarks/rally.py` without the product's geometry; and each rule by itself."""

from __future__ import annotations

import contextlib
import itertools
import random
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from missions.checking.check import check_mission
from missions.errors import NoRouteError, RouteError
from missions.fence import Fence, PolygonZone, ZoneKind
from missions.geo import LatLon, LocalPoint
from missions.ground.frame import frame_around
from missions.items import waypoint
from missions.request import GoTo
from missions.routing.rally_points import choose_rally_points
from missions.routing.rally_search import Candidates, fewest
from missions.situation import Known, Mission, Situation

PATH = list(sys.path)
sys.path.append(str(Path(__file__).parents[3] / "benchmarks"))
from drive_fields import make_field  # noqa: E402
from drive_more_fields import make_more  # noqa: E402
from rally import judged, one_field  # noqa: E402

sys.path[:] = PATH  # modules of the benchmarks have names of rooms of the tests

FRAME = frame_around([LatLon(48.1, 11.5)])


def at(east_m: float, north_m: float) -> LatLon:
    return FRAME.to_lat_lon(LocalPoint(east_m, north_m))


def box(kind: ZoneKind, west: float, south: float, east: float, north: float) -> PolygonZone:
    return PolygonZone(kind, (at(west, south), at(east, south), at(east, north), at(west, north)))


FIELD = box(ZoneKind.INCLUSION, -10, -10, 110, 70)
WALL = box(ZoneKind.EXCLUSION, 20, 29, 120, 31)
SECOND = box(ZoneKind.EXCLUSION, -20, 49, 80, 51)


def chosen(*route, zones=(FIELD, WALL), home=(0.0, 0.0), most=10, clearance_m=2.0, parameters=(), **asked):
    situation = Situation(
        fence=Known(Fence(zones), None, ""), home=Known(at(*home), None, ""), parameters=dict(parameters)
    )
    request = GoTo(clearance_m=clearance_m, start=at(*route[0]), **asked)
    mission = Mission(tuple(waypoint(at(*point)) for point in route[1:]), at(*home))
    checked = check_mission(mission, situation, request)
    return choose_rally_points(checked, situation, request, most)


ROUND_THE_WALL = ((0.0, 0.0), (100.0, 10.0), (10.0, 30.0), (100.0, 50.0))


@pytest.mark.parametrize(
    ("make", "seed"),
    [  # `benchmarks/rally.py` goes on, with the same fields and two hundred of each kind
        (make_field, 11),
        (make_more, 11),
        pytest.param(make_field, 15, marks=pytest.mark.campaign),
        pytest.param(make_more, 15, marks=pytest.mark.campaign),
    ],
)
def test_from_every_point_of_a_route_the_line_to_the_nearest_is_free(make, seed):
    result = one_field(make(seed), 10)
    assert result is not None
    assert result.count is not None, result.text
    assert result.lines > 1000
    assert result.broken == 0


def test_the_benchmark_finds_lines_that_are_not_free():
    """What judges is judged: straight through the walls to a point at the target."""
    field = make_field(11)
    straight = SimpleNamespace(points=(field.target,), keep_m=1.5, clearance_m=1.0)
    lines, broken, least_m = judged(field, [field.start, field.target], straight)
    assert 100 < broken <= lines
    assert least_m < -0.5


def test_one_point_where_one_sees_everything_and_home_where_it_does():
    choice = chosen((0.0, 0.0), (10.0, 10.0))
    assert len(choice.points) == 1
    assert choice.has_home
    assert choice.points[0] == pytest.approx(at(0, 0), abs=1e-7)
    assert choice.borders == ()
    assert (choice.clearance_m, choice.asked_m, choice.left_out_m) == (2.0, 2.0, 0.0)


def test_none_are_chosen_for_px4_whose_rtl_takes_them_otherwise():
    with pytest.raises(RouteError, match=r"rally points are chosen for ArduPilot's RTL; the vehicle is PX4"):
        chosen((0.0, 0.0), (60.0, 10.0), parameters={"RO_SPEED_LIM": 2.0, "RA_WHEEL_BASE": 0.321})


def test_more_where_a_wall_stands_between():
    choice = chosen(*ROUND_THE_WALL)
    assert 1 <= len(choice.points) <= 3
    assert choice.keep_m > 2.0
    assert 0.3 < choice.field_share <= 1.0
    assert choice.lines


def test_where_too_few_are_allowed_the_rest_is_named():
    with pytest.raises(
        NoRouteError,
        match=r"at most 1 rally points.* keeps 2.00 m from the whole route: with the best set found the line is not free from \d+ m of",
    ) as failed:
        chosen(
            (100.0, 10.0),
            (5.0, 10.0),
            (5.0, 40.0),
            (95.0, 40.0),
            (95.0, 60.0),
            (0.0, 60.0),
            zones=(FIELD, WALL, SECOND),
            most=1,
        )
    assert "--accept-less" in failed.value.details["advice"]
    assert failed.value.details["left_m"] > 0


def test_less_is_kept_only_where_that_is_accepted():
    """A lane of 5 m: 2 m on either side and the corridor do not fit."""
    lane = (box(ZoneKind.INCLUSION, -10, -2.2, 110, 2.2),)
    route = ((0.0, 0.0), (100.0, 0.0))
    with pytest.raises(NoRouteError, match="no set of at most 10"):
        chosen(*route, zones=lane)
    choice = chosen(*route, zones=lane, accepts_less=True)
    assert choice.clearance_m == pytest.approx(1.5)
    assert choice.asked_m == 2.0
    with pytest.raises(NoRouteError, match="no set") as failed:
        chosen(*route, zones=(box(ZoneKind.INCLUSION, -10, -0.2, 110, 0.2),), accepts_less=True)
    assert "--accept-less" not in failed.value.details["advice"]


def test_a_route_that_begins_near_a_fence_needs_no_more_than_it_has_there():
    choice = chosen((0.0, -9.0), (0.0, 10.0), (40.0, 10.0))
    assert choice.clearance_m == 2.0
    assert choice.left_out_m == 0.0


def test_what_lies_on_forbidden_ground_is_left_out_and_told():
    choice = chosen((60.0, 10.0), (60.0, 50.0))
    assert choice.left_out_m == pytest.approx(2.0, abs=1.1)
    assert choice.route_m == pytest.approx(40.0, abs=0.1)


def test_without_an_inclusion_and_far_from_any_fence():
    choice = chosen((0.0, 0.0), (60.0, 0.0), zones=(box(ZoneKind.EXCLUSION, 20, 29, 120, 31),))
    assert choice.points
    assert choice.has_home


def test_a_search_that_nobody_waits_for_ends():
    situation = Situation(fence=Known(Fence((FIELD, WALL)), None, ""), home=Known(at(0, 0), None, ""))
    request = GoTo(clearance_m=2.0, start=at(*ROUND_THE_WALL[0]))
    mission = Mission(tuple(waypoint(at(*point)) for point in ROUND_THE_WALL[1:]), at(0, 0))
    checked = check_mission(mission, situation, request)
    asked = itertools.count()
    with contextlib.suppress(NoRouteError):
        choose_rally_points(checked, situation, request, should_stop=lambda: next(asked) >= 0)
    assert next(asked) <= 6


@pytest.mark.parametrize("seed", range(12))
def test_the_fewest_of_few_candidates(seed):
    """Against all sets of up to three."""
    chance = random.Random(seed)
    count, pieces = 9, 12
    away_m = np.array([[chance.uniform(1, 50) for _ in range(pieces)] for _ in range(count)])
    sees = np.array([[chance.random() < 0.6 for _ in range(pieces)] for _ in range(count)])
    found = Candidates(away_m, sees, np.full(pieces, 2.0), np.full(pieces, 1.0))
    least = {
        size: min(_left_m(found, subset) for subset in itertools.combinations(range(count), size))
        for size in (1, 2, 3)
    }
    best, left_m = fewest(found, 3)
    assert left_m == _left_m(found, best)
    needed = next((size for size in (1, 2, 3) if least[size] == 0), None)
    if needed is not None and needed <= 2:
        assert (len(best), left_m) == (needed, 0.0)
    elif needed is None:
        assert left_m >= min(least.values())
    for others in ((), (0,), (1, 4)):
        with_each = found.with_each(list(others))
        for one in range(count):
            assert with_each[one] == pytest.approx(_left_m(found, [*others, one]))


def _left_m(found: Candidates, subset) -> float:
    """Written down anew, piece by piece."""
    left_m = 0.0
    for piece in range(found.away_m.shape[1]):
        least_m = min(found.away_m[one, piece] for one in subset)
        near = [one for one in subset if found.away_m[one, piece] <= least_m + found.within_m[piece]]
        left_m += 0.0 if all(found.sees[one, piece] for one in near) else float(found.lengths_m[piece])
    return left_m


def test_without_candidates_nothing_is_found():
    nothing = Candidates(np.empty((0, 3)), np.empty((0, 3), dtype=bool), np.ones(3), np.ones(3))
    assert fewest(nothing, 3) == ([], 3.0)
