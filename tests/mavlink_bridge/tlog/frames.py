"""Frames made byte by byte, independent of the reader: pymavlink's checksum, our own headers."""

from __future__ import annotations

import struct
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as dialect

LOGS = sorted((Path(__file__).parents[3] / "sitl_logs").glob("*.tlog"))
START_US = 1_795_314_272_000_000


def frame_v2(message_id, payload, *, system=1, component=1, seed=None, signature=b"", flags=None):
    flags = (1 if signature else 0) if flags is None else flags
    head = bytes([len(payload), flags, 0, 7, system, component]) + message_id.to_bytes(3, "little")
    return b"\xfd" + _sealed(head + payload, message_id, seed) + signature


def frame_v1(message_id, payload, *, system=1, component=1, seed=None):
    return b"\xfe" + _sealed(
        bytes([len(payload), 7, system, component, message_id]) + payload, message_id, seed
    )


def _sealed(body, message_id, seed):
    if seed is None:
        seed = dialect.mavlink_map[message_id].crc_extra
    crc = dialect.x25crc(body + bytes([seed])).crc
    return body + struct.pack("<H", crc)


def record(frame, time_us=START_US):
    return struct.pack(">Q", time_us) + frame


def records(data):
    """Split one of our recordings (MAVLink 2, unsigned) into its records."""
    found, at = [], 0
    while at < len(data):
        end = at + 20 + data[at + 9]
        found.append(data[at:end])
        at = end
    return found


def heartbeat(number=0):
    return frame_v2(0, struct.pack("<IBBBBB", number, 10, 3, 81, 4, 3))
