"""The whole safe transfer: keep the old list, push the new one, read back what is there, put the old one back if need be."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum, auto
from typing import TYPE_CHECKING

from mavlink_bridge.messages import Heartbeat, MissionResult, Statustext
from mavlink_bridge.protocol.download import RIVAL_PATIENCE_S, Download, DownloadOutcome
from mavlink_bridge.protocol.limits import Limits
from mavlink_bridge.protocol.round_trip import RoundTrip
from mavlink_bridge.protocol.stored_form import Difference, differences, is_unfinished_write
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.transitions import (
    VERIFIED_UPLOAD,
    DownloadState,
    UploadState,
    VerifiedUploadEvent,
    VerifiedUploadState,
)
from mavlink_bridge.protocol.upload import WINDOW, Upload, UploadOutcome
from mavlink_bridge.protocol.vehicle_watch import VehicleWatch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.messages import Frame, MissionType
    from mavlink_bridge.protocol.peer import Peer
    from missions.items import MissionItem

MOST_PUSHES = 4
MOST_RESTORES = 3
_HEARTBEAT_PATIENCE_S = 10.0
_FRESH_S = 3.0  # a heartbeat comes every second
_MOST_TEXTS = 12


class OutcomeKind(StrEnum):
    """How a safe upload ended."""

    VERIFIED = auto()  # the last complete read-back equalled the list, nothing was written since
    REFUSED = auto()  # the vehicle (or the check of its limits) said no; the old list is there
    BUSY = auto()  # another ground station kept the list busy; nothing was written
    ACTIVE = auto()  # armed in AUTO; nothing was written
    NO_ANSWER = auto()  # silence before anything was written
    UNCHANGED = auto()  # the upload did not get through; the old list was never replaced
    RESTORED = auto()  # the upload did not get through; the old list was put back and verified
    DIFFERENT = auto()  # something else is on the vehicle
    UNKNOWN = auto()  # what is on the vehicle could not be read


class Held(StrEnum):
    """What the vehicle holds now."""

    WANTED = auto()
    OLD = auto()
    UNFINISHED = auto()  # part old, part new
    FOREIGN = auto()  # neither
    UNKNOWN = auto()


@dataclass(frozen=True, slots=True)
class VerifiedUploadOutcome:
    """How a safe upload ended and what is on the vehicle.

    Parameters
    ----------
    kind : OutcomeKind
        How it ended.
    held : Held
        What the vehicle holds now.
    mission_type : MissionType
        Which list.
    result : MissionResult, optional
        What the vehicle refused with.
    item : int, optional
        The item it refused, for missions with home at 0.
    texts : tuple of str
        STATUSTEXTs that came while items were sent, or the limit that the list breaks.
    differences : tuple of Difference
        Where what is on the vehicle differs from what was wanted, as last read.
    backup : tuple of MissionItem, optional
        The list that was there before; None if it was never read.
    found : tuple of MissionItem, optional
        The list as last read; None if nothing was read after the upload began.
    pushes : int
        How often the list was sent; 0: it was there already, or nothing was written.
    is_coarse : bool
        The vehicle gives positions as 32-bit floats only: what is there is known to about 1 m.
    """

    kind: OutcomeKind
    held: Held
    mission_type: MissionType
    result: MissionResult | None = None
    item: int | None = None
    texts: tuple[str, ...] = ()
    differences: tuple[Difference, ...] = ()
    backup: tuple[MissionItem, ...] | None = None
    found: tuple[MissionItem, ...] | None = None
    pushes: int = 0
    is_coarse: bool = False

    @property
    def is_verified(self) -> bool:
        """Whether the vehicle holds the list, proved by reading it back."""
        return self.kind is OutcomeKind.VERIFIED


class VerifiedUpload(TableMachine[VerifiedUploadState, VerifiedUploadEvent]):
    """Uploads one list safely; the outcome is None until `is_done`.

    When `pending_backup` is not None the old list waits to be stored; nothing is written before `backup_stored` is called.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    mission_type : MissionType
        Which list.
    items : sequence of MissionItem
        The list as it goes over the wire, for missions with the home item at 0.
    limits : Limits, optional
        What fits on the vehicle; ArduPilot Rover's defaults if not given.
    is_active : bool, optional
        Whether the vehicle drives its mission (armed in AUTO, the mission not complete), from a fresh heartbeat; None waits for one.
    replace_active : bool
        Write even if it is.
    window : int
        Most items ahead of the requests.
    rival_patience_s : float
        How long another ground station may keep the list busy.
    """

    def __init__(
        self,
        peer: Peer,
        mission_type: MissionType,
        items: Sequence[MissionItem],
        *,
        limits: Limits | None = None,
        is_active: bool | None = None,
        replace_active: bool = False,
        window: int = WINDOW,
        rival_patience_s: float = RIVAL_PATIENCE_S,
    ) -> None:
        super().__init__(VERIFIED_UPLOAD, VerifiedUploadState.IDLE)
        self._peer = peer
        self._mission_type = mission_type
        self._wanted = tuple(items)
        self._limits = limits or Limits()
        self._is_active = is_active
        self._watch = VehicleWatch()
        self._active_known_s = 0.0
        self._replace_active = replace_active
        self._window = window
        self._rival_patience_s = rival_patience_s
        self._round_trip = RoundTrip()
        self._download: Download | None = None
        self._upload: Upload | None = None
        self._old: tuple[MissionItem, ...] | None = None
        self._found: tuple[MissionItem, ...] | None = None
        self._is_coarse = False
        self._may_be_coarse = True
        self._read_before: tuple[MissionItem, ...] | None = None
        self._pushed: UploadOutcome | None = None
        self._pushed_before: UploadOutcome | None = None
        self._refusal: UploadOutcome | None = None
        self._was_heeded = False
        self._pushes = 0
        self._restores = 0
        self._failed_read: DownloadOutcome | None = None
        self._texts: list[str] = []
        self._problem: str | None = None
        self._check_until_s = 0.0
        self._held = Held.UNKNOWN
        self._shown_progress = 0
        self._outcome: VerifiedUploadOutcome | None = None

    def know_vehicle(self, watch: VehicleWatch, now_s: float) -> None:
        """Take over what the vehicle told of itself before the start."""
        self._watch = watch
        self._is_active = watch.is_active(now_s)

    @property
    def pending_backup(self) -> tuple[MissionItem, ...] | None:
        """The old list, while the machine waits for it to be stored."""
        return self._old if self.state is VerifiedUploadState.STORING_BACKUP else None

    @property
    def backup(self) -> tuple[MissionItem, ...] | None:
        """The old list, once it was read."""
        return self._old

    @property
    def outcome(self) -> VerifiedUploadOutcome | None:
        """How it ended; None while it runs."""
        if self._outcome is None and self.is_done:
            self._outcome = self._sum_up()
        return self._outcome

    def _sum_up(self) -> VerifiedUploadOutcome:
        refusal = self._refusal
        found = self._found
        return VerifiedUploadOutcome(
            kind=self._kind(),
            held=self._held,
            mission_type=self._mission_type,
            result=MissionResult.NO_SPACE
            if self._problem
            else refusal.result
            if refusal
            else self._read_result(),
            item=refusal.item if refusal else None,
            texts=(self._problem,) if self._problem else tuple(self._texts),
            differences=() if found is None else self._differences(self._wanted, found),
            backup=self._old,
            found=found,
            pushes=self._pushes,
            is_coarse=self._is_coarse,
        )

    @property
    def progress(self) -> tuple[int, int]:
        """Items read, pushed and read back, and how many these are in all."""
        old_count = len(self._old) if self._old is not None else 0
        total = old_count + 2 * len(self._wanted)
        if self.is_done:
            return total, total
        part = self._download or self._upload
        before = {
            VerifiedUploadState.CHECKING_VEHICLE: old_count,
            VerifiedUploadState.STORING_BACKUP: old_count,
            VerifiedUploadState.PUSHING: old_count,
            VerifiedUploadState.READING_BACK: old_count + len(self._wanted),
        }.get(self.state, 0)
        self._shown_progress = max(self._shown_progress, before + (part.progress[0] if part else 0))
        return min(self._shown_progress, total), total

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end, whatever the link does; the wait for the backup is left out."""
        longest = max(len(self._wanted), len(self._old or ()))
        read_s = 50.0 + self._rival_patience_s + 0.5 * longest
        push_s = 60.0 + self._rival_patience_s + 1.5 * longest
        return _HEARTBEAT_PATIENCE_S + read_s + (MOST_PUSHES + MOST_RESTORES) * (push_s + 2 * read_s)

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        if self.is_done:
            return None
        if self.state is VerifiedUploadState.CHECKING_VEHICLE:
            return self._check_until_s
        part = self._download or self._upload
        return part.deadline_s if part else None

    def start(self, now_s: float) -> None:
        """Check the limits and begin with reading the old list."""
        if self.state is not VerifiedUploadState.IDLE:
            return
        self._problem = self._limits.problem(self._wanted, self._mission_type)
        self._held = Held.OLD  # whatever it is: nothing was written yet
        self._active_known_s = now_s
        if self._problem:
            self._move(VerifiedUploadEvent.TOO_LARGE)
        elif self._move(VerifiedUploadEvent.START):
            self._start_reading(now_s)

    def backup_stored(self, now_s: float) -> None:
        """Take notice that the old list is safe; only now is anything written."""
        if self._move(VerifiedUploadEvent.BACKUP_STORED):
            self._check_until_s = now_s + _HEARTBEAT_PATIENCE_S
            self._check_vehicle(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        if self.is_done or not self._peer.accepts(frame):
            return
        self._watch.receive(frame.message, now_s)
        if isinstance(frame.message, Heartbeat):
            self._is_active = self._watch.doing(now_s).drives_mission
            self._active_known_s = now_s
            self._check_vehicle(now_s)
        elif isinstance(frame.message, Statustext):
            if self._pushes and len(self._texts) < _MOST_TEXTS and frame.message.text not in self._texts:
                self._texts.append(frame.message.text)
        elif part := self._download or self._upload:
            part.receive(frame, now_s)
            self._advance(now_s)

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        if self.state is VerifiedUploadState.CHECKING_VEHICLE and now_s >= self._check_until_s:
            self._move(VerifiedUploadEvent.NOT_CLEAR)
        elif part := self._download or self._upload:
            part.handle_timer(now_s)
            self._advance(now_s)

    def _advance(self, now_s: float) -> None:
        """Pass on what the part under way wants to send, and go on when it has ended."""
        part = self._download or self._upload
        assert part is not None
        for message in part.messages_to_send():
            self._send(message)
        if self._download and (read := self._download.outcome):
            self._download = None
            self._take_read(read, now_s)
        elif self._upload and (pushed := self._upload.outcome):
            self._was_heeded |= self._upload.was_heeded
            self._upload = None
            self._take_push(pushed, now_s)

    def _start_reading(self, now_s: float) -> None:
        self._download = Download(
            self._peer,
            self._mission_type,
            rival_patience_s=self._rival_patience_s,
            round_trip=self._round_trip,
            float_form=self._may_be_coarse,
        )
        self._download.start(now_s)
        self._advance(now_s)

    def _start_pushing(self, items: tuple[MissionItem, ...], window: int, now_s: float) -> None:
        self._read_before = None
        self._upload = Upload(
            self._peer,
            self._mission_type,
            items,
            window=window,
            rival_patience_s=self._rival_patience_s,
            round_trip=self._round_trip,
        )
        self._upload.start(now_s)
        self._advance(now_s)

    def _check_vehicle(self, now_s: float) -> None:
        is_known = self._is_active is not None and now_s <= self._active_known_s + _FRESH_S
        if self.state is not VerifiedUploadState.CHECKING_VEHICLE or not is_known:
            return
        if self._is_active and not self._replace_active:
            self._move(VerifiedUploadEvent.NOT_CLEAR)
        elif self._move(VerifiedUploadEvent.CLEAR_TO_WRITE):
            self._push_wanted(self._window, now_s)

    def _push_wanted(self, window: int, now_s: float) -> None:
        self._pushes += 1
        self._texts.clear()
        self._start_pushing(self._wanted, window, now_s)

    def _take_push(self, pushed: UploadOutcome, now_s: float) -> None:
        self._pushed_before, self._pushed = self._pushed, pushed
        if self._move(VerifiedUploadEvent.PUSH_ENDED):
            self._start_reading(now_s)

    def _take_read(self, read: DownloadOutcome, now_s: float) -> None:
        if not read.is_complete:
            self._failed_read = read
            if self._pushes:
                self._held = Held.UNKNOWN
            self._move(VerifiedUploadEvent.READ_FAILED)
        elif self.state is VerifiedUploadState.READING_OLD:
            self._is_coarse = read.is_coarse
            self._may_be_coarse = read.is_coarse or not read.items
            self._take_old(read.items)
        else:
            self._is_coarse = read.is_coarse
            self._found = read.items
            self._judge(read.items, now_s)

    def _take_old(self, items: tuple[MissionItem, ...]) -> None:
        self._old = items
        if not self._differences(self._wanted, items):
            self._found = items
            self._held = Held.WANTED
            self._move(VerifiedUploadEvent.READ_WANTED)
        else:
            self._move(VerifiedUploadEvent.READ_OLD)

    def _judge(self, found: tuple[MissionItem, ...], now_s: float) -> None:
        """Decide what a read-back means; anything but the wanted list must be read twice alike before it is believed."""
        restoring = self.state is VerifiedUploadState.READING_RESTORED
        self._held = self._held_list(found)
        expected = Held.OLD if restoring else Held.WANTED
        if self._held is expected:
            self._move(VerifiedUploadEvent.READ_OLD if restoring else VerifiedUploadEvent.READ_WANTED)
        elif self._read_before is None or self._differences(self._read_before, found):
            self._read_before = found
            self._move(VerifiedUploadEvent.READ_AGAIN)
            self._start_reading(now_s)
        elif self._held is Held.FOREIGN:
            self._move(VerifiedUploadEvent.READ_FOREIGN)
        elif restoring:
            self._restore_again(now_s)
        else:
            self._push_again(now_s)

    def _held_list(self, found: tuple[MissionItem, ...]) -> Held:
        assert self._old is not None
        if not self._differences(self._wanted, found):
            return Held.WANTED
        if not self._differences(self._old, found):
            return Held.OLD
        if is_unfinished_write(found, self._old, self._wanted, self._mission_type, coarse=self._is_coarse):
            return Held.UNFINISHED
        return Held.FOREIGN

    def _push_again(self, now_s: float) -> None:
        """Send the list once more where that can help, else end with the old list there or put back."""
        assert self._old is not None
        pushed = self._pushed
        assert pushed is not None
        refused = pushed.state is UploadState.REFUSED
        # ERROR also answers an item that nobody waits for (after a reboot, say): it must come twice. And with several items
        # under way the refused one is not certain. Serving the items one by one settles both.
        settled = (
            refused
            and pushed.item_is_certain
            and (pushed.result is not MissionResult.ERROR or _is_same_refusal(pushed, self._pushed_before))
        )
        if settled:
            self._refusal = pushed
        # Somebody may have set it going meanwhile: the whole old list is driven on, a mix is put right all the same.
        drives_old = self._held is Held.OLD and bool(self._is_active) and not self._replace_active
        may_push = not settled and not drives_old and self._pushes < MOST_PUSHES
        if may_push and self._move(VerifiedUploadEvent.PUSH_AGAIN):
            self._push_wanted(1 if refused else self._window, now_s)
        elif self._held is Held.OLD:
            self._move(VerifiedUploadEvent.READ_OLD)
        elif self._move(VerifiedUploadEvent.READ_UNFINISHED):
            self._restore(now_s)

    def _restore(self, now_s: float) -> None:
        assert self._old is not None
        self._restores += 1
        self._start_pushing(self._old, self._window, now_s)

    def _restore_again(self, now_s: float) -> None:
        if self._restores < MOST_RESTORES and self._move(VerifiedUploadEvent.PUSH_AGAIN):
            self._restore(now_s)
        else:
            self._move(VerifiedUploadEvent.READ_UNFINISHED)

    def _differences(
        self, wanted: tuple[MissionItem, ...], found: tuple[MissionItem, ...]
    ) -> tuple[Difference, ...]:
        return differences(wanted, found, self._mission_type, coarse=self._is_coarse)

    def _read_result(self) -> MissionResult | None:
        return self._failed_read.result if self._failed_read else None

    def _kind(self) -> OutcomeKind:
        failed = self._failed_read
        if self.state is VerifiedUploadState.NOT_STARTED:
            if self._problem or (failed and failed.state is DownloadState.REFUSED):
                return OutcomeKind.REFUSED
            if failed and failed.state is DownloadState.BUSY:
                return OutcomeKind.BUSY
            return OutcomeKind.ACTIVE if self._is_active else OutcomeKind.NO_ANSWER
        if self.state is VerifiedUploadState.UNKNOWN and self._never_wrote():
            return OutcomeKind.BUSY
        if self.state in (VerifiedUploadState.UNCHANGED, VerifiedUploadState.RESTORED) and self._refusal:
            return OutcomeKind.REFUSED
        if self.state is VerifiedUploadState.UNCHANGED and self._pushed_to_busy():
            return OutcomeKind.BUSY
        return OutcomeKind(self.state.value)

    def _pushed_to_busy(self) -> bool:
        return self._pushed is not None and self._pushed.state is UploadState.BUSY

    def _never_wrote(self) -> bool:
        return self._pushed_to_busy() and not self._was_heeded


def _is_same_refusal(a: UploadOutcome, b: UploadOutcome | None) -> bool:
    return b is not None and (a.state, a.result, a.item) == (b.state, b.result, b.item)
