"""Home: which places can be reached from where, and a plan to the nearest one.

`home_field` lays the ways home of a field out, once for all questions (`routing.way_home`); `plan_home` asks `plan` for a mission to the nearest place, and to
the next one where the nearest cannot be driven to. A way home is a plan like any other: its promise, its check and its refusals are those of `plan`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from missions.errors import NoRouteError, PlanStoppedError, RouteError, SituationError
from missions.geo import distance_m
from missions.planning.plan import plan as make_plan
from missions.promise import known_vehicle, promise
from missions.request import GoTo, conditions
from missions.routing.way_home import places_of, ways_home
from missions.words import counted, metres

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from missions.geo import LatLon
    from missions.planned import Plan
    from missions.request import Request
    from missions.routing.way_home import Place, WaysHome
    from missions.situation import Situation


def home_field(situation: Situation, request: Request, given: Mapping[str, LatLon]) -> WaysHome:
    """Return the ways home of the field that a vehicle stands in.

    Parameters
    ----------
    situation : Situation
        What is known: fence, home, rally points, position.
    request : Request
        What is asked of every plan; where it takes less than it asks for, the ways keep the least that a plan may promise.
    given : mapping of str to LatLon
        Places beside home and the rally points.

    Raises
    ------
    MissionError
        As `plan`, of the fence and the vehicle; or no place, or no position is known.
    """
    places = places_of(situation, given)
    if not places:
        raise SituationError("no way home: home is not known, and there is no rally point and no --place")
    if situation.pose is None:
        raise SituationError("no way home: the vehicle's position is not known")
    takes_less = request.widest or request.accepts_less
    asked = replace(request, widest=False, accepts_less=False, clearance_m=0.0) if takes_less else request
    vehicle = known_vehicle(situation, asked)
    promised = promise(situation, asked, vehicle)
    return ways_home(situation, vehicle, promised.drawn_m, places, [situation.pose.value.position])


def at_home(situation: Situation, ways: WaysHome) -> Place | None:
    """Return the place that a vehicle stands at; None where it stands at none.

    It counts as there within its own waypoint radius, as it does to the autopilot: a steered rover that is to drive a hand's breadth back goes round.
    """
    if situation.pose is None:
        return None
    way = ways.nearest(situation.pose.value.position)
    is_there = way is not None and way.length_m <= ways.vehicle.waypoint_radius_m
    return way.place if way is not None and is_there else None


def plan_home(
    situation: Situation,
    request: Request,
    ways: WaysHome,
    *,
    planner: Callable[..., Plan] = make_plan,
    should_stop: Callable[[], bool] | None = None,
) -> Plan:
    """Plan the way home from where the vehicle is, to the nearest place that a route can be driven to.

    Parameters
    ----------
    situation : Situation
        What is known.
    request : Request
        What is asked of it; its targets count for nothing.
    ways : WaysHome
        Those of this field.
    planner : callable
        Makes a plan.
    should_stop : callable, optional
        As of `plan`.

    Raises
    ------
    MissionError
        As `plan`, of the nearest place; none can be reached.
    """
    if situation.pose is None:
        raise SituationError("no way home: the vehicle's position is not known")
    here = situation.pose.value.position
    asked = GoTo(**{**conditions(request), "start": None})
    refused: RouteError | None = None
    for place in _candidates(ways, here, may_escape=asked.escape):
        try:
            return planner(situation, asked.to(place.position), should_stop=should_stop)
        except PlanStoppedError:
            raise
        except RouteError as error:
            refused = refused or error
            if not asked.escape and not ways.is_allowed(here):
                break  # the vehicle stands where it must not be: that is so whatever the place
    if refused is None:
        raise NoRouteError(f"no way home: {_none_can_be_reached(ways)}", blocked=dict(ways.blocked))
    raise refused


def _candidates(ways: WaysHome, here: LatLon, *, may_escape: bool) -> Iterator[Place]:
    """Return the places that may be reached, the nearest first; last those to which the tree knows no way, for a plan may find a tighter one."""
    seen = set(ways.blocked)
    for way in ways.in_order(here, may_escape=may_escape):
        seen.add(way.place.name)
        yield way.place
    rest = [place for place in ways.places if place.name not in seen]
    yield from sorted(rest, key=lambda place: distance_m(here, place.position))


def _none_can_be_reached(ways: WaysHome) -> str:
    whys = "; ".join(f"{name}: {why}" for name, why in ways.blocked.items())
    return (
        f"none of {counted(len(ways.places), 'place')} (home, rally points, --place) can be reached with {metres(ways.clearance_m)} "
        f"to every fence ({whys})"
    )
