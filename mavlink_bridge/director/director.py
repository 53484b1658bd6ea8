"""The director: turns messages and time into decisions, as one state machine without sockets and clocks.

It listens for the vehicle, learns it, and makes of each target a plan; uploads the plan verified, drives it in AUTO and watches, as far as its
orders go. It notices what others do: a changed fence, a changed mission, a changed mode. The same object runs live, in a replay, against the
simulator and in tests.

How it is built
---------------
The director holds parts; each has one concern, and they share a `Core` (state, situation, peer, orders, target, plan, the machine that runs,
the voice). A frame goes to the parts in one order, `Parts.hearers`, and time in another, `Parts.timed`. A part may use the core and the parts it
was made with; it never calls one that was made after it. What others must act upon it returns as signals: a `Cue` moves the state where the table
in `states` lists it, and is ignored where it does not; a `Notice` leaves the state alone. Both are looked up in `handlers.HANDLERS`, and what a
handler returns is heeded before anything else happens. So nothing changes the state but the table, and all that one part leads to in another stands
in `handlers`.

==================  ===================================================================================================
`Learner`           finds the vehicle, learns it, notices silence and reboots
`ObstacleWatch`     knows which obstacles were reported, and forgets them
`ListWatch`         knows which of the vehicle's lists are as they were read, and reads the others again
`Halter`            HOLD, whether the vehicle stands, and where it will
`DriveSupervisor`   watches a drive until it has arrived
`HoldWatch`         where a HOLD ends: announces breaches to come, lets the vehicle go on first where that is better
`TargetInbox`       targets of all sources, answers to who asked, and a target that waits
`RouteDesk`         has plans made, drops those nobody waits for, and checks the one that stands
`MissionWriter`     a plan that stands → a verified mission on the vehicle
`Adopter`           has drives noted before they begin, and goes on with one that an earlier run has begun
`FenceGuard`        when the vehicle's fence counts, which zones do not, and whether it takes the mission
`Starter`           standing still where the mission holds, the last look, arming, AUTO, the first item
`HomeKeeper`        the way to the nearest place to go home to, from where the vehicle is
`HomeCaller`        what calls the vehicle home by a route: RTL, a low battery, no ground station, a breach
`HandOver`          who else has the vehicle: the operator, or the autopilot by a failsafe
`IdentityGuard`     who else speaks with our ids
==================  ===================================================================================================

Who may act when
----------------
Three parts make the vehicle do something. `Halter` sends HOLD, in any state in which the orders let it, and its messages go out before all others.
`Starter` arms and switches to AUTO, in STARTING alone: after a verified upload, once the vehicle stands where the mission holds, a last reading of what somebody may have changed, and a heartbeat
that shows HOLD by our doing. `MissionWriter` begins to write in UPLOADING alone, which ends only with the mission verified, the old one put back, or
the trouble told. (`HandOver` sends HOLD to a vehicle that was disarmed in our AUTO, for arming it would set it going.) No other part sends
anything but questions, answers and texts. One machine runs at a time (`Steps`); whatever drops what is wanted drops it too, but for an upload that
is under way.

Why the operator wins
---------------------
Each switch of ours tells `OperatorWatch` what to expect; anything else that a heartbeat shows, or that a ground station is overheard asking for,
is somebody's will, whoever it was, and becomes TAKEN_OVER. Every state in which something could still be done to the vehicle lists that cue (in a
clash `IdentityGuard` sees to it). Its handler drops the target, the drive, the HOLD under way and the machine that runs, before anything more is
sent; an upload is finished or undone first, and nothing follows it. From LET_GO only a new target leads on. `HandOver` hears each frame before
`TargetInbox` does, and before the machine that runs: what would go on is dropped before it can. A link that was lost, or a vehicle switched off and
on, leads to watching, and to driving only by a target given since: somebody may have had the vehicle meanwhile. When somebody else speaks with our ids,
not even targets by message count: only the keyboard does.

The one exception, where it was allowed (`--rtl-by-route`): the first RTL, which drives straight home, is answered by HOLD and a way home round the fences.
The second one is the operator's, and any other mode at any time (`home_caller`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.director.addressed import as_to_vehicle
from mavlink_bridge.director.core import Core
from mavlink_bridge.director.handlers import HANDLERS
from mavlink_bridge.director.parts import Parts
from mavlink_bridge.director.states import Cue, Signal, State
from mavlink_bridge.fold import fold
from mavlink_bridge.mavlink.messages import Heartbeat
from missions.situation import Situation

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from mavlink_bridge.backup.drive_note import DriveNote
    from mavlink_bridge.director.drive_watch import DriveWatch
    from mavlink_bridge.director.events import Event
    from mavlink_bridge.director.orders import Orders
    from mavlink_bridge.director.plan_task import HomeWays, PlanTask, WaysTask
    from mavlink_bridge.errors import BridgeError
    from mavlink_bridge.mavlink.messages import Frame, Message
    from mavlink_bridge.protocol.peer import Peer
    from mavlink_bridge.protocol.vehicle_watch import VehicleWatch
    from mavlink_bridge.protocol.verified_upload import VerifiedUpload, VerifiedUploadOutcome
    from missions.errors import MissionError
    from missions.geo import LatLon
    from missions.items import MissionItem
    from missions.planned import Plan
    from missions.request import Request
    from missions.routing.way_home import WayHome


class Director:
    """Turns targets into verified missions, and watches missions until arrival.

    Parameters
    ----------
    orders : Orders
        What it may do.
    situation : Situation, optional
        What is known beforehand (parameters of a file).
    notes : tuple of DriveNote
        The drives that earlier runs have begun; the vehicle's own may be adopted.
    """

    def __init__(
        self, orders: Orders, situation: Situation | None = None, notes: tuple[DriveNote, ...] = ()
    ) -> None:
        core = self._core = Core(orders, situation or Situation(), self._heed)
        self._parts = Parts(core, notes)

    # What is known

    @property
    def state(self) -> State:
        """Where the director is."""
        return self._core.state

    @property
    def is_done(self) -> bool:
        """Whether a single job has come to its end."""
        return self._core.is_done

    @property
    def orders(self) -> Orders:
        """What it may do."""
        return self._core.orders

    @orders.setter
    def orders(self, orders: Orders) -> None:
        self._core.orders = orders

    @property
    def situation(self) -> Situation:
        """What is known of the vehicle and around it."""
        return self._core.situation

    @property
    def trouble(self) -> BridgeError | MissionError | None:
        """Why the newest action failed; a single job ends with it."""
        return self._core.trouble

    @property
    def peer(self) -> Peer | None:
        """The vehicle, once it was found."""
        return self._core.peer

    @property
    def identity(self) -> tuple[int, int] | None:
        """The ids we speak with; None until they are known."""
        return self._core.identity

    @property
    def vehicle_uid(self) -> str:
        """The uid of the vehicle's board; empty where it tells none."""
        return self._core.vehicle_uid

    @property
    def watch(self) -> VehicleWatch:
        """What the vehicle does, as last told."""
        return self._core.watch

    @property
    def heard_s(self) -> float | None:
        """When the vehicle's newest heartbeat was heard; None before the first."""
        return self._core.heartbeat_s if math.isfinite(self._core.heartbeat_s) else None

    @property
    def plan(self) -> Plan | None:
        """The plan that stands."""
        return self._core.plan

    @property
    def drive(self) -> DriveWatch | None:
        """The drive on our mission."""
        return self._parts.driver.drive

    @property
    def drives_by_us(self) -> bool:
        """Whether the vehicle drives because of us, or is about to."""
        return self.orders.drive and (self._parts.halter.may_be_in_auto or self.state is State.DRIVING)

    @property
    def progress(self) -> tuple[int, int]:
        """Progress of the transfer under way, or of the drive by items."""
        if self.state is State.DRIVING and self.drive and self.plan:
            return self.drive.item - 1, len(self.plan.items)
        return self._core.steps.progress

    # What the shell does for it

    @property
    def upload(self) -> VerifiedUpload | None:
        """The newest upload, under way or ended; None before the first."""
        return self._parts.writer.upload

    @property
    def upload_outcome(self) -> VerifiedUploadOutcome | None:
        """The outcome of the newest upload that has ended."""
        return self._parts.writer.outcome

    @property
    def is_uploading(self) -> bool:
        """Whether an upload is under way, from the reading of the old mission on."""
        return self._parts.writer.under_way is not None

    @property
    def pending_backup(self) -> tuple[MissionItem, ...] | None:
        """The vehicle's old mission, while it waits to be stored; nothing is written before `backup_stored`."""
        return self._parts.writer.pending_backup

    def backup_stored(self, now_s: float, path: Path | None = None) -> None:
        """Take notice that the old mission is safe, and where: an upload that fails says so."""
        self._parts.writer.backup_stored(now_s, path)

    def backup_failed(self, trouble: BridgeError, now_s: float) -> None:
        """Take notice that the old mission cannot be stored: the upload is left before anything is written."""
        self._heed(self._parts.writer.backup_failed(trouble, now_s), now_s)

    @property
    def drive_note(self) -> DriveNote | None:
        """The note that is to stand on disk for this vehicle, its connection left open; nothing drives before `note_stored`."""
        return self._parts.adopter.note

    def note_stored(self) -> None:
        """Take notice that the drive is noted on disk."""
        self._parts.adopter.is_noted = True

    def note_failed(self, trouble: BridgeError, now_s: float) -> None:
        """Take notice that the drive cannot be noted: it is not begun."""
        self._heed(self._parts.starter.note_failed(trouble, now_s), now_s)

    @property
    def pending_plan(self) -> PlanTask | None:
        """The plan that is waited for; nothing follows before `plan_made`."""
        return self._parts.desk.pending

    def plan_made(self, task: PlanTask, made: Plan | MissionError, now_s: float) -> None:
        """Take a plan, or why there is none; one that nobody waits for any more is ignored."""
        self._heed(self._parts.desk.plan_made(task, made, now_s), now_s)

    @property
    def pending_ways(self) -> WaysTask | None:
        """The ways home that are waited for; nothing else waits for them."""
        return self._parts.keeper.pending

    def ways_made(self, task: WaysTask, made: HomeWays | MissionError, now_s: float) -> None:
        """Take ways home, or why there are none; what nobody waits for any more is ignored."""
        self._heed(self._parts.keeper.ways_made(task, made, now_s), now_s)

    @property
    def way_home(self) -> WayHome | None:
        """The way to the nearest place from where the vehicle was a moment ago."""
        return self._parts.keeper.way

    @property
    def no_way_home(self) -> str:
        """Why there is no way home; empty where there is one, and where that is not known."""
        return self._parts.keeper.trouble

    @property
    def awaits_confirmation(self) -> bool:
        """Whether a plan waits for `confirm` before it is uploaded."""
        return self._parts.writer.awaits_confirmation

    def confirm(self, now_s: float) -> None:
        """Take the operator's yes to the plan that waits for it; ignored where none does."""
        self._heed(self._parts.writer.confirm(), now_s)

    def start_drive(self, now_s: float) -> None:
        """Take the operator's word to drive: what is verified now, or once it is. A new target takes it back."""
        self._heed(self._parts.starter.begin_on_word(now_s), now_s)

    @property
    def awaits_start(self) -> bool:
        """Whether a word to drive was given, and `withhold_drive` would still keep the vehicle where it is."""
        return self._parts.starter.awaits_start

    @property
    def is_left_armed(self) -> bool:
        """Whether the vehicle stands armed in HOLD because we have armed it, for a drive that has not begun."""
        return self._parts.starter.is_left_armed

    def withhold_drive(self, now_s: float) -> None:
        """Take the word to drive back: what has not begun does not begin. Once AUTO was sent, only `hold` stops the vehicle; a way home goes on."""
        self._heed(self._parts.starter.withhold(), now_s)

    def hold(self, reason: str, now_s: float) -> None:
        """Stop the vehicle because a person asks for it, and let go of all that was wanted; ignored without orders to drive, and before a vehicle was found.

        Parameters
        ----------
        reason : str
            Who asks for it.
        now_s : float
            When.
        """
        self._heed(self._parts.hand_over.hold_asked(reason), now_s)

    def take_request(self, request: Request, now_s: float) -> None:
        """Take another request, with its targets, in place of the orders' own."""
        self._core.orders = replace(self._core.orders, request=request)
        self.take_target(request.targets[-1], now_s)

    def suspect_lists(self) -> None:
        """Have all lists read again when there is room for it: somebody else of this program has written one."""
        self._parts.lists.suspect_all()

    @property
    def is_transferring(self) -> bool:
        """Whether something is asked of the vehicle or written to it just now."""
        return bool(self._core.steps)

    @property
    def has_our_mission(self) -> bool:
        """Whether the vehicle's mission is the one that we have verified."""
        return self._core.has_our_mission

    def take_target(self, position: LatLon, now_s: float) -> None:
        """Take a target that was typed."""
        self._heed(self._parts.inbox.take_typed(position, now_s), now_s)

    def take_obstacle(self, position: LatLon | None, radius_m: float, now_s: float) -> None:
        """Take an obstacle that was typed; without a position it is right before the vehicle. Ignored where the orders do not list the keyboard."""
        self._heed(self._parts.obstacles.take_typed(position, radius_m, now_s), now_s)

    def clear_obstacles(self, now_s: float) -> None:
        """Forget all obstacles that were reported."""
        self._heed(self._parts.obstacles.clear(now_s), now_s)

    def take_events(self) -> list[Event]:
        """Return and forget what happened."""
        return self._core.voice.take_events()

    # Messages and time

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        times = [self._core.steps.deadline_s, self._core.voice.deadline_s]
        times += [part.deadline_s for part in self._parts.timed]
        return min((time_s for time_s in times if time_s is not None and time_s < math.inf), default=None)

    def start(self, now_s: float) -> None:
        """Begin to listen."""
        self._parts.learner.start(now_s)

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; one with our own ids that we did not send says nothing but that it is there, nor does another autopilot's with the vehicle's."""
        core = self._core
        if self._parts.guard.is_clash(frame):
            self._heed(self._parts.guard.take_clash(now_s), now_s)
            core.steps.receive(
                frame, now_s
            )  # a list that is read back may not be what we have written any more
            return
        if core.state is State.LISTENING:
            self._heed(self._parts.learner.look_for(frame, now_s), now_s)
            return
        if not core.orders.passive and core.is_from_vehicle(frame) and self._is_anothers(frame.message):
            return
        self._heed(self._parts.halter.hear_answer(frame, now_s), now_s)
        frame = as_to_vehicle(frame, core.peer)
        core.before = core.situation
        core.situation = fold(core.situation, frame, now_s)
        for part in self._parts.hearers:
            self._heed(part.receive(frame, now_s), now_s)
        core.steps.receive(frame, now_s)
        self._heed(self._parts.writer.look_at_old_mission(), now_s)

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        self._core.send(*self._core.voice.due(now_s))
        self._core.steps.handle_timer(now_s)
        for part in self._parts.timed:
            self._heed(part.handle_timer(now_s), now_s)

    def messages_to_send(self) -> list[Message]:
        """Return and forget what is to be sent now, HOLD before anything else."""
        core = self._core
        return [
            *self._parts.halter.messages_to_send(),
            *core.messages_to_send(),
            *core.steps.messages_to_send(),
        ]

    def _is_anothers(self, message: Message) -> bool:
        """Return whether a message is a HEARTBEAT of another autopilot than was learnt: its modes mean something else, and it is not that vehicle."""
        return isinstance(message, Heartbeat) and message.autopilot != self._core.autopilot.autopilot

    # Cues and notices

    def _heed(self, signals: Iterable[Signal], now_s: float) -> None:
        """Act on signals one after the other, and on what each leads to before the next."""
        for signal in signals:
            if isinstance(signal, Cue) and not self._core.move(signal):
                continue
            if (handler := HANDLERS.get(signal)) is not None:
                self._heed(handler(self._parts, now_s) or (), now_s)
