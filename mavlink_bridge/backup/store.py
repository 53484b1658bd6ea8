"""What was on a vehicle before it was overwritten, kept in a state folder; and a note of every upload under way.

A backup is one JSON file with the time, the vehicle, the list and its checksum. The note beside it marks that an upload has begun; it
is taken away when the outcome is known. A note found later means that our own process died half-way: nothing is restored
unasked, but the next run on that vehicle says so. Both know their vehicle by its `VehicleMark`: nearly every rover is system 1.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.backup.kept_file import (
    UNREADABLE,
    checksum,
    item_from_json,
    item_to_json,
    mark_from_json,
    mark_to_json,
    write_whole,
)
from mavlink_bridge.backup.vehicle_mark import Kinship, VehicleMark
from mavlink_bridge.errors import BackupError
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.user_folders import state_folder

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from missions.items import MissionItem

_FORMAT = 2  # of the file; since 2 it holds the mark of its vehicle
_KEPT_BACKUPS = 100  # of each list; chosen, not measured: bounds the folder
_BACKUP_NAME = re.compile(r"system-(\d+)-(mission|fence|rally)-\d{8}T\d{6}\.\d{6}Z(-[0-9a-f]{12})?\.json")
_NOTE_NAME = re.compile(r"upload-under-way-system-(\d+)-(mission|fence|rally)(-[0-9a-f]{12})?\.json")
"""Before format 2 the names ended without the vehicle's key."""


@dataclass(frozen=True, slots=True)
class Backup:
    """A list as it was on a vehicle.

    Parameters
    ----------
    path : Path
        The file.
    time : datetime
        When it was read from the vehicle, UTC.
    vehicle : VehicleMark
        Which vehicle; of backups before format 2 only the system id is known.
    mission_type : MissionType
        Which list.
    items : tuple of MissionItem
        The list as it goes over the wire, for missions with home at 0.
    """

    path: Path
    time: datetime
    vehicle: VehicleMark
    mission_type: MissionType
    items: tuple[MissionItem, ...]


@dataclass(frozen=True, slots=True)
class Note:
    """The note of an upload that never came to its outcome.

    Parameters
    ----------
    path : Path
        The file.
    vehicle : VehicleMark
        Which vehicle it was, as far as the note has it.
    mission_type : MissionType
        Which list.
    backup : Backup, optional
        What was on the vehicle before; None if it cannot be read.
    trouble : BackupError, optional
        Why it, or the note itself, cannot be read.
    """

    path: Path
    vehicle: VehicleMark
    mission_type: MissionType
    backup: Backup | None = None
    trouble: BackupError | None = None


