"""What the vehicle reports beside what missions are made of: battery, satellites, how well the link works. Clock-free."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from mavlink_bridge.console.view.places import place
from mavlink_bridge.console.view.sections import FootprintView, LinkView, VehicleView
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.modes import mode_name
from missions.request import POINT
from missions.vehicle.item_limit import most_items

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame, Message
    from missions.situation import Situation
    from missions.vehicle import Footprint

LATE_S = 3.0
"""A heartbeat comes every second: without one for so long the link is late."""

_WINDOW_S = 10.0  # over which heartbeats and frames are counted; chosen
_UNKNOWN_MV, _NO_SATELLITES = 65_535, 255
_FIXES = {
    0: "no GPS",
    1: "no fix",
    2: "2D fix",
    3: "3D fix",
    4: "DGPS",
    5: "RTK float",
    6: "RTK fixed",
}


class Instruments:
    """Keeps the newest of what the vehicle reports, and what it writes."""

    def __init__(self) -> None:
        self._battery_percent: int | None = None
        self._battery_v: float | None = None
        self._satellites: int | None = None
        self._beats: deque[float] = deque()
        self._frames: deque[float] = deque()
        self._begun_s: float | None = None
        self._texts: list[m.Statustext] = []
        self.current_seq: int | None = None

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame of the vehicle's autopilot."""
        if self._begun_s is None:
            self._begun_s = now_s
        self._frames.append(now_s)
        _forget(self._frames, now_s)
        message = frame.message
        if isinstance(message, m.Heartbeat):
            self._beats.append(now_s)
            _forget(self._beats, now_s)
        elif isinstance(message, m.Statustext):
            self._texts.append(message)
        elif isinstance(message, m.MissionCurrent):
            self.current_seq = message.seq
        else:
            self._take_figures(message)

    def take_texts(self) -> list[m.Statustext]:
        """Return and forget what the vehicle wrote."""
        texts, self._texts = self._texts, []
        return texts

    def _take_figures(self, message: Message) -> None:
        if isinstance(message, m.GpsRawInt):
            seen = message.satellites_visible
            self._satellites = None if seen == _NO_SATELLITES else seen
        elif isinstance(message, m.SysStatus):
            self._take_battery(message.battery_remaining, message.voltage_battery)
        elif isinstance(message, m.BatteryStatus) and message.id == 0:
            whole_mv = message.whole_mv
            self._take_battery(message.battery_remaining, _UNKNOWN_MV if whole_mv is None else whole_mv)

    def _take_battery(self, percent: int, millivolts: int) -> None:
        """Take a battery's figures; 0 V is no reading, as to ArduPilot, and 0 % beside it neither."""
        has_volts = millivolts not in (0, _UNKNOWN_MV)
        self._battery_v = round(millivolts / 1000, 2) if has_volts else None
        self._battery_percent = percent if percent > 0 or (percent == 0 and has_volts) else None

    def vehicle(self, situation: Situation, footprint: Footprint = POINT) -> VehicleView:
        """Return what is shown of the vehicle."""
        pose, fix = situation.pose, situation.fix
        mode = situation.mode
        has_size = footprint.length_m or footprint.width_m
        return VehicleView(
            system=situation.system,
            autopilot="" if situation.ardupilot is None else "ArduPilot" if situation.ardupilot else "PX4",
            firmware=str(situation.firmware or ""),
            mode=mode,
            mode_text=""
            if mode is None
            else mode_name(mode, situation.vehicle_type, ardupilot=situation.ardupilot),
            armed=situation.armed,
            position=place(pose.value.position) if pose else None,
            position_s=pose.time_s if pose else None,
            heading_deg=pose.value.heading_deg if pose else None,
            speed_mps=round(pose.value.speed_mps, 2) if pose and pose.value.velocity_mps else None,
            fix_kind=fix.value.kind if fix else None,
            fix_text=_FIXES.get(fix.value.kind, "") if fix else "",
            fix_error_m=fix.value.error_m if fix else None,
            satellites=self._satellites,
            battery_percent=self._battery_percent,
            battery_v=self._battery_v,
            footprint=FootprintView(
                length_m=footprint.length_m,
                width_m=footprint.width_m,
                gps_forward_m=footprint.gps_forward_m,
                gps_right_m=footprint.gps_right_m,
            )
            if has_size
            else None,
            most_items=most_items(situation.parameters) if situation.parameters else None,
        )

    def link(self, heard_s: float | None, now_s: float, *, is_lost: bool, trouble: str) -> LinkView:
        """Return what is shown of the link.

        Parameters
        ----------
        heard_s : float or None
            When the newest heartbeat came.
        now_s : float
            The time.
        is_lost : bool
            Whether the director has given the vehicle up for now.
        trouble : str
            Why the link is closed; empty where it is open.
        """
        if trouble:
            return LinkView(state="closed", heard_s=heard_s, trouble=trouble)
        if heard_s is None:
            return LinkView(state="listening")
        age_s = now_s - heard_s
        _forget(self._frames, now_s)
        _forget(self._beats, now_s)
        window_s = min(_WINDOW_S, now_s - (self._begun_s if self._begun_s is not None else now_s))
        missed = None
        if window_s >= _WINDOW_S:
            missed = round(max(0.0, 100.0 * (1 - len(self._beats) / math.floor(window_s))))
        return LinkView(
            state="lost" if is_lost else "late" if age_s > LATE_S else "ok",
            heard_s=heard_s,
            heartbeats_missed_percent=missed,
            rate_hz=round(len(self._frames) / window_s) if window_s >= 1.0 else None,
        )


def _forget(times_s: deque[float], now_s: float) -> None:
    while times_s and times_s[0] < now_s - _WINDOW_S:
        times_s.popleft()
