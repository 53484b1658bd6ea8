"""Repairing a mission: legs that break the clearance are replaced by routes; everything else keeps its place and meaning.

**How.** A leg between two places of the mission is a line that somebody drew, a row of a survey perhaps. Its route keeps to that line but near
what is in the way: places on the line are targets of the route too, a run-in before and behind it. The run-in is as short as the vehicle can
drive without slowing down; where none can be driven, the route leaves the line from end to end. The whole is checked as any mission is. A leg
that misses little gets that much more room; one that misses it again, or more, is planned from end to end, together with those beside it.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from missions.checking.check import MissionCheck, check_mission, forecast_band_m, plan_of
from missions.editing.edited_mission import ItemList
from missions.editing.own_line import places_on_line
from missions.editing.shorten import shortened
from missions.errors import (
    MissionTooLongError,
    NoRouteError,
    PlanCheckError,
    PlanStoppedError,
    RouteError,
    SituationError,
    StartBlockedError,
)
from missions.finishing.route_plan import plan_route
from missions.geo import bearing_deg, distance_m, to_e7
from missions.ground.legs import ROUNDING_RESERVE_M, reserve_m
from missions.ground.seams import with_seams
from missions.items import change_speed
from missions.promise import promise
from missions.request import Tour, conditions, request_of
from missions.situation import Known, Mission, Pose
from missions.vehicle.item_limit import most_own_items
from missions.words import counted, left_out_text, metres, moved_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from missions.checking.check import CheckedLeg
    from missions.checking.execution import CourseLeg
    from missions.editing.edited_mission import LegKey
    from missions.geo import LatLon
    from missions.items import MissionItem
    from missions.planned import Plan
    from missions.request import RepairMission, Request
    from missions.situation import Situation

# Chosen, not measured: routes that break the legs beside them are made anew so often; bounds the time
_ROUNDS = 8
# Chosen on one survey (docs/targets.md) for four vehicles: 1 m slowed them down, beyond 8 m a row is a row no more
_RUN_INS_M = (2.0, 4.0, 8.0)
"""How far before and after what is in the way a route leaves a leg's own line: the first that needs no slower stretch."""
_EXTRA_M, _MOST_EXTRA_M = 0.1, 0.5
"""More room for routes where the corners between them and their neighbours need it."""

MOST_TRACKED_JUMPS = 15
"""ArduPilot counts so many DO_JUMPs on small boards (AP_MISSION_MAX_NUM_DO_JUMP_COMMANDS); further ones are never taken."""


@dataclass(frozen=True, eq=False)
class Repair:
    """A repaired mission.

    Parameters
    ----------
    mission : Mission
        The items as they are now.
    check : MissionCheck
        What they keep: `holds` is true.
    changes : tuple of str
        What was changed, by the numbers that the items had.
    """

    mission: Mission
    check: MissionCheck
    changes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class _Detour:
    """What takes the place of one leg: items before the place it leads to, that place's item, items after it."""

    before: tuple[MissionItem, ...]
    goal: MissionItem
    after: tuple[MissionItem, ...]


@dataclass(eq=False)
class _Routed:
    """The legs that get routes.

    Parameters
    ----------
    keys : set of LegKey
        All of them.
    bent : set of LegKey
        Those planned from end to end: nobody drew their lines, or they broke when they kept to them.
    clearance_m : float
        What routes promise.
    spare_m : dict of LegKey to float
        More of it for those that keep to their lines, where a neighbour's corner took some.
    """

    keys: set[LegKey]
    bent: set[LegKey]
    clearance_m: float
    spare_m: dict[LegKey, float] = field(default_factory=dict)

    def clearance_of(self, key: LegKey) -> float:
        """Return what a leg's route promises."""
        return self.clearance_m + (0.0 if key in self.bent else self.spare_m.get(key, 0.0))

    def give_room(self, missing_m: Mapping[LegKey, float]) -> set[LegKey]:
        """Give room to legs that keep to their lines and miss little for the first time; return the other ones that miss some."""
        again = {
            key: missing_m[key] + _EXTRA_M
            for key in missing_m.keys() & (self.keys - self.bent - self.spare_m.keys())
            if missing_m[key] <= _MOST_EXTRA_M
        }
        self.spare_m |= again
        return set(missing_m) - set(again)


def repaired_plan(
    situation: Situation, request: RepairMission, *, should_stop: Callable[[], bool] | None = None
) -> Plan:
    """Repair the request's mission, else the situation's, and return it as a plan.

    Raises
    ------
    SituationError
        No mission is known.
    MissionError
        As `repair_mission`.
    """
    mission = request.mission or (situation.mission.value if situation.mission else None)
    if mission is None or not mission.items:
        raise SituationError("no mission to repair; use --via-mission FILE")
    repair = repair_mission(mission, situation, request, should_stop=should_stop)
    made = plan_of(repair.check, situation, method=request.method)
    return replace(made, info=(*repair.changes, *made.info))


