"""Grading a drive: how near to the fence it came, how far off the mission's lines, how long it took, and what was predicted.

What is predicted comes from the drive model (`missions.drive_model`), for the mission as it stood on the vehicle, from where the vehicle was.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import shapely
from shapely import LineString

from mavlink_bridge.logbook.legs import GradedLeg, LegMeter
from missions.checking.execution import follow_mission
from missions.checking.px4_waits import with_waits
from missions.drive_model import beyond_measured, envelope
from missions.drive_model.avoidance import with_avoidance
from missions.errors import MissionError
from missions.geo import LatLon
from missions.items import Command
from missions.situation import Mission
from missions.vehicle import Autopilot

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from mavlink_bridge.logbook.track import FenceMeter, TrackFix
    from missions.drive_model import Envelope
    from missions.ground.frame import LocalFrame
    from missions.items import MissionItem
    from missions.vehicle import Vehicle

OUTSIDE_M: Final = 0.25
"""How far outside the predicted band still counts as within: the vehicle's own estimate of its place is off by as much."""

STANDING_MPS: Final = 0.1  # slower is standing; chosen, not measured
_LEAST_DRIVEN_M = 1.0  # less is no drive; chosen, not measured
_PLAIN = frozenset({Command.NAV_WAYPOINT, Command.NAV_DELAY, Command.DO_CHANGE_SPEED})
_ODD = frozenset(
    {
        Command.DO_JUMP,
        Command.DO_SET_REVERSE,
        Command.DO_SET_MISSION_CURRENT,
        Command.CONDITION_DELAY,
        Command.CONDITION_DISTANCE,
    }
)
"""Commands that change the way or its time as the drive model cannot predict; so do all navigation commands but plain waypoints."""


@dataclass(frozen=True, slots=True)
class Foreseen:
    """What the drive model predicts, as far as the vehicle came.

    Parameters
    ----------
    took_s : float or None
        To the last waypoint that was reached; None where none was.
    least_clearance_m : float or None
        None without a fence.
    deviation_m : float
        The farthest off its lines.
    """

    took_s: float | None
    least_clearance_m: float | None
    deviation_m: float


@dataclass(frozen=True, slots=True)
class Grade:
    """One drive of a mission.

    Parameters
    ----------
    begun_s : float
        Since the log's begin.
    first_item, last_item : int
        The first and the last mission item (by seq) that were driven to.
    items : int
        Waypoints of the mission from the first item on.
    reached : int
        How many of them were reached.
    arrived : bool
        Whether the last of them was.
    took_s : float or None
        From the start to the last waypoint reached, by the vehicle's own clock; None where none was reached.
    driven_s, driven_m : float
        The whole drive, whether it reached a waypoint or not.
    least_clearance_m : float or None
        Of the track to forbidden ground; None where no fence was known.
    deviation_m, mean_deviation_m : float
        Off the mission's lines: the farthest, and the mean over all positions.
    outside_m : float or None
        The farthest outside the band that was predicted; None where none could be predicted.
    foreseen : Foreseen or None
        None where the mission holds what the drive model does not foretell.
    notes : tuple of str
        What to know before comparing.
    legs : tuple of GradedLeg
        The drive leg by leg, as far as the vehicle came.
    """

    begun_s: float
    first_item: int
    last_item: int
    items: int
    reached: int
    arrived: bool
    took_s: float | None
    driven_s: float
    driven_m: float
    least_clearance_m: float | None
    deviation_m: float
    mean_deviation_m: float
    outside_m: float | None
    foreseen: Foreseen | None
    notes: tuple[str, ...]
    legs: tuple[GradedLeg, ...] = ()

    @property
    def is_as_foreseen(self) -> bool | None:
        """Whether the track stayed within the band that was predicted; None where none could be."""
        return None if self.outside_m is None else self.outside_m <= OUTSIDE_M


class MissionWay(NamedTuple):
    """A mission as a drive: the waypoints to come, each with its seq; the speed asked for on the leg to each, and before which legs an item asks; stops; what is odd."""

    seqs: tuple[int, ...]
    positions: tuple[LatLon, ...]
    speeds: tuple[float | None, ...]
    asked_before: frozenset[int]
    stops: dict[int, float]
    odd: str | None


