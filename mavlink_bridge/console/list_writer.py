"""A list written beside the director, verified: a fence that was drawn on the page, or a backup that is put back. Clock-free; the old list goes to disk first.

It has the names of a machine, so that the link runs it beside the director's own; it runs only while the director asks and writes nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.backup.upload_note import UploadNote
from mavlink_bridge.backup.vehicle_lock import VehicleLock
from mavlink_bridge.console.view.sections import TransferView
from mavlink_bridge.errors import BridgeError
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.protocol.limits import Limits
from mavlink_bridge.protocol.outcomes import Writing, end_of_upload, upload_trouble
from mavlink_bridge.protocol.sendable import check_items
from mavlink_bridge.protocol.verified_upload import Held, VerifiedUpload

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from mavlink_bridge.backup.store import BackupStore
    from mavlink_bridge.backup.vehicle_mark import VehicleMark
    from mavlink_bridge.director import Director
    from mavlink_bridge.mavlink.messages import Frame, Message
    from missions.items import MissionItem


class ListWriter:
    """Writes one list at a time.

    Parameters
    ----------
    director : Director
        Whose vehicle.
    store : BackupStore
        Where old lists are kept.
    """

    def __init__(self, director: Director, store: BackupStore) -> None:
        self._director = director
        self._store = store
        self._machine: VerifiedUpload | None = None
        self._kind = MissionType.FENCE
        self._lock: VehicleLock | None = None
        self._note: UploadNote | None = None
        self._restored: Path | None = None
        self._outgoing: list[Message] = []
        self._ended: TransferView | None = None
        self._is_news = False

    def take_ended(self) -> TransferView | None:
        """Return how an upload has ended, once."""
        is_news, self._is_news = self._is_news, False
        return self._ended if is_news else None

    @property
    def is_busy(self) -> bool:
        """Whether a list is being written."""
        return self._machine is not None

    @property
    def writing(self) -> Writing | None:
        """What is being written, for whoever ends the program meanwhile."""
        machine, note = self._machine, self._note
        return Writing(self._name, machine, note.backup if note else None) if machine is not None else None

    @property
    def _name(self) -> str:
        return self._kind.name.lower()

    def begin(
        self,
        kind: MissionType,
        items: Sequence[MissionItem],
        vehicle: VehicleMark,
        now_s: float,
        restored: Path | None = None,
    ) -> None:
        """Begin to write a list.

        Parameters
        ----------
        kind : MissionType
            Which.
        items : sequence of MissionItem
            As it goes over the wire.
        vehicle : VehicleMark
            The vehicle.
        now_s : float
            The time.
        restored : Path, optional
            The backup that it is read from.

        Raises
        ------
        BridgeError, MissionError
            It cannot be sent, or somebody else on this computer writes to the vehicle.
        """
        peer = self._director.peer
        assert peer is not None
        assert self._machine is None
        check_items(items, kind)
        lock = VehicleLock(vehicle)
        if holder := lock.take():
            raise holder.error(vehicle)
        self._lock, self._kind, self._restored, self._ended = lock, kind, restored, None
        try:
            self._note = UploadNote(self._store, vehicle, kind)
        except BridgeError:
            self._free()
            raise
        limits = Limits.from_parameters(self._director.situation.parameters)
        machine = VerifiedUpload(peer, kind, items, limits=limits)
        machine.know_vehicle(self._director.watch, now_s)
        self._machine = machine
        machine.start(now_s)
        self._look(now_s)

    # As a machine

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        return self._machine.deadline_s if self._machine is not None else None

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        if self._machine is not None:
            self._machine.receive(frame, now_s)
            self._look(now_s)

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        if self._machine is not None:
            self._machine.handle_timer(now_s)
            self._look(now_s)

    def messages_to_send(self) -> list[Message]:
        """Return and forget what is to be sent."""
        messages, self._outgoing = self._outgoing, []
        return messages + (self._machine.messages_to_send() if self._machine is not None else [])

    # What comes of it

    def view(self) -> TransferView | None:
        """Return how it goes, or went; None before the first."""
        if self._machine is None:
            return self._ended
        done, count = self._machine.progress
        return TransferView(
            what=self._name, state="running", done=done, count=count, text=f"uploading the {self._name}"
        )

    def _look(self, now_s: float) -> None:
        """Store the old list where it waits, and see whether the upload has ended."""
        machine = self._machine
        assert machine is not None
        assert self._note is not None
        if (old := machine.pending_backup) is not None:
            try:
                self._note.begin(old)
            except BridgeError as error:
                self._end(TransferView(what=self._name, state="failed", text=str(error), time_s=now_s))
                return
            machine.backup_stored(now_s)
        outcome = machine.outcome
        if not machine.is_done or outcome is None:
            return
        self._outgoing += machine.messages_to_send()
        self._note.settle(outcome.held, self._restored)
        backup = str(self._note.backup) if self._note.backup else ""
        trouble = upload_trouble(outcome)
        if trouble is None:
            count = len(outcome.found or outcome.backup or ())
            text = f"{self._name} of {count} items verified on the vehicle"
            view = TransferView(
                what=self._name,
                state="verified",
                done=count,
                count=count,
                text=text,
                backup=backup,
                time_s=now_s,
            )
        else:
            ended = end_of_upload(trouble, Writing(self._name, machine, self._note.backup))
            details = getattr(ended, "details", {})
            advice = str(details.get("advice", ""))
            view = TransferView(
                what=self._name, state="failed", text=str(ended), advice=advice, backup=backup, time_s=now_s
            )
        self._end(view)

    def drop(self) -> None:
        """Leave what is under way, as where the link is gone: the note of it stays where anything was written."""
        if self._machine is None:
            return
        if self._note is not None and not self._machine.has_written:
            self._note.settle(Held.OLD)
        self._end(
            TransferView(
                what=self._name, state="failed", text=f"the {self._name} upload was stopped: the link is lost"
            )
        )

    def _end(self, view: TransferView) -> None:
        self._ended, self._is_news = view, True
        self._machine = self._note = None
        self._free()

    def _free(self) -> None:
        if self._lock is not None:
            self._lock.free()
            self._lock = None
