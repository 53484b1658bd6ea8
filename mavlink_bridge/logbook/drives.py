"""Finding the drives of missions in a track, and having them graded."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final

from mavlink_bridge.logbook.grade import STANDING_MPS, DriveGrader, Grade, GradedField, way_of
from mavlink_bridge.mavlink.autopilots import autopilot_of
from mavlink_bridge.mavlink.modes import drives_mission

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from mavlink_bridge.logbook.track import FenceMeter, TrackFix
    from missions.ground.frame import LocalFrame
    from missions.situation import Situation
    from missions.vehicle import Vehicle

_HEARTBEAT_S: Final = 1.5
"""A mode change is reported by the next heartbeat: the drive may have begun so long before."""

_MOST_RECENT = 64  # positions kept; chosen: more than come within `_HEARTBEAT_S` at usual rates


class Drives:
    """Follows a vehicle's drives: each runs while it is armed in AUTO with a mission that is known."""

    def __init__(self) -> None:
        self.grades: list[Grade] = []
        self._grader: DriveGrader | None = None
        self._asked_mps: float | None = None  # before the first position of a drive
        self._recent: deque[TrackFix] = deque(maxlen=_MOST_RECENT)

    def drive(
        self,
        situation: Situation,
        fixes: Sequence[TrackFix],
        points: NDArray[np.float64],
        clearances_m: NDArray[np.float64] | None,
        vehicle: Vehicle,
        frame: LocalFrame,
        meter: FenceMeter | None,
    ) -> None:
        """Take positions that were all driven in one situation, their points in the frame, and what the track to each keeps to the fence."""
        if not _is_driving(situation):
            self.end()
            self._asked_mps = None
        elif self._grader is None:
            self._begin(situation, fixes[0], GradedField(frame, meter, vehicle))
        if self._grader is not None:
            self._grader.drive(fixes, points, clearances_m)
        self._recent.extend(fixes)

    def change_speed(self, situation: Situation, speed_mps: float) -> None:
        """Note that the vehicle took a speed from a station; what was driven before was handed over. In other modes it changes no drive: AUTO begins at its own speed."""
        if self._grader is not None:
            self._grader.change_speed(speed_mps)
        elif _is_driving(situation):
            self._asked_mps = speed_mps

    def reached(self, seq: int) -> None:
        """Note that a mission item was reached at the latest position."""
        if self._grader is not None:
            self._grader.reached(seq, self._recent[-1].boot_s)

    def end(self) -> None:
        """End the drive under way, if there is one."""
        grader, self._grader = self._grader, None
        if grader is not None and (grade := grader.finish()) is not None:
            self.grades.append(grade)

    def _begin(self, situation: Situation, first: TrackFix, field: GradedField) -> None:
        assert situation.mission is not None
        home_first = autopilot_of(ardupilot=situation.ardupilot).lists.form.has_home_item
        way = way_of(
            situation.mission.value.items,
            max(int(home_first), first.item),
            home_first=home_first,
            vehicle=field.vehicle,
        )
        if not way.seqs:
            return
        before = self._from_standing(first)
        self._grader = DriveGrader(way, before[0] if before else first, field)
        asked_mps, self._asked_mps = self._asked_mps, None
        if asked_mps is not None:
            self._grader.change_speed(asked_mps)
        if before:
            points = field.frame.to_local_array([fix.position for fix in before])
            clearances_m = field.meter.at_points(points) if field.meter else None
            self._grader.drive(before, points, clearances_m)

    def _from_standing(self, first: TrackFix) -> list[TrackFix]:
        """Return the positions shortly before, from the last at which it stood; none where it still stands or none is known."""
        if first.speed_mps <= STANDING_MPS:
            return []
        before = [fix for fix in self._recent if first.time_s - fix.time_s <= _HEARTBEAT_S]
        standing = [index for index, fix in enumerate(before) if fix.speed_mps <= STANDING_MPS]
        return before[standing[-1] :] if standing else []


def _is_driving(situation: Situation) -> bool:
    return (
        bool(situation.armed)
        and situation.mission is not None
        and drives_mission(situation.mode, situation.vehicle_type, ardupilot=situation.ardupilot)
    )
