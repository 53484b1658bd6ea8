"""Reading a list until nobody else was heard to write it meanwhile.

An item that is replaced after it was read is not seen in what was read. So a reading during which somebody else wrote (`WriteWatch`), or in which one
item came twice and not alike, proves nothing: it is waited until the link has been quiet about the list for a while, then the list is read again, whole.
If others go on writing, the reading ends disturbed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.protocol.download import RIVAL_PATIENCE_S, Download
from mavlink_bridge.protocol.pace import MOST_S
from mavlink_bridge.protocol.round_trip import RoundTrip
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.transitions import (
    UNDISTURBED_READ,
    DownloadState,
    UndisturbedReadEvent,
    UndisturbedReadState,
)
from mavlink_bridge.protocol.write_watch import WriteWatch

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame, MissionType
    from mavlink_bridge.protocol.download import DownloadOutcome
    from mavlink_bridge.protocol.peer import Peer

MOST_READS = 4  # chosen, not measured: bounds the time where others keep writing
_QUIET_S = 1.5
"""ArduPilot asks a writer again every second: quiet for longer, it is not being written to. What was sent twice has arrived by then, too."""


class UndisturbedRead(TableMachine[UndisturbedReadState, UndisturbedReadEvent]):
    """Reads one list; the outcome is None until `is_done`.

    Parameters
    ----------
    peer : Peer
        The vehicle and our identity.
    mission_type : MissionType
        Which list.
    watch : WriteWatch, optional
        Is shown every frame by whoever runs this machine; one of its own if not given.
    rival_patience_s : float
        How long another ground station may keep the list busy, or be waited for between two reads.
    round_trip : RoundTrip, optional
        What is known of the link from transfers before.
    most_s : float
        The longest all reads may take together.
    float_form : bool
        Whether the old MISSION_REQUEST may be used.
    """

    def __init__(
        self,
        peer: Peer,
        mission_type: MissionType,
        watch: WriteWatch | None = None,
        *,
        rival_patience_s: float = RIVAL_PATIENCE_S,
        round_trip: RoundTrip | None = None,
        most_s: float = MOST_S,
        float_form: bool = True,
    ) -> None:
        super().__init__(UNDISTURBED_READ, UndisturbedReadState.IDLE)
        self._peer = peer
        self._mission_type = mission_type
        self._has_own_watch = watch is None
        self._watch = watch or WriteWatch(peer, mission_type)
        self._rival_patience_s = rival_patience_s
        self._round_trip = round_trip or RoundTrip()
        self._most_s = most_s
        self._float_form = float_form
        self._download: Download | None = None
        self._read: DownloadOutcome | None = None
        self._reads = 0
        self._limit_s = 0.0
        self._settled_at_s = 0.0
        self._settle_until_s = 0.0

    @property
    def outcome(self) -> DownloadOutcome | None:
        """How the last read ended; None while this runs. A disturbed one shows nothing of what is there."""
        return self._read if self.is_done else None

    @property
    def is_disturbed(self) -> bool:
        """Whether it ended because others keep writing."""
        return self.state is UndisturbedReadState.DISTURBED

    @property
    def progress(self) -> tuple[int, int]:
        """Items read and items in all."""
        if self._download is not None:
            return self._download.progress
        return (self._read.received, self._read.count) if self._read is not None else (0, 0)

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end, whatever the link and the vehicle do."""
        return self._most_s

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        if self.state is UndisturbedReadState.SETTLING:
            return min(self._settled_at_s, self._settle_until_s)
        return self._download.deadline_s if self._download is not None else None

    def start(self, now_s: float) -> None:
        """Begin to read."""
        if self._move(UndisturbedReadEvent.START):
            self._limit_s = now_s + self._most_s
            self._start_reading(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; what is not for this machine is ignored."""
        if self._has_own_watch:
            self._watch.look(frame, now_s)
        if self.state is UndisturbedReadState.SETTLING:
            self._settle(now_s)
        elif self._download is not None:
            self._download.receive(frame, now_s)
            self._advance(now_s)

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        if self.state is UndisturbedReadState.SETTLING:
            self._settle(now_s)
        elif self._download is not None:
            self._download.handle_timer(now_s)
            self._advance(now_s)

    def _start_reading(self, now_s: float) -> None:
        self._reads += 1
        self._watch.begin()
        self._download = Download(
            self._peer,
            self._mission_type,
            rival_patience_s=self._rival_patience_s,
            round_trip=self._round_trip,
            most_s=self._limit_s - now_s,
            float_form=self._float_form,
        )
        self._download.start(now_s)
        self._advance(now_s)

    def _advance(self, now_s: float) -> None:
        assert self._download is not None
        for message in self._download.messages_to_send():
            self._send(message)
        if self._download.state is DownloadState.FETCHING:
            self._watch.counted()
        read = self._download.outcome
        if read is None:
            return
        self._download, self._read = None, read
        if not read.is_complete:
            self._move(UndisturbedReadEvent.FAILURE)
        elif not (self._watch.is_disturbed or read.is_contradicted):
            self._move(UndisturbedReadEvent.READ)
        elif self._reads >= MOST_READS:
            self._move(UndisturbedReadEvent.OTHERS_STAY)
        elif self._move(UndisturbedReadEvent.DISTURBANCE):
            self._settled_at_s = now_s + self._quiet_s
            self._settle_until_s = min(now_s + max(self._rival_patience_s, self._quiet_s), self._limit_s)

    @property
    def _quiet_s(self) -> float:
        return _QUIET_S + 2 * self._round_trip.mean_s

    def _settle(self, now_s: float) -> None:
        self._settled_at_s = max(self._settled_at_s, self._watch.heard_s + self._quiet_s)
        if now_s < self._settled_at_s and now_s >= self._settle_until_s:
            self._move(UndisturbedReadEvent.OTHERS_STAY)
        elif now_s >= self._settled_at_s and self._move(UndisturbedReadEvent.QUIET):
            self._start_reading(now_s)
