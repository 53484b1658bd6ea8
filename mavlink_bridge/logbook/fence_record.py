"""What a log tells of a vehicle and its fence: how near it came, where it was on forbidden ground, what the autopilot reported of that."""

from __future__ import annotations

import math
import re
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from mavlink_bridge.logbook.facts import Intrusion, Nearest, ReportedBreach
from mavlink_bridge.logbook.track import FenceMeter
from missions.errors import MissionError
from missions.ground.from_situation import ground_for
from missions.vehicle import Vehicle, vehicle_from_parameters

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from mavlink_bridge.logbook.track import TrackFix
    from mavlink_bridge.mavlink.incident_rules import IncidentRules
    from mavlink_bridge.mavlink.messages import FenceStatus
    from missions.situation import Situation

_BOUNDARY: Final = 3  # FENCE_BREACH_BOUNDARY
_MOST_INTRUSIONS: Final = 1000  # the last ones are kept; chosen, bounds memory


class FenceRecord:
    """Measures a track against the fence that holds, batch by batch, and notes what happens there.

    Parameters
    ----------
    note : callable
        Takes what could not be reported, and why.
    """

    def __init__(self, note: Callable[[str], None]) -> None:
        self.nearest: Nearest | None = None
        self.intrusions: deque[Intrusion] = deque(maxlen=_MOST_INTRUSIONS)
        self.breaches: list[ReportedBreach] = []
        self.meter: FenceMeter | None = None
        self.vehicle = Vehicle()
        self.is_laid_out = False
        self._note = note
        self._is_inside = False
        self._breach_count: int | None = None

    def take_status(self, message: FenceStatus, now_s: float) -> None:
        """Take what the autopilot itself reports of its fence."""
        known, self._breach_count = self._breach_count, message.breach_count
        if message.breach_count > (known or 0) and (known is not None or message.breach_status):
            self.breaches.append(ReportedBreach(now_s, message.breach_count, message.breach_type))

    def take_text(self, text: str, rules: IncidentRules, now_s: float) -> None:
        """Take a text of the vehicle, where a text is how the autopilot reports that it left the fence."""
        if not rules.counts_breaches and re.match(rules.breach_text, text, re.IGNORECASE):
            self.breaches.append(ReportedBreach(now_s, len(self.breaches) + 1, _BOUNDARY))

    def measure(
        self,
        fixes: list[TrackFix],
        track: NDArray[np.object_],
        points: NDArray[np.float64],
        *,
        is_armed: bool,
    ) -> NDArray[np.float64] | None:
        """Note what positions keep to the fence, and return that; None without a fence."""
        clearances_m: NDArray[np.float64] | None = None
        if self.meter is not None:
            clearances_m, depths_m = self.meter.measure(track, points)
            if is_armed:
                self._note_nearest(fixes, track, points, clearances_m)
                self._note_intrusions(fixes, track, points, np.where(clearances_m > 0, -1.0, depths_m))
        if not is_armed:
            self._is_inside = False
        return clearances_m

    def lay_out(self, situation: Situation) -> None:
        """Lay the fence out that holds now, unless that is done."""
        if self.is_laid_out:
            return
        self.is_laid_out = True
        self.meter = None
        try:
            self.vehicle = vehicle_from_parameters(
                situation.parameters,
                mav_type=situation.vehicle_type,
                firmware=situation.firmware,
                ardupilot=situation.ardupilot,
            )
            if situation.fence is not None and situation.fence.value.zones:
                self.meter = FenceMeter(
                    ground_for(situation, self._with_known_circle(self.vehicle, situation), ())
                )
        except MissionError as error:
            self._note(f"no clearance: {error}")

    def _with_known_circle(self, vehicle: Vehicle, situation: Situation) -> Vehicle:
        """Leave the home circle out where home is not known."""
        if not vehicle.fence.enforces_home_circle or situation.home is not None:
            return vehicle
        self._note(
            f"the home circle ({vehicle.fence.radius_name} {vehicle.fence.radius_m:g} m) is left out: home is not known"
        )
        return replace(vehicle, fence=replace(vehicle.fence, radius_m=0.0))

    def _note_nearest(
        self,
        fixes: list[TrackFix],
        track: NDArray[np.object_],
        points: NDArray[np.float64],
        clearances_m: NDArray[np.float64],
    ) -> None:
        assert self.meter is not None
        least = int(clearances_m.argmin())
        clearance_m = float(clearances_m[least])
        if clearance_m == math.inf or (self.nearest and self.nearest.clearance_m <= clearance_m):
            return
        zone = self.meter.zone_near(track[least], points[least])
        self.nearest = Nearest(clearance_m, fixes[least].time_s, fixes[least].position, zone)

    def _note_intrusions(
        self,
        fixes: list[TrackFix],
        track: NDArray[np.object_],
        points: NDArray[np.float64],
        depths_m: NDArray[np.float64],
    ) -> None:
        """Note stretches on forbidden ground; a depth of 0 is a line that crossed it from fix to fix, a negative one is outside."""
        assert self.meter is not None
        for fix, piece, point, depth_m in zip(fixes, track, points, depths_m.tolist(), strict=True):
            if depth_m < 0:
                self._is_inside = False
                continue
            if not self._is_inside:
                zone = self.meter.zone_near(piece, point)
                self.intrusions.append(
                    Intrusion(fix.time_s, fix.time_s, depth_m, fix.position, zone, fix.position)
                )
                self._is_inside = True
                continue
            known = self.intrusions[-1]
            deeper = {"deepest_m": depth_m, "position": fix.position} if depth_m > known.deepest_m else {}
            self.intrusions[-1] = replace(known, ended_s=fix.time_s, **deeper)
