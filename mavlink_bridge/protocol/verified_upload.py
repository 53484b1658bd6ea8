"""The whole safe transfer: keep the old list, push the new one, read back what is there, put the old one back if need be.

How it works, and why. An upload to ArduPilot is no transaction: the first message cuts the stored list, every item is written as it comes, and the final
word can be lost. On PX4 it is one, and an upload that broke off needs no restoring; that this is so is read back, too. So the vehicle's acknowledgement
decides nothing here; what is read back does. Four rules make "verified" true:

1. *Only a whole read counts, and only one that nobody disturbed.* Every read is an `UndisturbedRead`: traffic which shows that somebody else wrote this
   list while it was read makes it worthless (an item already read may have been replaced), and it is read again, a bounded number of times. So the
   list was on the vehicle as a whole at one moment of the last read, and nothing heard since contradicts it.
2. *The wanted list is believed at once, anything else only when two reads agree.* A read of something else may be a late copy of an earlier answer; so one
   more read costs little. Reads that never agree end as unknown. Lists are compared as the vehicle stores them, NaN equal to NaN: every list is equal to
   itself.
3. *Nothing is written before the old list is safe, nor while the vehicle drives it.* The machine stops at `pending_backup` until the shell has
   stored it. What is the old list, or our own unfinished write, is pushed again, then the old one put back; a list that is neither is left alone.
4. *It ends.* Every part has a `Pace`; the whole may take `pace.MOST_S` besides the wait for the backup. No push begins in its second half, where there may
   be no time to put the old list back, and a push or a restoring stops early enough for what is there to be read. Wherever the time runs out after
   the first write, the outcome is unknown or different, never silence.

The states and what leads from one to the next stand in `transitions.VERIFIED_UPLOAD`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.messages import Heartbeat, MissionResult
from mavlink_bridge.mavlink.stored_form import differences
from mavlink_bridge.protocol.download import RIVAL_PATIENCE_S
from mavlink_bridge.protocol.judging import held_list, is_settled_refusal
from mavlink_bridge.protocol.limits import Limits
from mavlink_bridge.protocol.pace import MOST_S, bound_s
from mavlink_bridge.protocol.round_trip import RoundTrip
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.texts import Reasons
from mavlink_bridge.protocol.transitions import (
    VERIFIED_UPLOAD,
    DownloadState,
    UploadState,
    VerifiedUploadEvent,
    VerifiedUploadState,
)
from mavlink_bridge.protocol.undisturbed_read import UndisturbedRead
from mavlink_bridge.protocol.upload import WINDOW, Upload, UploadOutcome
from mavlink_bridge.protocol.vehicle_watch import VehicleWatch
from mavlink_bridge.protocol.verified_outcome import Held, OutcomeKind, VerifiedUploadOutcome
from mavlink_bridge.protocol.write_watch import WriteWatch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.mavlink.messages import Frame, MissionType
    from mavlink_bridge.mavlink.stored_form import Difference
    from mavlink_bridge.protocol.download import DownloadOutcome
    from mavlink_bridge.protocol.peer import Peer
    from missions.items import MissionItem

__all__ = ["Held", "OutcomeKind", "VerifiedUpload", "VerifiedUploadOutcome"]

# Chosen, not measured; at 40 % loss 1.29 pushes are needed in the mean (docs/transfers.md).
MOST_PUSHES = 4
MOST_RESTORES = 3
# Of the list after one push: two mostly agree, late copies on a link that reorders may need one more.
_MOST_READS = 6
_MOST_BACKUPS = 3  # as often as the old list is read because others wrote it before we could
_LAST_PUSH_S = MOST_S / 2  # later than this no push begins
_READ_RESERVE_S = 45.0  # kept for reading what a push left: 655 items at 40 % loss took up to 25 s, the 8 s included for which a vehicle left half-way refuses
_HEARTBEAT_PATIENCE_S = 10.0
_FRESH_S = 3.0  # a heartbeat comes every second


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
        What fits on the vehicle; its autopilot's defaults if not given.
    is_active : bool, optional
        Whether the vehicle drives its mission (armed in AUTO, the mission not complete), from a fresh heartbeat; None waits for one.
    replace_active : bool
        Write even if it is.
    window : int
        Most items ahead of the requests.
    rival_patience_s : float
        How long another ground station may keep the list busy.
    """

    # Many attributes: what a safe upload has to remember of the old list, the pushes, the reads and others who write.

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
        self._lists = peer.autopilot.lists
        self._wanted = self._lists.form.prepared(items, mission_type)
        self._limits = limits or Limits.of(peer.autopilot)
        self._is_active = is_active
        self._vehicle = VehicleWatch()
        self._active_known_s = 0.0
        self._replace_active = replace_active
        self._window = window
        self._rival_patience_s = rival_patience_s
        self._round_trip = RoundTrip()
        self._watch = WriteWatch(peer, mission_type)
        self._reading: UndisturbedRead | None = None
        self._upload: Upload | None = None
        self._old: tuple[MissionItem, ...] | None = None
        self._found: tuple[MissionItem, ...] | None = None
        self._is_coarse = False
        self._may_be_coarse = True
        self._read_before: tuple[MissionItem, ...] | None = None
        self._reads = 0  # since the push
        self._backups = 0
        self._is_disturbed = False
        self._pushed: UploadOutcome | None = None
        self._pushed_before: UploadOutcome | None = None
        self._refusal: UploadOutcome | None = None
        self._pushes = 0
        self._restores = 0
        self._failed_read: DownloadOutcome | None = None
        self._reasons = Reasons(peer, is_about_list=True)
        self._problem: str | None = None
        self._check_until_s = 0.0
        self._begun_s = 0.0  # the wait for the backup left out
        self._waits_since_s = 0.0
        self._held = Held.UNKNOWN
        self._shown_progress = 0
        self._outcome: VerifiedUploadOutcome | None = None

    def know_vehicle(self, watch: VehicleWatch, now_s: float) -> None:
        """Take over what the vehicle reported about itself before the start."""
        self._vehicle = watch
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
    def has_written(self) -> bool:
        """Whether anything was handed out to be sent that may have changed the list; true from the first MISSION_COUNT on."""
        return self._pushes > 0

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
            texts=(self._problem,) if self._problem else self._reasons.texts,
            differences=() if found is None else self._differences(self._wanted, found),
            backup=self._old,
            found=found,
            pushes=self._pushes,
            is_coarse=self._is_coarse,
            writer=self._watch.writer if self._is_disturbed or self._held is Held.FOREIGN else None,
            shortfall=self._shortfall(),
        )

    @property
    def progress(self) -> tuple[int, int]:
        """Items read, pushed and read back, and how many these are in all."""
        old_count = len(self._old) if self._old is not None else 0
        total = old_count + 2 * len(self._wanted)
        if self.is_done:
            return total, total
        part = self._reading or self._upload
        before = {
            VerifiedUploadState.CHECKING_VEHICLE: old_count,
            VerifiedUploadState.STORING_BACKUP: old_count,
            VerifiedUploadState.PUSHING: old_count,
            VerifiedUploadState.READING_BACK: old_count + len(self._wanted),
        }.get(self.state, 0)
        self._shown_progress = max(self._shown_progress, before + (part.progress[0] if part else 0))
        return min(self._shown_progress, total), total

    @property
    def is_atomic(self) -> bool:
        """Whether the vehicle replaces a list as a whole: what broke off has left the old list, or the new one."""
        return self._lists.is_atomic

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end, whatever the link and the vehicle do; the wait for the backup is left out."""
        return MOST_S

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        if self.is_done or self.state in (VerifiedUploadState.IDLE, VerifiedUploadState.STORING_BACKUP):
            return None
        if self.state is VerifiedUploadState.CHECKING_VEHICLE:
            return min(self._check_until_s, self._limit_s)
        part = self._reading or self._upload
        part_s = part.deadline_s if part else None
        return self._limit_s if part_s is None else min(part_s, self._limit_s)

    @property
    def _limit_s(self) -> float:
        return self._begun_s + MOST_S

    def start(self, now_s: float) -> None:
        """Check the limits and begin with reading the old list."""
        if self.state is not VerifiedUploadState.IDLE:
            return
        self._problem = self._limits.problem(self._wanted, self._mission_type)
        self._held = Held.OLD  # whatever it is: nothing was written yet
        self._active_known_s = self._begun_s = now_s
        if self._problem:
            self._move(VerifiedUploadEvent.TOO_LARGE)
        elif self._move(VerifiedUploadEvent.START):
            self._start_reading(now_s)

    def backup_stored(self, now_s: float) -> None:
        """Note that the old list is safe; only now is anything written."""
        if self._move(VerifiedUploadEvent.BACKUP_STORED):
            self._begun_s += now_s - self._waits_since_s
            self._check_until_s = now_s + _HEARTBEAT_PATIENCE_S
            self._check_vehicle(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        if self.is_done:
            return
        self._watch.look(frame, now_s)
        if not self._peer.accepts(frame):
            return
        self._reasons.take(frame, now_s)
        self._vehicle.receive(frame.message, now_s)
        if isinstance(frame.message, Heartbeat):
            self._is_active = self._vehicle.doing(now_s).drives_mission
            self._active_known_s = now_s
            self._check_vehicle(now_s)
        elif part := self._reading or self._upload:
            part.receive(frame, now_s)
            self._advance(now_s)

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        if self.is_done or self.state is VerifiedUploadState.STORING_BACKUP:
            return
        if self.state is VerifiedUploadState.CHECKING_VEHICLE and now_s >= self._check_until_s:
            self._move(VerifiedUploadEvent.NOT_CLEAR)
        elif now_s >= self._limit_s and self._move(VerifiedUploadEvent.TIME_IS_UP):
            self._reading = self._upload = None
            if self.has_written:
                self._held = Held.UNKNOWN
        elif part := self._reading or self._upload:
            part.handle_timer(now_s)
            self._advance(now_s)

    def _advance(self, now_s: float) -> None:
        """Pass on what the part under way wants to send, and go on when it has ended."""
        part = self._reading or self._upload
        assert part is not None
        for message in part.messages_to_send():
            self._watch.note_sent(message)
            self._send(message)
        if self._reading and (read := self._reading.outcome):
            self._is_disturbed = self._reading.is_disturbed
            self._reading = None
            self._take_read(read, now_s)
        elif self._upload and (pushed := self._upload.outcome):
            self._upload = None
            self._take_push(pushed, now_s)

    def _start_reading(self, now_s: float) -> None:
        self._reads += 1
        self._reading = UndisturbedRead(
            self._peer,
            self._mission_type,
            self._watch,
            rival_patience_s=self._rival_patience_s,
            round_trip=self._round_trip,
            float_form=self._may_be_coarse,
        )
        self._reading.start(now_s)
        self._advance(now_s)

    def _start_pushing(self, items: tuple[MissionItem, ...], window: int, now_s: float) -> None:
        self._read_before = None
        self._reads = 0
        self._upload = Upload(
            self._peer,
            self._mission_type,
            items,
            window=window,
            rival_patience_s=self._rival_patience_s,
            round_trip=self._round_trip,
            most_s=min(bound_s(len(items)), self._limit_s - _READ_RESERVE_S - now_s),
        )
        self._upload.start(now_s)
        self._advance(now_s)

    def _check_vehicle(self, now_s: float) -> None:
        is_known = self._is_active is not None and now_s <= self._active_known_s + _FRESH_S
        if self.state is not VerifiedUploadState.CHECKING_VEHICLE or not is_known:
            return
        if self._is_active and not self._replace_active:
            self._move(VerifiedUploadEvent.NOT_CLEAR)
        elif self._watch.is_disturbed:  # the backup may not be what would be replaced
            self._is_disturbed = True
            if self._backups < _MOST_BACKUPS and self._move(VerifiedUploadEvent.READ_AGAIN):
                self._start_reading(now_s)
            else:
                self._move(VerifiedUploadEvent.OTHERS_WRITE)
        elif self._move(VerifiedUploadEvent.CLEAR_TO_WRITE):
            self._push_wanted(self._window, now_s)

    def _push_wanted(self, window: int, now_s: float) -> None:
        self._pushes += 1
        self._reasons.ask()
        self._start_pushing(self._wanted, window, now_s)

    def _take_push(self, pushed: UploadOutcome, now_s: float) -> None:
        self._reasons.answered(now_s)
        self._pushed_before, self._pushed = self._pushed, pushed
        if self._move(VerifiedUploadEvent.PUSH_ENDED):
            self._start_reading(now_s)

    def _take_read(self, read: DownloadOutcome, now_s: float) -> None:
        if self._is_disturbed:
            self._held = Held.UNKNOWN
            self._move(VerifiedUploadEvent.OTHERS_WRITE)
        elif not read.is_complete:
            self._failed_read = read
            if self.has_written:
                self._held = Held.UNKNOWN
            self._move(VerifiedUploadEvent.READ_FAILED)
        elif self.state is VerifiedUploadState.READING_OLD:
            self._is_coarse = read.is_coarse
            self._may_be_coarse = read.is_coarse or not read.items
            self._take_old(read.items, now_s)
        else:
            self._is_coarse = read.is_coarse
            self._found = read.items
            self._judge(read.items, now_s)

    def _take_old(self, items: tuple[MissionItem, ...], now_s: float) -> None:
        self._old = items
        self._backups += 1
        self._waits_since_s = now_s
        if not self._differences(self._wanted, items):
            self._found = items
            self._held = Held.WANTED
            self._move(VerifiedUploadEvent.READ_WANTED)
        else:
            self._move(VerifiedUploadEvent.READ_OLD)

    def _judge(self, found: tuple[MissionItem, ...], now_s: float) -> None:
        """Decide what a read-back means; anything but the wanted list must be read twice alike before it is believed."""
        restoring = self.state is VerifiedUploadState.READING_RESTORED
        assert self._old is not None
        self._held = held_list(
            found, self._wanted, self._old, self._mission_type, self._lists, coarse=self._is_coarse
        )
        expected = Held.OLD if restoring else Held.WANTED
        if self._held is expected:
            self._move(VerifiedUploadEvent.READ_OLD if restoring else VerifiedUploadEvent.READ_WANTED)
        elif self._read_before is None or self._differences(self._read_before, found):
            self._read_before = found
            if self._reads < _MOST_READS and self._move(VerifiedUploadEvent.READ_AGAIN):
                self._start_reading(now_s)
            elif self._move(VerifiedUploadEvent.READ_UNSTEADY):
                self._held = Held.UNKNOWN
        elif self._held is Held.FOREIGN:
            self._move(VerifiedUploadEvent.READ_FOREIGN)
        elif restoring:
            self._restore_again(now_s)
        else:
            self._push_again(now_s)

    def _push_again(self, now_s: float) -> None:
        """Send the list once more where that can help, else end with the old list there or put back."""
        assert self._old is not None
        pushed = self._pushed
        assert pushed is not None
        refused = pushed.state is UploadState.REFUSED
        settled = is_settled_refusal(pushed, self._pushed_before)
        if settled:
            self._refusal = pushed
        # Somebody may have set it going meanwhile: the whole old list is driven on, a mix is put right all the same.
        drives_old = self._held is Held.OLD and bool(self._is_active) and not self._replace_active
        is_time = now_s < self._begun_s + _LAST_PUSH_S
        may_push = not settled and not drives_old and is_time and self._pushes < MOST_PUSHES
        if may_push and self._move(VerifiedUploadEvent.PUSH_AGAIN):
            self._push_wanted(1 if refused else self._window, now_s)
        elif self._held is Held.OLD:
            self._move(VerifiedUploadEvent.READ_OLD)
        elif not self._may_restore(now_s):
            self._move(VerifiedUploadEvent.NO_TIME_LEFT)
        elif self._move(VerifiedUploadEvent.READ_UNFINISHED):
            self._restore(now_s)

    def _may_restore(self, now_s: float) -> bool:
        return self._restores < MOST_RESTORES and now_s < self._limit_s - 2 * _READ_RESERVE_S

    def _restore(self, now_s: float) -> None:
        assert self._old is not None
        self._restores += 1
        self._start_pushing(self._old, self._window, now_s)

    def _restore_again(self, now_s: float) -> None:
        if self._may_restore(now_s) and self._move(VerifiedUploadEvent.PUSH_AGAIN):
            self._restore(now_s)
        else:
            self._move(VerifiedUploadEvent.READ_UNFINISHED)

    def _differences(
        self, wanted: tuple[MissionItem, ...], found: tuple[MissionItem, ...]
    ) -> tuple[Difference, ...]:
        return differences(wanted, found, self._mission_type, self._lists.form, coarse=self._is_coarse)

    def _shortfall(self) -> str:
        failed = self._failed_read
        return failed.shortfall if failed and failed.state is DownloadState.TOO_SLOW else ""

    def _read_result(self) -> MissionResult | None:
        return self._failed_read.result if self._failed_read else None

    def _kind(self) -> OutcomeKind:
        failed = self._failed_read
        if self.state is VerifiedUploadState.NOT_STARTED:
            if self._is_disturbed:
                return OutcomeKind.BUSY
            if self._problem or (failed and failed.state is DownloadState.REFUSED):
                return OutcomeKind.REFUSED
            if failed and failed.state is DownloadState.BUSY:
                return OutcomeKind.BUSY
            return OutcomeKind.ACTIVE if self._is_active else OutcomeKind.NO_ANSWER
        if self.state in (VerifiedUploadState.UNCHANGED, VerifiedUploadState.RESTORED) and self._refusal:
            return OutcomeKind.REFUSED
        was_busy = self._pushed is not None and self._pushed.state is UploadState.BUSY
        if self.state is VerifiedUploadState.UNCHANGED and was_busy:
            return OutcomeKind.BUSY
        return OutcomeKind(self.state.value)
