"""The note of a drive that pbpp has begun, on disk before it begins, so that a bridge started anew knows it for its own.

One file a vehicle, written whole; it goes with the drive's end, however it ends, where somebody was there to see that.
"""

from __future__ import annotations

import contextlib
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mavlink_bridge.backup.kept_file import (
    UNREADABLE,
    checksum,
    item_from_json,
    item_to_json,
    mark_from_json,
    mark_to_json,
    number_to_json,
    write_whole,
)
from mavlink_bridge.errors import BackupError
from missions.checking.drive_record import DriveRecord
from missions.errors import MissionError
from missions.fence import fence_from_items, fence_to_items
from missions.firmware import read_firmware
from missions.formats.calibration import calibration_from_plain, calibration_to_plain
from missions.geo import LatLon

if TYPE_CHECKING:
    from pathlib import Path

    from mavlink_bridge.backup.vehicle_mark import VehicleMark
    from missions.items import MissionItem

_FORMAT = 1  # of the file; others are not read
_MOST_BYTES = 4_000_000
"""Of a note: 40 times that of a mission of 700 items. Larger ones are not read."""

_NUMBERS = ("clearance_m", "asked_m", "drawn_clearance_m", "driven_clearance_m", "heading_deg")
_PLACES = ("path", "targets", "asked_targets")


@dataclass(frozen=True, slots=True)
class DriveNote:
    """A drive that was begun.

    Parameters
    ----------
    vehicle : VehicleMark
        Which vehicle.
    mission : tuple of MissionItem
        The list as it was read back from it, ArduPilot's with home at 0.
    boot_ms : int
        How long the autopilot had been on, in milliseconds: later less says that it was switched off and on since.
    record : DriveRecord
        What was planned.
    call : str
        What the vehicle was called home by; empty where it was not.
    """

    vehicle: VehicleMark
    mission: tuple[MissionItem, ...]
    boot_ms: int
    record: DriveRecord
    call: str = ""


def note_to_json(note: DriveNote) -> dict[str, Any]:
    """Return a note for JSON, with its checksum."""
    record = note.record
    kept = {name: getattr(record, name) for name in ("method", "vehicle_type")}
    kept |= {name: _number(getattr(record, name)) for name in _NUMBERS}
    kept |= {name: [list(place) for place in getattr(record, name)] for name in _PLACES}
    content = {
        "format": _FORMAT,
        "system": note.vehicle.system,
        "vehicle": mark_to_json(note.vehicle),
        "mission": [item_to_json(item) for item in note.mission],
        "boot_ms": note.boot_ms,
        "call": note.call,
        **kept,
        "items": [item_to_json(item) for item in record.items],
        "home": list(record.home) if record.home is not None else None,
        "fence": [item_to_json(item) for item in fence_to_items(record.fence)],
        "parameters": {name: number_to_json(value) for name, value in record.parameters.items()},
        "firmware": str(record.firmware) if record.firmware is not None else None,
        "calibration": calibration_to_plain(record.calibration),
    }
    if not record.ardupilot:  # notes of ArduPilot's drives have no word of it
        content["ardupilot"] = False
    return {**content, "sha256": checksum(content)}


def note_from_json(content: dict[str, Any]) -> DriveNote:
    """Return a note from JSON.

    Raises
    ------
    ValueError, KeyError, TypeError, AttributeError, OverflowError, MissionError
        It is none, or was changed.
    """
    content = dict(content)
    if not (isinstance(content["vehicle"], dict) and content["path"] and content["targets"]):
        raise ValueError("it names no vehicle, path or target")
    if content.pop("sha256") != checksum(content):
        raise ValueError("its checksum does not match")
    if content["format"] != _FORMAT:
        raise ValueError(f"format {content['format']!r}; expected {_FORMAT}")
    places: dict[str, Any] = {name: tuple(LatLon(*place) for place in content[name]) for name in _PLACES}
    numbers: dict[str, Any] = {
        name: None if content[name] is None else float(content[name]) for name in _NUMBERS
    }
    home, firmware = content["home"], content["firmware"]
    record = DriveRecord(
        items=tuple(map(item_from_json, content["items"])),
        **places,
        **numbers,
        method=str(content["method"]),
        home=LatLon(*home) if home is not None else None,
        fence=fence_from_items(tuple(map(item_from_json, content["fence"]))),
        parameters={name: float(value) for name, value in content["parameters"].items()},
        vehicle_type=content["vehicle_type"],
        firmware=read_firmware(firmware) if firmware is not None else None,
        ardupilot=bool(content.get("ardupilot", True)),
        calibration=calibration_from_plain(content.get("calibration")),
    )
    mark = mark_from_json(int(content["system"]), content["vehicle"])
    mission = tuple(map(item_from_json, content["mission"]))
    return DriveNote(mark, mission, int(content["boot_ms"]), record, str(content.get("call", "")))


class DriveNotes:
    """The notes of drives under way, in the folder of the backups.

    Parameters
    ----------
    folder : Path
        Where.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def keep(self, note: DriveNote) -> None:
        """Write a note in the place of the vehicle's earlier one; it is safe on disk after that.

        Raises
        ------
        BackupError
            It cannot be written.
        """
        write_whole(self._path(note.vehicle), note_to_json(note), "the note of the drive")

    def end(self, vehicle: VehicleMark) -> None:
        """Take a vehicle's note away."""
        with contextlib.suppress(
            OSError
        ):  # what cannot be taken away is judged, as any note, by what the vehicle does
            self._path(vehicle).unlink(missing_ok=True)

    def read(self) -> tuple[tuple[DriveNote, ...], list[BackupError]]:
        """Return the notes there are, and why others cannot be read."""
        notes, troubles = [], []
        for path in sorted(self._folder.glob("drive-under-way-*.json")) if self._folder.is_dir() else ():
            try:
                if not path.is_file() or path.stat().st_size > _MOST_BYTES:
                    raise ValueError(f"it is not a file, or is larger than {_MOST_BYTES} bytes")
                notes.append(note_from_json(json.loads(path.read_text(encoding="utf-8"))))
            except (OSError, IndexError, *UNREADABLE, MissionError) as error:
                troubles.append(
                    BackupError(
                        f"{path}: the note of a drive cannot be read: {error}; that drive is not adopted",
                        path=str(path),
                    )
                )
        return tuple(notes), troubles

    def _path(self, vehicle: VehicleMark) -> Path:
        return self._folder / f"drive-under-way-system-{vehicle.system}-{vehicle.key}.json"


def _number(value: float | None) -> float | str | None:
    return None if value is None else number_to_json(value)