def repair_mission(
    mission: Mission,
    situation: Situation,
    request: Request,
    *,
    should_stop: Callable[[], bool] | None = None,
) -> Repair:
    """Replace the legs of a mission that break the clearance by routes around the fences.

    A route's corners affect the legs beside it, so the repaired mission is checked again as a whole; legs that fail then, or stand
    beside one that still does, are replaced too.

    Parameters
    ----------
    mission : Mission
        The items, without the home item.
    situation : Situation
        Fence, parameters, home and where the vehicle is.
    request : Request
        Start, clearance, ``snap_m`` for places that are blocked, method: what a `RepairMission` may ask for.
    should_stop : callable, optional
        Asked now and then; once it returns True, nobody waits for the repair any more.

    Raises
    ------
    PlanStoppedError
        It was stopped.
    RequestError
        More is asked for than a repair keeps: targets, an end, a speed.
    RouteError
        A leg cannot be replaced (the message says which and why), or the corners between legs keep breaking the promise.
    SituationError
        Something in the mission is not understood, so that where it leads is not known.
    FenceMissingError, FenceError, VehicleError, InvalidPositionError
        As `missions.checking.check.check_mission`.
    """
    should_stop = PlanStoppedError.when(should_stop)
    request = request_of(**{**request.words(), "via": mission, "via_own": False})
    asked = _checked(mission, situation, request)
    found = _in_rounds(asked, situation, request, should_stop, keeps_lines=True)
    if isinstance(found, RouteError):
        found = _in_rounds(asked, situation, request, should_stop, keeps_lines=False)
    if isinstance(found, RouteError):
        raise found
    return found


def _in_rounds(
    asked: MissionCheck,
    situation: Situation,
    request: Request,
    should_stop: Callable[[], bool] | None,
    *,
    keeps_lines: bool,
) -> Repair | RouteError:
    """Return the repaired mission, or why there is none: a leg has no route, the corners between legs break the promise, it is too long."""
    repaired, checked = ItemList(asked.mission), asked
    legs = _Routed(
        {_key(leg.leg) for leg in asked.broken},
        {_key(leg.leg) for leg in asked.broken if not leg.leg.first_item or leg.leg.is_return},
        asked.clearance_m,
    )
    for _ in range(_ROUNDS):
        legs.bent |= set() if keeps_lines else legs.keys
        try:
            repaired = _routed(asked, legs, situation, request, should_stop)
        except RouteError as error:
            if legs.clearance_m > asked.clearance_m:
                break  # there is no more room: the error found before is returned
            return error
        checked = check_mission(repaired.mission(), situation, request)
        if checked.holds:
            return _within_storage(repaired, checked, situation, request, should_stop)
        missing_m: dict[LegKey, float] = {}
        for leg in checked.broken:
            key = repaired.origin(leg.leg)
            missing_m[key] = max(missing_m.get(key, 0.0), leg.asked_m - leg.driven_clearance_m)
        found = legs.give_room(missing_m)
        near = found | _beside(asked, found)
        more = found if not found <= legs.keys else near
        if found and more <= legs.bent:
            legs.clearance_m += min(max(missing_m.values()), _MOST_EXTRA_M) + _EXTRA_M
        legs.keys |= more
        legs.bent |= near & legs.keys
    return _unrepaired(repaired, checked)


def _checked(mission: Mission, situation: Situation, request: Request) -> MissionCheck:
    """Return what a mission keeps.

    Raises
    ------
    SituationError, StartBlockedError
        It cannot be repaired, whatever it keeps.
    """
    asked = check_mission(mission, situation, request)
    if asked.troubles:
        raise SituationError(f"the mission cannot be repaired: {'; '.join(asked.troubles)}")
    if asked.dangers:
        raise StartBlockedError(f"the mission cannot be repaired: {'; '.join(asked.dangers)}")
    return asked


def _within_storage(
    repaired: ItemList,
    checked: MissionCheck,
    situation: Situation,
    request: Request,
    should_stop: Callable[[], bool] | None,
) -> Repair | MissionTooLongError:
    """Return a repaired mission with as many items as the vehicle holds, or why it cannot be shortened so far.

    Raises
    ------
    SituationError
        It holds more jumps than the autopilot counts.
    """
    _check_jumps(repaired)
    changes = _changes(repaired)
    most = most_own_items(situation)
    count = len(checked.mission.items)
    if count > most:
        try:
            checked = shortened(
                checked.mission, repaired.own_seqs, situation, request, most=most, should_stop=should_stop
            )
        except MissionTooLongError as error:
            return error
        left_out = count - len(checked.mission.items)
        changes = (
            *changes,
            left_out_text(left_out, most + checked.vehicle.home_items),
        )
    return Repair(checked.mission, checked, changes)


