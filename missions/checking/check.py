"""Checking a mission, whoever wrote it, against a fence: what each leg keeps while it is drawn and while it is driven."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import LineString, Point
from shapely.ops import nearest_points

from missions.checking.execution import CIRCLE_M, Course, CourseLeg, follow_mission
from missions.checking.forecast import forecast_drive
from missions.checking.holding import hold_check, hold_warnings
from missions.checking.home_ways import checked_ways
from missions.checking.mission_end import crossed_zones, end_warnings, return_warnings
from missions.checking.pivots import pivot_remarks
from missions.checking.px4_waits import with_waits
from missions.checking.rtl_lines import return_place
from missions.drive_model import Envelope, extrapolated
from missions.errors import SituationError, StartBlockedError
from missions.geo import LatLon, LocalPoint, distance_m
from missions.ground.from_situation import ground_for, heading_at
from missions.ground.ground import EDGE_BOW_M, Ground
from missions.ground.known_fence import fence_warnings, known_fence
from missions.ground.legs import drawn_leg
from missions.ground.px4_fence import own_promise_info, unenforced_warnings
from missions.ground.seams import Seam, first_stop, is_seam, seam_advice, seam_reason, seams_of
from missions.ground.start_hazard import start_hazard
from missions.planned import Clearances, Plan
from missions.promise import known_vehicle, promise
from missions.request import GoTo
from missions.situation import Known
from missions.vehicle import real_number
from missions.vehicle.parameter_remarks import assumed_remarks, parameter_remarks
from missions.words import HEADING_UNKNOWN, start_near_text

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from shapely.geometry.base import BaseGeometry

    from missions.checking.home_ways import CheckedWay
    from missions.drive_model.stopping import HoldCheck
    from missions.fence import Fence
    from missions.promise import Promise
    from missions.request import Request
    from missions.situation import Mission, Situation
    from missions.vehicle import Vehicle

# A home farther off is not laid out with the mission. Chosen, not measured: it bounds the frame
_FAR_M = 50_000.0
_STEP_M = 0.5  # between the places of the first leg that are asked for their clearance; chosen, not measured
_ANYTHING = GoTo()

TOLERANCE_M = 0.01
"""A leg that falls short by no more than this keeps its promise: positions are rounded to degE7."""


@dataclass(frozen=True, slots=True)
class CheckedLeg:
    """What one leg keeps.

    Parameters
    ----------
    leg : CourseLeg
        From where to where.
    length_m : float
        Its drawn length.
    drawn_clearance_m : float
        The least distance of its straight line to any fence; 0 where it crosses one, infinite without a fence.
    driven_clearance_m : float
        The least distance predicted for the driven track, the corner at its end included.
    asked_m : float
        What the driven track has to keep: the clearance, on a first leg no more than the start itself has.
    fence : str or None
        The zone that is nearest.
    at : LatLon or None
        Where on the leg it is nearest; where it crosses a fence, the first place where it does.
    crosses : tuple of str
        The zones that the straight line crosses, and seams of a union before which the vehicle stops.
    time_s : float
        Time from the place before to this leg's end.
    """

    leg: CourseLeg
    length_m: float
    drawn_clearance_m: float
    driven_clearance_m: float
    asked_m: float
    fence: str | None
    at: LatLon | None
    crosses: tuple[str, ...]
    time_s: float

    @property
    def stops_at_seam(self) -> bool:
        """Whether the vehicle would stop before a seam of the union."""
        return any(is_seam(name) for name in self.crosses)

    @property
    def breaks(self) -> bool:
        """Whether it breaks the promise."""
        return bool(self.crosses) or self.driven_clearance_m < self.asked_m - TOLERANCE_M

    @property
    def name(self) -> str:
        """The leg by its items: ``2 → 3``, ``5 → 2 (jump 6)``, ``3 → home``."""
        jump = f" (jump {self.leg.jump_item})" if self.leg.jump_item else ""
        goal = "home" if self.leg.is_return else str(self.leg.last_item)
        return f"{self.leg.first_item or 'start'} → {goal}{jump}"


@dataclass(frozen=True, eq=False)
class MissionCheck:
    """A mission and what its legs keep.

    Parameters
    ----------
    mission : Mission
        What was checked.
    course : Course
        The legs that it makes the vehicle drive.
    legs : tuple of CheckedLeg
        Each as often as it is driven.
    clearance_m : float
        What was to be kept while driving.
    dangers : tuple of str
        What is known to end in the fence, whatever the legs keep; with any of these the mission does not hold.
    warnings : tuple of str
        What else a person should know.
    info : tuple of str
        What was added to be safe.
    envelope : Envelope
        The predicted corridor.
    extrapolated : tuple of str
        Why the drive lies outside the measured range: then it is predicted, not promised, that the mission holds.
    trusts_model : bool
        Whether that is promised all the same.
    hold : HoldCheck or None
        What HOLD does on the way.
    home_ways : tuple of CheckedWay
        The ways home inside the mission, behind its end; none of them may be unsafe.
    """

    mission: Mission
    course: Course
    legs: tuple[CheckedLeg, ...]
    clearance_m: float
    dangers: tuple[str, ...]
    warnings: tuple[str, ...]
    fence: Fence
    ground: Ground
    vehicle: Vehicle
    envelope: Envelope
    extrapolated: tuple[str, ...] = ()
    trusts_model: bool = False
    info: tuple[str, ...] = ()
    hold: HoldCheck | None = None
    home_ways: tuple[CheckedWay, ...] = ()

    @property
    def broken(self) -> tuple[CheckedLeg, ...]:
        """The legs that break the promise."""
        return tuple(leg for leg in self.legs if leg.breaks)

    @property
    def holds(self) -> bool:
        """Whether every leg and way home keeps its clearance, everything was understood, and nothing is known to end in the fence."""
        ways_hold = not any(way.trouble for way in self.home_ways)
        return not self.broken and not self.troubles and not self.dangers and ways_hold

    @property
    def is_promised(self) -> bool:
        """Whether it holds, and that was measured or the drive model is trusted."""
        return self.holds and (self.trusts_model or not self.extrapolated)

    @property
    def troubles(self) -> tuple[str, ...]:
        """What was not understood; with any of these the mission does not hold."""
        return self.course.troubles

    @property
    def duration_s(self) -> float:
        """The time for all of it; for one round of a mission that repeats without end."""
        return self.envelope.duration_s

    @property
    def length_m(self) -> float:
        """The drawn length of all legs."""
        return sum(leg.length_m for leg in self.legs)

    @property
    def drawn_clearance_m(self) -> float:
        """The least drawn clearance of all legs."""
        return min(leg.drawn_clearance_m for leg in self.legs)

    @property
    def driven_clearance_m(self) -> float:
        """The least predicted clearance of all legs."""
        return min(leg.driven_clearance_m for leg in self.legs)

    @property
    def path(self) -> tuple[LatLon, ...]:
        """The drawn lines, start first."""
        return self.course.path


def check_mission(mission: Mission, situation: Situation, request: Request = _ANYTHING) -> MissionCheck:
    """Check every leg of a mission against the situation's fence, for the situation's vehicle.

    Parameters
    ----------
    mission : Mission
        The items, without the home item.
    situation : Situation
        Fence, parameters, home and where the vehicle is.
    request : Request
        What every leg has to keep while driving, as for plans: clearance, reserve, the position's error, the vehicle's size. Where the vehicle
        starts; default: where it is, else home. The rest of it is not used: places and speeds are the mission's.

    Raises
    ------
    FenceMissingError
        No fence is known.
    SituationError
        The mission drives nowhere, or a place is too far away.
    FenceError, VehicleError, InvalidPositionError
        The fence, a parameter or a position cannot be used.
    """
    request = replace(request, widest=False, speed_mps=None, corner_allowance_m=None)
    found = _check_drive(mission, situation, request)
    return replace(found, home_ways=checked_ways(found, situation, request, _check_drive))


def _check_drive(mission: Mission, situation: Situation, request: Request) -> MissionCheck:
    """Check what a mission drives by itself, from its first item to its end."""
    # Long by the warnings, which stand in the order in which they are told.
    fence = known_fence(situation)
    vehicle = known_vehicle(situation, request)
    asked = promise(situation, request, vehicle)
    situation = _with_home(situation, mission)
    home = situation.home.value if situation.home else None
    start = request.start or (situation.pose.value.position if situation.pose else home)
    course = _course(mission, situation, vehicle, start, home)
    ground = ground_for(situation, vehicle, (*course.path, *_near(home, course)))
    heading_deg = heading_at(situation, start) if start else None
    forecast = _forecast(course, ground, vehicle, heading_deg)
    legs = _checked_legs(course, ground, forecast, asked.required_m, seams_of(ground, vehicle))
    dangers, hazards = _at_start(ground, start, vehicle)
    hold = hold_check(forecast, vehicle, ground, situation.stops)
    speeds = (leg.speed_mps for leg in course.legs)
    reasons = extrapolated(vehicle, forecast, *speeds, ends_in_loiter=course.ends_in_loiter)
    warnings = [
        *parameter_remarks(situation),
        *fence_warnings(vehicle, situation),
        *ground.warnings,
        *unenforced_warnings(vehicle, situation, ground),
        *asked.warnings,
        *course.notes,
        *hazards,
        *_seam_warnings(vehicle, legs),
        *_start_warnings(ground, start, heading_deg, legs[0], asked),
        *_drive_warnings(vehicle, forecast, course),
        *pivot_remarks(ground, vehicle, forecast, _items_of(course)),
        *reasons,
        *([] if any(leg.crosses for leg in legs) else hold_warnings(hold)),
        *return_warnings(situation, vehicle, ground, course.path),
        *end_warnings(situation, vehicle, course),
    ]
    return MissionCheck(
        mission=mission,
        course=course,
        legs=legs,
        clearance_m=asked.promised_m,
        dangers=dangers,
        warnings=tuple(dict.fromkeys(warnings)),
        fence=fence,
        ground=ground,
        vehicle=vehicle,
        envelope=forecast,
        extrapolated=reasons,
        trusts_model=request.trusts_model,
        hold=hold,
        info=(*asked.info, *own_promise_info(vehicle)),
    )


def plan_of(check: MissionCheck, situation: Situation, *, method: str = "optimal") -> Plan:
    """Return a checked mission as a plan: for pictures, files, uploads and drives."""
    path = check.path
    home = situation.home.value if situation.home else check.mission.home
    return Plan(
        items=check.mission.items,
        path=path,
        seqs=(0, *(leg.leg.last_item for leg in check.legs)),
        speeds=tuple(leg.leg.speed_mps for leg in check.legs),
        start=path[0],
        targets=path[-1:],
        method=method,
        straight_line_m=distance_m(path[0], path[-1]),
        keeps=Clearances(
            check.clearance_m,
            max(leg.asked_m for leg in check.legs),
            check.drawn_clearance_m,
            check.driven_clearance_m,
        ),
        blocks=0,
        fence=check.fence,
        ground=check.ground,
        vehicle=check.vehicle,
        envelope=check.envelope,
        home=home,
        warnings=check.warnings,
        info=check.info,
    )


def _course(
    mission: Mission, situation: Situation, vehicle: Vehicle, start: LatLon | None, home: LatLon | None
) -> Course:
    """Follow the mission as this vehicle drives it."""
    course = follow_mission(
        mission,
        start,
        home=home,
        return_to=partial(return_place, situation),
        return_speed_mps=real_number(situation.parameters, "RTL_SPEED", 0.0) or None,
        circle_m=real_number(situation.parameters, "CIRC_RADIUS", CIRCLE_M),
        own_speed_mps=vehicle.speed_mps,
    )
    if not course.legs:
        raise SituationError("; ".join(["the mission has no leg to check", *course.troubles]))
    course = with_waits(course, mission.items, vehicle)
    return _with_drift(course, vehicle) if vehicle.boat_drift_m else course


def _with_drift(course: Course, vehicle: Vehicle) -> Course:
    """Return the course of a boat, which drifts LOIT_RADIUS about each place where it stops (ArduPilot Rover's start_loiter)."""
    drift_m = vehicle.boat_drift_m or 0.0
    legs = tuple(
        leg if leg.stop_s is None else replace(leg, circle_m=max(leg.circle_m, drift_m))
        for leg in course.legs
    )
    notes = dict.fromkeys(
        f"a boat (FRAME_CLASS 2) drifts within LOIT_RADIUS {drift_m:g} m of item {leg.last_item}"
        + (f" for {leg.stop_s:g} s" if leg.stop_s else "")
        for leg in legs
        if leg.stop_s is not None
    )
    return replace(course, legs=legs, notes=(*course.notes, *notes))


def _forecast(course: Course, ground: Ground, vehicle: Vehicle, heading_deg: float | None) -> Envelope:
    speeds = [leg.speed_mps for leg in course.legs]
    stops = {number: leg.stop_s for number, leg in enumerate(course.legs, 1) if leg.stop_s is not None}
    return forecast_drive(ground, course.path, vehicle, heading_deg, speeds=speeds, stops=stops)


def _checked_legs(
    course: Course, ground: Ground, forecast: Envelope, promised_m: float, seams: tuple[Seam, ...]
) -> tuple[CheckedLeg, ...]:
    times_s = np.diff(forecast.arrivals_s)
    driven_m = _driven_m(forecast, ground, len(course.legs))
    known: dict[BaseGeometry, _Drawn] = {}
    checked = []
    circle_before_m = 0.0
    for number, leg in enumerate(course.legs):
        shape = _shape(ground, leg, circle_before_m)
        drawn = known.get(shape) or known.setdefault(shape, _Drawn.of(ground, shape, seams))
        leg_driven_m = min(float(driven_m[number]), drawn.clearance_m)
        if leg.circle_m or circle_before_m:
            leg_driven_m = min(leg_driven_m, max(0.0, drawn.clearance_m - forecast_band_m(forecast)))
        asked_m = promised_m
        if leg.first_item == 0 and number == 0:
            asked_m = _asked_of_first_leg_m(ground, leg, forecast_band_m(forecast), promised_m)
        checked.append(
            CheckedLeg(
                leg=leg,
                length_m=distance_m(leg.start, leg.end),
                drawn_clearance_m=drawn.clearance_m,
                driven_clearance_m=leg_driven_m,
                asked_m=asked_m,
                fence=drawn.fence,
                at=drawn.at,
                crosses=drawn.crosses,
                time_s=float(times_s[number]),
            )
        )
        circle_before_m = leg.circle_m
    return tuple(checked)


def _asked_of_first_leg_m(ground: Ground, leg: CourseLeg, band_m: float, promised_m: float) -> float:
    """Return the clearance that the leg from the start must keep: less than the others where the start is near a fence and the leg leads away from it."""
    line = drawn_leg(ground, leg.start, leg.end)
    if not isinstance(line, LineString) or not ground.allowed.covers(line):
        return promised_m
    at_m = np.arange(0.0, line.length + _STEP_M, _STEP_M)
    clearances_m = shapely.distance(shapely.line_interpolate_point(line, at_m), ground.edge)
    far = np.flatnonzero(clearances_m >= promised_m + band_m)
    if len(far) and clearances_m[far[0] :].min() < promised_m + band_m - TOLERANCE_M:
        return promised_m  # it has led away, and comes near a fence again
    return min(promised_m, max(0.0, float(clearances_m[0]) - band_m))


def forecast_band_m(forecast: Envelope) -> float:
    """Return the widest straight-line band of a drive."""
    return max((leg.half_width_m for leg in forecast.legs), default=0.0)


def _shape(ground: Ground, leg: CourseLeg, circle_before_m: float) -> BaseGeometry:
    """Return where a leg's drawn line may run: a circle may be left, and come to, anywhere on it."""
    line: BaseGeometry = drawn_leg(ground, leg.start, leg.end)
    if circle_before_m:
        disc = Point(ground.frame.to_local(leg.start)).buffer(circle_before_m * CIRCLE_PAD)
        line = shapely.union_all([disc, line]).convex_hull
    if leg.circle_m:
        disc = Point(ground.frame.to_local(leg.end)).buffer(leg.circle_m * CIRCLE_PAD)
        line = shapely.union_all([disc, line])
    return line


CIRCLE_PAD = 1.01
"""A polygon about a circle holds it if its corners stand so much farther out; 16 a quarter need 1.0012, the rest is the autopilot's metre."""


@dataclass(frozen=True, slots=True)
class _Drawn:
    """What a drawn shape keeps."""

    clearance_m: float
    fence: str | None
    at: LatLon | None
    crosses: tuple[str, ...]

    @classmethod
    def of(cls, ground: Ground, shape: BaseGeometry, seams: tuple[Seam, ...]) -> _Drawn:
        if not ground.allowed.covers(shape):
            crossed = crossed_zones(ground, shape)
            return cls(0.0, crossed[0], _position(ground, _first_outside(ground, shape)), crossed)
        if (stop := first_stop(seams, shape)) is not None:
            name, place = stop
            return cls(0.0, name, _position(ground, place), (name,))
        nearest, _ = ground.nearest(shape)
        at, _ = nearest_points(shape, ground.edge)
        clearance_m = max(0.0, ground.clearance_m(shape) - EDGE_BOW_M)
        return cls(clearance_m, nearest.name if nearest else None, _position(ground, at), ())


def _first_outside(ground: Ground, shape: BaseGeometry) -> Point:
    """Return the first place of a shape, in its own direction, that is on forbidden ground."""
    outside = shape.difference(ground.allowed)
    if not isinstance(shape, LineString) or outside.is_empty:
        return outside.representative_point() if not outside.is_empty else shape.representative_point()
    along_m = min(shape.project(Point(place)) for place in shapely.get_coordinates(outside))
    return Point(shape.interpolate(along_m))


def _position(ground: Ground, point: Point) -> LatLon:
    return ground.frame.to_lat_lon(LocalPoint(point.x, point.y))


def _driven_m(forecast: Envelope, ground: Ground, count: int) -> NDArray[np.float64]:
    """Return the least predicted clearance of each leg, with the corner at its end."""
    pieces_m = np.maximum(forecast.clearances_m(ground.edge), 0.0)
    pieces_m[~shapely.covers(ground.allowed, forecast.cores)] = 0.0
    legs_m = np.full(count, np.inf)
    np.minimum.at(legs_m, np.clip(forecast.waypoints - 1, 0, count - 1), pieces_m)
    # Places that lie on one another are one to the drive model: the last of them, at the mission's end the first.
    bare = set(range(count)) - set((forecast.waypoints - 1).tolist())
    for number in sorted(bare - {count - 1}, reverse=True):
        legs_m[number] = min(legs_m[number], legs_m[number + 1])
    for number in sorted(bare - {0}):
        legs_m[number] = min(legs_m[number], legs_m[number - 1])
    return legs_m


def _with_home(situation: Situation, mission: Mission) -> Situation:
    """Return the situation with the mission's home where it knows none."""
    if situation.home or not mission.home:
        return situation
    return replace(situation, home=Known(mission.home, None, "the mission"))


def _near(home: LatLon | None, course: Course) -> list[LatLon]:
    """Return home where it is so near that it is laid out with the mission."""
    return [home] if home and distance_m(home, course.path[0]) < _FAR_M else []


def _at_start(ground: Ground, start: LatLon | None, vehicle: Vehicle) -> tuple[tuple[str, ...], list[str]]:
    """Return what is known to end in the fence from the start, and warnings of what may stop the vehicle there."""
    hazard = start_hazard(ground, ground.frame.to_local(start), vehicle) if start else None
    if isinstance(hazard, StartBlockedError):
        return (f"{hazard}; {hazard.details['advice']}",), []
    return (), [hazard] if hazard else []


def _seam_warnings(vehicle: Vehicle, legs: tuple[CheckedLeg, ...]) -> list[str]:
    return (
        [f"{seam_reason(vehicle)}; {seam_advice(vehicle)}"] if any(leg.stops_at_seam for leg in legs) else []
    )


def _start_warnings(
    ground: Ground, start: LatLon | None, heading_deg: float | None, first: CheckedLeg, asked: Promise
) -> list[str]:
    """Return warnings of what is unknown at the start, and of what its first leg cannot keep."""
    if start is None:
        return [f"start position unknown; the leg to item {first.leg.first_item} was not checked"]
    warnings = []
    if heading_deg is None:
        warnings.append(HEADING_UNKNOWN)
    if first.asked_m < asked.required_m and not first.breaks:
        start_m = ground.clearance_m(Point(ground.frame.to_local(start)))
        warnings.append(start_near_text(start_m, asked.promised_m, first.driven_clearance_m))
    return warnings


def _items_of(course: Course) -> list[int]:
    """Return the mission items of its places."""
    return [course.legs[0].first_item, *(leg.last_item for leg in course.legs)]


def _drive_warnings(vehicle: Vehicle, forecast: Envelope, course: Course) -> list[str]:
    """Return warnings of where the drive model does not hold, and of parameters that were not known."""
    items = _items_of(course)
    warnings = [
        f"item {items[corner.waypoint]}: {abs(corner.turn_deg):.0f}° turn between short legs; "
        "in tests rovers swung wider there than predicted"
        for corner in forecast.corners
        if not corner.bounded
    ]
    return [*warnings, *assumed_remarks(vehicle)]
