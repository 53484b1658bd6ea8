"""The vehicle's side of a log, as the bytes that it sent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from mavlink_bridge.logbook.log_situation import vehicle_of
from mavlink_bridge.mavlink.messages import Heartbeat
from mavlink_bridge.tlog import TlogReader

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_PATH_PLANNER: Final = 195
"""MAV_COMP_ID_PATHPLANNER: a bridge like ours, under the vehicle's system id; the one under test would hear itself."""


def vehicle_frames(
    path: Path, system: int | None = None, *, any_vehicle: bool = False
) -> Iterator[tuple[float, bytes]]:
    """Return what a log's vehicle and its companions sent, frame by frame: the log's time, and the bytes as recorded.

    Frames with a wrong checksum are left out; those of ids foreign to us, whose checksum cannot be checked, are not.

    Parameters
    ----------
    path : pathlib.Path
    system : int, optional
        Which vehicle; needed where several were heard.
    any_vehicle : bool
        Accept vehicles other than rovers and boats.

    Raises
    ------
    LogError
        The log is unusable, or holds no such vehicle, or several and none was chosen.
    """
    vehicle = vehicle_of(path, TlogReader(path, {Heartbeat}), system, any_vehicle=any_vehicle)
    return _frames(path, vehicle.system)


def _frames(path: Path, system: int) -> Iterator[tuple[float, bytes]]:
    for block, _ in TlogReader(path, []).blocks():
        scan, which = block.scan, block.which
        systems, components = block.senders(np.arange(len(which)))
        is_sent = (systems == system) & (components != _PATH_PLANNER)
        is_sent &= scan.intact(which) | ~scan.is_known[which]
        for index, time_us in zip(which[is_sent].tolist(), block.time_us[is_sent].tolist(), strict=True):
            yield time_us / 1e6, scan.data[int(scan.at[index]) : int(scan.end[index])]
