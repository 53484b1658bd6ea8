"""Pushing a list of items to the vehicle once, ahead of its requests.

An upload ends with the vehicle's word, not with the truth: `VerifiedUpload` reads back what is really there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages
from mavlink_bridge.mavlink.messages import MissionResult
from mavlink_bridge.protocol.download import PATIENCE_S, RIVAL_PATIENCE_S
from mavlink_bridge.protocol.pace import MOST_S, Pace, bound_s
from mavlink_bridge.protocol.round_trip import RoundTrip
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.transitions import UPLOAD, UploadEvent, UploadState
from mavlink_bridge.protocol.wire import item_to_message, mission_result

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.mavlink.messages import Frame, MissionType
    from mavlink_bridge.protocol.peer import Peer
    from missions.items import MissionItem

# Items pushed ahead, at first and at most (docs/transfers.md, "How fast, and why"): ArduPilot took 500 within 0.04 s when measured.
FIRST_WINDOW = 25
WINDOW = 200

# MISSION_COUNT, where the round trip is not known; ArduPilot repeats its requests as often
_ANNOUNCE_AGAIN_S = 1.0
# Shares of the time after which the vehicle asks again (ArduPilot: 1 s). A request repeated sooner is the same frame arriving twice; so long after the usual
# time it is no first request; and after so long it would have asked again by now.
_ECHO, _ASKED_AGAIN, _PROBE_AFTER = 0.25, 0.9, 2.0
_MOST_PROBE_AFTER_S = 2.0
_QUEUE_S = 0.5  # so long an answer may be late before the link counts as full
_PROBE_END_AFTER_S = 1.2
_SOON_S = 0.4
"""The least of both where it is known how long answers take on this link."""

_GIVEN_UP = (
    0.75  # of the time after which the vehicle gives an upload up (ArduPilot: 8 s): its messages may be late
)
_ERRORS_BELIEVED = 3
"""Answers of ERROR without progress, where that may also answer a repeated MISSION_COUNT or a late item; chosen, not measured."""
_LEAST_DOUBT_S, _MOST_DOUBT_S = 0.15, 2.0  # between two of them; chosen, not measured

# Bounds of the time in which frames that overtook one another still come in. Chosen, not measured.
_LEAST_SETTLE_S = 0.03
_MOST_SETTLE_S = 1.0


@dataclass(frozen=True, slots=True)
class UploadOutcome:
    """How one push ended.

    Parameters
    ----------
    state : UploadState
        ACCEPTED, REFUSED, BUSY (another ground station kept writing) or UNCONFIRMED (no final word came).
    result : MissionResult, optional
        What the vehicle refused or cancelled with.
    item : int, optional
        The item it refused: the last it had asked for; None if it refused the list as a whole.
    item_is_certain : bool
        No other item was under way when the refusal came.
    """

    state: UploadState
    result: MissionResult | None = None
    item: int | None = None
    item_is_certain: bool = True


class Upload(TableMachine[UploadState, UploadEvent]):
    """Pushes one list; the outcome is None until `is_done`.

    The items go out in order ahead of the requests, in a window that grows while requests keep up. When the vehicle reports
    INVALID_SEQUENCE and then stops asking for new items, one is missing: the push goes on from the item it asked for, with a window
    of one. Every repeated request is answered. Only MISSION_COUNT and list requests are repeated on our own timer.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    mission_type : MissionType
        Which list.
    items : sequence of MissionItem
        The list as it goes over the wire, for missions with the home item at 0.
    window : int
        Most items ahead of the requests; 1 serves the vehicle one by one.
    rival_patience_s : float
        How long another ground station may keep the list busy.
    round_trip : RoundTrip, optional
        What is known of the link from transfers before.
    most_s : float
        The longest it may take, `pace.MOST_S` if not given.
    """

    # Many attributes: what the mission protocol has a writer remember: window, requests heard, when each is repeated and given up.

    def __init__(
        self,
        peer: Peer,
        mission_type: MissionType,
        items: Sequence[MissionItem],
        *,
        window: int = WINDOW,
        rival_patience_s: float = RIVAL_PATIENCE_S,
        round_trip: RoundTrip | None = None,
        most_s: float = MOST_S,
    ) -> None:
        super().__init__(UPLOAD, UploadState.IDLE)
        self._peer = peer
        self._lists = peer.autopilot.lists
        self._mission_type = mission_type
        self._messages = [item_to_message(item, seq, peer, mission_type) for seq, item in enumerate(items)]
        self._most_ahead = window
        self._window = float(min(window, FIRST_WINDOW))
        self._threshold = float(window)
        self._is_recovering = False
        self._run_from = 0
        self._rival_patience_s = rival_patience_s
        self._round_trip = round_trip or RoundTrip()
        self._wanted = -1  # the item the vehicle asked for last
        self._next = 0  # the item to push next
        self._most_sent = 0
        self._sent_s: dict[int, float] = {}
        self._repeated: set[int] = set()
        self._result: MissionResult | None = None
        self._heard_s = 0.0
        self._announced_s = 0.0
        self._act_at_s = 0.0
        self._gap_at_s: float | None = None
        self._advanced_s = math.inf  # when another item was asked for
        self._asked_s = -math.inf  # when the item wanted was last asked for
        self._rival_since_s: float | None = None
        self._errors = 0
        self._next_error_s = -math.inf
        self._pace = Pace(most_s)

    @property
    def outcome(self) -> UploadOutcome | None:
        """How it ended; None while it runs."""
        if not self.is_done:
            return None
        if self.state is not UploadState.REFUSED:
            return UploadOutcome(self.state, self._result)
        item = self._wanted if self._wanted >= 0 else None
        is_certain = item is None or self._most_ahead == 1 or self._next <= item + 1
        return UploadOutcome(self.state, self._result, item, is_certain)

    @property
    def progress(self) -> tuple[int, int]:
        """Items asked for and items in all."""
        count = len(self._messages)
        return (count if self.state is UploadState.ACCEPTED else max(self._wanted, 0)), count

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end, whatever the link does."""
        return bound_s(len(self._messages))

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        if self.is_done or self.state is UploadState.IDLE:
            return None
        if self.state is UploadState.WAITING:
            return min(self._act_at_s, self._pace.deadline_s)
        due_s = min(self._act_at_s, self._heard_s + PATIENCE_S, self._pace.deadline_s)
        return due_s if self._gap_at_s is None else min(due_s, self._gap_at_s)

    def start(self, now_s: float) -> None:
        """Announce the list."""
        if self._move(UploadEvent.START):
            self._heard_s = now_s
            self._pace.start(now_s)
            self._announced_s = now_s
            self._announce(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        if self.is_done or not self._peer.accepts(frame, self._mission_type):
            return
        message = frame.message
        if isinstance(message, messages.MissionRequest | messages.MissionRequestInt):
            self._take_request(message.seq, now_s)
        elif isinstance(message, messages.MissionAck):
            self._take_ack(message.type, now_s)
        elif isinstance(message, messages.MissionCount):
            self._move(UploadEvent.COUNT)

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        if self.is_done or self.state is UploadState.IDLE:
            return
        is_waiting = self.state is UploadState.WAITING
        if self._pace.is_over(now_s) or (not is_waiting and now_s >= self._heard_s + PATIENCE_S):
            if self._move(UploadEvent.SILENCE):
                self._let_go()
            else:
                self._move(UploadEvent.RIVAL_STAYS)
            return
        if self._gap_at_s is not None and now_s >= self._gap_at_s:
            self._fill_gap(now_s)
        if now_s < self._act_at_s:
            return
        if self.state is UploadState.SENDING:
            self._probe(now_s)
        elif is_waiting and self._rival_stays(now_s):
            self._move(UploadEvent.RIVAL_STAYS)
        else:
            if self._move(UploadEvent.RETRY):
                self._heard_s = self._announced_s = now_s
            self._announce(now_s)

    def _rival_stays(self, now_s: float) -> bool:
        return self._rival_since_s is not None and now_s >= self._rival_since_s + self._rival_patience_s

    def _let_go(self) -> None:
        """End what we began on a vehicle that heeds it: else it is busy for everybody until it gives up."""
        if self._lists.heeds_cancel:
            self._send(
                messages.MissionAck(
                    self._peer.system,
                    self._peer.component,
                    MissionResult.OPERATION_CANCELLED,
                    int(self._mission_type),
                )
            )

    def _announce(self, now_s: float) -> None:
        least_s = _SOON_S if self._round_trip.is_known else _ANNOUNCE_AGAIN_S
        self._act_at_s = now_s + self._round_trip.timeout_s(least_s, 2 * _ANNOUNCE_AGAIN_S)
        self._send(
            messages.MissionCount(
                self._peer.system, self._peer.component, len(self._messages), int(self._mission_type)
            )
        )

    def _probe(self, now_s: float) -> None:
        """Find out how it stands: ask for the list, which a vehicle that still takes items denies, or send the item again that is waited for."""
        self._act_at_s = now_s + self._probe_after_s()
        if self._lists.asked_by_item:
            self._push_item(self._wanted, now_s)
            return
        self._send(
            messages.MissionRequestList(self._peer.system, self._peer.component, int(self._mission_type))
        )

    def _take_request(self, seq: int, now_s: float) -> None:
        if not 0 <= seq < len(self._messages) or not self._move(UploadEvent.REQUEST):
            return
        self._heard_s = now_s
        self._pace.advance(seq, now_s)
        if self._wanted < 0:
            self._round_trip.guess(now_s - self._announced_s)
        if seq != self._wanted:
            self._advanced_s = now_s
        self._rival_since_s = None
        if seq > self._wanted:
            self._errors = 0
            self._keep_up(seq, now_s)
        elif self._is_asked_again(seq, now_s):
            # Asked again, or from the front after a second MISSION_COUNT: this one is wanted, whatever came before.
            self._wanted = seq
            if now_s >= self._answered_at_s():
                self._narrow_window()
            self._push_item(seq, now_s)
        if seq == self._wanted:
            self._asked_s = now_s
        self._push(now_s)
        self._act_at_s = now_s + self._probe_after_s()

    def _is_asked_again(self, seq: int, now_s: float) -> bool:
        """Return whether a request for the item wanted is no echo of one before."""
        again_s = self._lists.asks_again_s
        last_s = max(self._sent_s.get(seq, -math.inf), self._asked_s)
        # A vehicle that asks again before an answer can have come asks of an item that is on its way.
        is_hasty = again_s < self._round_trip.mean_s and now_s < self._answered_at_s()
        return not is_hasty and now_s - last_s >= _ECHO * again_s

    def _probe_after_s(self) -> float:
        """Return the silence after which to ask: shorter when only the final ACK is missing."""
        at_end = self._wanted == len(self._messages) - 1
        if not at_end:
            return max(
                _PROBE_AFTER * self._lists.asks_again_s, min(2 * self._round_trip.mean_s, _MOST_PROBE_AFTER_S)
            )
        least_s = _SOON_S if self._round_trip.is_known else _PROBE_END_AFTER_S
        return max(least_s, 2 * self._round_trip.mean_s)

    def _keep_up(self, seq: int, now_s: float) -> None:
        """Follow the vehicle to a later item."""
        again_s = _ASKED_AGAIN * self._lists.asks_again_s
        late_s = self._sent_s.get(seq, now_s) + self._round_trip.mean_s + again_s
        is_repeat = seq < self._next and now_s >= late_s  # its first request was lost, and so was the item
        is_full = not is_repeat and self._measure(seq - 1, now_s)
        self._grow_window(seq - self._wanted, is_full=is_full)
        self._wanted = seq
        self._gap_at_s = None
        if is_repeat:
            self._narrow_window()
            self._next = seq
        self._next = max(self._next, seq)

    def _measure(self, seq: int, now_s: float) -> bool:
        """Take the time in which an item sent once was answered; return whether so long that it has waited in a queue."""
        if seq not in self._sent_s or seq in self._repeated:
            return False
        took_s = now_s - self._sent_s[seq]
        self._round_trip.observe(took_s)
        return took_s > self._round_trip.least_s + _QUEUE_S

    def _grow_window(self, steps: int, *, is_full: bool) -> None:
        if is_full:  # a longer queue would only make repairs late
            self._threshold = max((self._threshold if self._is_recovering else self._window) / 2, 1.0)
        if self._is_recovering:
            self._window = self._threshold
        elif not is_full:
            self._window += steps if self._window < self._threshold else steps / self._window
        self._window = min(self._window, self._most_ahead)
        self._is_recovering = False

    def _push(self, now_s: float) -> None:
        end = min(self._wanted + int(self._window), len(self._messages))
        while self._next < end:
            self._push_item(self._next, now_s)
            self._next += 1

    def _push_item(self, seq: int, now_s: float) -> None:
        if seq in self._sent_s:
            self._repeated.add(seq)
        self._sent_s[seq] = now_s
        self._most_sent = max(self._most_sent, seq + 1)
        self._send(self._messages[seq])

    def _narrow_window(self) -> None:
        if not self._is_recovering:
            run = self._wanted - self._run_from  # what got through at a stretch is what the link bears
            self._threshold = max(self._window / 2, min(run, self._most_ahead), 1.0)
            self._run_from = self._wanted
        self._window = 1.0
        self._is_recovering = True

    def _take_ack(self, result_number: int, now_s: float) -> None:
        result = mission_result(result_number)
        if result is None:
            return
        if result is MissionResult.ACCEPTED:
            if self._most_sent == len(self._messages):  # else it is not about this list
                self._move(UploadEvent.ACCEPTED)
        elif result is MissionResult.INVALID_SEQUENCE:
            if self._move(UploadEvent.OUT_OF_SEQUENCE):
                self._heard_s = now_s
                self._suspect_gap(now_s)
        elif self._is_busy(result):
            if self._move(UploadEvent.DENIED) and self.state is UploadState.WAITING:
                self._rival_since_s = now_s if self._rival_since_s is None else self._rival_since_s
                self._act_at_s = now_s + _ANNOUNCE_AGAIN_S
                self._let_go()  # what it is busy with may be ours, of which it did not hear the end
        elif not self._is_in_doubt(result, now_s):
            # After so long a stall the vehicle has given up, and ERROR only means that it waits for no item.
            given_up_s = self._advanced_s + _GIVEN_UP * self._lists.gives_up_after_s
            has_given_up = result is MissionResult.ERROR and now_s >= given_up_s
            is_cancelled = result is MissionResult.OPERATION_CANCELLED or has_given_up
            if self._move(UploadEvent.CANCELLED if is_cancelled else UploadEvent.REFUSAL):
                self._result = result
                self._let_go()

    def _is_busy(self, result: MissionResult) -> bool:
        """Return whether an answer says that the vehicle is busy; ERROR says so only to MISSION_COUNT."""
        is_error = result is MissionResult.ERROR
        return result in self._lists.busy and not (is_error and self.state is UploadState.SENDING)

    def _is_in_doubt(self, result: MissionResult, now_s: float) -> bool:
        """Return whether an answer may be about something else, and the upload go on: then the item waited for is sent again, which shows it."""
        if result not in self._lists.busy:
            return False
        if now_s >= self._next_error_s:
            self._errors += 1
            doubt_s = self._round_trip.timeout_s(_LEAST_DOUBT_S, _MOST_DOUBT_S)
            self._next_error_s = now_s + doubt_s
            self._act_at_s = min(self._act_at_s, self._next_error_s)
        return self._errors < _ERRORS_BELIEVED

    def _suspect_gap(self, now_s: float) -> None:
        """Wait until it is clear whether an item is missing, or a frame only came twice or late."""
        if self._gap_at_s is None and self._next > self._wanted + 1:
            settle_s = 4 * self._round_trip.variation_s
            begins_s = max(now_s, self._answered_at_s())
            self._gap_at_s = begins_s + min(max(settle_s, _LEAST_SETTLE_S), _MOST_SETTLE_S)

    def _answered_at_s(self) -> float:
        """Return when the item wanted, as last sent, is answered; what is heard before is about copies sent before."""
        return self._sent_s.get(self._wanted, -math.inf) + self._round_trip.mean_s

    def _fill_gap(self, now_s: float) -> None:
        self._gap_at_s = None
        self._narrow_window()
        self._next = self._wanted
        self._push(now_s)
