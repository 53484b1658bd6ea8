"""Putting back what was on a vehicle before: which backups are its own, and what interrupted uploads left behind."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.backup.vehicle_lock import VehicleLock
from mavlink_bridge.backup.vehicle_mark import Kinship
from mavlink_bridge.cli.terminal import say
from mavlink_bridge.errors import BackupError, OtherVehicleError, UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.backup.store import Backup, BackupStore, Note
    from mavlink_bridge.backup.vehicle_mark import VehicleMark

_ARDUPILOT = 3  # MAV_AUTOPILOT; of marks before it was kept, which were all ArduPilot's
_FORGET = "`pbpp upload --forget` dismisses this note"


@dataclass(frozen=True, slots=True)
class Restoration:
    """What is to be put back.

    Parameters
    ----------
    backup : Backup, optional
        The backup that was named; None for those of interrupted uploads.
    for_another : bool
        Whether it may be another vehicle's (``--other-vehicle``).
    """

    backup: Backup | None
    for_another: bool


def interrupted_warnings(store: BackupStore, vehicle: VehicleMark) -> list[str]:
    """Return which uploads to a vehicle never came to their outcome."""
    return [_warning(note, vehicle) for note in store.interrupted(vehicle)]


def reader_warnings(store: BackupStore, vehicle: VehicleMark) -> list[str]:
    """Return what somebody who only reads from a vehicle should know: who writes to it now, or which uploads were interrupted."""
    lock = VehicleLock(vehicle)
    try:
        holder = lock.take()
    except BackupError:  # whoever only reads needs no lock
        holder = None
    lock.free()
    if holder is None:
        return interrupted_warnings(store, vehicle)
    return [f"{holder} on this computer is writing to {vehicle}: what is read now may be part old, part new"]


def _warning(note: Note, vehicle: VehicleMark) -> str:
    name = note.mission_type.name.lower()
    is_same = vehicle.kinship(note.vehicle) is Kinship.SAME
    to = f"to system {note.vehicle.system}" if is_same else f"to {note.vehicle}, which may be this vehicle,"
    if note.backup is None:
        return (
            f"an upload of the {name} {to} was interrupted: the list may be part old, part new; what was there before is not known "
            f"({note.trouble}). Check what the vehicle holds (`pbpp download {name}`); {_FORGET}"
        )
    backup = note.backup
    kept = f"({len(backup.items)} items, read {backup.time:%Y-%m-%d %H:%M:%S} UTC, {backup.path})"
    return (
        f"an upload of the {name} {to} was interrupted: the list may be part old, part new. "
        f"`pbpp upload --restore` puts back the old one {kept}; {_FORGET}"
    )


def backups_to_restore(store: BackupStore, vehicle: VehicleMark, wanted: Restoration) -> list[Backup]:
    """Return the backups that are to be put back on a vehicle.

    Raises
    ------
    OtherVehicleError
        They are another vehicle's, or cannot be shown to be this one's, and nobody allows it.
    BackupError
        What an interrupted upload replaced is not known any more.
    UsageError
        There is no such backup.
    """
    if wanted.backup is not None:
        _check_autopilot(wanted.backup, vehicle)
        if not wanted.for_another:
            _check_vehicle(wanted.backup, vehicle)
        return [wanted.backup]
    notes = store.interrupted(vehicle)
    if lost := [note for note in notes if note.backup is None]:
        raise BackupError(
            f"{lost[0].trouble}; nothing was written to the vehicle. {_FORGET}; "
            f"to restore another backup give its file (they are in {store.folder})"
        )
    if not notes:
        _say_whose(store.notes(), vehicle)
        raise UsageError(
            f"no upload to system {vehicle.system} was interrupted; to restore another backup give its file (they are in {store.folder})"
        )
    backups = [note.backup for note in notes if note.backup]
    for backup in backups:
        _check_autopilot(backup, vehicle)
        _check_vehicle(backup, vehicle)
    return backups


def _check_autopilot(backup: Backup, vehicle: VehicleMark) -> None:
    """Refuse a list that another autopilot held: ArduPilot's missions begin with home, which PX4 would drive to."""
    held, now = (mark.autopilot or _ARDUPILOT for mark in (backup.vehicle, vehicle))
    if held != now:
        raise OtherVehicleError(
            f"the backup {backup.path} was read from another autopilot (MAV_AUTOPILOT {held}, this is {now}), which stores lists "
            "in another form; nothing was written"
        )


def _say_whose(notes: Sequence[Note], vehicle: VehicleMark) -> None:
    """Refuse, where only uploads to other vehicles with the same system id were interrupted."""
    for note in notes:
        if note.vehicle.system == vehicle.system and note.backup is not None:
            raise _refusal(note.backup, vehicle)


def _check_vehicle(backup: Backup, vehicle: VehicleMark) -> None:
    kinship = vehicle.kinship(backup.vehicle)
    if kinship is Kinship.SAME:
        return
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise _refusal(backup, vehicle)
    whose = "is another vehicle's" if kinship is Kinship.OTHER else "cannot be shown to be this vehicle's"
    say(
        f"the backup {backup.path} of {backup.vehicle} {whose}: this is {vehicle}. Write it here? [y/N] ",
        nl=False,
    )
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise _refusal(backup, vehicle)


def _refusal(backup: Backup, vehicle: VehicleMark) -> OtherVehicleError:
    is_other = vehicle.kinship(backup.vehicle) is Kinship.OTHER
    why = "is another vehicle's" if is_other else "cannot be shown to be this vehicle's"
    name = backup.mission_type.name.lower()
    return OtherVehicleError(
        f"the backup of the {name} of {backup.vehicle} {why}: this is {vehicle}; nothing was written to it",
        backup=str(backup.path),
        backup_of=str(backup.vehicle),
        vehicle=str(vehicle),
        advice=f"if it belongs on this vehicle all the same: `pbpp upload --restore {backup.path} --other-vehicle`",
    )
