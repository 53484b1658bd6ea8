"""ArduPilot's DataFlash logs (``.bin``): what of them says where the vehicle was and what it was told, as the messages of a telemetry log.

A DataFlash log is a row of messages, each with the head A3 95 and a type; FMT messages say how long each type is and which fields it has. What this project
looks at is written as MAVLink frames with timestamps, so that whatever reads a telemetry log reads these too. The formats are those that a log itself declares; what the
fields mean is ArduPilot's (LogStructure.h, AC_Fence/LogStructure.h, AC_PolyFence_loader.h).
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from mavlink_bridge.errors import LogError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.codec import Codec

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from pathlib import Path

    from mavlink_bridge.mavlink.messages import Message

HEAD: Final = b"\xa3\x95"
_FMT: Final = 128  # the type of FMT itself, which begins every log
_FMT_FIELDS = struct.Struct("<BB4s16s64s")
_LEAST_BYTES = 3  # of a message: head and type

_CODES = {
    "a": "64s",
    "b": "b",
    "B": "B",
    "h": "h",
    "H": "H",
    "i": "i",
    "I": "I",
    "f": "f",
    "d": "d",
    "n": "4s",
    "N": "16s",
    "Z": "64s",
    "c": "h",
    "C": "H",
    "e": "i",
    "E": "I",
    "L": "i",
    "M": "B",
    "q": "q",
    "Q": "Q",
}
"""Python's struct codes of the letters in a FMT message's format."""

_HUNDREDTHS = "cCeE"
_TEXTS = "nNZ"
_NUMBERS = "bBhHiIqQfcCeELM"  # no double: it may hold more than a message of telemetry can

_NEEDED: dict[str, tuple[str, ...]] = {
    "PARM": ("Name", "Value"),
    "MODE": (),
    "ARM": ("ArmState",),
    "EV": ("Id",),
    "MSG": ("Message",),
    "GPS": ("Status", "Lat", "Lng"),
    "POS": ("Lat", "Lng"),
    "ATT": ("Yaw",),
    "ORGN": ("Lat", "Lng"),
    "CMD": ("CTot", "CNum", "CId", "Prm1", "Prm2", "Prm3", "Prm4", "Lat", "Lng"),
    "MISE": ("CNum",),
    "FNCE": ("Tot", "Seq", "Type", "Lat", "Lng", "Count", "Radius"),
    "RALY": ("Tot", "Seq", "Lat", "Lng"),
}
"""Without which fields a message says nothing; its time is needed too."""

_LETTERS: dict[str, str] = {
    "TimeUS": "Q",
    "GMS": "I",
    **dict.fromkeys(("CTot", "CNum", "CId", "Tot", "Seq", "GWk"), "BH"),
    **dict.fromkeys(("ArmState", "Id", "Status", "I", "Type", "Count", "Frame", "Mode", "ModeNum"), "BM"),
    **dict.fromkeys(
        ("Value", "Yaw", "Spd", "GCrs", "Alt", "Radius", "Prm1", "Prm2", "Prm3", "Prm4"), _NUMBERS
    ),
    **dict.fromkeys(("Lat", "Lng"), "L"),
    **dict.fromkeys(("Name", "Message", "FWS"), _TEXTS),
}
"""As what a field is understood. A log declares its own formats, and a message that is laid out otherwise is passed over, whoever wrote it or whatever damaged
it. So are the missions of ArduPilot 3.6: their places are 32-bit degrees, up to 0.8 m off."""

_GPS_EPOCH_S, _WEEK_S = 315_964_800, 604_800  # 6 January 1980 in seconds since 1970, and a week
_LEAP_S = 18  # between GPS time and UTC, since 2017
_FIX_3D = 3  # GPS_FIX_TYPE_3D_FIX
_BEAT_US = 1_000_000  # a vehicle sends a HEARTBEAT a second
_MOST_US = 1 << 52  # 142 years after the boot: a damaged time
_MOST_BYTES = 1 << 29
"""Of telemetry that a log may become, which is held in memory (chosen): days of driving, and what unpacks to more is no log of a drive."""

_STATION = (255, 190)  # who a list is told to: some ground station's
_ARMED, _DISARMED = 10, 11  # EV.Id
_TYPES = {"ArduRover": 10, "ArduCopter": 2, "ArduPlane": 1, "ArduSub": 12, "Blimp": 7, "AntennaTracker": 5}
_BOAT, _BOAT_CLASS = 11, 2.0  # MAV_TYPE_SURFACE_BOAT; FRAME_CLASS of a boat
_REACHED = re.compile(r"Reached waypoint #(\d+)")
_SYSTEM_NAMES = ("SYSID_THISMAV", "MAV_SYSID")  # before ArduPilot 4.7, and since

_FENCE_COMMANDS = {98: 5001, 97: 5002, 96: 5004, 95: 5000, 94: 5003, 93: 5004, 92: 5003}
"""MAV_CMD_NAV_FENCE_* of AC_PolyFenceType: polygons, the return point, and circles, those of whole metres (96, 94) and of older firmware included."""

_CIRCLES = (5003, 5004)  # MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION and _EXCLUSION


@dataclass(frozen=True, slots=True)
class _Format:
    """How messages of one type are laid out."""

    name: str
    size: int
    fields: struct.Struct
    letters: str
    labels: tuple[str, ...]
    is_understood: bool
    """Whether it has the fields that are looked at, each as what it is understood."""

    def read(self, data: bytes, at: int) -> dict[str, Any]:
        """Return the fields of a message by name."""
        values = self.fields.unpack_from(data, at + _LEAST_BYTES)
        return {
            label: _value(letter, value)
            for label, letter, value in zip(self.labels, self.letters, values, strict=True)
        }


def _value(letter: str, value: Any) -> Any:  # noqa: ANN401 - as FMT says
    if letter in _TEXTS:
        return value.split(b"\0", 1)[0].decode("ascii", "replace")
    return value / 100 if letter in _HUNDREDTHS else value


def messages_of(pieces: Iterable[bytes], wanted: frozenset[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the wanted messages of a DataFlash log, by name; bytes that belong to none are skipped, and messages that are laid out as nobody expects.

    Parameters
    ----------
    pieces : iterable of bytes
        The log, in pieces of any size, of which one at a time is held.
    wanted : frozenset of str
        Names of messages.
    """
    formats: dict[int, _Format] = {}
    data, at = b"", 0
    for piece in pieces:
        data, at = data[at:] + piece, 0
        while at + _LEAST_BYTES <= len(data):
            kind = data[at + 2]
            known = formats.get(kind)
            if data[at : at + 2] != HEAD or (known is None and kind != _FMT):
                following = data.find(HEAD, at + 1)
                at = following if following >= 0 else len(data) - 1  # whose last byte may begin a head
                continue
            size = _LEAST_BYTES + _FMT_FIELDS.size if known is None or kind == _FMT else known.size
            if at + size > len(data):
                break
            if kind == _FMT:
                declared = _declared(data, at)
                if declared is not None:
                    formats[declared[0]] = declared[1]
            elif known is not None and known.name in wanted and known.is_understood:
                yield known.name, known.read(data, at)
            at += size


