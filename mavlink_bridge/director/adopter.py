"""The part of the director that notes the drives it begins, and adopts one that an earlier run has begun.

A bridge that was killed, or whose computer lost its power, leaves the vehicle in AUTO with nobody to watch it. So a drive is noted on disk before it
begins (`backup.drive_note`), and the note goes with the drive's end:

    plan, mission read back, uid ──Starter──► note ──shell──► disk ──(restart)──► notes ──look──► the drive adopted, or why not

A drive is adopted only where nothing speaks against it: the board's uid is the noted one, the vehicle is armed and in AUTO, was not switched off
since, was in AUTO at each heartbeat heard, and its mission, read back whole, is the noted one in every item; mission and fence are read once more before,
for changes while all was read. Then the director is where it would be without a restart: driving, with the
same plan. Who was not heard is not known: an operator who took over and went back to AUTO on the same mission while no bridge ran looks like the drive
going on. Any change of mode that is seen from then on is a takeover, as ever. Once told to be another's, a note is taken away for good.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.backup.drive_note import DriveNote
from mavlink_bridge.backup.vehicle_mark import VehicleMark
from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.director.states import Cue, Signal, State
from mavlink_bridge.director.targets import HomeCall, Target, is_same_place
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.protocol.vehicle_watch import MISSION_COMPLETE
from missions.checking.drive_record import plan_again, record_of, situation_of
from missions.errors import MissionError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.director.drive_supervisor import DriveSupervisor
    from mavlink_bridge.director.halter import Halter
    from mavlink_bridge.director.list_watch import ListWatch
    from mavlink_bridge.director.route_desk import RouteDesk
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.mavlink.stored_form import StoredForm
    from missions.geo import LatLon
    from missions.items import MissionItem

_PATIENCE_S = 10.0
"""So long an autopilot may take to tell which item it drives to: it tells it about once a second. Chosen, not measured."""


class Adopter(Part):
    """Knows which drive is noted.

    Parameters
    ----------
    notes : tuple of DriveNote
        What earlier runs have left on disk.

    Attributes
    ----------
    note : DriveNote or None
        What is to stand on disk for this vehicle.
    is_noted : bool
        Whether it does.
    """

    def __init__(
        self,
        core: Core,
        lists: ListWatch,
        halter: Halter,
        driver: DriveSupervisor,
        desk: RouteDesk,
        notes: tuple[DriveNote, ...],
    ) -> None:
        super().__init__(core)
        self._lists = lists
        self._halter = halter
        self._driver = driver
        self._desk = desk
        self._left = notes
        self._awaits_item = False
        self._was_in_other_hands = False
        self._until_s = math.inf
        self._boot_ms = 0
        self.note: DriveNote | None = None
        self.is_noted = False

    @property
    def deadline_s(self) -> float | None:
        """Until when the vehicle may tell which item it drives to."""
        return self._until_s if self._awaits_item else None

    def handle_timer(self, now_s: float) -> Sequence[Signal]:
        """Give up a drive of which the vehicle does not tell where it goes."""
        if self._awaits_item and now_s >= self._until_s:
            self._awaits_item = False
            self._tell_why_not("the vehicle does not report which item it drives to", now_s)
        return []

    def receive(self, frame: Frame, now_s: float) -> Sequence[Signal]:
        """Adopt the drive once the vehicle has said which item it drives to, and nothing has changed meanwhile."""
        core, message = self.core, frame.message
        if not core.is_from_vehicle(frame):
            return []
        if isinstance(message, m.GlobalPositionInt):
            self._boot_ms = message.time_boot_ms
        self._was_in_other_hands |= core.state is State.LEARNING and not self._is_driving
        if not (self._awaits_item and isinstance(message, m.MissionCurrent)):
            return []
        is_told = bool(core.number_of(message.seq)) or message.mission_state == MISSION_COMPLETE
        if core.state is not State.READY or not is_told or core.steps or self._lists.has_suspects:
            return []
        self._awaits_item = False
        if self.note is not None and (why_not := self._why_not(self.note)):
            self._tell_why_not(why_not, now_s)
            self.forget()
            return []
        return [Cue.ADOPTED]

    # Noting

    def begin(self) -> None:
        """Have the drive that is about to begin noted."""
        core = self.core
        assert core.plan is not None
        assert core.peer is not None
        if (
            self.note is not None
            and self.note.mission == core.ours
            and self.note.record.path == core.plan.path
        ):
            return
        mark = VehicleMark(core.peer.system, core.vehicle_uid)
        self.is_noted = False
        call = core.target.call if core.target is not None else None
        record = record_of(core.plan, core.situation)
        self.note = DriveNote(mark, core.ours or (), self._boot_ms, record, call or "")

    def forget(self) -> None:
        """Take notice that no drive of ours is under way any more."""
        self.note = None
        self._awaits_item = False

    def stop_waiting(self) -> None:
        """Take notice that something else is wanted; the note stands until the vehicle stands."""
        self._awaits_item = False

    # Adopting

    def look(self, now_s: float) -> bool:
        """Return whether the vehicle is on a drive that an earlier run has begun; where not, and it matters, it is said why."""
        core, notes = self.core, self._left
        self._left = ()
        if core.orders.once or core.orders.passive:
            return False
        note = next((one for one in notes if one.vehicle.uid and one.vehicle.uid == core.vehicle_uid), None)
        if note is None:
            if self._is_driving:
                self._tell_why_not(self._why_not_known(notes), now_s)
            return False
        why_not = self._why_not(note)
        if not why_not:
            try:
                core.plan = plan_again(note.record)
            except MissionError as error:
                why_not = f"it cannot be followed: {error}"
        if why_not:
            self._tell_why_not(why_not, now_s)
            return False
        assert core.plan is not None
        self.note = note
        self._awaits_item = True
        self._desk.take_up(situation_of(note.record))
        core.ours = note.mission
        self._until_s = now_s + _PATIENCE_S
        self._lists.suspect_all()
        core.operator.expect(core.modes.mission, set(), is_armed=True)
        return True

    def leads_to(self, target: LatLon) -> bool:
        """Return whether the noted drive is the one to a target."""
        asked = self.note.record.asked_targets if self.note is not None else ()
        return bool(asked) and is_same_place(asked[-1], target)

    def adopted(self, now_s: float) -> None:
        """Go on with the drive as if it had never been left; without orders to drive, watch it."""
        core, is_ours = self.core, self.core.orders.drive
        assert core.plan is not None
        call = HomeCall(self.note.call) if self.note is not None and self.note.call in set(HomeCall) else None
        source = TargetSource.TYPED if call is None else TargetSource.HOME
        core.target = Target(core.plan.targets[-1], source, call=call)
        text = "adopted the drive that pbpp started before it was restarted"
        text += "" if is_ours else "; without --drive it is only watched"
        core.voice.tell(now_s, EventName.ADOPTED, text, len(core.ours or ()), self._driver.item)
        self._halter.may_be_in_auto = is_ours
        self._driver.adopt(now_s, is_ours=is_ours)

    @property
    def _is_driving(self) -> bool:
        return self.core.is_in_mission

    def _why_not_known(self, notes: tuple[DriveNote, ...]) -> str:
        if not notes:
            return "this computer has no note of a drive that pbpp started"
        if not self.core.vehicle_uid:
            return (
                "the vehicle does not report its board's uid, so it may not be the one whose drive is noted"
            )
        return f"the noted drive is that of another vehicle ({notes[0].vehicle})"

    def _why_not(self, note: DriveNote) -> str:
        """Return what speaks against adopting; empty where nothing does."""
        situation, modes = self.core.situation, self.core.modes
        if not situation.armed:
            return "the vehicle is disarmed"
        if situation.mode != modes.mission:
            return f"the vehicle is in {modes.words(situation.mode)}, not in {modes.words(modes.mission)}"
        if self._was_in_other_hands:
            return "it was disarmed, or not in AUTO, while this bridge read its lists"
        if self._boot_ms < note.boot_ms:
            return "the vehicle has been rebooted since"
        if situation.mission is None:
            return "the vehicle's mission is not known"
        form = self.core.autopilot.lists.form
        return _difference(situation.mission.value.items, form.own_items(note.mission), form)

    def _tell_why_not(self, why_not: str, now_s: float) -> None:
        text = f"the vehicle's drive is neither adopted nor watched: {why_not}"
        self.core.voice.tell(now_s, EventName.NOT_ADOPTED, text, why_not)


def _difference(found: tuple[MissionItem, ...], noted: tuple[MissionItem, ...], form: StoredForm) -> str:
    """Return in words how a mission differs from the noted one; empty where it does not. Which of its items is the current one does not matter."""
    first = int(form.has_home_item)
    if len(found) != len(noted):
        return f"its mission has {len(found) + first} items, the noted one {len(noted) + first}"
    different = [
        seq
        for seq, (one, other) in enumerate(zip(found, noted, strict=True), first)
        if replace(one, current=False) != replace(other, current=False)
    ]
    return f"item {different[0]} of its mission is not the noted one" if different else ""
