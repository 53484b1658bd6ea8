"""What happened to one vehicle, from its log frame by frame."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final, TypeVar

from mavlink_bridge.fold import FOLDED, fold
from mavlink_bridge.logbook.drives import Drives
from mavlink_bridge.logbook.facts import (
    ModeSpan,
    ParameterChange,
    ParameterLog,
    TargetSeen,
    TrackPart,
    VehicleLog,
)
from mavlink_bridge.logbook.fence_record import FenceRecord
from mavlink_bridge.logbook.track import Odometer, TrackFix, pieces
from mavlink_bridge.logbook.transfers import TRANSFER_TYPES, TransferWatch
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import autopilot_of
from mavlink_bridge.mavlink.modes import mode_name
from missions.geo import LatLon, distance_m
from missions.ground.frame import MAX_LATITUDE_DEG, frame_around
from missions.items import Command
from missions.vehicle import PARAMETER_NAMES, PX4_PREFIXES
from missions.vehicle.parameter_remarks import no_number_remarks, range_remarks
from missions.vehicle.parameters import PX4_NAMES

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from mavlink_bridge.mavlink.messages import Frame
    from missions.fence import Fence
    from missions.ground.frame import LocalFrame
    from missions.situation import Known, Situation

T = TypeVar("T")
TrackTaker = Callable[[int, str, bool, Sequence["TrackFix"], "NDArray[np.float64] | None"], None]
"""Takes positions batch by batch: of which system, in which mode, whether armed, and what the track to each keeps to the fence."""

RECORDED = (
    FOLDED
    | TRANSFER_TYPES
    | {m.MissionCurrent, m.MissionItemReached, m.FenceStatus, m.CommandInt, m.CommandLong, m.CommandAck}
)
"""The message types that a recorder looks at."""

_BATCH: Final = 4096  # positions measured against the fence at once; chosen, it changes no answer
_MOST_TARGETS = 1000  # the last ones are kept; chosen, bounds memory
_NOWHERE = LatLon(math.nan, math.nan)
_SAME_M, _SAID_AGAIN_S = 0.2, 3.0  # within both a target is the same one repeated; chosen, not measured


class VehicleRecorder:
    """Folds a vehicle's frames and notes what happens; positions are measured in batches, so memory does not grow with the log.

    Parameters
    ----------
    situation : Situation
        What holds from the beginning: the vehicle's ids, what the log reports later but was so before.
    on_track : callable, optional
        Takes the positions batch by batch; those without a fix have no number as their place, and come before earlier ones that have one.
    """

    # Many attributes: one for each kind of thing that is noted, and what of it is under way.

    def __init__(self, situation: Situation, on_track: TrackTaker | None = None) -> None:
        self._on_track = on_track
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
        self._batch: list[TrackFix] = []
        self._before: TrackFix | None = None
        self._positions = self._without_fix = 0
        self._item = 0
        self._asked_mps: float | None = None
        self._frame: LocalFrame | None = None
        self._odometer = Odometer()
        self._notes: dict[str, None] = {}
        self._drives = Drives()
        self._fence = FenceRecord(self._note)
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
        if isinstance(frame.message, m.CommandInt | m.CommandLong):
            self._take_command(frame.message)
        if (frame.system, frame.component) == (before.system, before.component):
            self._take_own(frame.message, now_s)

    def finish(self, now_s: float) -> VehicleLog:
        """Return what was noted, at the log's end."""
        self._flush()
        self._drives.end()
        if self._modes:
            self._modes[-1] = replace(self._modes[-1], ended_s=now_s)
        situation = self.situation
        for text in (
            *no_number_remarks(situation.no_numbers, situation.parameters),
            *range_remarks(situation.parameters, ardupilot=situation.ardupilot),
        ):
            self._note(text)
        if self._fence.nearest is None and not self._fences:
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
            parameters=ParameterLog(
                {name: situation.parameters[name] for name in sorted(situation.parameters) if _matters(name)},
                len(self._seen_parameters),
                tuple(self._changes),
            ),
            driven_m=sum(span.driven_m for span in self._modes if span.armed),
            positions=self._positions,
            positions_without_fix=self._without_fix,
            nearest=self._fence.nearest,
            intrusions=tuple(self._fence.intrusions),
            reported_breaches=tuple(self._fence.breaches),
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
            self._fence.is_laid_out = False
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
        elif isinstance(message, m.CommandAck):
            self._take_answer(message)
        elif isinstance(message, m.FenceStatus):
            self._fence.take_status(message, now_s)
        elif isinstance(message, m.Statustext):
            rules = autopilot_of(ardupilot=self.situation.ardupilot).incidents
            self._fence.take_text(message.text, rules, now_s)

    def _take_command(self, message: m.CommandInt | m.CommandLong) -> None:
        is_ours = message.target_system in (0, self.situation.system)
        if is_ours and message.command == Command.DO_CHANGE_SPEED:
            self._asked_mps = message.param2

    def _take_answer(self, message: m.CommandAck) -> None:
        """Take over a speed that the vehicle accepts; one below 0 changes nothing."""
        if message.command != Command.DO_CHANGE_SPEED:
            return
        asked_mps, self._asked_mps = self._asked_mps, None
        if asked_mps is not None and asked_mps > 0 and message.result == m.MavResult.ACCEPTED:
            self._flush()
            self._drives.change_speed(self.situation, asked_mps)

    def _take_item(self, item: int) -> None:
        if 0 < item < self._item:  # begun anew, or jumped back: another drive
            self._flush()
            self._drives.end()
            self._odometer.begin_part()
        self._item = item

    def _take_position(self, message: m.GlobalPositionInt, now_s: float) -> None:
        self._positions += 1
        pose = self.situation.pose
        if (message.lat, message.lon) == (0, 0) or pose is None or pose.time_s != now_s:
            self._without_fix += 1
            lost = TrackFix(now_s, message.time_boot_ms / 1000, _NOWHERE, math.nan, self._item, None)
            self._hand_on([lost], None)
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
        fence = self._fence
        fence.lay_out(self.situation)
        frame = fence.meter.ground.frame if fence.meter else self._frame
        joined = fixes if self._before is None else [self._before, *fixes]
        self._before = fixes[-1]
        points = frame.to_local_array([fix.position for fix in joined])
        track = pieces(joined, points)[len(joined) - len(fixes) :]
        points = points[len(joined) - len(fixes) :]
        own = points if frame is self._frame else self._frame.to_local_array([fix.position for fix in fixes])
        driven_m = self._odometer.drive(self._mode_name, fixes, own)
        if self._modes:
            self._modes[-1] = replace(self._modes[-1], driven_m=self._modes[-1].driven_m + driven_m)
        clearances_m = fence.measure(fixes, track, points, is_armed=bool(self.situation.armed))
        self._drives.drive(self.situation, fixes, points, clearances_m, fence.vehicle, frame, fence.meter)
        self._hand_on(fixes, clearances_m)

    def _hand_on(self, fixes: Sequence[TrackFix], clearances_m: NDArray[np.float64] | None) -> None:
        situation = self.situation
        if self._on_track is not None:
            self._on_track(situation.system or 0, self._mode_name, bool(situation.armed), fixes, clearances_m)

    def _note(self, text: str) -> None:
        self._notes.setdefault(text)


def _value(known: Known[T] | None) -> T | None:
    return None if known is None else known.value


def _is_other_ground(before: Situation, after: Situation) -> bool:
    """Return whether the same fence means other ground now: home or a parameter changed."""
    if _value(before.home) != _value(after.home):
        return True
    return before.parameters is not after.parameters and any(
        before.parameters.get(name) != after.parameters.get(name) for name in _FIELD_NAMES
    )


_FIELD_NAMES = (*PARAMETER_NAMES, *PX4_NAMES)


def _matters(name: str) -> bool:
    return name in PARAMETER_NAMES or name.startswith(PX4_PREFIXES)