def _declared(data: bytes, at: int) -> tuple[int, _Format] | None:
    """Return the type and format that a FMT message declares; None where it makes no sense."""
    kind, size, *texts = _FMT_FIELDS.unpack_from(data, at + _LEAST_BYTES)
    name, letters, labels = (text.split(b"\0", 1)[0].decode("ascii", "replace") for text in texts)
    if any(letter not in _CODES for letter in letters):
        return None
    fields = struct.Struct("<" + "".join(_CODES[letter] for letter in letters))
    names = tuple(labels.split(",")) if labels else ()
    if fields.size + _LEAST_BYTES != size or len(names) != len(letters):
        return None
    is_understood = {"TimeUS", *_NEEDED[name]} <= set(names) if name in _NEEDED else True
    is_understood &= all(
        letter in _LETTERS.get(label, letter) for label, letter in zip(names, letters, strict=True)
    )
    return kind, _Format(name, size, fields, letters, names, is_understood)


def as_telemetry(pieces: Callable[[], Iterable[bytes]], path: Path) -> bytes:
    """Return a DataFlash log as the bytes of a telemetry log.

    Parameters
    ----------
    pieces : callable
        Returns the log, piece by piece from its begin; it is gone through twice.
    path : Path
        For errors.

    Raises
    ------
    LogError
        It does not say which vehicle it is of, holds nothing that is looked at, or too much.
    """
    about = _About(pieces())
    if about.vehicle_type is None:
        raise LogError(
            f"{path}: a DataFlash log that does not say whose it is: no MSG or VER names ArduRover",
            path=str(path),
            advice="use the telemetry log (.tlog) that the ground station recorded",
        )
    records, size = [], 0
    for record in _Translator(about).translated(pieces()):
        records.append(record)
        size += len(record)
        if size > _MOST_BYTES:
            raise LogError(
                f"{path}: a DataFlash log with more than {_MOST_BYTES >> 20} MB of positions, modes and lists",
                path=str(path),
                advice="use the telemetry log (.tlog) that the ground station recorded",
            )
    return b"".join(records)


