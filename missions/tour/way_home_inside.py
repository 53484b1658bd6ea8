"""A mission with its ways home inside: behind its end, for each leg, a way to the nearest reachable place, to be chosen while that leg is driven.

The ways are planned as routes, from the ends of the legs. They share what they have in common: where the straight lines from all of a leg to a waypoint of a way that is
there already are free, the leg's way begins there. Each is checked from its leg as `pbpp check` does it; one that does not hold is left out, and named.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING

from missions.checking.check import check_mission
from missions.checking.home_part import HomePart, home_parts, jump_to_end
from missions.checking.home_ways import checked_way
from missions.errors import MissionError, MissionTooLongError, NoRouteError, RouteError
from missions.finishing.route_plan import plan_route
from missions.geo import bearing_deg, distance_m
from missions.items import change_speed, jump_tag, waypoint
from missions.request import GoTo, conditions
from missions.routing.way_home import places_of, ways_home
from missions.situation import Known, Mission, Pose
from missions.vehicle import Autopilot
from missions.vehicle.item_limit import most_items
from missions.words import counted

if TYPE_CHECKING:
    from collections.abc import Callable

    from missions.checking.check import CheckedLeg, MissionCheck
    from missions.geo import LatLon
    from missions.items import MissionItem
    from missions.planned import Plan
    from missions.request import Request, Tour
    from missions.routing.way_home import WaysHome
    from missions.situation import Situation

_MUCH_LONGER = 1.25
_LITTLE_M = 5.0
"""A way that is there already is taken unless it is longer than the leg's own by so much. Chosen: items are few, and a quarter is not far."""
_WAIT_S = 1.0  # a stop where a way home turns off too sharply to be driven on; chosen, the shortest that ArduPilot knows
_JUMP_TAG_SINCE = (4, 4)


@dataclass(eq=False)
class _Chain:
    """One way to a place, with the legs from which each of its points may be chosen."""

    points: tuple[LatLon, ...]
    speeds: tuple[float | None, ...]
    stops_first: bool
    tags: dict[int, list[int]] = field(default_factory=dict)

    def rest_m(self, index: int) -> float:
        """Return how far it is from a point to the end."""
        return sum(distance_m(a, b) for a, b in pairwise(self.points[index:]))

    def items(self, own_mps: float, *, has_speeds: bool) -> list[MissionItem]:
        """Return its items, with the tags."""
        found: list[MissionItem] = []
        now: float | None = None
        for index, (point, speed_mps) in enumerate(zip(self.points, self.speeds, strict=True)):
            if index < min(self.tags, default=0):
                continue  # from nowhere is it chosen
            found += [jump_tag(number) for number in self.tags.get(index, ())]
            wanted = own_mps if speed_mps is None else speed_mps
            if has_speeds and (index in self.tags or wanted != now):
                found.append(change_speed(wanted))
                now = wanted
            item = waypoint(point)
            if index == 0 and self.stops_first and len(self.points) > 1:
                item = replace(item, params=(_WAIT_S, 0.0, 0.0, 0.0))
            found.append(item)
        return found


def with_way_home_inside(
    planned: Plan, situation: Situation, request: Tour, *, should_stop: Callable[[], bool] | None = None
) -> Plan:
    """Return a plan with its ways home behind its end.

    Raises
    ------
    NoRouteError
        There is no place to go home to, or no leg has a way.
    MissionTooLongError
        The vehicle does not hold the items.
    """
    _check_vehicle(planned, situation)
    places = places_of(situation, dict(request.places))
    if not places:
        raise NoRouteError(
            "there is no place to go home to: no home, no rally points and no --place",
            advice="give --home LAT,LON or --place NAME=LAT,LON",
        )
    builder = _Builder(
        planned,
        situation,
        request,
        ways_home(situation, planned.vehicle, planned.asked_m, places, planned.path),
        should_stop,
    )
    for leg in reversed(builder.found.legs):  # the farthest have the longest ways, which others can join
        builder.add(leg)
    items = builder.items()
    if len(items) + 1 > (most := most_items(situation.parameters)):
        raise MissionTooLongError(
            f"the mission with its ways home needs {len(items) + 1} items with home; the vehicle holds {most}",
            items=len(items) + 1,
            most=most,
            advice="leave --way-home-inside out, or plan fewer targets at a time",
        )
    if not builder.chains:
        raise NoRouteError(f"no leg has a way home: {builder.without[0]}", advice="see pbpp check --place")
    parts = home_parts(items)
    told = f"ways home inside: {len(items) - len(planned.items)} items for {counted(len(parts), 'leg')}; to go home while the vehicle drives to an item, choose the item after the arrow: "
    told += ", ".join(f"{part.leg_item} → {part.item}" for part in parts)
    return replace(
        planned, items=items, info=(*planned.info, told), warnings=(*planned.warnings, *builder.without)
    )