def _unrepaired(repaired: ItemList, checked: MissionCheck) -> NoRouteError:
    """Return the error for a mission whose corners keep breaking the promise."""
    worst = min(checked.broken, key=lambda leg: leg.driven_clearance_m - leg.asked_m)
    return NoRouteError(
        f"the mission cannot be repaired: near {_names(repaired.origin(worst.leg))} the vehicle would still come "
        f"within {metres(worst.driven_clearance_m)} of {worst.fence} at {worst.at}; {metres(worst.asked_m)} is required",
        driven_clearance_m=round(worst.driven_clearance_m, 3),
        fences=[worst.fence],
    )


def _routed(
    asked: MissionCheck,
    legs: _Routed,
    situation: Situation,
    request: Request,
    should_stop: Callable[[], bool] | None,
) -> ItemList:
    """Return the mission with routes in place of some legs."""
    repaired = ItemList(asked.mission)
    moved: dict[int, LatLon] = {}

    def put(run: Sequence[CourseLeg]) -> None:
        there = [_where_moved(leg, moved) for leg in run]
        for leg, detour in zip(
            run, _detours(there, legs, asked, situation, request, should_stop), strict=True
        ):
            repaired.replace_leg(_key(leg), detour.before, detour.goal, detour.after)
            if detour.goal.is_placed:
                moved[leg.last_item] = detour.goal.position

    for run in _runs(asked, legs):
        try:
            put(run)
        except RouteError:
            if len(run) == 1:
                raise
            for (
                leg
            ) in run:  # one by one; whether the corners between them keep the promise is checked afterwards
                put([leg])
    return repaired


def _key(leg: CourseLeg) -> LegKey:
    return leg.first_item, leg.last_item, leg.jump_item


def _names(key: LegKey) -> str:
    first, last, jump = key
    return f"leg {first or 'start'} → {last}{f' (jump {jump})' if jump else ''}"


def _where_moved(leg: CourseLeg, moved: Mapping[int, LatLon]) -> CourseLeg:
    """Return a leg between the places where its ends are now."""
    return replace(leg, start=moved.get(leg.first_item, leg.start), end=moved.get(leg.last_item, leg.end))


def _first_driven(checked: MissionCheck) -> list[tuple[int, CheckedLeg]]:
    """Return each leg once, where it is driven first, with its number in the course."""
    found: dict[LegKey, tuple[int, CheckedLeg]] = {}
    for number, leg in enumerate(checked.legs):
        found.setdefault(_key(leg.leg), (number, leg))
    return list(found.values())


def _runs(asked: MissionCheck, legs: _Routed) -> list[list[CourseLeg]]:
    """Return the legs to be routed: those that are bent grouped where they are driven one after another at one speed."""
    runs: list[list[CourseLeg]] = []
    before = -2
    for number, checked in _first_driven(asked):
        leg = checked.leg
        if _key(leg) not in legs.keys:
            continue
        last = runs[-1][-1] if runs and number == before + 1 else None
        follows = last is not None and last.speed_mps == leg.speed_mps and last.stop_s is None
        if last is not None and follows and {_key(last), _key(leg)} <= legs.bent:
            runs[-1].append(leg)
        else:
            runs.append([leg])
        before = number
    return runs


def _beside(asked: MissionCheck, keys: set[LegKey]) -> set[LegKey]:
    """Return the legs driven just before and after some legs."""
    order = [_key(leg.leg) for leg in asked.legs]
    places = [number for number, key in enumerate(order) if key in keys]
    return {order[near] for number in places for near in (number - 1, number + 1) if 0 <= near < len(order)}


def _detours(
    run: Sequence[CourseLeg],
    legs: _Routed,
    asked: MissionCheck,
    situation: Situation,
    request: Request,
    should_stop: Callable[[], bool] | None,
) -> list[_Detour]:
    """Plan a run of legs: one that is not bent along its own line up to near what is in the way, where that can be driven.

    Raises
    ------
    RouteError
        There is no route; the message says for which legs.
    """
    first = run[0]
    local = replace(situation, pose=_pose(first, asked, situation), mission=None)
    clearance_m = legs.clearance_of(_key(first))
    own = {"start": first.start, "speed_mps": first.speed_mps, "clearance_m": clearance_m}
    wanted = Tour(**{**conditions(request), **own})

    def planned(*targets: LatLon) -> Plan:
        return plan_route(local, replace(wanted, targets=targets), should_stop=should_stop)

    found: list[Plan] = []
    for places in () if _key(first) in legs.bent else _places_on_line(first, asked, situation, wanted):
        with suppress(RouteError, PlanCheckError):  # what does not pass its own check is no choice either
            found.append(planned(*places, first.end))
            if _is_steady(found[-1]):
                break
    try:
        plan = min(found, key=_slowness) if found else planned(*(leg.end for leg in run))
    except RouteError as error:
        names = " and ".join(_names(_key(leg)) for leg in run)
        raise type(error)(f"{names}: {error}", **error.details) from None
    return _split(plan, plan.targets[-len(run) :], run, asked.mission)


