"""``--clearance`` is one coherent thing: the small form of `benchmarks/ladder.py`, and each rule by itself."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import pytest
from charts import FIELD, IN, OUT, WALL, box, place, situation_of
from shapely import Point

from missions.errors import NoRouteError, RequestError, TargetBlockedError
from missions.planning.plan import plan
from missions.request import GoTo, RepairMission, Tour
from missions.routing import promised_route
from missions.routing.no_route import NoRoute, NoRouteKind
from missions.routing.promised_route import PromisedRoute
from missions.routing.route_search import RouteSearch
from missions.situation import Known, Pose

PATH = list(sys.path)
sys.path.append(str(Path(__file__).parents[3] / "benchmarks"))

from ladder import asked_of, ladder_of  # noqa: E402

sys.path[:] = PATH  # modules of the benchmarks have names of rooms of the tests

GATE = [box(IN, -60, -60, 60, 60), box(OUT, -3, -60, 3, -2.5), box(OUT, -3, 2.5, 3, 60)]
THROUGH = GoTo(start=place(-50, 0), target=place(50, 0))


def gate(**parameters: float):
    situation = situation_of(*GATE, WP_SPEED=2.0, WP_RADIUS=2.0, **parameters)
    return replace(situation, pose=Known(Pose(place(-50, 0), 90.0), None, "test"))


@pytest.mark.parametrize(("place_name", "last_m"), [("field 2", 3.0), ("field 3", 6.5)])
def test_a_ladder_of_clearances_does_not_contradict_itself(place_name: str, last_m: float) -> None:
    """Field 3 has hairpins and a target near a fence, field 2 gates: both refuse the last rungs."""
    found = ladder_of(place_name, 0.5, last_m)
    contradictions = found.contradictions()
    assert {kind: texts for kind, texts in contradictions.items() if texts} == {}
    planned = [rung for rung in found.rungs if rung.promised_m is not None]
    assert 3 < len(planned) < len(found.rungs)
    assert found.widest.promised_m is not None


@pytest.mark.parametrize(("place_name", "asked_m", "more_m"), [("field 17", 5.0, 5.5), ("maze", 3.5, 4.0)])
def test_a_quicker_route_that_keeps_more_serves_who_asks_for_less(
    place_name: str, asked_m: float, more_m: float
) -> None:
    """Fitted to less they took 79.8 s where 72.9 s kept more, and 62.6 s where 58.6 s did."""
    situation, request = asked_of(place_name)
    less, more = (plan(situation, GoTo(**request, clearance_m=one)) for one in (asked_m, more_m))
    assert less.clearance_m is not None
    assert less.clearance_m >= asked_m
    assert less.duration_s <= 1.02 * more.duration_s


def test_where_what_is_asked_cannot_be_fitted_more_of_it_serves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines that fail at one clearance and not at a greater one were refused at the first."""
    find = RouteSearch.find

    def only_from_2_m(self: RouteSearch, *, briefly: bool = False):
        if self.required_m < 1.95:
            return NoRoute(NoRouteKind.CORNER, "a centimetre is missing")
        return find(self, briefly=briefly)

    monkeypatch.setattr(RouteSearch, "find", only_from_2_m)
    found = plan(gate(), replace(THROUGH, clearance_m=1.8))
    assert found.clearance_m is not None
    assert 1.95 <= found.clearance_m <= 2.5
    assert found.driven_clearance_m >= found.clearance_m


@pytest.mark.parametrize(
    "asked", [{"clearance_m": 1.0}, {"clearance_m": 1.5}, {"clearance_m": 2.5}, {"widest": True}]
)
def test_a_start_that_can_only_be_left_over_a_turn_too_short_to_settle_is_refused_whatever_is_asked(
    asked,
) -> None:
    """In field 1 a rover that cannot turn faces away: routes over a first leg of 0.7 m were planned, and left their corridor in the simulator."""
    situation, request = asked_of("field 1")
    with pytest.raises(NoRouteError, match="at the start this vehicle would come as near"):
        plan(situation, GoTo(**request, **asked))


def test_less_than_was_asked_needs_a_word() -> None:
    asked = replace(THROUGH, clearance_m=4.53)
    with pytest.raises(
        NoRouteError, match=r"no route keeps 4\.53 m while driving; the widest keeps 2\.\d\d m"
    ) as caught:
        plan(gate(), asked)
    less = plan(gate(), replace(asked, accepts_less=True))
    widest = plan(gate(), replace(THROUGH, widest=True))
    assert less.clearance_m == widest.clearance_m == caught.value.details["widest_m"]
    assert any("no route keeps 4.53 m while driving: the widest, with 2." in text for text in less.info)
    assert not any("--accept-less" in text for text in (*less.warnings, *widest.warnings, *widest.info))


