"""What is shown of a plan, of a checked mission, and of why there is no route."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from mavlink_bridge.console.view.fields import asked_view, identity
from mavlink_bridge.console.view.places import finite, line, multi_polygon, place, places
from mavlink_bridge.console.view.sections import (
    Blocker,
    LegView,
    LineString,
    Narrowest,
    NoRouteView,
    PlanView,
    ProfileSample,
    RoutePoint,
    WidestRoute,
)
from missions.checking.check import check_mission
from missions.checking.holding import hold_info
from missions.errors import MissionError, PlanStoppedError
from missions.geo import LatLon, distance_m
from missions.ground.from_situation import ground_for, route_ends
from missions.picture.outlines import line_on_earth, outline, route_samples
from missions.picture.plans import plan_scene
from missions.promise import known_vehicle
from missions.request import GoTo, conditions
from missions.routing.bottleneck import NarrowestPlace, narrowest_place, widest_line
from missions.situation import Mission, Situation
from missions.words import metres

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.console.view.sections import Verdict
    from missions.checking.check import CheckedLeg, MissionCheck
    from missions.ground.ground import Ground
    from missions.planned import Plan
    from missions.request import Request


def plan_id(planned: Plan) -> str:
    """Return the name of a plan: that of its items, its start and what it promises."""
    return identity(planned.items, planned.start, planned.clearance_m)


def is_same_route(one: Plan, other: Plan) -> bool:
    """Return whether two plans are one route to a person who has seen either: the same places but for what a standing position wanders, and no less promised."""
    if len(one.items) != len(other.items) or [item.command for item in one.items] != [
        item.command for item in other.items
    ]:
        return False
    if (one.clearance_m or 0.0) > (other.clearance_m or 0.0) + _SAME_M:
        return False
    places_of = zip(one.items, other.items, strict=True)
    return all(
        distance_m(a.position, b.position) <= _SAME_ROUTE_M for a, b in places_of if a.is_placed
    ) and bool(one.extrapolated) == bool(other.extrapolated)


def plan_view(
    planned: Plan, situation: Situation, request: Request, *, took_s: float | None = None
) -> PlanView:
    """Return a plan as it is shown, its legs judged by a check of its own items.

    Parameters
    ----------
    planned : missions.planned.Plan
        The plan.
    situation : Situation
        What it was made in.
    request : Request
        What was asked.
    took_s : float, optional
        How long that took.
    """
    checked = _checked(planned, situation, request)
    legs = (
        tuple(map(_checked_leg, range(len(checked.legs)), checked.legs, [checked] * len(checked.legs)))
        if checked
        else _bare_legs(planned)
    )
    view = PlanView(
        id=plan_id(planned),
        state="planned",
        took_s=took_s,
        request=asked_view(request),
        legs=legs,
        is_promised=planned.clearance_m is not None and not planned.extrapolated,
        dangers=checked.dangers if checked else (),
        info=(*planned.info, *hold_info(planned.hold)),
        warnings=planned.warnings,
    )
    return replace(view, **_route(planned))


def checked_view(
    checked: MissionCheck, planned: Plan, request: Request, *, took_s: float | None = None
) -> PlanView:
    """Return a checked mission as it is shown: whoever wrote it.

    Parameters
    ----------
    checked : MissionCheck
        What was found.
    planned : missions.planned.Plan
        The same as a plan, as `missions.checking.check.plan_of` makes it.
    request : Request
        What was asked.
    took_s : float, optional
        How long that took.
    """
    legs = tuple(_checked_leg(index, leg, checked) for index, leg in enumerate(checked.legs))
    view = PlanView(
        id=identity(checked.mission.items, checked.path[0], checked.clearance_m),
        state="checked",
        took_s=took_s,
        request=asked_view(request),
        legs=legs,
        is_promised=checked.is_promised,
        dangers=(*checked.troubles, *checked.dangers),
        info=(*checked.info, *hold_info(checked.hold)),
        warnings=checked.warnings,
    )
    route = _route(planned)
    promised_m = checked.clearance_m if checked.is_promised else None
    return replace(view, **{**route, "promised_m": promised_m, "extrapolated": checked.extrapolated})


def _route(planned: Plan) -> dict[str, Any]:
    """Return the facts of a route that plans and checked missions share."""
    scene = plan_scene(planned)
    frame = planned.ground.frame
    narrow = scene.narrowest
    narrowest = None
    if narrow is not None:
        a, b = places(line_on_earth(frame, narrow.ends))
        narrowest = Narrowest((a, b), round(narrow.width_m, 3), _leg_at(planned, narrow.ends.mean(axis=0)))
    return {
        "start": place(planned.start),
        "targets": places(planned.targets),
        "asked_targets": places(planned.asked_targets),
        "length_m": round(planned.length_m, 3),
        "straight_line_m": round(planned.straight_line_m, 3),
        "duration_s": round(planned.duration_s, 1),
        "promised_m": planned.clearance_m,
        "asked_m": finite(planned.asked_m),
        "drawn_m": finite(planned.drawn_clearance_m),
        "driven_m": finite(planned.driven_clearance_m),
        "start_m": finite(planned.start_clearance_m),
        "extrapolated": planned.extrapolated,
        "points": tuple(
            RoutePoint(at=place(at), seq=seq, time_s=round(float(time_s), 1), text=text.replace("\n", ", "))
            for at, seq, time_s, text in zip(
                planned.path, planned.seqs, planned.envelope.arrivals_s, scene.point_texts, strict=True
            )
        ),
        "corridor": multi_polygon(outline(frame, planned.envelope.area)),
        "narrowest": narrowest,
        "profile": tuple(
            ProfileSample(
                round(one.along_m, 2),
                round(one.time_s, 1),
                finite(one.drawn_m, 2),
                finite(one.driven_m, 2),
                round(one.speed_mps, 2),
            )
            for one in route_samples(planned)
        ),
        "items": len(planned.items) + planned.vehicle.home_items,
    }


def _leg_at(planned: Plan, point: Any) -> int:  # noqa: ANN401 - an array of two
    """Return which leg of the path is nearest to a point in the plane."""
    best, found = math.inf, 0
    for index, (a, b) in enumerate(pairwise(planned.points)):
        way = b - a
        share = min(1.0, max(0.0, float((point - a) @ way) / max(float(way @ way), 1e-9)))
        away_m = math.dist(point, a + share * way)
        if away_m < best:
            best, found = away_m, index
    return found


def _checked(planned: Plan, situation: Situation, request: Request) -> MissionCheck | None:
    """Return a check of the plan's own items from its own start; None where a check is not possible."""
    asked = GoTo(**{**conditions(request), "start": planned.start})
    try:
        return check_mission(Mission(planned.items, planned.home), situation, asked)
    except MissionError:
        return None