class BackupStore:
    """The state folder.

    Parameters
    ----------
    folder : Path, optional
        Where; the user's state folder if not given.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder or state_folder() / "backups"

    def keep(self, vehicle: VehicleMark, mission_type: MissionType, items: Sequence[MissionItem]) -> Path:
        """Write a backup; return its path once it is safe on disk.

        Raises
        ------
        BackupError
            It cannot be written; nothing should be uploaded then.
        """
        now = datetime.now(UTC)
        while (path := self._backup(vehicle, mission_type, now)).exists():  # clocks may be coarse
            now += timedelta(microseconds=1)
        content = {
            "format": _FORMAT,
            "time": now.isoformat(),
            "system": vehicle.system,
            "vehicle": mark_to_json(vehicle),
            "mission_type": mission_type.name.lower(),
            "items": [item_to_json(item) for item in items],
        }
        content["sha256"] = checksum(content)
        write_whole(path, content)
        self._prune(vehicle.system, mission_type)
        return path

    def begin(self, vehicle: VehicleMark, mission_type: MissionType, items: Sequence[MissionItem]) -> Path:
        """Keep a backup and note that an upload begins; return the path of the backup that is to be restored if it fails.

        If an earlier upload to this vehicle was interrupted, what is on it now is its remains: the note goes on naming the older backup.

        Raises
        ------
        BackupError
            It cannot be written; nothing should be uploaded then.
        """
        path = self.keep(vehicle, mission_type, items)
        for earlier in self.interrupted(vehicle, mission_type):
            if earlier.backup and vehicle.kinship(earlier.vehicle) is Kinship.SAME:
                path = earlier.backup.path
                break
        note = {
            "time": datetime.now(UTC).isoformat(),
            "backup": path.name,
            "process": os.getpid(),
            "vehicle": mark_to_json(vehicle),
        }
        write_whole(self._note(vehicle, mission_type), note)
        return path

    def end(self, vehicle: VehicleMark, mission_type: MissionType, restored: Path | None = None) -> None:
        """Take this vehicle's notes away: the outcome of the upload is known.

        Parameters
        ----------
        vehicle : VehicleMark
            Which vehicle.
        mission_type : MissionType
            Which list.
        restored : Path, optional
            The backup that was put back: a note that names it is settled too, unless it is known to be of another vehicle.
        """
        for note in self.interrupted(vehicle, mission_type):
            is_named = (
                restored is not None and note.backup is not None and note.backup.path.name == restored.name
            )
            if is_named or vehicle.kinship(note.vehicle) is Kinship.SAME:
                with contextlib.suppress(OSError):  # it stays, and is reported: the upload itself ended well
                    note.path.unlink(missing_ok=True)

    def interrupted(self, vehicle: VehicleMark, mission_type: MissionType | None = None) -> list[Note]:
        """Return the notes of uploads to a vehicle that never came to their outcome, and of those that may have been to it."""
        return [
            note
            for note in self.notes()
            if mission_type in (None, note.mission_type)
            and vehicle.kinship(note.vehicle) is not Kinship.OTHER
        ]

    def notes(self) -> list[Note]:
        """Return the notes of all uploads that never came to their outcome."""
        if not self.folder.is_dir():
            return []
        named = (
            (path, _NOTE_NAME.fullmatch(path.name))
            for path in sorted(self.folder.glob("upload-under-way-*.json"))
        )
        return [self._read_note(path, name) for path, name in named if name]

    def forget(self, notes: Iterable[Note]) -> list[Path]:
        """Put notes aside, under another name in the same folder; return their new paths.

        Raises
        ------
        BackupError
            The folder cannot be written.
        """
        put_aside = []
        for note in notes:
            path = note.path.with_name(f"put-aside-{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}-{note.path.name}")
            try:
                note.path.replace(path)
            except OSError as error:
                raise BackupError(f"{note.path} cannot be dismissed: {error.strerror or error}") from None
            put_aside.append(path)
        return put_aside

    def newest(self, system: int, mission_type: MissionType) -> Backup | None:
        """Return the newest backup of a list of the vehicles with a system id; None if there is none.

        Raises
        ------
        BackupError
            It cannot be read.
        """
        paths = self._paths(system, mission_type)
        return read_backup(paths[-1]) if paths else None

    def kept(self, system: int, most: int = 50) -> list[Backup]:
        """Return the newest backups of the vehicles with a system id, newest first; what cannot be read is left out."""
        paths = [path for kind in MissionType for path in self._paths(system, kind)]
        found: list[Backup] = []
        for path in sorted(paths, key=lambda one: one.name.split("-")[3], reverse=True)[:most]:
            with contextlib.suppress(BackupError):
                found.append(read_backup(path))
        return found

    def named(self, name: str) -> Backup:
        """Return the backup of a name in this folder.

        Raises
        ------
        BackupError
            There is none, or it cannot be read.
        """
        if not _BACKUP_NAME.fullmatch(name):
            raise BackupError(f"{name!r} is not the name of a backup")
        return read_backup(self.folder / name)

    def _prune(self, system: int, mission_type: MissionType) -> None:
        """Take the oldest backups away, but none that is still to be restored."""
        named = {note.backup.path for note in self.notes() if note.backup}
        for old in self._paths(system, mission_type)[:-_KEPT_BACKUPS]:
            if old not in named:
                with contextlib.suppress(OSError):
                    old.unlink(missing_ok=True)

    def _read_note(self, path: Path, name: re.Match[str]) -> Note:
        vehicle, mission_type = VehicleMark(int(name[1])), MissionType[name[2].upper()]
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            backup = self.folder / Path(content["backup"]).name  # it cannot lead out of the folder
            if "vehicle" in content:
                vehicle = mark_from_json(int(name[1]), content["vehicle"])
        except (OSError, *UNREADABLE) as error:
            trouble = BackupError(f"{path}: the note of an interrupted upload cannot be read: {error}")
            return Note(path, vehicle, mission_type, trouble=trouble)
        try:
            return Note(path, vehicle, mission_type, read_backup(backup))
        except BackupError as error:
            return Note(path, vehicle, mission_type, trouble=error)

    def _paths(self, system: int, mission_type: MissionType) -> list[Path]:
        prefix = f"system-{system}-{mission_type.name.lower()}-"
        if not self.folder.is_dir():
            return []
        return sorted(
            path for path in self.folder.glob(f"{prefix}*.json") if _BACKUP_NAME.fullmatch(path.name)
        )

    def _backup(self, vehicle: VehicleMark, mission_type: MissionType, time: datetime) -> Path:
        stamp = f"{time:%Y%m%dT%H%M%S.%fZ}"
        return self.folder / f"system-{vehicle.system}-{mission_type.name.lower()}-{stamp}-{vehicle.key}.json"

    def _note(self, vehicle: VehicleMark, mission_type: MissionType) -> Path:
        name = f"upload-under-way-system-{vehicle.system}-{mission_type.name.lower()}-{vehicle.key}.json"
        return self.folder / name


def read_backup(path: Path) -> Backup:
    """Read a backup file and check its checksum.

    Raises
    ------
    BackupError
        The file is missing, is not a backup, or has been changed.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        claimed = content.pop("sha256")
        backup = Backup(
            path,
            datetime.fromisoformat(content["time"]),
            mark_from_json(int(content["system"]), content.get("vehicle", {})),
            MissionType[content["mission_type"].upper()],
            tuple(item_from_json(item) for item in content["items"]),
        )
        expected = checksum(content)
    except OSError as error:
        raise BackupError(
            f"the backup {path} cannot be read: {error.strerror or error}", path=str(path)
        ) from None
    except UNREADABLE:
        raise BackupError(
            f"{path} is not a backup that pbpp wrote; nothing was written to the vehicle", path=str(path)
        ) from None
    if claimed != expected:
        raise BackupError(f"the backup {path} is damaged: its checksum does not match", path=str(path))
    return backup