def test_a_refusal_that_is_not_compared_names_what_straight_legs_keep_and_looks_for_nothing_to_drive(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = replace(THROUGH, clearance_m=4.53)
    with pytest.raises(NoRouteError, match="the widest keeps") as compared:
        plan(gate(), asked)
    monkeypatch.setattr(PromisedRoute, "widest", None)  # that would take as long as several plans
    with pytest.raises(
        NoRouteError,
        match=r"no route keeps 4\.53 m; along straight legs the widest keeps \d\.\d\d m, narrowest between",
    ) as caught:
        plan(gate(), asked, compares=False)
    assert "widest_m" not in caught.value.details
    assert caught.value.details["widest_drawn_m"] == compared.value.details["widest_drawn_m"]
    with pytest.raises(NoRouteError, match="along straight legs the widest keeps"):
        plan(gate(), Tour(start=THROUGH.start, targets=(THROUGH.target,), clearance_m=4.53), compares=False)


def test_a_target_too_near_a_fence_is_reached_with_less_where_less_is_accepted() -> None:
    near = GoTo(start=place(-50, 0), target=place(-4, 30), clearance_m=2.0)
    with pytest.raises(TargetBlockedError, match=r"closer than 2 m while driving|closer than 2 m"):
        plan(gate(), near)
    less = plan(gate(), replace(near, accepts_less=True))
    assert less.clearance_m is not None
    assert 0 < less.clearance_m < 1.0


def test_messages_quote_what_was_typed() -> None:
    """Asked for 0.5 m with FENCE_MARGIN 3 m they spoke of 3.1 m alone."""
    margin = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 4.0, "FENCE_MARGIN": 3.0, "AVOID_ENABLE": 1.0}
    with pytest.raises(NoRouteError, match=r"no route keeps 0\.5 m \(raised to 3\.1 m\) while driving"):
        plan(gate(**margin), replace(THROUGH, clearance_m=0.5))
    with pytest.raises(NoRouteError, match=r"no route keeps 2\.6 m while driving"):
        plan(gate(), replace(THROUGH, clearance_m=2.6, position_error_m=0.3))


def test_what_the_start_costs_is_told_apart() -> None:
    """3 m before a wall, facing it: the route keeps what was asked, the first legs what the place leaves."""
    situation = replace(
        situation_of(FIELD, WALL, WP_SPEED=2.0), pose=Known(Pose(place(-8, 0), 90.0), None, "test")
    )
    found = plan(situation, GoTo(target=place(50, 0), clearance_m=2.5))
    assert found.clearance_m == 2.5
    assert found.start_clearance_m is not None
    assert 0 < found.start_clearance_m < 2.5
    assert found.driven_clearance_m >= found.start_clearance_m
    start = Point(found.ground.frame.to_local(found.start))
    assert found.start_clearance_m < found.ground.clearance_m(start)
    open_field = plan(situation, GoTo(start=place(-50, 0), target=place(50, 0), clearance_m=2.5))
    assert open_field.start_clearance_m is None


def test_the_widest_is_no_less_than_what_was_found_for_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each clearance is aimed at once: a refusal and the widest route that it names share what was tried."""
    asked = []
    search = PromisedRoute._search

    def counted(self: PromisedRoute, required_m: float, enough_m: float) -> RouteSearch:
        asked.append(required_m)
        return search(self, required_m, enough_m)

    monkeypatch.setattr(PromisedRoute, "_search", counted)
    with pytest.raises(NoRouteError, match="the widest keeps"):
        plan(gate(), replace(THROUGH, clearance_m=2.4))
    assert len(asked) == len(set(asked))


def test_the_widest_goes_on_to_what_can_be_asked_above_the_best_level_tried(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In field 19 it promised 0.94 m, and 1 m could be asked for."""
    whole = plan(gate(), replace(THROUGH, widest=True)).clearance_m
    monkeypatch.setattr(promised_route, "_downwards", lambda *_: iter((1.8,)))
    climbed = plan(gate(), replace(THROUGH, widest=True)).clearance_m
    assert climbed == pytest.approx(whole, abs=0.1)


def test_tours_take_less_too_and_repairs_never_do() -> None:
    tour = Tour(start=place(-50, 0), targets=(place(50, 10), place(50, -10)), clearance_m=4.0, order="best")
    with pytest.raises(NoRouteError, match="no route"):
        plan(gate(), tour)
    less = plan(gate(), replace(tour, accepts_less=True))
    assert less.clearance_m is not None
    assert 1.5 < less.clearance_m < 2.5
    with pytest.raises(RequestError, match="accepts_less True: expected none"):
        RepairMission(accepts_less=True)


@pytest.mark.parametrize("allowance_m", [0.0, 0.3])
def test_with_a_corner_allowance_the_widest_is_the_most_that_can_be_asked(allowance_m: float) -> None:
    """It was 97 % of it: more could be asked than the widest kept."""
    widest = plan(gate(), replace(THROUGH, widest=True, corner_allowance_m=allowance_m))
    most_m = widest.asked_m - allowance_m
    assert most_m == pytest.approx(2.5 - allowance_m, abs=0.03)
    asked = plan(gate(), replace(THROUGH, clearance_m=most_m, corner_allowance_m=allowance_m))
    assert asked.asked_m == pytest.approx(widest.asked_m)
    with pytest.raises(NoRouteError, match="no route keeps"):
        plan(gate(), replace(THROUGH, clearance_m=most_m + 0.03, corner_allowance_m=allowance_m))
