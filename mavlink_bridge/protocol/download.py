"""Reading a list of items from the vehicle, several requests in flight."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages
from mavlink_bridge.mavlink.messages import MissionResult, MissionType
from mavlink_bridge.mavlink.stored_form import is_same_item
from mavlink_bridge.protocol.pace import MOST_S, Pace, bound_s
from mavlink_bridge.protocol.round_trip import RoundTrip
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.transitions import DOWNLOAD, DownloadEvent, DownloadState
from mavlink_bridge.protocol.wire import item_from_message, mission_result

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.peer import Peer
    from missions.items import MissionItem

FIRST_WINDOW = 50
WINDOW = 100
"""Requests in flight: ArduPilot is fastest with 50 to 100 and loses requests at 500."""

# Of silence (a vehicle gives up after 8 s), and of a rival station that keeps the list (docs/transfers.md, "Patience").
PATIENCE_S = 10.0
RIVAL_PATIENCE_S = 30.0
_ASK_AGAIN_S = 0.5  # for the list's length, and to check it; chosen, not measured
_RIVAL_AGAIN_S = 1.0  # after DENIED; chosen, not measured
_REFUSALS_BELIEVED = 3  # alike, as one may be a late copy; chosen, not measured
_STALE_PATIENCE_S = 30.0  # a refusal about items may answer a transfer before; chosen, not measured
_OUT_OF_ORDER = (MissionResult.ERROR, MissionResult.INVALID_SEQUENCE)
_MOST_COPIES = 3
"""So often each request is said at the most, to a vehicle that takes the next one for a wrong one where one is lost: at a loss of 10 % each way all three copies
of one of 17 fail once in nine readings. Chosen."""
_OVERTAKEN_BY = 3  # so many later answers mean lost, not reordered; chosen, not measured
# The old request is tried after so long without an answer to the exact one. Chosen, not measured.
_FLOAT_FORM_AFTER_S = 6.0
_DOUBT_S = 8.0
"""So long the exact form is asked for before a list in the old form is believed: it may only have been lost."""
# Bounds of the timeout that the measured round trip gives. Chosen, not measured.
_LEAST_OVERDUE_S = 0.15
_MOST_OVERDUE_S = 2.0


@dataclass(frozen=True, slots=True)
class DownloadOutcome:
    """How a download ended.

    Parameters
    ----------
    state : DownloadState
        COMPLETE, REFUSED, BUSY (another ground station kept writing), SILENT or TOO_SLOW.
    items : tuple of MissionItem
        The list as the vehicle holds it, for missions with the home item at 0; empty unless complete.
    result : MissionResult, optional
        What the vehicle refused with.
    is_coarse : bool
        The vehicle gave positions as 32-bit floats (MISSION_ITEM), up to 1 m off.
    is_contradicted : bool
        An item came twice and was another one the second time: the list changed while it was read.
    count : int
        How many items the vehicle announced.
    received : int
        How many of them came.
    took_s : float
        How long it took.
    """

    state: DownloadState
    items: tuple[MissionItem, ...] = ()
    result: MissionResult | None = None
    is_coarse: bool = False
    is_contradicted: bool = False
    count: int = 0
    received: int = 0
    took_s: float = 0.0

    @property
    def is_complete(self) -> bool:
        """Whether the whole list arrived."""
        return self.state is DownloadState.COMPLETE

    @property
    def shortfall(self) -> str:
        """How far a download came that the vehicle did not finish, in words."""
        if self.state is not DownloadState.TOO_SLOW:
            return "the vehicle stopped answering"
        return (
            f"the vehicle announced {self.count} items and sent {self.received} in {self.took_s:.0f} s; "
            f"a list may take {bound_s(self.count):.0f} s"
        )


@dataclass(slots=True)
class _ItemRequest:
    order: int
    sent_s: float
    is_repeat: bool


class Download(TableMachine[DownloadState, DownloadEvent]):
    """Reads one list; the outcome is None until `is_done`.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    mission_type : MissionType
        Which list.
    window : int
        Most requests in flight; 1 for vehicles that want them one by one.
    rival_patience_s : float
        How long another ground station may keep the list busy.
    round_trip : RoundTrip, optional
        What is known of the link from transfers before.
    most_s : float
        The longest it may take, `pace.MOST_S` if not given.
    float_form : bool
        Whether a vehicle that answers no MISSION_REQUEST_INT is asked by the old MISSION_REQUEST, which gives coarse positions.
    """

    # Many attributes: what the mission protocol has a reader remember: window, items, requests under way, when each is repeated and given up.

    def __init__(
        self,
        peer: Peer,
        mission_type: MissionType,
        *,
        window: int = WINDOW,
        rival_patience_s: float = RIVAL_PATIENCE_S,
        round_trip: RoundTrip | None = None,
        most_s: float = MOST_S,
        float_form: bool = True,
    ) -> None:
        super().__init__(DOWNLOAD, DownloadState.IDLE)
        self._peer = peer
        self._lists = peer.autopilot.lists
        self._mission_type = mission_type
        self._most_in_flight = window
        self._window = float(min(window, FIRST_WINDOW))
        self._copies = 1  # of each request
        self._rival_patience_s = rival_patience_s
        self._round_trip = round_trip or RoundTrip()
        self._count = 0
        self._most_count = 0
        self._items: dict[int, MissionItem] = {}
        self._in_flight: dict[int, _ItemRequest] = {}  # in order of sending
        self._next = 0
        self._orders = 0
        self._newest_answered = 0
        self._refusals = 0
        self._refusal_counts = False
        self._checks = 0
        self._checked_s = -math.inf
        self._result: MissionResult | None = None
        self._may_use_floats = float_form and self._lists.has_float_form
        self._float_form = False
        self._coarse_seqs: set[int] = set()
        self._believed_at_s: float | None = None  # when a whole list in the old form will be
        self._heard_s = 0.0
        self._counting_since_s = 0.0
        self._fetching_since_s = 0.0
        self._act_at_s = 0.0
        self._rival_since_s: float | None = None
        self._begun_s = self._ended_s = 0.0
        self._advanced_s = 0.0  # when the count, or an item that was not there, came
        self._doubted_at_s: float | None = (
            None  # when an ERROR without any item since is believed to be the transfer's end
        )
        self._pace = Pace(most_s)
        self._is_contradicted = False

    @property
    def outcome(self) -> DownloadOutcome | None:
        """How it ended; None while it runs."""
        if not self.is_done:
            return None
        items = (
            tuple(self._items[seq] for seq in range(self._count))
            if self.state is DownloadState.COMPLETE
            else ()
        )
        result = self._result if self.state is DownloadState.REFUSED else None
        return DownloadOutcome(
            self.state,
            items,
            result,
            is_coarse=bool(self._coarse_seqs),
            is_contradicted=self._is_contradicted,
            count=self._count,
            received=len(self._items),
            took_s=self._ended_s - self._begun_s,
        )

    @property
    def progress(self) -> tuple[int, int]:
        """Items read and items in all."""
        return len(self._items), self._count

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end, whatever the link and the vehicle do; less once the count is known."""
        return bound_s(self._most_count) if self._most_count else MOST_S

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        if self.is_done or self.state is DownloadState.IDLE:
            return None
        if self.state is DownloadState.FETCHING:
            due_s = min(self._overdue_at_s(), self._heard_s + PATIENCE_S, self._pace.deadline_s)
            if self._doubted_at_s is not None:
                due_s = min(due_s, self._doubted_at_s)
            return due_s if self._believed_at_s is None else min(due_s, self._believed_at_s)
        return min(self._act_at_s, self._pace.deadline_s)

    def start(self, now_s: float) -> None:
        """Ask how many items there are."""
        if self._move(DownloadEvent.START):
            self._heard_s = self._begun_s = self._counting_since_s = now_s
            self._pace.start(now_s)
            self._ask_count(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        if self.is_done or not self._peer.accepts(frame, self._mission_type):
            return
        self._ended_s = now_s
        message = frame.message
        if isinstance(message, messages.MissionItemInt | messages.MissionItem):
            self._take_item(message, now_s)
        elif isinstance(message, messages.MissionCount):
            self._take_count(message.count, now_s)
        elif isinstance(message, messages.MissionAck):
            self._take_ack(message.type, now_s)
        elif isinstance(message, messages.Statustext):
            self._take_text(message.text, now_s)

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        if self.is_done or self.state is DownloadState.IDLE:
            return
        self._ended_s = now_s
        is_waiting = self.state is DownloadState.WAITING
        if not is_waiting and now_s >= self._heard_s + PATIENCE_S:
            if self._move(DownloadEvent.SILENCE):
                self._let_go()
        elif self._pace.is_over(now_s) or self._is_hopeless(now_s):
            self._give_up()
        elif self.state is DownloadState.FETCHING:
            if self._believed_at_s is not None and now_s >= self._believed_at_s:
                self._finish()
            elif self._lists.in_order:
                self._repeat_in_order(now_s)
            else:
                self._repeat_overdue(now_s)
        elif now_s >= self._act_at_s:
            if is_waiting and not self._rival_may_go_on(now_s):
                self._move(DownloadEvent.RIVAL_STAYS)
                return
            if self._move(DownloadEvent.RETRY):
                self._heard_s = self._counting_since_s = now_s
            self._ask_count(now_s)

    def _give_up(self) -> None:
        for event in (DownloadEvent.TIME_IS_UP, DownloadEvent.RIVAL_STAYS, DownloadEvent.SILENCE):
            if self._move(event):
                self._let_go()
                return

    def _let_go(self) -> None:
        """End what we began on a vehicle that heeds it: else it is busy for everybody until it gives up."""
        if self._lists.heeds_cancel:
            self._end_transfer(MissionResult.OPERATION_CANCELLED)

    def _is_hopeless(self, now_s: float) -> bool:
        if self.state is not DownloadState.FETCHING:
            return False
        return self._pace.is_hopeless(len(self._items), self._count, self._fetching_since_s, now_s)

    def _rival_may_go_on(self, now_s: float) -> bool:
        return self._rival_since_s is None or now_s < self._rival_since_s + self._rival_patience_s

    def _ask_count(self, now_s: float) -> None:
        self._act_at_s = now_s + _ASK_AGAIN_S
        self._refusal_counts = True
        self._send(
            messages.MissionRequestList(
                self._peer.system, self._peer.component, mission_type=int(self._mission_type)
            )
        )

    def _take_count(self, count: int, now_s: float) -> None:
        if self.state is DownloadState.FETCHING and count == self._count:
            return
        was_counting = self.state is DownloadState.COUNTING
        event = DownloadEvent.COUNT if count else DownloadEvent.COUNT_ZERO
        if not self._move(event):
            return
        if was_counting:
            self._round_trip.guess(now_s - self._counting_since_s)
        self._heard_s = self._fetching_since_s = self._advanced_s = now_s
        self._rival_since_s = None
        self._refusals = 0
        self._count = count
        self._most_count = max(self._most_count, count)
        self._is_contradicted = False
        self._forget_items()
        if self.is_done:
            self._thank()
        else:
            self._fill_window(now_s)

    def _forget_items(self) -> None:
        self._items.clear()
        self._in_flight.clear()
        self._coarse_seqs.clear()
        self._believed_at_s = self._doubted_at_s = None
        self._next = 0

    def _take_item(self, message: messages.MissionItemInt | messages.MissionItem, now_s: float) -> None:
        is_coarse = isinstance(message, messages.MissionItem)
        if self.state is not DownloadState.FETCHING or not 0 <= message.seq < self._count:
            return
        if is_coarse and not self._may_use_floats:
            return
        if self._lists.in_order and message.seq >= self._next:  # of a reading before this one
            return
        self._heard_s = now_s
        request = self._in_flight.pop(message.seq, None)
        if request is not None:
            self._newest_answered = max(self._newest_answered, request.order)
            if not request.is_repeat:
                self._round_trip.observe(now_s - request.sent_s)
        if not is_coarse:
            self._forget_coarse(now_s)
        if message.seq in self._items:
            self._compare_again(message)
            return
        self._items[message.seq] = item_from_message(message)
        self._advanced_s, self._doubted_at_s = now_s, None
        self._pace.advance(len(self._items), now_s)
        if is_coarse:
            self._coarse_seqs.add(message.seq)
        self._window = min(self._window + 1.0, self._most_in_flight)
        if len(self._items) == self._count:
            if self._coarse_seqs:
                self._doubt(now_s)
            else:
                self._finish()
            return
        if not self._lists.in_order:
            self._repeat_overtaken(now_s)
        self._fill_window(now_s)

    def _compare_again(self, message: messages.MissionItemInt | messages.MissionItem) -> None:
        """Notice that an item that came before is another one now; home moves by itself."""
        form = self._lists.form
        is_home = message.seq < form.first_compared(self._mission_type)
        is_coarse = isinstance(message, messages.MissionItem) or message.seq in self._coarse_seqs
        before, again = self._items[message.seq], item_from_message(message)
        if not is_home and not is_same_item(before, again, self._mission_type, form, coarse=is_coarse):
            self._is_contradicted = True

    def _finish(self) -> None:
        self._move(DownloadEvent.ALL_ITEMS)
        self._thank()

    def _doubt(self, now_s: float) -> None:
        """Ask for the exact form once more, of everything."""
        self._believed_at_s = now_s + _DOUBT_S
        self._float_form = False
        for seq in sorted(self._coarse_seqs)[: int(self._window)]:
            self._request(seq, now_s, is_repeat=True)

    def _forget_coarse(self, now_s: float) -> None:
        """Use the exact form from now on: the vehicle knows it."""
        self._may_use_floats = self._float_form = False
        self._believed_at_s = None
        if self._coarse_seqs:
            for seq in self._coarse_seqs:
                del self._items[seq]
            self._coarse_seqs.clear()
            self._next = 0
            self._fill_window(now_s)

    def _take_ack(self, result_number: int, now_s: float) -> None:
        result = mission_result(result_number)
        if result is MissionResult.DENIED:
            self._wait_for_rival(now_s)
        elif self.state is DownloadState.COUNTING and result not in (None, MissionResult.ACCEPTED):
            self._take_refusal(result, now_s)
        elif self.state is DownloadState.FETCHING and result in _OUT_OF_ORDER:
            if self._lists.in_order:
                self._doubted_at_s = now_s + self._overdue_s()
            else:
                self._check_list(now_s)

    def _take_text(self, text: str, now_s: float) -> None:
        """Take a text that is all the answer of a busy vehicle."""
        busy = self._peer.autopilot.texts.busy
        if busy is not None and self.state is DownloadState.COUNTING and text.lower().startswith(busy):
            self._wait_for_rival(now_s)

    def _wait_for_rival(self, now_s: float) -> None:
        if self._move(DownloadEvent.DENIED):
            self._rival_since_s = now_s if self._rival_since_s is None else self._rival_since_s
            self._act_at_s = now_s + _RIVAL_AGAIN_S

    def _take_refusal(self, result: MissionResult, now_s: float) -> None:
        """Count a refusal, once for each time we asked; the same one has to come again and again.

        ERROR and INVALID_SEQUENCE also answer items pushed before, which a narrow link may carry long after: they are believed late.
        """
        is_about_items = result in _OUT_OF_ORDER
        if is_about_items:
            self._heard_s = now_s
        if not self._refusal_counts:
            return
        self._refusal_counts = False
        self._refusals = self._refusals + 1 if result is self._result else 1
        self._result = result
        patience_s = _STALE_PATIENCE_S if is_about_items else 0.0
        if self._refusals >= _REFUSALS_BELIEVED and now_s >= self._counting_since_s + patience_s:
            self._move(DownloadEvent.REFUSAL)

    def _check_list(self, now_s: float) -> None:
        """Find out what an error meant: a shorter list, an answer to items pushed before, or a vehicle that wants requests in order."""
        if now_s < self._checked_s + _ASK_AGAIN_S:
            return
        self._checked_s = now_s
        self._checks += 1
        if self._checks >= _REFUSALS_BELIEVED and self._most_in_flight > 1:
            self._begin_anew(now_s)
        else:
            self._ask_count(now_s)

    def _begin_anew(self, now_s: float) -> None:
        """Read the list from its beginning: where the last item may be asked for once more, with each request said more often, in the end an item at a time."""
        if self._lists.in_order and self._copies < _MOST_COPIES and self._most_in_flight > 1:
            self._copies += 1
        else:
            self._copies, self._most_in_flight, self._window = 1, 1, 1.0
        self._forget_items()
        self._move(DownloadEvent.LIST_CHANGED)
        self._counting_since_s = now_s
        self._ask_count(now_s)

    def _fill_window(self, now_s: float) -> None:
        while self._next < self._count and len(self._in_flight) < int(self._window):
            if self._next not in self._items and self._next not in self._in_flight:
                self._request(self._next, now_s, is_repeat=False)
            self._next += 1

    def _request(self, seq: int, now_s: float, *, is_repeat: bool) -> None:
        self._orders += 1
        self._in_flight[seq] = _ItemRequest(self._orders, now_s, is_repeat)
        message_class = messages.MissionRequest if self._float_form else messages.MissionRequestInt
        for _ in range(self._copies):
            self._send(message_class(self._peer.system, self._peer.component, seq, int(self._mission_type)))

    def _repeat(self, seqs: list[int], now_s: float) -> None:
        for seq in seqs:
            del self._in_flight[seq]
            self._request(seq, now_s, is_repeat=True)

    def _repeat_overtaken(self, now_s: float) -> None:
        """Ask again for items whose later-asked neighbours have come."""
        overtaken = []
        for seq, request in self._in_flight.items():
            if request.order > self._newest_answered - _OVERTAKEN_BY:
                break
            if now_s - request.sent_s >= self._round_trip.mean_s:
                overtaken.append(seq)
        self._repeat(overtaken, now_s)

    def _overdue_at_s(self) -> float:
        """Return the time at which the oldest request counts as lost: long after it and after anything that came since."""
        oldest = next(iter(self._in_flight.values()))
        return max(oldest.sent_s, self._heard_s) + self._overdue_s()

    def _overdue_s(self) -> float:
        return self._round_trip.timeout_s(_LEAST_OVERDUE_S, _MOST_OVERDUE_S)

    def _repeat_in_order(self, now_s: float) -> None:
        """Ask again for the last item asked for, which is all that may be asked for again; where others are missing, begin anew.

        The vehicle has ended the transfer, too, where a request of ours came twice or late: its ERROR shows it, or its silence for as long as it waits.
        """
        is_doubted = self._doubted_at_s is not None and now_s >= self._doubted_at_s
        has_ended = is_doubted or now_s >= self._advanced_s + self._lists.gives_up_after_s
        if not has_ended and now_s < self._overdue_at_s():
            return
        if has_ended or list(self._in_flight) != [self._next - 1]:
            self._begin_anew(now_s)
        else:
            self._copies, self._most_in_flight, self._window = 1, 1, 1.0
            self._repeat([self._next - 1], now_s)

    def _repeat_overdue(self, now_s: float) -> None:
        if now_s < self._overdue_at_s():
            return
        if self._may_use_floats and not self._items and now_s >= self._fetching_since_s + _FLOAT_FORM_AFTER_S:
            self._float_form = not self._float_form  # old vehicles answer only the old request
        self._window = max(self._window / 2, min(5.0, self._most_in_flight))
        overdue_s = self._overdue_s()
        overdue = [seq for seq, request in self._in_flight.items() if now_s >= request.sent_s + overdue_s]
        self._repeat(overdue, now_s)

    def _thank(self) -> None:
        self._end_transfer(MissionResult.ACCEPTED)

    def _end_transfer(self, result: MissionResult) -> None:
        peer = self._peer
        self._send(messages.MissionAck(peer.system, peer.component, result, int(self._mission_type)))
