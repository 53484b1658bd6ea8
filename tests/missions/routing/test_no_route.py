"""No route as a result: its kind, its facts, and the error that the door makes of it."""

from __future__ import annotations

import pytest
from charts import FIELD, IN, OUT, WALL, box, place, situation_of
from shapely import Point

from missions.errors import NoRouteError, StartBlockedError, TargetBlockedError
from missions.ground.from_situation import ground_for
from missions.routing.drawn_route import DrawnRoutes, Sought
from missions.routing.no_route import NoRoute, NoRouteKind, explained
from missions.vehicle import vehicle_from_parameters

RING = (
    box(OUT, 30, -10, 32, 10),
    box(OUT, 48, -10, 50, 10),
    box(OUT, 30, 8, 50, 10),
    box(OUT, 30, -10, 50, -8),
)
GATE = (box(OUT, -2, -200, 2, -1.5), box(OUT, -2, 1.5, 2, 200))
WEST, EAST = (-50.0, 0.0), (40.0, 0.0)


def sought(*zones, start=WEST, target=EAST, **options):
    ground = ground_for(situation_of(*zones), vehicle_from_parameters({}), [place(*start), place(*target)])
    return Sought(
        ground, ground.frame.to_local(place(*start)), [ground.frame.to_local(place(*target))], **options
    )


@pytest.mark.parametrize(
    ("asked", "clearance_m", "kind", "error", "facts"),
    [
        (sought(FIELD, WALL, start=(0.0, 0.0)), 1.0, NoRouteKind.START_BLOCKED, StartBlockedError, {"fences", "distance_m", "bearing_deg", "nearest_free"}),
        (sought(FIELD, WALL, target=(0.0, 0.0)), 1.0, NoRouteKind.TARGET_BLOCKED, TargetBlockedError, {"fences", "clearance_m", "distance_m", "bearing_deg", "nearest_free"}),
        (sought(box(IN, -60, -5, 60, 5)), 6.0, NoRouteKind.NOWHERE_FREE, NoRouteError, {"clearance_m"}),
        (sought(box(IN, -60, -60, 60, 60), *GATE), 2.0, NoRouteKind.TOO_NARROW, NoRouteError, {"clearance_m", "widest_m", "fences", "narrowest_at"}),
        (sought(FIELD, *RING), 1.0, NoRouteKind.WALLED_IN, NoRouteError, {"clearance_m", "walled_in", "fences", "advice"}),
    ],
)  # fmt: skip
def test_each_kind_has_its_facts_and_its_error(asked, clearance_m, kind, error, facts):
    found = DrawnRoutes.at(asked, clearance_m).find()
    assert isinstance(found, NoRoute)
    assert found.kind is kind
    made = found.error()
    assert type(made) is error
    assert str(made) == found.text
    assert set(made.details) == facts
    assert list(made.details.get("fences", [])) == list(found.fences)


def test_the_widest_is_what_was_drawn():
    found = DrawnRoutes.at(sought(box(IN, -60, -60, 60, 60), *GATE), 2.0).find()
    assert found.facts["widest_m"] == pytest.approx(1.5, abs=0.02)


def test_where_there_is_no_other_way_round_it_is_said_so():
    routes = DrawnRoutes.at(sought(box(IN, -60, -5, 60, 5)), 1.0)
    here = routes.find().points.mean(axis=0)
    found = routes.around(Point(here).buffer(6.0)).find()
    assert found.kind is NoRouteKind.NO_OTHER_WAY
    assert found.text == "no other route keeps 1.00 m"
    assert routes.find().points.tolist()  # the one before stays as it was


def test_a_seam_explains_itself_and_leaves_the_reason_as_it_was():
    vehicle = vehicle_from_parameters({"AVOID_ENABLE": 1.0, "FENCE_ENABLE": 1.0, "FENCE_OPTIONS": 2.0})
    why = NoRoute(NoRouteKind.WALLED_IN, "no route", {"fences": ["a"]}, ["a"], advice="open it")
    assert explained(why, vehicle) is why
    seam = NoRoute(
        NoRouteKind.WALLED_IN, "no route", {}, ["the inner edge of inclusion polygon 1"], advice="x"
    )
    told = explained(seam, vehicle)
    assert told.text.startswith("no route: with AVOID_ENABLE 1 (bit 0) the vehicle stops")
    assert told.error().details["seam"] is True
    assert "pbpp fence merge" in told.error().details["advice"]
    assert (seam.advice, seam.is_seam, "seam" in seam.error().details) == ("x", False, False)
