"""A small writer of DataFlash logs, as ArduPilot lays them out; independent of the reader."""

from __future__ import annotations

import struct

_CODES = {
    "Q": "Q",
    "B": "B",
    "H": "H",
    "I": "I",
    "L": "i",
    "f": "f",
    "N": "16s",
    "Z": "64s",
    "n": "4s",
    "M": "B",
    "c": "h",
    "C": "H",
}
FORMATS = {
    "PARM": (32, "QNff", "TimeUS,Name,Value,Default"),
    "MSG": (33, "QZ", "TimeUS,Message"),
    "MODE": (34, "QMBB", "TimeUS,Mode,ModeNum,Rsn"),
    "ARM": (35, "QBIBB", "TimeUS,ArmState,ArmChecks,Forced,Method"),
    "GPS": (36, "QBBIHBcLLffff", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ"),
    "POS": (37, "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt"),
    "ATT": (38, "QccccCCf", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP"),
    "ORGN": (39, "QBLLf", "TimeUS,Type,Lat,Lng,Alt"),
    "CMD": (40, "QHHHffffLLfB", "TimeUS,CTot,CNum,CId,Prm1,Prm2,Prm3,Prm4,Lat,Lng,Alt,Frame"),
    "MISE": (41, "QHHHffffLLfB", "TimeUS,CTot,CNum,CId,Prm1,Prm2,Prm3,Prm4,Lat,Lng,Alt,Frame"),
    "FNCE": (42, "QBBBLLBf", "TimeUS,Tot,Seq,Type,Lat,Lng,Count,Radius"),
    "RALY": (43, "QBBLLhB".replace("h", "H"), "TimeUS,Tot,Seq,Lat,Lng,Alt,Flags"),
    "IMU": (44, "QBff", "TimeUS,I,GyrX,GyrY"),
    "EV": (45, "QB", "TimeUS,Id"),
}


def declarations() -> bytes:
    own = (128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")
    rows = [
        own,
        *(
            (kind, 3 + _layout(letters).size, name.encode(), letters.encode(), labels.encode())
            for name, (kind, letters, labels) in FORMATS.items()
        ),
    ]
    return b"".join(b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", *row) for row in rows)


def _layout(letters: str) -> struct.Struct:
    return struct.Struct("<" + "".join(_CODES[letter] for letter in letters))


def message(name: str, *values: object) -> bytes:
    kind, letters, _ = FORMATS[name]
    packed = [_packed(letter, value) for letter, value in zip(letters, values, strict=True)]
    return b"\xa3\x95" + bytes([kind]) + _layout(letters).pack(*packed)


def _packed(letter: str, value: object) -> object:
    if isinstance(value, str):
        return value.encode()
    return round(value * 100) if letter in "cC" else value