def _checked_leg(index: int, leg: CheckedLeg, checked: MissionCheck) -> LegView:
    verdict: Verdict = "keeps"
    if leg.breaks:
        verdict = "breaks"
    elif checked.extrapolated and not checked.trusts_model:
        verdict = "extrapolated"
    elif leg.asked_m < max(one.asked_m for one in checked.legs):
        verdict = "near"
    return LegView(
        name=leg.name,
        index=index,
        start=place(leg.leg.start),
        end=place(leg.leg.end),
        length_m=round(leg.length_m, 3),
        time_s=round(leg.time_s, 1),
        speed_mps=leg.leg.speed_mps,
        drawn_m=finite(leg.drawn_clearance_m),
        driven_m=finite(leg.driven_clearance_m),
        asked_m=finite(leg.asked_m),
        verdict=verdict,
        fence=leg.fence or "",
        at=place(leg.at) if leg.at else None,
        crosses=leg.crosses,
        text=_leg_text(leg, verdict),
    )


def _leg_text(leg: CheckedLeg, verdict: Verdict) -> str:
    if leg.stops_at_seam:
        return f"crosses {', '.join(leg.crosses)}: the vehicle stops there"
    if leg.crosses:
        return f"crosses {', '.join(leg.crosses)}"
    if math.isinf(leg.driven_clearance_m):
        return "no fence near"
    kept = f"{metres(leg.driven_clearance_m)} from {leg.fence} while driving"
    if verdict == "breaks":
        return f"{kept}; {metres(leg.asked_m)} is required"
    if verdict == "near":
        return f"{kept}, as much as the start allows"
    return f"{kept}, predicted but not measured" if verdict == "extrapolated" else kept


def _bare_legs(planned: Plan) -> tuple[LegView, ...]:
    """Return the legs of a plan by what is drawn alone."""
    found = []
    names = [str(seq) if seq else "start" for seq in planned.seqs]
    times_s = planned.envelope.arrivals_s
    for index, (a, b) in enumerate(pairwise(planned.path)):
        found.append(
            LegView(
                name=f"{names[index]} → {names[index + 1]}",
                index=index,
                start=place(a),
                end=place(b),
                length_m=round(math.dist(*planned.points[index : index + 2]), 3),
                time_s=round(float(times_s[index + 1] - times_s[index]), 1),
                speed_mps=planned.speeds[index],
                drawn_m=None,
                driven_m=None,
                asked_m=None,
                verdict="extrapolated",
                text="not checked by itself",
            )
        )
    return tuple(found)


