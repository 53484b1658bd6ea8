"""The part of the director that sets the vehicle going on its verified mission: nothing else arms or switches to AUTO.

How its mission is begun at the first item, and whether before or after the change of mode, stands in its autopilot's table (`mavlink.drive_rules`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.halter import STILL_MPS
from mavlink_bridge.director.states import ON_VEHICLE, Cue, Notice, Signal, State
from mavlink_bridge.director.steps import step
from mavlink_bridge.errors import OutcomeError, RefusedError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.drive_rules import FirstItem
from mavlink_bridge.protocol.command import SendCommand
from mavlink_bridge.protocol.first_item import BeginAtFirstItem
from mavlink_bridge.protocol.mode_switch import Arming, AwaitHeartbeat, ModeSwitch, SeenCommand
from mavlink_bridge.protocol.standstill import AwaitStandstill
from missions.items import Command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.director.adopter import Adopter
    from mavlink_bridge.director.drive_supervisor import DriveSupervisor
    from mavlink_bridge.director.fence_guard import FenceGuard
    from mavlink_bridge.director.halter import Halter
    from mavlink_bridge.director.list_watch import ListWatch
    from mavlink_bridge.director.route_desk import RouteDesk
    from mavlink_bridge.errors import BridgeError
    from mavlink_bridge.mavlink.messages import Frame

START_YOURSELF = "arm it, then give the target again (or run the command again); or arm it in HOLD and switch it to AUTO yourself"

_LEFT_ARMED = "pbpp armed the vehicle for a drive that has not begun: it stands armed in HOLD; disarm it, or start the drive again"

_ARMS_LATE_S = 5.0
"""So long after the command to arm a vehicle may still become armed by it: longer than it is repeated for. Chosen, not measured."""

_MOVED_M = 1.0
"""A vehicle that stands within this of where its route begins counts as not having moved since it was planned."""


class Starter(Part):
    """Looks once more, arms where asked, switches to AUTO and to the first item.

    Attributes
    ----------
    is_told : bool
        Whether a person has given the word to drive what is verified: good for one start, also for one that fails.
    """

    def __init__(
        self,
        core: Core,
        lists: ListWatch,
        halter: Halter,
        driver: DriveSupervisor,
        desk: RouteDesk,
        adopter: Adopter,
        fence: FenceGuard,
    ) -> None:
        super().__init__(core)
        self._armed_s: float | None = None  # when it was told to arm, for a drive that has not begun
        self._is_armed_told = False
        self._fence = fence
        self._lists = lists
        self._halter = halter
        self._driver = driver
        self._desk = desk
        self._adopter = adopter
        self.is_told = False

    @property
    def may_begin(self) -> bool:
        """Whether a verified mission is driven now: at once, on a person's word where that is waited for, and a way home without one."""
        orders = self.core.orders
        return orders.drive and (not orders.starts_on_word or self.is_told or self._is_home)

    @property
    def _is_home(self) -> bool:
        target = self.core.target
        return target is not None and target.is_home

    @property
    def awaits_start(self) -> bool:
        """Whether the word was given, and the vehicle was not switched to AUTO on it yet; a way home needs none."""
        return self.is_told and not self._is_home

    @property
    def is_left_armed(self) -> bool:
        """Whether the vehicle stands armed in HOLD by us, and no drive is begun: its start was taken back, stopped or refused after it was armed."""
        situation = self.core.situation
        is_ours = self._armed_s is not None and self.core.state is not State.STARTING
        return is_ours and bool(situation.armed) and situation.mode == self.core.modes.hold

    def receive(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Notice a vehicle that we have armed and that does not drive: once it is somebody else's, or disarmed, nothing more is said of it."""
        if (
            self._armed_s is None
            or not self.core.is_from_vehicle(frame)
            or not isinstance(frame.message, m.Heartbeat)
        ):
            return []
        situation = self.core.situation
        if self.is_left_armed:
            if not self._is_armed_told:
                self._is_armed_told = True
                self.core.voice.tell(now_s, EventName.LEFT_ARMED, _LEFT_ARMED)
        elif self.core.state is not State.STARTING:
            is_late = now_s > self._armed_s + _ARMS_LATE_S
            if self._is_armed_told or is_late or situation.mode != self.core.modes.hold:
                self._armed_s = None
        return []

    def begin_on_word(self, now_s: float) -> Sequence[Signal]:
        """Return that a person gives the word to drive: now, or once the mission is verified; one that the vehicle has refused is judged again first."""
        self.is_told = True
        if self.core.state in ON_VEHICLE and self._fence.has_refused:
            return self._fence.verified(now_s, may_begin=self.may_begin)
        is_ready = self.core.state in ON_VEHICLE and not self._fence.is_waiting
        return [Cue.DRIVE] if is_ready and self.may_begin else []

    def withhold(self) -> Sequence[Signal]:
        """Take the word back, and return that the mission waits again that was to be driven."""
        is_starting = self.awaits_start and self.core.state is State.STARTING
        self.is_told = False
        if not is_starting:
            return []
        self.core.steps.clear()
        self._adopter.forget()
        self._driver.stand_by()
        return [Cue.RENEWED]

    def begin(self, now_s: float) -> Sequence[Signal]:
        """Begin the drive; a vehicle that still rolls to where it was expected to stand is waited for."""
        if not self._desk.is_foreseen or self._halter.stands:
            return self._settle(now_s)
        assert self.core.peer is not None
        rest = AwaitStandstill(self.core.peer, STILL_MPS, self._halter.patience_over_s)
        self.core.steps.run([step(rest, lambda _machine, then_s: self._settle(then_s))], now_s)
        return []

    def _settle(self, now_s: float) -> Sequence[Signal]:
        """Go on where the mission is safe from the very place; else return that a route from there is wanted."""
        if not self._desk.settles(now_s):
            return [Cue.TARGET]
        self.look_once_more(now_s)
        return []

    def look_once_more(self, now_s: float) -> None:
        """Read again what somebody may have changed, and wait for a heartbeat: it shows a takeover that was on its way."""
        assert self.core.peer is not None
        self._adopter.begin()
        self._lists.reread_suspects(now_s)
        self.core.steps.run([step(AwaitHeartbeat(self.core.peer), self._looked)], now_s)

    def _looked(self, _machine: AwaitHeartbeat, now_s: float) -> Sequence[Signal]:
        core, situation, halter = self.core, self.core.situation, self._halter
        is_waiting = halter.stopping is not None or not self._adopter.is_noted
        if self._lists.has_suspects or is_waiting or not core.operator.is_ours(situation.mode):
            self.look_once_more(now_s)
            return []
        if driven := self._driven_in_hold(now_s):
            return driven
        if not self._fence.counts(now_s):
            self._adopter.forget()
            return [Cue.RENEWED]
        if not situation.armed and not core.orders.arm:
            return self._refuse_unarmed(now_s)
        if (
            situation.mode != core.modes.hold
        ):  # it starts from HOLD: any other mode is then known for somebody else's
            halter.command_hold(now_s)
            self.look_once_more(now_s)
            return []
        found = self._desk.recheck(1)
        if not found.holds and (found.moved_m > _MOVED_M or self._desk.is_stale):
            return self._desk.broke(found, now_s)
        if core.orders.arm and not situation.armed:
            assert core.peer is not None
            self._armed_s, self._is_armed_told = now_s, False
            core.steps.run([step(Arming(core.peer), self._armed)], now_s)
        else:
            self._go_off(now_s)
        return []

    def note_failed(self, trouble: BridgeError, now_s: float) -> Sequence[Signal]:
        """Return that a drive is not begun that cannot be noted; one that was adopted goes on, and it is said."""
        if self.core.state is not State.STARTING:
            details = dict(trouble.details)
            self.core.voice.error(now_s, EventName.TROUBLE, trouble, details)
            return []
        self.core.steps.clear()
        return self._give_up(trouble, now_s)

    def _refuse_unarmed(self, now_s: float) -> Sequence[Signal]:
        """Leave the mode of a disarmed vehicle alone: in AUTO, arming it would drive off."""
        situation = self.core.situation
        modes = self.core.modes
        mode = modes.words(situation.mode)
        drives_off = ": arming it makes it drive" if situation.mode == modes.mission else ""
        trouble = OutcomeError(
            f"the mission is verified on the vehicle, which is not armed and does not drive: its mode was not changed ({mode}{drives_off})",
            advice=START_YOURSELF,
            mode=mode,
        )
        return self._give_up(trouble, now_s)

    def _give_up(self, trouble: BridgeError, now_s: float) -> Sequence[Signal]:
        """Return that the drive is not begun."""
        self.is_told = False
        self._adopter.forget()
        self._driver.stand_by()
        self.core.voice.error(now_s, EventName.TROUBLE, trouble, dict(trouble.details))
        return self.core.fail_step(trouble)

    def _armed(self, machine: Arming, now_s: float) -> Sequence[Signal]:
        if not machine.is_granted:
            return self._not_granted(machine, now_s)
        if self.core.situation.mode == self.core.modes.hold:
            self._go_off(now_s)
        else:  # a heartbeat from before our HOLD, overtaken on the way, or an operator: the next one tells which
            self.look_once_more(now_s)
        return []

    def _go_off(self, now_s: float) -> None:
        """Switch to AUTO, with the first item the current one where that is to be before."""
        core = self.core
        assert core.peer is not None
        if self._first_item is FirstItem.BY_MESSAGE_BEFORE:
            core.steps.run([step(BeginAtFirstItem(core.peer), self._first_item_set)], now_s)
        else:
            self._switch_to_auto(now_s)

    def _first_item_set(self, _machine: BeginAtFirstItem, now_s: float) -> Sequence[Signal]:
        if driven := self._driven_in_hold(now_s):
            return driven
        self._switch_to_auto(now_s)
        return []

    def _driven_in_hold(self, now_s: float) -> Sequence[Signal]:
        """Return what follows where the vehicle moves in the mode that stops: a click that was heard has come to it late, or somebody else drives it."""
        halter = self._halter
        if self.core.situation.mode != self.core.modes.hold or not halter.moves_in_hold:
            return []
        self._adopter.forget()
        return [Notice.ROUTE_WANTED if halter.may_be_clicked(now_s) else Notice.DRIVEN_IN_HOLD]

    def _switch_to_auto(self, now_s: float) -> None:
        core, situation = self.core, self.core.situation
        assert core.peer is not None
        self.is_told = False
        self._halter.may_be_in_auto = True
        core.operator.expect(core.modes.mission, {situation.mode}, is_armed=bool(situation.armed))
        core.steps.run([step(ModeSwitch(core.peer, core.modes.mission), self._in_auto)], now_s)

    @property
    def _first_item(self) -> FirstItem:
        return self.core.autopilot.driving.first_item

    def _in_auto(self, machine: ModeSwitch, now_s: float) -> Sequence[Signal]:
        if machine.is_left:
            self._adopter.forget()
            self._tell_failed(machine.command_name, machine.result_name, machine.texts, now_s)
            return [Notice.SWITCHED_BACK]
        if not machine.is_granted:
            self._driver.stand_by()
            return self._not_granted(machine, now_s)
        self._armed_s = None
        self.core.operator.settle(now_s)
        if self._first_item is not FirstItem.BY_COMMAND_IN_MISSION:
            return [Cue.STARTED]
        core = self.core
        assert core.peer is not None
        # Only after the mode change: before it, in HOLD, ArduPilot reports internal errors.
        first = m.CommandLong(
            core.peer.system, core.peer.component, Command.DO_SET_MISSION_CURRENT, param1=1.0, param2=1.0
        )
        core.steps.run([step(SendCommand(core.peer, first), self._started)], now_s)
        return []

    def _started(self, machine: SendCommand, now_s: float) -> Sequence[Signal]:
        if _is_accepted(machine):
            return [Cue.STARTED]
        signals = self._refused(machine, now_s)
        self._halter.command_hold(now_s)  # it drives from an item that we do not know
        return signals

    def _refused(self, machine: SendCommand, now_s: float) -> Sequence[Signal]:
        outcome = machine.outcome
        assert outcome is not None
        result = outcome.result.name if outcome.result is not None else "no answer"
        return self._failed(Command(outcome.command).name, result, outcome.texts, now_s)

    def _not_granted(self, machine: SeenCommand, now_s: float) -> Sequence[Signal]:
        return self._failed(machine.command_name, machine.result_name, machine.texts, now_s)

    def _failed(self, name: str, result: str, texts: tuple[str, ...], now_s: float) -> Sequence[Signal]:
        self.is_told = False
        self.core.steps.clear()
        self._adopter.forget()
        self._tell_failed(name, result, (), now_s)
        kind = OutcomeError if result == "no answer" else RefusedError
        why = "".join(f"; {text}" for text in texts)
        return self.core.fail_step(
            kind(f"the mission is on the vehicle, but it refused {name}: {result}{why}")
        )

    def _tell_failed(self, name: str, result: str, texts: tuple[str, ...], now_s: float) -> None:
        why = "".join(f"; {text.strip()}" for text in texts)
        self.core.voice.tell(now_s, EventName.COMMAND_FAILED, f"{name}: {result}{why}", name, result)


def _is_accepted(machine: SendCommand) -> bool:
    return machine.outcome is not None and machine.outcome.is_accepted