def way_of(
    items: Sequence[MissionItem], first_item: int, *, home_first: bool, vehicle: Vehicle | None = None
) -> MissionWay:
    """Return the way that a mission describes from an item on.

    Parameters
    ----------
    items : sequence of MissionItem
        Without home.
    first_item : int
        The seq that is driven to first; 0 is the beginning.
    home_first : bool
        Whether seq 0 is home (ArduPilot), so that the items begin at seq 1.
    vehicle : Vehicle, optional
        What drives: what it makes of waits. Default: ArduPilot's, which stands.
    """
    numbered = list(enumerate(items, start=int(home_first)))
    odd = next((entry for entry in numbered if entry[0] >= first_item and _is_odd(entry[1])), None)
    listed = Mission(tuple(map(_as_listed, items)))
    course = follow_mission(listed, LatLon(0.0, 0.0), most_legs=len(items) + 1)
    legs = (course if vehicle is None else with_waits(course, listed.items, vehicle)).legs
    seqs = [leg.last_item - 1 + int(home_first) for leg in legs]
    to_come = [(seq, leg) for seq, leg in zip(seqs, legs, strict=True) if seq >= first_item]
    circled = next((seq for seq, leg in to_come if leg.circle_m), None)
    asking = [seq for seq, item in numbered if item.command == Command.DO_CHANGE_SPEED and item.params[1] > 0]
    to_come_seqs = [seq for seq, _ in to_come]
    return MissionWay(
        seqs=tuple(to_come_seqs),
        positions=tuple(leg.end for _, leg in to_come),
        speeds=tuple(leg.speed_mps for _, leg in to_come),
        asked_before=frozenset(bisect_left(to_come_seqs, seq) for seq in asking),
        stops={number: leg.stop_s for number, (_, leg) in enumerate(to_come, 1) if leg.stop_s},
        odd=f"item {odd[0]} (MAV_CMD {odd[1].command})"
        if odd is not None
        else f"the wait at item {circled}, which PX4 drives as a circle"
        if circled is not None
        else None,
    )


def _is_odd(item: MissionItem) -> bool:
    """Return whether the drive model cannot predict an item."""
    is_navigation = item.command < Command.NAV_LAST
    return item.command in _ODD or (is_navigation and item.command not in _PLAIN)


