"""The part of the director that keeps what is known of the vehicle true: it notices what others change, and reads it again."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from mavlink_bridge.director.acquaintance import Acquaintance
from mavlink_bridge.director.changes import ChangeWatch
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.grounds import Grounds
from mavlink_bridge.director.learning import MISSION_TYPES, list_of, with_read_list
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.director.states import State
from mavlink_bridge.errors import BridgeError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.protocol.download import Download
from missions.situation import ListKind
from missions.vehicle import PARAMETER_NAMES
from missions.vehicle.parameter_remarks import no_number_remarks

if TYPE_CHECKING:
    from mavlink_bridge.director.orders import Orders
    from mavlink_bridge.mavlink.messages import Frame
    from missions.items import MissionItem
    from missions.situation import Situation

_AT_REST = frozenset(
    {State.READY, State.PROPOSED, State.VERIFIED, State.DRIVING, State.ARRIVED, State.LET_GO}
)
_WRITING = frozenset({State.UPLOADING, State.WITHDRAWING, State.CLASHING})


class Keeper(Acquaintance):
    """Knows a vehicle, for hours.

    Parameters
    ----------
    orders : Orders
        Whom to look for, and as whom to speak.
    situation : Situation, optional
        What is known beforehand (parameters of a file).
    """

    def __init__(self, orders: Orders, situation: Situation | None = None) -> None:
        super().__init__(orders, situation)
        self._changes: ChangeWatch | None = None
        self._grounds = Grounds.of(self.situation)
        self._rereading: set[ListKind] = set()

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        deadline_s = super().deadline_s
        if not self._may_reread or self._changes is None:
            return deadline_s
        reread_s = self._changes.deadline_s(is_driving=self.state is State.DRIVING)
        return reread_s if deadline_s is None else min(deadline_s, reread_s)

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        super().handle_timer(now_s)
        if self._may_reread and self._changes is not None:
            self._reread(self._changes.due(now_s, is_driving=self.state is State.DRIVING), now_s)

    @property
    def _is_outdated(self) -> bool:
        """Whether something on the vehicle was changed that was not read again yet, and may be."""
        return self._may_ask and self._has_suspects

    @property
    def _has_suspects(self) -> bool:
        return self._changes is not None and bool(self._changes.suspects)

    @property
    def _may_ask(self) -> bool:
        return not self.orders.once and not self.orders.passive

    @property
    def _may_reread(self) -> bool:
        return self.state in _AT_REST and not self._steps and self._may_ask

    def _all_learnt(self, now_s: float) -> None:
        if self._peer is not None and self._changes is None:
            kinds = {ListKind.FENCE, ListKind.MISSION}
            if TargetSource.RALLY in self.orders.target_sources:
                kinds.add(ListKind.RALLY)
            self._changes = ChangeWatch((self._peer.own_system, self._peer.own_component), frozenset(kinds))
        if self._changes is not None:
            self._changes.settle(now_s)
        self._grounds = Grounds.of(self.situation)
        super()._all_learnt(now_s)

    def _take_vehicle_frame(self, frame: Frame, now_s: float) -> None:
        super()._take_vehicle_frame(frame, now_s)
        if self._changes is not None:
            self._changes.look(frame, now_s)
            if self.state in _WRITING:  # it is we who change it, and it is read back
                self._changes.suspects.discard(ListKind.MISSION)

    def _take_any_frame(self, frame: Frame, before: Situation, now_s: float) -> None:
        after = self.situation
        if after.no_numbers is not before.no_numbers:
            self._tell_no_numbers(before, now_s)
        if after.fence is not before.fence or isinstance(frame.message, m.ParamValue | m.HomePosition):
            self._notice_grounds(now_s)

    def _tell_no_numbers(self, before: Situation, now_s: float) -> None:
        """Tell of a parameter that came as no number, once; of those that matter here."""
        after = self.situation
        came = {
            name: text
            for name, text in after.no_numbers.items()
            if name in PARAMETER_NAMES and before.no_numbers.get(name) != text
        }
        for text in no_number_remarks(came, after.parameters):
            self._voice.tell(now_s, EventName.TROUBLE, text, "VehicleError", came)

    # Reading again

    def _reread_suspects(self, now_s: float) -> None:
        """Read again what was changed."""
        if self._changes is not None and self._changes.suspects:
            self._reread(self._changes.due(now_s, is_driving=False), now_s)

    def _reread(self, kinds: set[ListKind], now_s: float) -> None:
        """Read again what somebody may have changed."""
        assert self._peer is not None
        self._rereading |= kinds
        order = [kind for kind in ListKind if kind in kinds]  # the mission first: it tells whose it is
        peer = self._peer
        self._steps.run(
            [(Download(peer, MISSION_TYPES[kind]), partial(self._take_reread, kind)) for kind in order],
            now_s,
        )

    def _take_reread(self, kind: ListKind, machine: Download, now_s: float) -> None:
        """Take what a download brought; where nothing was answered, it stays suspect."""
        self._rereading.discard(kind)
        items = list_of(machine, kind)
        if isinstance(items, BridgeError):
            if machine.outcome is not None and machine.outcome.result is None and self._changes is not None:
                self._changes.suspects.add(kind)
            return
        self.situation = with_read_list(self.situation, kind, items, now_s)
        if kind is ListKind.FENCE:
            self._fence_read(now_s)
        elif kind is ListKind.MISSION:
            self._mission_read(items, now_s)
        else:
            self._rally_read(now_s)

    def _fence_read(self, now_s: float) -> None:
        trouble = self.situation.fence_trouble
        if trouble is None:
            self._notice_grounds(now_s)
            return
        self._voice.tell(now_s, EventName.TROUBLE, f"the fence cannot be used: {trouble}", "FenceError", {})
        self._fence_changed(now_s)

    def _drop_steps(self) -> None:
        """Leave what is under way; what was to be read again is to be read later."""
        self._steps.clear()
        if self._changes is not None:
            self._changes.suspects |= self._rereading
        self._rereading.clear()

    def _notice_grounds(self, now_s: float) -> None:
        """Compare what routes rest on with what was last acted upon."""
        if self.state is State.LEARNING:
            return
        before, self._grounds = self._grounds, Grounds.of(self.situation)
        fence = self.situation.fence
        if fence is None:
            if self._changes is not None:  # somebody wrote one that we saw only in part
                self._changes.suspects.add(ListKind.FENCE)
            self._grounds = before
            return
        changes = self._grounds.changes_since(before)
        if changes:
            zones, vertices = len(fence.value.zones), fence.value.vertex_count
            text = f"the fence changed: {', '.join(changes)}"
            self._voice.tell(now_s, EventName.FENCE_CHANGED, text, zones, vertices)
            self._fence_changed(now_s)

    def _lists_heard(self, before: Situation, now_s: float) -> None:
        if self.situation.mission is not before.mission:
            self._mission_heard(now_s)
        if self.situation.rally is not before.rally:
            self._rally_read(now_s)

    # Hooks: what follows is decided above

    def _fence_changed(self, now_s: float) -> None:
        """Act on a fence that is another one than before."""
        raise NotImplementedError

    def _mission_read(self, items: tuple[MissionItem, ...], now_s: float) -> None:
        """Act on the vehicle's mission as it was read again."""
        raise NotImplementedError

    def _rally_read(self, now_s: float) -> None:
        """Act on rally points that may be others than before."""
        raise NotImplementedError

    def _mission_heard(self, now_s: float) -> None:
        """Act on a mission that others transferred, while we only listen."""
        raise NotImplementedError