class _About:
    """What has to be known of a log before it is translated: whose it is, and when it begins."""

    def __init__(self, pieces: Iterable[bytes]) -> None:
        self.vehicle_type: int | None = None
        self.system = 1
        self.begins_us = 0
        is_boat = False
        for name, fields in messages_of(pieces, frozenset({"MSG", "VER", "PARM", "GPS"})):
            if name == "PARM":
                is_boat |= fields["Name"] == "FRAME_CLASS" and fields["Value"] == _BOAT_CLASS
                if fields["Name"] in _SYSTEM_NAMES and 1 <= fields["Value"] <= 255:
                    self.system = int(fields["Value"])
            elif name == "GPS":
                self._take_time(fields)
            elif self.vehicle_type is None:
                text = str(fields.get("Message", fields.get("FWS", "")))
                self.vehicle_type = next(
                    (number for word, number in _TYPES.items() if text.startswith(word)), None
                )
        if is_boat and self.vehicle_type == _TYPES["ArduRover"]:
            self.vehicle_type = _BOAT

    def _take_time(self, gps: dict[str, Any]) -> None:
        """Take when the vehicle booted, from the first GPS message with a fix and a date."""
        week = gps.get("GWk", 0)
        if not self.begins_us and week and gps["Status"] >= _FIX_3D:
            gps_s = _GPS_EPOCH_S + week * _WEEK_S + gps.get("GMS", 0) / 1000 - _LEAP_S
            self.begins_us = max(0, round(gps_s * 1e6) - gps["TimeUS"])