def _check_vehicle(planned: Plan, situation: Situation) -> None:
    """Refuse a vehicle that does not know tags.

    Raises
    ------
    RouteError
        It is no ArduPilot, or one before 4.4.
    """
    firmware = situation.firmware
    is_old = firmware is not None and (firmware.major, firmware.minor) < _JUMP_TAG_SINCE
    if planned.vehicle.autopilot is not Autopilot.ARDUPILOT or is_old:
        raise RouteError(
            f"ways home inside a mission need JUMP_TAG, which ArduPilot has since 4.4; the vehicle is {planned.vehicle.autopilot} {firmware or ''}".rstrip(),
            advice="leave --way-home-inside out",
        )


class _Builder:
    """Collects the ways home of a plan's legs."""

    def __init__(
        self,
        planned: Plan,
        situation: Situation,
        request: Request,
        ways: WaysHome,
        should_stop: Callable[[], bool] | None,
    ) -> None:
        self.chains: list[_Chain] = []
        self.without: list[str] = []
        self._planned = planned
        self._situation = situation
        self._ways = ways
        self._should_stop = should_stop
        kept = {**conditions(request), "widest": False, "clearance_m": planned.clearance_m, "escape": False}
        self._wanted = GoTo(**{**kept, "start": planned.start, "accepts_less": False, "snap_m": 0.0})
        self._checked = replace(self._wanted, speed_mps=None)
        self.found: MissionCheck = check_mission(
            Mission(planned.items, planned.home), situation, self._checked
        )

    def add(self, leg: CheckedLeg) -> None:
        """Find the way home from a leg: one that is there already, or a new one."""
        number, end = leg.leg.last_item, leg.leg.end
        nearest = self._ways.nearest(end)
        if nearest is None:
            self.without.append(f"no way home from the leg to item {number}: no place can be reached")
            return
        enough_m = _MUCH_LONGER * nearest.length_m + _LITTLE_M
        known = [
            (distance_m(end, point) + chain.rest_m(index), chain, index)
            for chain in self.chains
            for index, point in enumerate(chain.points)
        ]
        for _, chain, index in sorted((one for one in known if one[0] <= enough_m), key=lambda one: one[0]):
            if not self._trouble(leg, chain, index):
                chain.tags.setdefault(index, []).append(number)
                return
        self._add_new(leg, nearest.place.position)

    def _add_new(self, leg: CheckedLeg, place: LatLon) -> None:
        """Plan a way of the leg's own, and begin it at the last of its points that is free from all of the leg."""
        number, trouble = leg.leg.last_item, ""
        for stops_first in (False, True):
            try:
                chain = self._planned_chain(leg, place, stops_first=stops_first)
            except RouteError as error:
                trouble = str(error)
                break
            for index in reversed(range(len(chain.points))):
                if not (trouble := self._trouble(leg, chain, index)):
                    chain.tags[index] = [number]
                    self.chains.append(chain)
                    return
        self.without.append(f"no way home from the leg to item {number}: {trouble}")

    def items(self) -> tuple[MissionItem, ...]:
        """Return the whole mission: the drive, the jump to its end, the ways home, the tag at the end."""
        speeds = [*self._planned.speeds, *(speed for chain in self.chains for speed in chain.speeds)]
        has_speeds = any(speed is not None for speed in speeds)
        own_mps = self._planned.vehicle.speed_mps
        ways = [chain.items(own_mps, has_speeds=has_speeds) for chain in self.chains]
        drive = self._planned.items
        last_item = len(drive) + 1 + sum(len(way) + 1 for way in ways)
        jump = jump_to_end(last_item)
        parts = [item for number, way in enumerate(ways) for item in ((jump, *way) if number else way)]
        return (*drive, jump, *parts, jump_tag(len(drive) + 1))

    def _planned_chain(self, leg: CheckedLeg, place: LatLon, *, stops_first: bool) -> _Chain:
        end = leg.leg.end
        if distance_m(end, place) < _LITTLE_M / 10:
            return _Chain((place,), (leg.leg.speed_mps,), stops_first)
        pose = Known(Pose(end, bearing_deg(leg.leg.start, end)), None, "the end of the leg")
        wanted = replace(self._wanted, start=end, target=place)
        found = plan_route(replace(self._situation, pose=pose), wanted, should_stop=self._should_stop)
        return _Chain(found.path, (leg.leg.speed_mps, *found.speeds), stops_first)

    def _trouble(self, leg: CheckedLeg, chain: _Chain, index: int) -> str:
        """Return why a leg's way may not begin at a point; empty where it may."""
        tail = _tail(chain, index)
        items = tuple(tail.items(self._planned.vehicle.speed_mps, has_speeds=any(tail.speeds)))
        numbers = tuple(range(index + 1, index + 1 + len(items)))
        part = HomePart(leg.leg.last_item, index + 1, items, numbers)
        try:
            return checked_way(
                part, leg.leg, leg.asked_m, self.found, self._situation, self._checked, check_mission
            ).trouble
        except MissionError as error:
            return str(error)


def _tail(chain: _Chain, index: int) -> _Chain:
    """Return the rest of a way from a point on."""
    return _Chain(chain.points[index:], chain.speeds[index:], chain.stops_first and index == 0)