def _as_listed(item: MissionItem) -> MissionItem:
    """Return an item as the track is compared with it: the places in their order, whatever is odd about what happens there or between them."""
    if item.command in _PLAIN:
        return item
    command = Command.NAV_WAYPOINT if item.is_placed else Command.DO_FENCE_ENABLE
    return replace(item, command=command, params=(0.0, 0.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class GradedField:
    """What a drive is measured in: the plane, the fence where one is known, the vehicle by its parameters."""

    frame: LocalFrame
    meter: FenceMeter | None
    vehicle: Vehicle


@dataclass(slots=True)
class _Tally:
    fixes: int = 0
    driven_m: float = 0.0
    least_clearance_m: float = math.inf
    deviation_m: float = 0.0
    sum_m: float = 0.0
    outside_m: float = 0.0
    farthest: int = 1
    reached_s: dict[int, float] = field(default_factory=dict)


class DriveGrader:
    """Grades one drive, batch by batch; keeps no positions.

    Parameters
    ----------
    way : MissionWay
        With at least one waypoint.
    start : TrackFix
        Where the drive began.
    field : GradedField
    """

    def __init__(self, way: MissionWay, start: TrackFix, field: GradedField) -> None:
        self.way = way
        self._start = start
        self._field = field
        self._last = start
        self._tally = _Tally()
        self._points = field.frame.to_local_array([start.position, *way.positions])
        self._last_point = self._points[:1]
        self._seqs = np.array(way.seqs)
        self._legs = LegMeter(self._points)
        self._notes: list[str] = []
        if start.speed_mps > STANDING_MPS:
            self._notes.append(
                f"the drive began at {start.speed_mps:.1f} m/s; the prediction is for a start from rest"
            )
        self._speeds = way.speeds
        self._mixed: set[int] = set()
        self._heading_deg = start.heading_deg if start.speed_mps <= STANDING_MPS else None
        self._forecast = self._foresee()
        self._windows = np.array(
            [
                LineString(self._points[max(0, leg - 1) : leg + 3])  # the leg, the one before, the one after
                for leg in range(len(way.seqs))
            ]
        )

    def drive(
        self,
        fixes: Sequence[TrackFix],
        points: NDArray[np.float64],
        clearances_m: NDArray[np.float64] | None,
    ) -> None:
        """Take positions, their points in the field's frame, and what the track to each keeps to the fence."""
        tally = self._tally
        track = np.concatenate((self._last_point, points))
        self._last_point = points[-1:]
        steps = np.diff(track, axis=0)
        places = shapely.points(points)
        items = np.array([fix.item for fix in fixes])
        legs = np.minimum(np.searchsorted(self._seqs, items), len(self._seqs) - 1)
        deviations_m = shapely.distance(places, self._windows[legs])
        tally.fixes += len(fixes)
        tally.driven_m += float(np.hypot(*steps.T).sum())
        tally.deviation_m = max(tally.deviation_m, float(deviations_m.max()))
        tally.sum_m += float(deviations_m.sum())
        tally.farthest = max(tally.farthest, int(legs.max()) + 1)
        if clearances_m is not None:
            tally.least_clearance_m = min(tally.least_clearance_m, float(clearances_m.min()))
        outside_m: NDArray[np.float64] | None = None
        if self._forecast is not None:
            outside_m = np.asarray(shapely.distance(places, self._forecast.area))
            tally.outside_m = max(tally.outside_m, float(outside_m.max()))
        self._legs.take(track, np.array([fix.speed_mps for fix in fixes]), legs, outside_m)
        self._last = fixes[-1]

    def change_speed(self, speed_mps: float) -> None:
        """Note a speed that a station asked for: it holds until an item of the mission asks for another (both set the same: Rover/mode_auto.cpp, set_desired_speed)."""
        now = min(int(np.searchsorted(self._seqs, self._last.item)), len(self._seqs) - 1)
        end = min((leg for leg in self.way.asked_before if leg > now), default=len(self._speeds))
        changed = (*self._speeds[:now], *(speed_mps,) * (end - now), *self._speeds[end:])
        if changed == self._speeds:
            return
        self._speeds = changed
        if self._tally.fixes:
            self._mixed.add(now)
        if self._forecast is not None:
            self._forecast = self._foresee()

    def reached(self, seq: int, boot_s: float) -> None:
        """Note that a mission item was reached, by MISSION_ITEM_REACHED."""
        if seq in self.way.seqs:
            number = self.way.seqs.index(seq) + 1
            self._tally.reached_s.setdefault(number, boot_s)
            self._tally.farthest = max(self._tally.farthest, number)

    def finish(self) -> Grade | None:
        """Return the grade; None where the vehicle hardly moved."""
        tally, way = self._tally, self.way
        if not tally.fixes or tally.driven_m < _LEAST_DRIVEN_M:
            return None
        last_reached = max(tally.reached_s, default=0)
        took_s = tally.reached_s[last_reached] - self._start.boot_s if last_reached else None
        forecast = self._forecast
        has_fence = self._field.meter is not None and math.isfinite(tally.least_clearance_m)
        return Grade(
            begun_s=self._start.time_s,
            first_item=way.seqs[0],
            last_item=way.seqs[tally.farthest - 1],
            items=len(way.seqs),
            reached=last_reached,
            arrived=last_reached == len(way.seqs),
            took_s=took_s,
            driven_s=self._last.boot_s - self._start.boot_s,
            driven_m=tally.driven_m,
            least_clearance_m=tally.least_clearance_m if has_fence else None,
            deviation_m=tally.deviation_m,
            mean_deviation_m=tally.sum_m / tally.fixes,
            outside_m=None if forecast is None else tally.outside_m,
            foreseen=None if forecast is None else self._foreseen(forecast, last_reached),
            notes=tuple(dict.fromkeys(self._notes)),
            legs=self._legs.finish(
                way.seqs[: tally.farthest],
                [self._field.vehicle.speed_mps if asked is None else asked for asked in self._speeds][
                    : tally.farthest
                ],
                forecast,
                self._mixed,
            ),
        )

    def _foresee(self) -> Envelope | None:
        if self.way.odd is not None:
            self._notes.append(f"no prediction: the drive model does not cover {self.way.odd}")
            return None
        if self._field.vehicle.autopilot is not Autopilot.ARDUPILOT:
            reasons = beyond_measured(self._field.vehicle, *self._speeds)
            more = f"; and {len(reasons) - 1} more" if len(reasons) > 1 else ""
            self._notes += [f"the prediction is extrapolated: {reason}{more}" for reason in reasons[:1]]
        try:
            forecast = envelope(
                self._points,
                self._field.vehicle,
                heading_deg=self._heading_deg,
                speeds=self._speeds,
                stops=self.way.stops,
            )
            if self._field.meter is not None:
                forecast = with_avoidance(forecast, self._field.vehicle, self._field.meter.ground.edge)
        except MissionError as error:
            self._notes.append(f"no prediction: {error}")
            return None
        shapely.prepare(forecast.area)
        return forecast

    def _foreseen(self, forecast: Envelope, last_reached: int) -> Foreseen:
        farthest = self._tally.farthest
        legs = [max(leg.left_m, leg.right_m) for leg in forecast.legs if leg.first < farthest]
        corners = [
            max(corner.inside_cut_m, corner.outside_overshoot_m)
            for corner in forecast.corners
            if corner.waypoint < farthest
        ]
        return Foreseen(
            took_s=float(forecast.arrivals_s[last_reached]) if last_reached else None,
            least_clearance_m=self._foreseen_clearance_m(forecast),
            deviation_m=max(*legs, *corners, 0.0, 0.0),
        )

    def _foreseen_clearance_m(self, forecast: Envelope) -> float | None:
        meter = self._field.meter
        if meter is None or meter.ground.edge.is_empty:
            return None
        lines = self._points[: self._tally.farthest + 1]
        if not meter.at_points(
            lines
        ).all():  # a waypoint on forbidden ground, maybe with the whole band inside it
            return 0.0
        pieces_m = forecast.clearances_m(meter.ground.edge)[forecast.waypoints <= self._tally.farthest]
        return max(0.0, float(pieces_m.min(initial=math.inf)))
