"""What is asked of a plan: its kinds, what makes no sense, and that nothing asked for is dropped."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from charts import FIELD, HOME, OUT, WALL, box, place, situation_of
from hypothesis import given
from hypothesis import strategies as st

from missions import plan, repair_mission
from missions.errors import InvalidPositionError, MissionError, RequestError, SituationError
from missions.geo import LatLon, rounded
from missions.items import Command, waypoint
from missions.request import End, GoTo, Method, Order, RepairMission, Request, Tour, conditions, request_of
from missions.situation import Known, Mission
from missions.vehicle import Footprint

NUMBERS = ("clearance_m", "corner_allowance_m", "snap_m", "position_error_m", "reserve_m", "speed_mps")
MISSION = Mission((waypoint(place(20, 20)),), HOME)


@pytest.mark.parametrize("kind", [GoTo, Tour, RepairMission, Request])
@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -1e-9, "2", True, 1j])
def test_a_number_that_makes_no_sense_is_refused_where_it_is_asked_for(kind, name, value):
    with pytest.raises(RequestError, match=f"^{name} .*: expected a finite number") as caught:
        kind(**{name: value})
    assert caught.value.details["field"] == name
    assert caught.value.details["value"] is value


@pytest.mark.parametrize("name", ["snap_m", "reserve_m", "method", "footprint"])
def test_what_has_a_default_of_its_own_cannot_be_none(name):
    with pytest.raises(RequestError, match=f"^{name} None"):
        GoTo(**{name: None})


def test_the_widest_route_has_no_clearance_that_is_asked_for():
    with pytest.raises(RequestError, match=r"clearance_m 2\.0: expected none beside the widest route"):
        Tour(widest=True, clearance_m=2.0)


def test_no_speed_is_no_speed_and_no_room_is_room():
    with pytest.raises(RequestError, match="speed_mps 0: expected a finite number above 0"):
        GoTo(speed_mps=0)
    asked = GoTo(
        clearance_m=0,
        corner_allowance_m=0.0,
        snap_m=0,
        position_error_m=np.float64(0.0),
        reserve_m=np.float32(0),
    )
    assert asked.clearance_m == asked.reserve_m == 0


@pytest.mark.parametrize(
    ("kind", "name", "value", "known"),
    [
        (GoTo, "method", "fast", "optimal, pbpp-taut, pbpp"),
        (Tour, "method", "", "optimal, pbpp-taut, pbpp"),
        (Tour, "order", "nearest", "given, best"),
        (Tour, "end", "RTL", "hold, loiter, rtl"),
        (Tour, "end", None, "hold, loiter, rtl"),
    ],
)
def test_a_word_that_is_not_known_is_refused_with_those_that_are(kind, name, value, known):
    with pytest.raises(RequestError, match=f"expected one of {known}$"):
        kind(**{name: value})


def test_words_become_what_they_mean():
    asked = Tour(targets=[(40.0, -105.0)], order="best", end="rtl", method="pbpp")
    assert (asked.order, asked.end, asked.method) == (Order.BEST, End.RTL, Method.PBPP)
    assert asked.targets == (LatLon(40.0, -105.0),)
    assert isinstance(asked.targets[0], LatLon)


@pytest.mark.parametrize(
    ("field", "made"),
    [
        ("start", lambda value: GoTo(start=value)),
        ("start", lambda value: RepairMission(start=value)),
        ("target", lambda value: GoTo(target=value)),
        ("targets", lambda value: Tour(targets=(HOME, value))),
    ],
)
def test_a_place_works_or_fails_at_once(field, made):
    assert made(tuple(HOME)) == made(HOME) == made(list(HOME))
    assert isinstance(
        getattr(made(tuple(HOME)), field.removesuffix("s") if field == "start" else field), LatLon | tuple
    )
    for senseless in ("40,-105", (40.0,), (40.0, -105.0, 0.0), 40.0, ("40", "-105"), (None, 1.0)):
        with pytest.raises(
            RequestError, match=f"^{field} .*: expected a latitude and a longitude in degrees"
        ):
            made(senseless)
    for beyond in ((91.0, 0.0), (40.0, 181.0), (math.nan, 0.0), (0.0, math.inf)):
        with pytest.raises(InvalidPositionError, match=r"beyond ±|is not a pair of numbers"):
            made(beyond)


def test_one_place_for_several_and_other_things_are_refused():
    with pytest.raises(RequestError, match=r"^targets .*: expected a latitude"):
        Tour(targets=HOME)
    with pytest.raises(RequestError, match=r"^targets 7: expected a sequence"):
        Tour(targets=7)
    with pytest.raises(RequestError, match=r"^footprint .*: expected a Footprint"):
        GoTo(footprint=(1.0, 0.5))
    with pytest.raises(RequestError, match=r"^mission .*: expected a Mission"):
        RepairMission(mission=MISSION.items)


def test_the_common_constructor_makes_the_kind_that_its_words_ask_for():
    assert Request() == Tour()
    assert Request(HOME, (FAR,), 2.0, False, 0.5) == Tour(
        start=HOME, targets=(FAR,), clearance_m=2.0, corner_allowance_m=0.5
    )
    assert Request(HOME, (FAR,), None, True) == Tour(start=HOME, targets=(FAR,), widest=True)
    assert replace(Request(targets=(FAR,)), targets=(HOME, FAR), end="loiter") == Tour(
        targets=(HOME, FAR), end=End.LOITER
    )
    assert Request(via=MISSION, snap_m=1.0) == RepairMission(mission=MISSION, snap_m=1.0)
    assert Request(via_own=True, order="given", targets=()) == RepairMission()
    assert Request(via_own=True, trusts_model=True) == RepairMission(trusts_model=True)
    assert all(isinstance(one, Request) for one in (GoTo(), Tour(), RepairMission()))
    with pytest.raises(TypeError, match="clearance_m"):
        Request(HOME, (), 2.0, clearance_m=1.0)
    with pytest.raises(TypeError, match="no_such_word"):
        Request(no_such_word=1)
    with pytest.raises(TypeError, match="30 were given"):
        Request(*[None] * 30)


FAR = place(100, 60)


@pytest.mark.parametrize(
    "dropped",
    [
        {"targets": (FAR,)},
        {"order": "best"},
        {"comes_back": True},
        {"end": "rtl"},
        {"widest": True},
        {"speed_mps": 1.0},
        {"corner_allowance_m": 0.0},
        {"escape": True},
    ],
)
def test_what_a_repair_cannot_keep_is_refused(dropped):
    for repaired in ({"via": MISSION}, {"via_own": True}):
        with pytest.raises(RequestError, match=f"^{next(iter(dropped))} .*a repair keeps the mission's own"):
            Request(**repaired, **dropped)
    with pytest.raises(RequestError, match=f"^{next(iter(dropped))} .*a repair keeps the mission's own"):
        repair_mission(MISSION, situation_of(FIELD), Request(**dropped))
    with pytest.raises(RequestError, match="via_own True: expected none beside another mission"):
        Request(via=MISSION, via_own=True)


def test_another_target_takes_the_place_of_all():
    assert GoTo(target=HOME, snap_m=1.0).to(FAR) == GoTo(target=FAR, snap_m=1.0)
    back = Tour(targets=(HOME, FAR), comes_back=True, end="loiter")
    assert back.to(FAR) == replace(back, targets=(FAR,))
    assert RepairMission(mission=MISSION).to(FAR) == RepairMission(mission=MISSION)


LENGTHS = st.floats(0.0, 50.0)
PLACES = st.tuples(st.floats(-80.0, 80.0), st.floats(-180.0, 180.0)).map(lambda pair: LatLon(*pair))
SHARED = {
    "start": st.none() | PLACES,
    "clearance_m": st.none() | LENGTHS,
    "snap_m": LENGTHS,
    "method": st.sampled_from(Method),
    "position_error_m": st.none() | LENGTHS,
    "reserve_m": LENGTHS,
    "footprint": st.builds(Footprint, length_m=LENGTHS, width_m=LENGTHS),
}
ON_A_ROUTE = {
    **SHARED,
    "speed_mps": st.none() | st.floats(0.1, 9.0),
    "escape": st.booleans(),
}
REQUESTS = st.one_of(
    st.builds(GoTo, **ON_A_ROUTE, target=st.none() | PLACES),
    st.builds(
        Tour,
        **ON_A_ROUTE,
        targets=st.lists(PLACES, min_size=2, max_size=4),
        order=st.sampled_from(Order),
        comes_back=st.booleans(),
        end=st.sampled_from(End),
    ),
    st.builds(RepairMission, **SHARED, mission=st.sampled_from([None, MISSION])),
)


@given(REQUESTS | st.builds(GoTo, start=PLACES, widest=st.just(True)))
def test_the_words_of_a_request_make_the_same_one(asked):
    made = request_of(**asked.words())
    assert made == Request(*asked.words().values())
    assert made.words() == asked.words()
    assert made == asked or (
        isinstance(asked, GoTo) and made == Tour(**conditions(asked), targets=asked.targets)
    )


YARD = place(-50, -30)
WALLED = replace(situation_of(FIELD, WALL), home=Known(YARD, None, "test"))


def test_home_again_and_an_end_are_honoured_whatever_door_they_come_by():
    """The function that plans one route once took such a request and dropped both."""
    asked = Request(place(-50, 0), (place(-50, 40),), 2.0, comes_back=True, end="loiter")
    made = plan(WALLED, asked)
    assert made.targets == (rounded(place(-50, 40)), rounded(YARD))
    assert made.items[-1].command == Command.NAV_LOITER_UNLIM
    returning = plan(WALLED, replace(asked, comes_back=False, end="rtl"))
    assert returning.items[-1].command == Command.NAV_RETURN_TO_LAUNCH


def test_a_mission_to_repair_is_repaired_or_said_to_be_missing():
    barn = box(OUT, 40, 20, 60, 40)
    through = Mission((waypoint(place(20, 30)), waypoint(place(80, 30))), HOME)
    situation = situation_of(FIELD, barn)
    own = replace(situation, mission=Known(through, None, "test"))
    made = plan(situation, RepairMission(mission=through, clearance_m=2.0))
    assert made.items == plan(own, RepairMission(clearance_m=2.0)).items
    assert len(made.items) > 2
    with pytest.raises(SituationError, match="no mission to repair"):
        plan(situation, RepairMission(clearance_m=2.0))


def test_what_makes_no_sense_is_an_error_of_missions_whatever_it_is():
    for words in ({"method": "x"}, {"clearance_m": math.nan}, {"targets": ((1e3, 0.0),)}, {"start": "here"}):
        with pytest.raises(MissionError, match=r"expected|beyond"):
            Request(**words)


def test_one_place_is_planned_the_same_by_either_kind():
    going = plan(WALLED, GoTo(start=place(-50, 0), target=place(50, 0), clearance_m=2.0))
    touring = plan(WALLED, Tour(start=place(-50, 0), targets=(place(50, 0),), clearance_m=2.0))
    assert (going.items, going.warnings) == (touring.items, touring.warnings)
