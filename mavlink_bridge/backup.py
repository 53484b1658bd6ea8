"""What was on a vehicle before it was overwritten, kept in a state folder; and a note of every upload under way.

A backup is one JSON file with the time, the system id, the list and its checksum. The note beside it says that an upload has begun; it
is taken away when the outcome is known. A note found later means that our own process died half-way: nothing is restored
unasked, but the next run says so.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mavlink_bridge.errors import BackupError
from mavlink_bridge.messages import MissionType
from mavlink_bridge.user_folders import state_folder
from missions.items import MissionItem

if TYPE_CHECKING:
    from collections.abc import Sequence

_FORMAT = 1
_KEPT_BACKUPS = 100
_NAME = re.compile(r"system-(\d+)-(mission|fence|rally)-\d{8}T\d{6}\.\d{6}Z\.json")


@dataclass(frozen=True, slots=True)
class Backup:
    """A list as it was on a vehicle.

    Parameters
    ----------
    path : Path
        The file.
    time : datetime
        When it was read from the vehicle, UTC.
    system : int
        The vehicle's system id.
    mission_type : MissionType
        Which list.
    items : tuple of MissionItem
        The list as it goes over the wire, for missions with home at 0.
    """

    path: Path
    time: datetime
    system: int
    mission_type: MissionType
    items: tuple[MissionItem, ...]


class BackupStore:
    """The state folder.

    Parameters
    ----------
    folder : Path, optional
        Where; the user's state folder if not given.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder or state_folder() / "backups"

    def keep(self, system: int, mission_type: MissionType, items: Sequence[MissionItem]) -> Path:
        """Write a backup; give its path once it is safe on disk.

        Raises
        ------
        BackupError
            It cannot be written; nothing should be uploaded then.
        """
        now = datetime.now(UTC)
        while (path := self._backup(system, mission_type, now)).exists():  # clocks may be coarse
            now += timedelta(microseconds=1)
        content = {
            "format": _FORMAT,
            "time": now.isoformat(),
            "system": system,
            "mission_type": mission_type.name.lower(),
            "items": [_item_to_json(item) for item in items],
        }
        content["sha256"] = _checksum(content)
        self._write(path, content)
        for old in self._paths(system, mission_type)[:-_KEPT_BACKUPS]:
            old.unlink(missing_ok=True)
        return path

    def begin(self, system: int, mission_type: MissionType, items: Sequence[MissionItem]) -> Path:
        """Keep a backup and note that an upload begins; give the path of the backup that is to be restored if it fails.

        If an earlier upload was interrupted, what is on the vehicle now is its remains: the note goes on naming the older backup.

        Raises
        ------
        BackupError
            It cannot be written; nothing should be uploaded then.
        """
        path = self.keep(system, mission_type, items)
        if earlier := self._noted(system, mission_type):
            path = earlier
        note = {"time": datetime.now(UTC).isoformat(), "backup": path.name, "process": os.getpid()}
        self._write(self._note(system, mission_type), note)
        return path

    def end(self, system: int, mission_type: MissionType) -> None:
        """Take the note away: the outcome of the upload is known."""
        self._note(system, mission_type).unlink(missing_ok=True)

    def interrupted(self, system: int, mission_type: MissionType) -> Backup | None:
        """Give the backup of an upload that never came to its outcome; None if there is none.

        Raises
        ------
        BackupError
            There is a note, but its backup cannot be read.
        """
        path = self._noted(system, mission_type)
        return read_backup(path) if path else None

    def newest(self, system: int, mission_type: MissionType) -> Backup | None:
        """Give the newest backup of a vehicle's list; None if there is none.

        Raises
        ------
        BackupError
            It cannot be read.
        """
        paths = self._paths(system, mission_type)
        return read_backup(paths[-1]) if paths else None

    def _noted(self, system: int, mission_type: MissionType) -> Path | None:
        note = self._note(system, mission_type)
        try:
            return self.folder / Path(json.loads(note.read_text(encoding="utf-8"))["backup"]).name
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise BackupError(f"{note}: the note of an interrupted upload cannot be read: {error}") from None

    def _paths(self, system: int, mission_type: MissionType) -> list[Path]:
        prefix = f"system-{system}-{mission_type.name.lower()}-"
        if not self.folder.is_dir():
            return []
        return sorted(path for path in self.folder.glob(f"{prefix}*.json") if _NAME.fullmatch(path.name))

    def _backup(self, system: int, mission_type: MissionType, time: datetime) -> Path:
        return self.folder / f"system-{system}-{mission_type.name.lower()}-{time:%Y%m%dT%H%M%S.%fZ}.json"

    def _note(self, system: int, mission_type: MissionType) -> Path:
        return self.folder / f"upload-under-way-system-{system}-{mission_type.name.lower()}.json"

    def _write(self, path: Path, content: dict[str, Any]) -> None:
        """Write a file so that after a crash there is the whole of it or nothing."""
        unfinished = path.with_suffix(".part")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with unfinished.open("w", encoding="utf-8") as file:
                json.dump(content, file, allow_nan=False, indent=1)
                file.flush()
                os.fsync(file.fileno())
            unfinished.replace(path)
            _sync_folder(self.folder)
        except OSError as error:
            raise BackupError(
                f"the backup cannot be written to {path}: {error.strerror or error}", path=str(path)
            ) from None


def read_backup(path: Path) -> Backup:
    """Read a backup file and check its checksum.

    Raises
    ------
    BackupError
        The file is missing, is none, or has been changed.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        claimed = content.pop("sha256")
        backup = Backup(
            path,
            datetime.fromisoformat(content["time"]),
            int(content["system"]),
            MissionType[content["mission_type"].upper()],
            tuple(_item_from_json(item) for item in content["items"]),
        )
    except OSError as error:
        raise BackupError(
            f"the backup {path} cannot be read: {error.strerror or error}", path=str(path)
        ) from None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise BackupError(f"{path} is no backup: {error!r}", path=str(path)) from None
    if claimed != _checksum(content):
        raise BackupError(f"the backup {path} is damaged: its checksum does not match", path=str(path))
    return backup


def _checksum(content: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()


def _item_to_json(item: MissionItem) -> dict[str, Any]:
    return {
        "command": int(item.command),
        "frame": int(item.frame),
        "params": [_number_to_json(value) for value in item.params],
        "lat_e7": item.lat_e7,
        "lon_e7": item.lon_e7,
        "alt_m": _number_to_json(item.alt_m),
        "current": item.current,
        "autocontinue": item.autocontinue,
    }


def _item_from_json(item: dict[str, Any]) -> MissionItem:
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


def _number_to_json(value: float) -> float | str:
    return value if math.isfinite(value) else str(value)


def _sync_folder(folder: Path) -> None:
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