_SAME_M = 0.01  # clearances are given to the centimetre
_SAME_ROUTE_M = (
    0.5  # a position without RTK wanders by as much while the vehicle stands; chosen, not measured
)


# No route


def no_route_view(
    error: MissionError,
    situation: Situation,
    request: Request,
    should_stop: Callable[[], bool] | None = None,
    *,
    took_s: float | None = None,
) -> PlanView:
    """Return why there is no plan, with the widest route and the fences that stand in the way.

    Parameters
    ----------
    error : MissionError
        Why.
    situation : Situation
        What is known.
    request : Request
        What was asked.
    should_stop : callable, optional
        Asked now and then; True ends it.
    took_s : float, optional
        How long it took.
    """
    details = dict(error.details)
    advice = str(details.pop("advice", ""))
    ground, ends = _ground(situation, request)
    stop = PlanStoppedError.when(should_stop)
    narrow = _narrowest(ground, ends, stop)
    widest = None
    if ground is not None and narrow and math.isfinite(least_m := min(one.clearance_m for one in narrow)):
        least = next(one for one in narrow if one.clearance_m == least_m)
        driven_m = details.get("widest_m")
        widest = WidestRoute(
            round(_number(driven_m, least_m), 4),
            place(least.at) if least.at else None,
            tuple(dict.fromkeys(least.between)),
            _widest_path(ground, ends, narrow, stop),
            is_driven=driven_m is not None,
        )
    named = _named(details)
    if not named and widest is not None:
        named = widest.between
    why = NoRouteView(
        kind=type(error).__name__,
        message=str(error),
        advice=advice,
        details={key: _plain(value) for key, value in details.items()},
        widest=widest,
        blockers=tuple(_blocker(name, ground) for name in named),
        at=_place_of(details) or (widest.at if widest else None),
    )
    return PlanView(
        id=identity("no route", str(error), request.targets),
        state="no_route",
        took_s=took_s,
        request=asked_view(request),
        targets=places(request.targets),
        no_route=why,
    )


def _ground(situation: Situation, request: Request) -> tuple[Ground | None, tuple[LatLon, ...]]:
    try:
        start, targets = route_ends(situation, request)
        return ground_for(situation, known_vehicle(situation, request), [start, *targets]), (start, *targets)
    except MissionError:
        return None, ()


def _narrowest(
    ground: Ground | None, ends: tuple[LatLon, ...], stop: Callable[[], bool] | None
) -> list[NarrowestPlace]:
    """Return the narrowest places of the widest route over all ends, one for each; none where there is no route at all."""
    if ground is None:
        return []
    local = map(ground.frame.to_local, ends)
    found = [narrowest_place(ground, a, b, stop) for a, b in pairwise(local)]
    return [] if None in found else [one for one in found if one is not None]


def _widest_path(
    ground: Ground, ends: tuple[LatLon, ...], narrow: list[NarrowestPlace], stop: Callable[[], bool] | None
) -> LineString | None:
    """Return the straight legs of the widest route: to look at, so that nobody waits for one that can be driven."""
    found = []
    for (a, b), one in zip(pairwise(map(ground.frame.to_local, ends)), narrow, strict=True):
        straight = np.array([a, b])
        found.append(widest_line(ground, a, b, one, stop) if math.isfinite(one.clearance_m) else straight)
    known = [one for one in found if one is not None]
    return line(line_on_earth(ground.frame, np.concatenate(known))) if len(known) == len(found) else None


def _named(details: dict[str, Any]) -> tuple[str, ...]:
    """Return the fences that an error blames."""
    found: list[str] = []
    for key in ("zone", "fence", "zones", "fences", "between"):
        value = details.get(key)
        found += [value] if isinstance(value, str) else list(map(str, value or ()))
    return tuple(dict.fromkeys(found))


def _blocker(name: str, ground: Ground | None) -> Blocker:
    barriers = [] if ground is None else [one for one in ground.barriers if one.name == name]
    if not barriers or ground is None:
        return Blocker(name)
    return Blocker(name, multi_polygon(outline(ground.frame, barriers[0].area)))


def _place_of(details: dict[str, Any]) -> tuple[float, float] | None:
    for key in ("at", "narrowest_at", "target", "start", "position"):
        value = details.get(key)
        if isinstance(value, LatLon) or (isinstance(value, list | tuple) and len(value) == 2):
            return place(LatLon(*value))
    return None


def _plain(value: object) -> object:
    """Return a detail as JSON holds it."""
    if isinstance(value, str | int | bool) or value is None:
        return value
    if isinstance(value, float):
        return finite(value, 8)
    if isinstance(value, dict):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(one) for one in value]
    return str(value)


def _number(value: object, otherwise: float) -> float:
    return float(value) if isinstance(value, int | float) else otherwise
