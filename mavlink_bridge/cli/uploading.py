"""Lists and parameters on their way to one vehicle: made ready, locked, backed up, uploaded, verified; and the message if that breaks off."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.backup.upload_note import UploadNote
from mavlink_bridge.backup.vehicle_lock import VehicleLock
from mavlink_bridge.errors import LinkError, OutcomeError, RefusedError
from mavlink_bridge.link import now_s
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.protocol.limits import Limits
from mavlink_bridge.protocol.outcomes import Writing, end_of_parameters, ends_in_words, upload_trouble
from mavlink_bridge.protocol.parameters import ReadParameters, SetParameter
from mavlink_bridge.protocol.verified_upload import Held, VerifiedUpload
from missions.vehicle.asked_parameters import STORAGE_NAMES

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from mavlink_bridge.backup.vehicle_mark import VehicleMark
    from mavlink_bridge.cli.enforcing import Enforcement
    from mavlink_bridge.cli.session import Session
    from mavlink_bridge.protocol.parameters import SetParameterOutcome
    from mavlink_bridge.protocol.verified_upload import VerifiedUploadOutcome
    from missions.items import MissionItem

Lists = list[tuple[MissionType, tuple["MissionItem", ...]]]

_LOCK_PATIENCE_S = 5.0
"""Most uploads take less; who waits longer wants to know for whom."""
_LOCK_LOOK_S = 0.2  # between attempts at another process's lock; chosen, not measured


@dataclass(frozen=True, slots=True)
class Done:
    """One list that is on the vehicle now, verified; of a fence that does not count at once, which of its zones the vehicle leaves out."""

    mission_type: MissionType
    outcome: VerifiedUploadOutcome
    backup: Path | None
    took_s: float
    not_enforced: tuple[str, ...] | None = None

    def document(self) -> dict[str, Any]:
        """Return it for JSON."""
        enforced = {} if self.not_enforced is None else {"not_enforced": list(self.not_enforced)}
        return {
            "list": self.mission_type.name.lower(),
            "items": len(self.outcome.found or ()),
            "outcome": str(self.outcome.kind),
            "pushes": self.outcome.pushes,
            "backup": str(self.backup) if self.backup else None,
            "transfer_s": round(self.took_s, 3),
            **enforced,
        }


class Uploads:
    """What one run writes to one vehicle.

    Parameters
    ----------
    session : Session
        The vehicle on its link.
    store : BackupStore
        Where the old lists are kept.
    replace_active : bool
        Write even while the vehicle drives its mission.

    Attributes
    ----------
    vehicle : VehicleMark
        Which vehicle it is.
    done : list of Done
        The lists that are on the vehicle, verified.
    changed : dict
        The parameters that were set, with their old and new values.
    """

    def __init__(self, session: Session, store: BackupStore, *, replace_active: bool) -> None:
        self.vehicle: VehicleMark = session.which_vehicle()
        self.done: list[Done] = []
        self.changed: dict[str, tuple[float | None, float]] = {}
        self._session = session
        self._store = store
        self._replace_active = replace_active
        self._lock = VehicleLock(self.vehicle)
        self._writing: Writing | None = None
        self._verified: list[str] = []

    def begin(self) -> AbstractContextManager[None]:
        """Lock the vehicle for a block that writes to it; whatever ends the block reports what it left on the vehicle.

        Raises
        ------
        VehicleInUseError
            Another process of this computer writes to the vehicle, and goes on doing so.
        BackupError
            No lock can be taken.
        """
        until_s = time.monotonic() + _LOCK_PATIENCE_S
        while holder := self._lock.take():
            if time.monotonic() >= until_s:
                raise holder.error(self.vehicle)
            self._session.listen_until(lambda: False, _LOCK_LOOK_S)
        return ends_in_words(lambda: self._writing, self._verified, self._lock.free)

    def on_it(self) -> str:
        """Return what this run has put on the vehicle so far, for people."""
        lists = [
            f"{entry.mission_type.name.lower()} ({len(entry.outcome.found or ())} items)"
            for entry in self.done
        ]
        parameters = [f"parameters {', '.join(self.changed)}"] if self.changed else []
        put = ", ".join((*lists, *parameters))
        return f"uploaded and verified: {put}" if put else ""

    def write_lists(self, lists: Lists, restored: Path | None = None) -> None:
        """Upload lists one after the other, each verified.

        Parameters
        ----------
        lists : list of tuple
            Lists as they go over the wire.
        restored : Path, optional
            The backup that they are read from.

        Raises
        ------
        BridgeError
            What an upload ended with.
        """
        limits = _limits(self._session, lists)
        for mission_type, items in lists:
            self._write_list(mission_type, items, limits, restored)

    def _write_list(
        self, mission_type: MissionType, items: tuple[MissionItem, ...], limits: Limits, restored: Path | None
    ) -> None:
        session, name = self._session, mission_type.name.lower()
        note = UploadNote(self._store, self.vehicle, mission_type)
        machine = VerifiedUpload(
            session.vehicle,
            mission_type,
            items,
            limits=limits,
            replace_active=self._replace_active,
        )
        machine.know_vehicle(session.watch, session.link.now_s())
        self._writing = Writing(name, machine, None)

        def step() -> None:
            if (old := machine.pending_backup) is not None:
                self._writing = Writing(name, machine, note.begin(old))
                machine.backup_stored(now_s())

        begun_s = time.monotonic()
        try:
            session.run(machine, f"{name}: {len(items)} items", step)
        except BaseException:
            if not machine.has_written:
                note.settle(Held.OLD)
            raise
        outcome = machine.outcome
        assert outcome is not None
        note.settle(outcome.held, restored)
        if trouble := upload_trouble(outcome):
            raise trouble
        self.done.append(Done(mission_type, outcome, note.backup, time.monotonic() - begun_s))
        self._writing = None
        if outcome.pushes:
            self._verified.append(name)

    def await_fence(self, watch: Enforcement, items: Sequence[MissionItem]) -> list[str]:
        """Wait until the fence that was written counts; return warnings of what of it does not."""
        zones = tuple(watch.awaited(items))
        self.done = [
            replace(one, not_enforced=zones) if one.mission_type is MissionType.FENCE else one
            for one in self.done
        ]
        name = self._session.autopilot.kind
        return [f"{name} does not enforce {', '.join(zones)}"] if zones else []

    def write_parameters(self, wanted: Mapping[str, float]) -> None:
        """Set the parameters that differ.

        Raises
        ------
        BridgeError
            The vehicle does not have one, does not take one, or does not answer.
        """
        reading = ReadParameters(self._session.vehicle, wanted)
        self._session.run(reading, "reading parameters")
        read = reading.outcome
        assert read is not None
        if read.is_silent:
            raise LinkError("the vehicle did not answer the parameter request; none was set")
        if read.missing:
            raise RefusedError(
                f"the vehicle has no parameter {', '.join(read.missing)}; none was set",
                missing=list(read.missing),
            )
        different = {
            name: value for name, value in wanted.items() if not _is_same(read.values.get(name), value)
        }
        setting: SetParameter | None = None
        try:
            for name, value in different.items():
                setting = SetParameter(self._session.vehicle, name, value, read.types[name])
                self._session.run(setting, f"setting {name}")
                _check_set(setting.outcome, value)
                self.changed[name] = (read.values.get(name), value)  # None where it held no number
        except BaseException as cause:
            ended = end_of_parameters(cause, setting, self.changed)
            if ended is cause:
                raise
            raise ended from cause


def _check_set(outcome: SetParameterOutcome | None, wanted: float) -> None:
    assert outcome is not None
    if not outcome.is_confirmed:
        now = "an unknown value" if outcome.value is None else f"{outcome.value:g}"
        raise OutcomeError(
            f"parameter {outcome.name} was to be {wanted:g}, the vehicle holds {now}",
            wanted=wanted,
            found=outcome.value,
        )


def _is_same(held: float | None, wanted: float) -> bool:
    return held is not None and abs(held - wanted) <= 1e-6 * abs(wanted)


def _limits(session: Session, lists: Sequence[tuple[MissionType, tuple[MissionItem, ...]]]) -> Limits:
    """Return what fits; where the usual limits are too small, the vehicle is asked for its SD card's."""
    table = session.autopilot
    limits = Limits.of(table)
    is_enough = not any(limits.problem(items, mission_type) for mission_type, items in lists)
    if is_enough or not table.lists.has_storage_parameters:
        return limits
    # ARMING_CHECK is on every vehicle: an answer to it distinguishes a missing parameter from a lossy link.
    reading = ReadParameters(session.vehicle, ("ARMING_CHECK", *STORAGE_NAMES))
    session.run(reading, "reading the vehicle's limits")
    return Limits.from_parameters(reading.outcome.values) if reading.outcome else limits
