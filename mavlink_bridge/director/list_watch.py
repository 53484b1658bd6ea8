"""The part of the director that keeps what is known of the vehicle's lists true: it notices what others change, and reads it again."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from mavlink_bridge.director import clash
from mavlink_bridge.director.changes import ChangeWatch
from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.grounds import Grounds
from mavlink_bridge.director.learning import MISSION_TYPES, with_read_list
from mavlink_bridge.director.states import ON_VEHICLE, Notice, Signal, State
from mavlink_bridge.director.steps import step
from mavlink_bridge.errors import BridgeError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.protocol.download import Download
from mavlink_bridge.protocol.outcomes import list_read
from missions.situation import ListKind
from missions.vehicle.parameter_remarks import no_number_remarks
from missions.vehicle.parameters import PARAMETERS

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from mavlink_bridge.mavlink.messages import Frame
    from missions.items import MissionItem
    from missions.situation import Situation

_AT_REST = frozenset({State.READY, State.PROPOSED, *ON_VEHICLE, State.DRIVING, State.ARRIVED, State.LET_GO})
_WRITING = frozenset({State.UPLOADING, State.WITHDRAWING, State.CLASHING})


class ListWatch(Part):
    """Knows which lists are as they were read.

    Attributes
    ----------
    mission_items : tuple of MissionItem
        The vehicle's mission as it was last read again, home first.
    """

    def __init__(self, core: Core) -> None:
        super().__init__(core)
        self._changes: ChangeWatch | None = None
        self._grounds = Grounds.of(core.situation)
        self.mission_items: tuple[MissionItem, ...] = ()

    @property
    def deadline_s(self) -> float | None:
        """When lists are to be read again."""
        if not self._may_reread or self._changes is None:
            return None
        return self._changes.deadline_s(is_driving=self.core.state is State.DRIVING)

    def handle_timer(self, now_s: float) -> Sequence[Signal]:
        """Read again what is due."""
        if self._may_reread and self._changes is not None:
            self._reread(self._changes.due(now_s, is_driving=self.core.state is State.DRIVING), now_s)
        return []

    def receive(self, frame: Frame, now_s: float) -> Iterable[Signal]:
        """Notice what a frame says of changes."""
        core = self.core
        if self._changes is not None and core.is_from_vehicle(frame):
            self._changes.look(frame, now_s)
            if core.state in _WRITING:  # it is we who change it, and it is read back
                self._changes.suspects.discard(ListKind.MISSION)
        if core.state in clash.CLASHES:
            return
        before, after = core.before, core.situation
        if after.no_numbers is not before.no_numbers:
            self._tell_no_numbers(before, now_s)
        if after.fence is not before.fence or isinstance(frame.message, m.ParamValue | m.HomePosition):
            yield from self._notice_grounds(now_s)

    @property
    def is_outdated(self) -> bool:
        """Whether something on the vehicle was changed that was not read again yet, and may be."""
        return self._may_ask and self.has_suspects

    @property
    def has_suspects(self) -> bool:
        """Whether something on the vehicle was changed that was not read again yet."""
        return self._changes is not None and bool(self._changes.suspects)

    def settle(self, now_s: float) -> None:
        """Take notice that all lists were just read."""
        core = self.core
        if core.peer is not None and self._changes is None:
            kinds = {ListKind.FENCE, ListKind.MISSION}
            if core.orders.needs_rally or (core.orders.reads_rally and core.situation.rally is not None):
                kinds.add(ListKind.RALLY)
            identity = (core.peer.own_system, core.peer.own_component)
            self._changes = ChangeWatch(identity, frozenset(kinds))
        if self._changes is not None:
            self._changes.settle(now_s)
        self._grounds = Grounds.of(core.situation)

    def suspect_all(self) -> None:
        """Have all lists read once more."""
        if self._changes is not None:
            self._changes.suspect_all()

    @property
    def _may_ask(self) -> bool:
        return not self.core.orders.once and not self.core.orders.passive

    @property
    def _may_reread(self) -> bool:
        return self.core.state in _AT_REST and not self.core.steps and self._may_ask

    def _tell_no_numbers(self, before: Situation, now_s: float) -> None:
        """Report a parameter that came as no number, once; of those that matter here."""
        after = self.core.situation
        came = {
            name: text
            for name, text in after.no_numbers.items()
            if name in PARAMETERS and before.no_numbers.get(name) != text
        }
        for text in no_number_remarks(came, after.parameters):
            self.core.voice.tell(now_s, EventName.TROUBLE, text, "VehicleError", came)

    # Reading again

    def reread_suspects(self, now_s: float) -> None:
        """Read again what was changed."""
        if self._changes is not None and self._changes.suspects:
            self._reread(self._changes.due(now_s, is_driving=False), now_s)

    def _reread(self, kinds: set[ListKind], now_s: float) -> None:
        """Read again what somebody may have changed; what is dropped is to be read later."""
        peer = self.core.peer
        assert peer is not None
        order = [kind for kind in ListKind if kind in kinds]  # the mission first: it tells whose it is
        self.core.steps.run(
            [
                step(
                    Download(peer, MISSION_TYPES[kind]),
                    partial(self._take_reread, kind),
                    partial(self._suspect, kind),
                )
                for kind in order
            ],
            now_s,
        )

    def _suspect(self, kind: ListKind) -> None:
        if self._changes is not None:
            self._changes.suspects.add(kind)

    def _take_reread(self, kind: ListKind, machine: Download, now_s: float) -> Sequence[Signal]:
        """Take what a download brought; where nothing was answered, it stays suspect."""
        items = list_read(machine, kind)
        if isinstance(items, BridgeError):
            if machine.outcome is not None and machine.outcome.result is None:
                self._suspect(kind)
            return []
        self.core.situation = with_read_list(self.core.situation, kind, items, now_s)
        if kind is ListKind.FENCE:
            return self._fence_read(now_s)
        if kind is ListKind.MISSION:
            self.mission_items = items
            return [Notice.MISSION_READ]
        return [Notice.RALLY_HEARD]

    def _fence_read(self, now_s: float) -> Sequence[Signal]:
        trouble = self.core.situation.fence_trouble
        if trouble is None:
            return self._notice_grounds(now_s)
        self.core.voice.tell(
            now_s, EventName.TROUBLE, f"the fence cannot be used: {trouble}", "FenceError", {}
        )
        return [Notice.FENCE_CHANGED]

    def _notice_grounds(self, now_s: float) -> Sequence[Signal]:
        """Compare what routes rest on with what was last acted upon."""
        core = self.core
        if core.state is State.LEARNING:
            return []
        before, self._grounds = self._grounds, Grounds.of(core.situation)
        fence = core.situation.fence
        if fence is None:
            self._suspect(ListKind.FENCE)  # somebody wrote one that we saw only in part
            self._grounds = before
            return []
        changes = self._grounds.changes_since(before)
        if not changes:
            return []
        zones, vertices = len(fence.value.zones), fence.value.vertex_count
        text = f"the fence changed: {', '.join(changes)}"
        core.voice.tell(now_s, EventName.FENCE_CHANGED, text, zones, vertices)
        return [Notice.FENCE_CHANGED]