def _places_on_line(
    leg: CourseLeg, asked: MissionCheck, situation: Situation, request: Request
) -> Iterator[list[LatLon]]:
    """Return where a route may leave the leg's own line and come back to it, first as near to what is in the way as may be."""
    required_m = promise(situation, request, asked.vehicle).required_m
    clearance_m = required_m + forecast_band_m(asked.envelope) + reserve_m(asked.ground)
    ground = with_seams(asked.ground, asked.vehicle)
    for run_in_m in _RUN_INS_M:
        if places := places_on_line(ground, leg, clearance_m, run_in_m):
            yield places


def _slowness(plan: Plan) -> tuple[bool, float]:
    """Return what orders plans: first those without slower stretches and stops, then the quicker ones."""
    return not _is_steady(plan), plan.duration_s


def _is_steady(plan: Plan) -> bool:
    """Return whether a plan is driven without slower stretches and stops."""
    return not any(plan.speeds) and not any(item.params[0] > 0 for item in plan.items if item.is_placed)


def _pose(first: CourseLeg, asked: MissionCheck, situation: Situation) -> Known[Pose] | None:
    """Return where and how the vehicle comes to the first leg of a run."""
    number = next(n for n, leg in enumerate(asked.legs) if _key(leg.leg) == _key(first))
    if number == 0:
        return situation.pose
    before = [leg.leg for leg in asked.legs[:number] if leg.length_m > 0]
    heading_deg = bearing_deg(before[-1].start, before[-1].end) if before else None
    return Known(Pose(first.start, heading_deg), None, "the mission")


def _split(
    planned: Plan, ends: Sequence[LatLon], run: Sequence[CourseLeg], mission: Mission
) -> list[_Detour]:
    """Return the part of a plan that belongs to each leg of a run, by where each ends now."""
    detours = []
    begin = int(run[0].speed_mps is not None)  # the mission sets its speed itself
    point = 0
    for leg, target in zip(run, ends, strict=True):
        goal = mission.items[leg.last_item - 1]
        if not leg.is_return and distance_m(goal.position, target) > ROUNDING_RESERVE_M:
            lat_e7, lon_e7 = to_e7(target)
            goal = replace(goal, lat_e7=lat_e7, lon_e7=lon_e7)
        before_point = point
        point = next(index for index in range(point, len(planned.path)) if planned.path[index] == target)
        if point == before_point:  # it leads to where it begins
            detours.append(_Detour((), goal, ()))
            continue
        end = planned.seqs[point]
        before, there = planned.items[begin : end - 1], planned.items[end - 1]
        if leg.is_return:
            before = (*before, there)
        elif there.params[0] > 0 and not goal.params[0] > 0:
            goal = replace(goal, params=(there.params[0], *goal.params[1:]))
        detours.append(_Detour(before, goal, ()))
        begin = end
    last_mps = planned.speeds[point - 1] if point else None
    if last_mps is not None and last_mps != planned.vehicle.speed_mps:
        detours[-1] = replace(detours[-1], after=(change_speed(planned.vehicle.speed_mps),))
    return detours


def _check_jumps(repaired: ItemList) -> None:
    if repaired.jumps > MOST_TRACKED_JUMPS:
        raise SituationError(
            f"the repaired mission has {repaired.jumps} jumps (DO_JUMP); the autopilot supports {MOST_TRACKED_JUMPS}",
            jumps=repaired.jumps,
        )


def _changes(repaired: ItemList) -> tuple[str, ...]:
    """Return sentences that list what was changed."""
    texts = []
    for key, count in repaired.added.items():
        texts.append(f"{_names(key)}: replaced by a route with {counted(count, 'more waypoint')}")
    for seq, (old, new) in repaired.changed.items():
        if old.position != new.position:
            texts.append(moved_text(f"item {seq}", distance_m(old.position, new.position), new.position))
        if old.params != new.params:
            texts.append(
                f"item {seq}: the vehicle now waits {new.params[0]:g} s there, to turn from standstill"
            )
    return tuple(texts)
