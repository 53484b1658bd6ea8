"""Files of the state folder: whole or not there, with a checksum; and how vehicles and mission items stand in them."""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import os
import secrets
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from mavlink_bridge.backup.vehicle_mark import VehicleMark
from mavlink_bridge.errors import BackupError
from missions.items import MissionItem

if TYPE_CHECKING:
    from pathlib import Path


UNREADABLE = (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError)
"""What reading a content raises that is not what was written."""


def write_whole(path: Path, content: dict[str, Any], what: str = "the backup") -> None:
    """Write a JSON file so that after a crash there is the whole of it or nothing.

    Raises
    ------
    BackupError
        It cannot be written.
    """
    unfinished = path.with_suffix(f".{secrets.token_hex(8)}.part")  # nobody else's, nor guessed beforehand
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with unfinished.open("x", encoding="utf-8") as file:
            json.dump(content, file, allow_nan=False, indent=1)
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(path)
        _sync_folder(path.parent)
    except OSError as error:
        with contextlib.suppress(OSError):
            unfinished.unlink(missing_ok=True)
        raise BackupError(
            f"{what} cannot be written to {path}: {error.strerror or error}; nothing was written to the vehicle",
            path=str(path),
            advice="free some disk space, or set XDG_STATE_HOME to a writable folder",
        ) from None


def mark_to_json(vehicle: VehicleMark) -> dict[str, Any]:
    """Return a vehicle's mark for JSON."""
    return {"uid": vehicle.uid, "connection": vehicle.connection, "autopilot": vehicle.autopilot}


def mark_from_json(system: int, content: dict[str, Any]) -> VehicleMark:
    """Return a vehicle's mark from JSON."""
    autopilot = content.get("autopilot")
    return VehicleMark(
        system,
        str(content.get("uid", "")),
        str(content.get("connection", "")),
        None if autopilot is None else int(autopilot),
    )


def checksum(content: dict[str, Any]) -> str:
    """Return the checksum of a content without one."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()


def item_to_json(item: MissionItem) -> dict[str, Any]:
    """Return a mission item for JSON."""
    params = [number_to_json(value) for value in item.params]
    return {**asdict(item), "params": params, "alt_m": number_to_json(item.alt_m)}


def item_from_json(item: dict[str, Any]) -> MissionItem:
    """Return a mission item from JSON."""
    param1, param2, param3, param4 = (float(value) for value in item["params"])
    return MissionItem(
        int(item["command"]),
        int(item["frame"]),
        (param1, param2, param3, param4),
        int(item["lat_e7"]),
        int(item["lon_e7"]),
        float(item["alt_m"]),
        bool(item["current"]),
        bool(item["autocontinue"]),
    )


def number_to_json(value: float) -> float | str:
    """Return a number for JSON, which holds no infinite ones."""
    return value if math.isfinite(value) else str(value)


def _sync_folder(folder: Path) -> None:
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