class _Translator:
    """Writes what a DataFlash log tells as MAVLink messages, in its order."""

    def __init__(self, about: _About) -> None:
        self._about = about
        self._codec = Codec(about.system, 1)
        self._records: list[bytes] = []
        self._now_us = 0
        self._beaten_us: int | None = None
        self._mode = 0
        self._armed = False
        self._velocity_mps = (0.0, 0.0)
        self._yaw_deg: float | None = None
        self._has_pos = False
        self._lists: dict[str, list[dict[str, Any]]] = {}
        self._takers: dict[str, Callable[[dict[str, Any]], None]] = {
            "PARM": self._parameter,
            "MODE": self._take_mode,
            "ARM": self._take_arm,
            "EV": self._take_event,
            "MSG": self._text,
            "GPS": self._gps,
            "POS": self._position,
            "ATT": self._attitude,
            "ORGN": self._origin,
            "CMD": self._command,
            "MISE": self._executed,
            "FNCE": self._fence,
            "RALY": self._rally,
        }

    def translated(self, pieces: Iterable[bytes]) -> Iterator[bytes]:
        """Yield the records of a telemetry log."""
        for name, fields in messages_of(pieces, frozenset(self._takers)):
            if fields["TimeUS"] > _MOST_US:
                continue
            self._now_us = fields["TimeUS"]
            if self._beaten_us is None or not 0 <= self._now_us - self._beaten_us < _BEAT_US:
                self._beat()
            self._takers[name](fields)
            yield from self._records
            self._records.clear()

    def _tell(self, message: Message) -> None:
        time_us = (self._about.begins_us + self._now_us) & ~3  # whose low bits are a link's number
        self._records.append(struct.pack(">Q", time_us) + self._codec.encode(message))

    def _beat(self) -> None:
        self._beaten_us = self._now_us
        base = m.ModeFlag.CUSTOM_MODE_ENABLED | (m.ModeFlag.SAFETY_ARMED if self._armed else 0)
        self._tell(
            m.Heartbeat(self._about.vehicle_type or 0, m.Autopilot.ARDUPILOTMEGA, int(base), self._mode, 4)
        )

    def _parameter(self, fields: dict[str, Any]) -> None:
        self._tell(m.ParamValue(fields["Name"], fields["Value"], 9, 0, 65535))

    def _take_mode(self, fields: dict[str, Any]) -> None:
        self._mode = int(fields.get("ModeNum", fields.get("Mode", self._mode)))
        self._beat()

    def _take_arm(self, fields: dict[str, Any]) -> None:
        self._armed = bool(fields["ArmState"])
        self._beat()

    def _take_event(self, fields: dict[str, Any]) -> None:
        if fields["Id"] in (_ARMED, _DISARMED):
            self._armed = fields["Id"] == _ARMED
            self._beat()

    def _text(self, fields: dict[str, Any]) -> None:
        text = fields["Message"]
        self._tell(m.Statustext(6, text[:50]))
        if found := _REACHED.match(text):
            self._tell(m.MissionItemReached(int(found[1]) & 0xFFFF))

    def _gps(self, fields: dict[str, Any]) -> None:
        if fields.get("I", 0):  # the second receiver
            return
        status, course_rad = fields["Status"], math.radians(fields.get("GCrs", 0.0))
        speed_mps = fields.get("Spd", 0.0)
        if math.isfinite(speed_mps) and math.isfinite(course_rad):
            self._velocity_mps = (speed_mps * math.cos(course_rad), speed_mps * math.sin(course_rad))
        lat, lon = (fields["Lat"], fields["Lng"]) if status >= _FIX_3D else (0, 0)
        self._tell(m.GpsRawInt(self._now_us, status, fields["Lat"], fields["Lng"], 0))
        if not self._has_pos:
            self._place(lat, lon)

    def _position(self, fields: dict[str, Any]) -> None:
        self._has_pos = True  # the estimate, which is what the autopilot drives by
        self._place(fields["Lat"], fields["Lng"])

    def _place(self, lat: int, lon: int) -> None:
        north, east = (max(-32768, min(32767, round(speed * 100))) for speed in self._velocity_mps)
        heading = 65535 if self._yaw_deg is None else round(self._yaw_deg % 360.0 * 100) % 36000
        boot_ms = self._now_us // 1000 & 0xFFFFFFFF
        self._tell(m.GlobalPositionInt(boot_ms, lat, lon, 0, 0, north, east, 0, heading))

    def _attitude(self, fields: dict[str, Any]) -> None:
        if math.isfinite(fields["Yaw"]):
            self._yaw_deg = float(fields["Yaw"])

    def _origin(self, fields: dict[str, Any]) -> None:
        if fields.get("Type") == 1:  # home; 0 is the estimator's origin
            self._tell(m.HomePosition(fields["Lat"], fields["Lng"]))

    def _executed(self, fields: dict[str, Any]) -> None:
        self._tell(m.MissionCurrent(int(fields["CNum"])))

    def _command(self, fields: dict[str, Any]) -> None:
        """Take an item of the mission, written all at once; by itself it is the one that is begun (before MISE)."""
        if fields["CNum"] and fields["CNum"] != len(self._lists.get("CMD", ())):
            self._executed(fields)
            return
        self._collect("CMD", fields, "CTot", "CNum", m.MissionType.MISSION, self._mission_item)

    def _fence(self, fields: dict[str, Any]) -> None:
        self._collect("FNCE", fields, "Tot", "Seq", m.MissionType.FENCE, self._fence_item)

    def _rally(self, fields: dict[str, Any]) -> None:
        self._collect("RALY", fields, "Tot", "Seq", m.MissionType.RALLY, self._rally_item)

    def _collect(
        self,
        name: str,
        fields: dict[str, Any],
        total: str,
        seq: str,
        kind: m.MissionType,
        item: Callable[[dict[str, Any]], m.MissionItemInt],
    ) -> None:
        """Take an item of a list; a whole one is told as if it were read from the vehicle."""
        if fields[seq] == 0:
            self._lists[name] = []
        rows = self._lists.get(name, [])
        if fields[seq] != len(rows):
            self._lists.pop(name, None)  # one is missing
            return
        rows.append(fields)
        if len(rows) == fields[total]:
            self._tell(m.MissionCount(*_STATION, len(rows), int(kind)))
            for row in rows:
                self._tell(item(row))
            del self._lists[name]

    def _mission_item(self, fields: dict[str, Any]) -> m.MissionItemInt:
        numbers = (fields["Prm1"], fields["Prm2"], fields["Prm3"], fields["Prm4"])
        frame = int(fields.get("Frame", 0))
        return _item(fields, fields["CNum"], (frame, fields["CId"]), numbers, m.MissionType.MISSION)

    def _fence_item(self, fields: dict[str, Any]) -> m.MissionItemInt:
        command = _FENCE_COMMANDS.get(fields["Type"], 0)
        first = float(fields["Radius"] if command in _CIRCLES else fields["Count"])
        return _item(fields, fields["Seq"], (0, command), (first, 0.0, 0.0, 0.0), m.MissionType.FENCE)

    def _rally_item(self, fields: dict[str, Any]) -> m.MissionItemInt:
        return _item(fields, fields["Seq"], _RALLY, (0.0, 0.0, 0.0, 0.0), m.MissionType.RALLY)


_RALLY = (3, 5100)  # MAV_FRAME_GLOBAL_RELATIVE_ALT, MAV_CMD_NAV_RALLY_POINT


def _item(
    fields: dict[str, Any],
    seq: int,
    kind: tuple[int, int],
    numbers: tuple[float, float, float, float],
    list_of: m.MissionType,
) -> m.MissionItemInt:
    """Return an item as it is read from a vehicle: its frame and command, and where it is."""
    frame, command = kind
    first, second, third, fourth = numbers
    return m.MissionItemInt(
        target_system=_STATION[0],
        target_component=_STATION[1],
        seq=seq,
        frame=frame,
        command=command,
        current=0,
        autocontinue=1,
        param1=first,
        param2=second,
        param3=third,
        param4=fourth,
        x=fields["Lat"],
        y=fields["Lng"],
        z=float(fields.get("Alt", 0.0)),
        mission_type=int(list_of),
    )
