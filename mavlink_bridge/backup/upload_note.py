"""The backup and the note of one upload: made before it writes, taken away when it is known what the vehicle holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.backup.vehicle_mark import Kinship
from mavlink_bridge.protocol.verified_outcome import Held

if TYPE_CHECKING:
    from pathlib import Path

    from mavlink_bridge.backup.store import BackupStore
    from mavlink_bridge.backup.vehicle_mark import VehicleMark
    from mavlink_bridge.mavlink.messages import MissionType
    from missions.items import MissionItem


class UploadNote:
    """Keeps the old list for one upload, whose vehicle is locked, and the note that it has begun.

    Parameters
    ----------
    store : BackupStore
        Where.
    vehicle : VehicleMark
        Which vehicle.
    mission_type : MissionType
        Which list.

    Attributes
    ----------
    backup : Path or None
        What is to be restored if the upload fails; None before there is a backup.
    """

    def __init__(self, store: BackupStore, vehicle: VehicleMark, mission_type: MissionType) -> None:
        earlier = store.interrupted(vehicle, mission_type)
        self._was_interrupted = any(vehicle.kinship(note.vehicle) is Kinship.SAME for note in earlier)
        self._store = store
        self._vehicle = vehicle
        self._mission_type = mission_type
        self.backup: Path | None = None

    def begin(self, old: tuple[MissionItem, ...]) -> Path:
        """Store the old list, and note that the upload begins; return the backup that is to be restored if it fails.

        Raises
        ------
        BackupError
            It cannot be written; nothing should be uploaded then.
        """
        self.backup = self._store.begin(self._vehicle, self._mission_type, old)
        return self.backup

    def settle(self, held: Held, restored: Path | None = None) -> None:
        """Take the note away where it is known what the vehicle holds.

        Of an earlier upload that was interrupted the old list is not the one before it, and its note stays until a wanted one is on the vehicle.

        Parameters
        ----------
        held : Held
            What the vehicle holds: the old list too where nothing was written.
        restored : Path, optional
            The backup that the wanted list was read from.
        """
        is_own = self.backup is not None and not self._was_interrupted
        if held is Held.WANTED:
            self._store.end(self._vehicle, self._mission_type, restored)
        elif held in (Held.OLD, Held.FOREIGN) and is_own:
            self._store.end(self._vehicle, self._mission_type)
