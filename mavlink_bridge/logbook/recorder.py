"""What happened to one vehicle, from its log frame by frame."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np

from mavlink_bridge.fold import FOLDED, fold
from mavlink_bridge.logbook.drives import Drives
from mavlink_bridge.logbook.facts import (
    Intrusion,
    ModeSpan,
    Nearest,
    ParameterChange,
    ReportedBreach,
    TargetSeen,
    TrackPart,
    VehicleLog,
)
from mavlink_bridge.logbook.track import FenceMeter, Odometer, TrackFix, pieces
from mavlink_bridge.logbook.transfers import TRANSFER_TYPES, TransferWatch
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.modes import mode_name
from missions.errors import MissionError
from missions.geo import distance_m
from missions.ground.frame import MAX_LATITUDE_DEG, frame_around
from missions.ground.from_situation import ground_for
from missions.vehicle import PARAMETER_NAMES, PX4_PREFIXES, Vehicle, vehicle_from_parameters
from missions.vehicle.parameter_remarks import no_number_remarks

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from mavlink_bridge.mavlink.messages import Frame
    from missions.fence import Fence
    from missions.geo import LatLon
    from missions.ground.frame import LocalFrame
    from missions.situation import Known, Situation

T = TypeVar("T")

RECORDED = FOLDED | TRANSFER_TYPES | {m.MissionCurrent, m.MissionItemReached, m.FenceStatus}
"""The message types that a recorder looks at."""

_BATCH: Final = 4096  # positions measured against the fence at once; chosen, it changes no answer
_MOST_TARGETS, _MOST_INTRUSIONS = 1000, 1000  # the last ones are kept; chosen, bounds memory
_SAME_M, _SAID_AGAIN_S = 0.2, 3.0  # within both a target is the same one repeated; chosen, not measured


class VehicleRecorder:
    """Folds a vehicle's frames and notes what happens; positions are measured in batches, so memory does not grow with the log.

    Parameters
    ----------
    situation : Situation
        What holds from the beginning: the vehicle's ids, what the log reports later but was so before.
    """

    def __init__(self, situation: Situation) -> None:
        assert situation.system is not None
        assert situation.component is not None
        self.situation = situation
        self._mav_type = situation.vehicle_type or 0
        self._transfers = TransferWatch(situation.system, situation.component)
        self._targets: deque[TargetSeen] = deque(maxlen=_MOST_TARGETS)
        self._targets_seen = 0
        self._target_said_s = -math.inf
        self._modes: list[ModeSpan] = []
        self._changes: list[ParameterChange] = []
        self._seen_parameters: set[str] = set()
        self._fences: list[tuple[float, Fence]] = []
        self._breaches: list[ReportedBreach] = []
        self._breach_count: int | None = None
        self._batch: list[TrackFix] = []
        self._before: TrackFix | None = None
        self._positions = self._without_fix = 0
        self._item = 0
        self._frame: LocalFrame | None = None
        self._odometer = Odometer()
        self._nearest: Nearest | None = None
        self._intrusions: deque[Intrusion] = deque(maxlen=_MOST_INTRUSIONS)
        self._is_inside = False
        self._notes: dict[str, None] = {}
        self._drives = Drives()
        self._meter: FenceMeter | None = None
        self._vehicle = Vehicle()
        self._has_meter = False
        if situation.fence is not None:
            self._fences.append((0.0, situation.fence.value))

    def take(self, frame: Frame, now_s: float) -> None:
        """Take a frame of any sender, at a time since the log's begin."""
        before = self.situation
        after = fold(before, frame, now_s)
        if after is not before:
            self._notice(before, after, frame, now_s)
        if isinstance(frame.message, m.ParamValue) and frame.system == before.system:
            self._seen_parameters.add(frame.message.param_id)
        self._transfers.look(frame, now_s)
        if (frame.system, frame.component) == (before.system, before.component):
            self._take_own(frame.message, now_s)

    def finish(self, now_s: float) -> VehicleLog:
        """Return what was noted, at the log's end."""
        self._flush()
        self._drives.end()
        if self._modes:
            self._modes[-1] = replace(self._modes[-1], ended_s=now_s)
        situation = self.situation
        for text in no_number_remarks(situation.no_numbers, situation.parameters):
            self._note(text)
        if self._nearest is None and not self._fences:
            self._note("no clearance: the log contains no fence")
        return VehicleLog(
            system=situation.system or 0,
            component=situation.component or 0,
            mav_type=self._mav_type,
            situation=situation,
            fences=tuple(self._fences),
            transfers=self._transfers.finish(),
            targets=tuple(self._targets),
            targets_seen=self._targets_seen,
            modes=tuple(self._modes),
            parameters={
                name: situation.parameters[name] for name in sorted(situation.parameters) if _matters(name)
            },
            parameters_seen=len(self._seen_parameters),
            parameter_changes=tuple(self._changes),
            driven_m=sum(span.driven_m for span in self._modes if span.armed),
            positions=self._positions,
            positions_without_fix=self._without_fix,
            nearest=self._nearest,
            intrusions=tuple(self._intrusions),
            reported_breaches=tuple(self._breaches),
            track=tuple(
                TrackPart(mode, begun_s, tuple(part))
                for mode, begun_s, part in self._odometer.parts
                if len(part) > 1
            ),
            grades=tuple(self._drives.grades),
            notes=tuple(self._notes),
        )

    # What changes

    def _notice(self, before: Situation, after: Situation, frame: Frame, now_s: float) -> None:
        """Take over a new situation; what was driven under the old one is measured first."""
        mode_changed = (before.mode, before.armed) != (after.mode, after.armed)
        fence_changed = _value(before.fence) != _value(after.fence)
        mission_changed = _value(before.mission) != _value(after.mission)
        is_other_ground = fence_changed or _is_other_ground(before, after)
        if mode_changed or mission_changed or is_other_ground:
            self._flush()
        if mode_changed or mission_changed:
            self._odometer.begin_part()
        if is_other_ground:
            self._has_meter = False
        if mission_changed:
            self._drives.end()
        self.situation = after
        if fence_changed and after.fence is not None:
            self._fences.append((now_s, after.fence.value))
        if after.target is not None and after.target is not before.target:
            self._take_target(after.target.value, after.target.source, frame, now_s)
        if after.parameters is not before.parameters and isinstance(frame.message, m.ParamValue):
            self._take_parameter(before.parameters, frame.message, now_s)
        if mode_changed or not self._modes:
            self._take_mode(now_s)

    def _take_target(self, position: LatLon, source: str, frame: Frame, now_s: float) -> None:
        last = self._targets[-1] if self._targets else None
        is_again = now_s - self._target_said_s < _SAID_AGAIN_S
        self._target_said_s = now_s
        if last is not None and is_again and distance_m(last.position, position) < _SAME_M:
            self._targets[-1] = replace(last, said=last.said + 1)
            return
        self._targets_seen += 1
        self._targets.append(TargetSeen(now_s, position, source, (frame.system, frame.component)))

    def _take_parameter(self, before: Mapping[str, float], message: m.ParamValue, now_s: float) -> None:
        name = message.param_id
        value = self.situation.parameters[name]
        known = before.get(name)
        if _matters(name) and known is not None:
            self._changes.append(ParameterChange(now_s, name, known, value))

    def _take_mode(self, now_s: float) -> None:
        situation = self.situation
        if situation.mode is None:
            return
        if self._modes:
            self._modes[-1] = replace(self._modes[-1], ended_s=now_s)
        self._modes.append(
            ModeSpan(situation.mode, self._mode_name, bool(situation.armed), now_s, now_s, driven_m=0.0)
        )

    @property
    def _mode_name(self) -> str:
        situation = self.situation
        return (
            "unknown"
            if situation.mode is None
            else mode_name(situation.mode, situation.vehicle_type, ardupilot=situation.ardupilot)
        )

    # What the vehicle reports

    def _take_own(self, message: m.Message, now_s: float) -> None:
        if isinstance(message, m.GlobalPositionInt):
            self._take_position(message, now_s)
        elif isinstance(message, m.MissionCurrent):
            self._take_item(message.seq)
        elif isinstance(message, m.MissionItemReached):
            self._flush()
            self._drives.reached(message.seq)
        elif isinstance(message, m.FenceStatus):
            self._take_fence_status(message, now_s)

    def _take_item(self, item: int) -> None:
        if 0 < item < self._item:  # begun anew, or jumped back: another drive
            self._flush()
            self._drives.end()
            self._odometer.begin_part()
        self._item = item

    def _take_fence_status(self, message: m.FenceStatus, now_s: float) -> None:
        known, self._breach_count = self._breach_count, message.breach_count
        if message.breach_count > (known or 0) and (known is not None or message.breach_status):
            self._breaches.append(ReportedBreach(now_s, message.breach_count, message.breach_type))

    def _take_position(self, message: m.GlobalPositionInt, now_s: float) -> None:
        self._positions += 1
        pose = self.situation.pose
        if (message.lat, message.lon) == (0, 0) or pose is None or pose.time_s != now_s:
            self._without_fix += 1
            return
        if abs(pose.value.position.lat_deg) > MAX_LATITUDE_DEG:
            self._note("positions near a pole were skipped")
            return
        speed_mps = math.hypot(message.vx, message.vy) / 100
        fix = TrackFix(
            now_s,
            message.time_boot_ms / 1000,
            pose.value.position,
            speed_mps,
            self._item,
            pose.value.heading_deg,
        )
        if self._frame is None:
            self._frame = frame_around([fix.position])
        self._batch.append(fix)
        if len(self._batch) >= _BATCH:
            self._flush()

    # Measuring

    def _flush(self) -> None:
        """Measure the positions since the last time; all were driven under the situation as it stands."""
        fixes, self._batch = self._batch, []
        if not fixes or self._frame is None:
            return
        self._lay_out()
        frame = self._meter.ground.frame if self._meter else self._frame
        joined = fixes if self._before is None else [self._before, *fixes]
        self._before = fixes[-1]
        driven_m = self._odometer.drive(
            self._mode_name, fixes, self._frame.to_local_array([fix.position for fix in fixes])
        )
        if self._modes:
            self._modes[-1] = replace(self._modes[-1], driven_m=self._modes[-1].driven_m + driven_m)
        points = frame.to_local_array([fix.position for fix in joined])
        track = pieces(joined, points)[len(joined) - len(fixes) :]
        points = points[len(joined) - len(fixes) :]
        clearances_m: NDArray[np.float64] | None = None
        if self._meter is not None:
            clearances_m, depths_m = self._meter.measure(track, points)
            if self.situation.armed:
                self._note_nearest(fixes, track, points, clearances_m)
                self._note_intrusions(fixes, track, points, np.where(clearances_m > 0, -1.0, depths_m))
        if not self.situation.armed:
            self._is_inside = False
        self._drives.drive(self.situation, fixes, clearances_m, self._vehicle, frame, self._meter)

    def _lay_out(self) -> None:
        """Lay the fence out that holds now, unless that is done."""
        if self._has_meter:
            return
        self._has_meter = True
        self._meter = None
        situation = self.situation
        try:
            self._vehicle = vehicle_from_parameters(
                situation.parameters,
                mav_type=situation.vehicle_type,
                firmware=situation.firmware,
                ardupilot=situation.ardupilot,
            )
            if situation.fence is not None and situation.fence.value.zones:
                self._meter = FenceMeter(ground_for(situation, self._with_known_circle(self._vehicle), ()))
        except MissionError as error:
            self._note(f"no clearance: {error}")

    def _with_known_circle(self, vehicle: Vehicle) -> Vehicle:
        """Leave the home circle out where home is not known."""
        if not vehicle.fence.enforces_home_circle or self.situation.home is not None:
            return vehicle
        self._note(
            f"the home circle (FENCE_RADIUS {vehicle.fence.radius_m:g} m) is left out: home is not known"
        )
        return replace(vehicle, fence=replace(vehicle.fence, radius_m=0.0))

    def _note_nearest(
        self,
        fixes: list[TrackFix],
        track: NDArray[np.object_],
        points: NDArray[np.float64],
        clearances_m: NDArray[np.float64],
    ) -> None:
        assert self._meter is not None
        least = int(clearances_m.argmin())
        clearance_m = float(clearances_m[least])
        if clearance_m == math.inf or (self._nearest and self._nearest.clearance_m <= clearance_m):
            return
        zone = self._meter.zone_near(track[least], points[least])
        self._nearest = Nearest(clearance_m, fixes[least].time_s, fixes[least].position, zone)

    def _note_intrusions(
        self,
        fixes: list[TrackFix],
        track: NDArray[np.object_],
        points: NDArray[np.float64],
        depths_m: NDArray[np.float64],
    ) -> None:
        """Note stretches on forbidden ground; a depth of 0 is a line that crossed it from fix to fix, a negative one is outside."""
        assert self._meter is not None
        for fix, piece, point, depth_m in zip(fixes, track, points, depths_m.tolist(), strict=True):
            if depth_m < 0:
                self._is_inside = False
                continue
            if not self._is_inside:
                zone = self._meter.zone_near(piece, point)
                self._intrusions.append(
                    Intrusion(fix.time_s, fix.time_s, depth_m, fix.position, zone, fix.position)
                )
                self._is_inside = True
                continue
            known = self._intrusions[-1]
            deeper = {"deepest_m": depth_m, "position": fix.position} if depth_m > known.deepest_m else {}
            self._intrusions[-1] = replace(known, ended_s=fix.time_s, **deeper)

    def _note(self, text: str) -> None:
        self._notes.setdefault(text)


def _value(known: Known[T] | None) -> T | None:
    return None if known is None else known.value


def _is_other_ground(before: Situation, after: Situation) -> bool:
    """Return whether the same fence means other ground now: home or a parameter changed."""
    if _value(before.home) != _value(after.home):
        return True
    return before.parameters is not after.parameters and any(
        before.parameters.get(name) != after.parameters.get(name) for name in PARAMETER_NAMES
    )


def _matters(name: str) -> bool:
    return name in PARAMETER_NAMES or name.startswith(PX4_PREFIXES)
