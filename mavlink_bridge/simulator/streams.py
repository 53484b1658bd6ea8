"""Which telemetry flows how often."""

from __future__ import annotations

from collections.abc import Mapping

# Message ids in MAVLink's common.xml and ardupilotmega.xml.
HEARTBEAT = 0
SYS_STATUS = 1
GPS_RAW_INT = 24
ATTITUDE = 30
GLOBAL_POSITION_INT = 33
MISSION_CURRENT = 42
NAV_CONTROLLER_OUTPUT = 62
VFR_HUD = 74
POSITION_TARGET_GLOBAL_INT = 87
BATTERY_STATUS = 147
AUTOPILOT_VERSION = 148
FENCE_STATUS = 162
SIMSTATE = 164
EKF_STATUS_REPORT = 193
HOME_POSITION = 242
OBSTACLE_DISTANCE = 330

DEFAULT_RATES_HZ: Mapping[int, float] = {
    SYS_STATUS: 2.0,
    GPS_RAW_INT: 2.0,
    GLOBAL_POSITION_INT: 4.0,
    MISSION_CURRENT: 2.0,
    NAV_CONTROLLER_OUTPUT: 2.0,
    VFR_HUD: 2.0,
    POSITION_TARGET_GLOBAL_INT: 2.0,
    BATTERY_STATUS: 1.0,
    FENCE_STATUS: 2.0,
    EKF_STATUS_REPORT: 2.0,
    HOME_POSITION: 0.2,
}
"""What flows unasked."""

SENSOR_RATES_HZ: Mapping[int, float] = {ATTITUDE: 10.0, OBSTACLE_DISTANCE: 10.0}
"""What flows beside that where the rover has a distance sensor."""

MAX_RATE_HZ = 40.0
"""0.8 of the loop's rate; faster is refused."""

_ALL = 0  # MAV_DATA_STREAM_ALL
_GROUPS = {
    2: (
        SYS_STATUS,
        MISSION_CURRENT,
        GPS_RAW_INT,
        NAV_CONTROLLER_OUTPUT,
        FENCE_STATUS,
        POSITION_TARGET_GLOBAL_INT,
    ),
    6: (GLOBAL_POSITION_INT,),
    11: (VFR_HUD,),
    12: (EKF_STATUS_REPORT, SIMSTATE, BATTERY_STATUS),
}
_STREAMED = frozenset(message_id for group in _GROUPS.values() for message_id in group) | {HOME_POSITION}


class Streams:
    """The timetable of periodic messages; HEARTBEAT always flows once a second.

    Parameters
    ----------
    rates_hz : mapping of int to float
        What flows at first, by message id.
    now_s : float
        When it begins.
    """

    def __init__(self, rates_hz: Mapping[int, float], now_s: float) -> None:
        self._intervals_s = {message_id: 1.0 / rate_hz for message_id, rate_hz in rates_hz.items()}
        self._intervals_s[HEARTBEAT] = 1.0
        self._due_s = dict.fromkeys(self._intervals_s, now_s)

    @property
    def deadline_s(self) -> float:
        """When the next message is due."""
        return min(self._due_s.values())

    def due(self, now_s: float) -> list[int]:
        """Return the ids of what is due and put each off by its interval."""
        due = [message_id for message_id, due_s in self._due_s.items() if due_s <= now_s + 1e-9]
        for message_id in due:
            interval_s = self._intervals_s[message_id]
            missed = int((now_s - self._due_s[message_id]) / interval_s)
            self._due_s[message_id] += interval_s * (missed + 1)
        return due

    def request_stream(self, stream: int, rate_hz: float, now_s: float) -> None:
        """Change the rate of a group of messages (REQUEST_DATA_STREAM); a group we do not send is no matter."""
        groups = _GROUPS.values() if stream == _ALL else [_GROUPS.get(stream, ())]
        for group in groups:
            for message_id in group:
                self._set(message_id, 1.0 / min(rate_hz, MAX_RATE_HZ) if rate_hz > 0 else None, now_s)

    def set_interval(self, message_id: int, interval_us: float, now_s: float) -> bool:
        """Change one message's interval (MAV_CMD_SET_MESSAGE_INTERVAL): -1 stops it, 0 restores the default."""
        if message_id not in _STREAMED:
            return False
        if interval_us < 0:
            interval_s = None
        elif interval_us == 0:
            rate_hz = DEFAULT_RATES_HZ.get(message_id)
            interval_s = 1.0 / rate_hz if rate_hz else None
        else:
            interval_s = interval_us / 1e6
        if interval_s is not None and interval_s < 1.0 / MAX_RATE_HZ - 1e-9:
            return False
        self._set(message_id, interval_s, now_s)
        return True

    def _set(self, message_id: int, interval_s: float | None, now_s: float) -> None:
        if interval_s is None:
            self._intervals_s.pop(message_id, None)
            self._due_s.pop(message_id, None)
        else:
            self._intervals_s[message_id] = interval_s
            self._due_s[message_id] = now_s + interval_s
