"""The part of the director that makes the plan that stands a verified mission on the vehicle, as far as the orders go."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.states import ON_VEHICLE, Cue, Notice, Signal, State
from mavlink_bridge.director.steps import step
from mavlink_bridge.errors import BridgeError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.protocol.limits import Limits
from mavlink_bridge.protocol.outcomes import Writing, end_of_upload, upload_trouble
from mavlink_bridge.protocol.sendable import check_items
from mavlink_bridge.protocol.verified_upload import VerifiedUpload, VerifiedUploadOutcome
from missions.errors import MissionError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from mavlink_bridge.director.halter import Halter
    from mavlink_bridge.director.list_watch import ListWatch
    from mavlink_bridge.director.route_desk import RouteDesk
    from missions.items import MissionItem

_ON_OUR_MISSION = frozenset({*ON_VEHICLE, State.STARTING, State.DRIVING})


class MissionWriter(Part):
    """Writes missions, and notices when somebody else has.

    Attributes
    ----------
    upload : VerifiedUpload or None
        The newest upload, under way or ended; None before the first.
    outcome : VerifiedUploadOutcome or None
        How the newest upload that has ended did.
    is_confirmed : bool
        Whether the operator has said yes to the plan that stands.
    """

    def __init__(self, core: Core, lists: ListWatch, halter: Halter, desk: RouteDesk) -> None:
        super().__init__(core)
        self._lists = lists
        self._halter = halter
        self._desk = desk
        self.upload: VerifiedUpload | None = None
        self.outcome: VerifiedUploadOutcome | None = None
        self.is_confirmed = False
        self._backup_path: Path | None = None
        self._others_items = 0

    # What the shell sees and does

    @property
    def under_way(self) -> VerifiedUpload | None:
        """The upload under way, from the reading of the old mission on."""
        current = self.core.steps.current
        return current if isinstance(current, VerifiedUpload) else None

    @property
    def has_written(self) -> bool:
        """Whether anything was written on the vehicle in this run, or may have been."""
        under_way = self.under_way
        return self.outcome is not None or (under_way is not None and under_way.has_written)

    @property
    def pending_backup(self) -> tuple[MissionItem, ...] | None:
        """The vehicle's old mission, while it waits to be stored."""
        under_way = self.under_way
        return under_way.pending_backup if under_way is not None else None

    @property
    def awaits_confirmation(self) -> bool:
        """Whether a plan stands that is uploaded only after a yes."""
        orders = self.core.orders
        is_asked = orders.upload and orders.confirm and not self._is_confirmed
        return self.core.state is State.PROPOSED and is_asked

    @property
    def _is_confirmed(self) -> bool:
        """Whether the plan that stands may be written: a way home, which nobody may be there to confirm, was allowed with `--rtl-by-route`."""
        target = self.core.target
        return self.is_confirmed or (target is not None and target.is_home)

    def confirm(self) -> Sequence[Signal]:
        """Take the operator's yes to the plan that stands; a yes to none is forgotten."""
        if self.core.state is not State.PROPOSED:
            return []
        self.is_confirmed = True
        return self.go_on()

    def backup_stored(self, now_s: float, path: Path | None) -> None:
        """Take notice that the old mission is safe, and where: an upload that fails says so."""
        if (under_way := self.under_way) is not None:
            self._backup_path = path
            under_way.backup_stored(now_s)

    def backup_failed(self, trouble: BridgeError, now_s: float) -> Sequence[Signal]:
        """Take notice that the old mission cannot be stored: the upload is left before anything is written."""
        if self.pending_backup is None:
            return []
        self.core.steps.clear()
        return [*self._failed(trouble, {}, now_s), Notice.UPLOAD_ENDED]

    # Writing

    def go_on(self) -> Sequence[Signal]:
        """Do with the plan what the orders allow."""
        core = self.core
        if core.state is not State.PROPOSED or core.plan is None or core.peer is None:
            return []
        if not core.orders.upload:
            return core.end()
        return [] if core.orders.confirm and not self._is_confirmed else [Cue.UPLOAD]

    def begin(self, now_s: float) -> Sequence[Signal]:
        """Begin to write the plan that stands."""
        core = self.core
        assert core.plan is not None
        assert core.peer is not None
        core.steps.clear()
        form = core.autopilot.lists.form
        items = form.mission_of(core.plan.items, core.plan.home or core.plan.start)
        try:
            check_items(items, m.MissionType.MISSION)
        except MissionError as error:
            return self._failed(error, dict(error.details), now_s)
        self._backup_path = None
        limits = Limits.of_vehicle(core.autopilot, core.situation.parameters)
        upload = self.upload = VerifiedUpload(core.peer, m.MissionType.MISSION, items, limits=limits)
        if self._halter.is_mode_known(now_s):
            upload.know_vehicle(core.watch, now_s)
        core.voice.tell(now_s, EventName.UPLOADING, f"uploading {len(items)} items", len(items))
        core.steps.run([step(upload, self._uploaded)], now_s)
        return []

    def _uploaded(self, machine: VerifiedUpload, now_s: float) -> Sequence[Signal]:
        core = self.core
        outcome = self.outcome = machine.outcome
        assert outcome is not None
        if (trouble := upload_trouble(outcome)) is not None:
            core.ours = None
            ended = end_of_upload(trouble, Writing("mission", machine, self._backup_path))
            assert isinstance(ended, BridgeError)
            return [*self._failed(ended, dict(ended.details), now_s), Notice.UPLOAD_ENDED]
        core.ours = outcome.found if outcome.found is not None else outcome.backup
        assert core.plan is not None
        count = len(core.autopilot.lists.form.mission_of(core.plan.items, core.plan.start))
        text = f"mission of {count} items verified on the vehicle"
        core.voice.tell(now_s, EventName.VERIFIED, text, count, outcome.pushes)
        return [Cue.UPLOAD_VERIFIED, Notice.UPLOAD_ENDED]

    def _failed(
        self, trouble: BridgeError | MissionError, details: Mapping[str, object], now_s: float
    ) -> Sequence[Signal]:
        self.core.voice.error(now_s, EventName.UPLOAD_FAILED, trouble, details)
        return self.core.fail_step(trouble)

    # Missions of others

    def look_at_old_mission(self) -> Sequence[Signal]:
        """Leave an upload of our own idea whose old mission, just read, is not ours any more."""
        ours, old = self.core.ours, self.pending_backup
        if old is None or not self._desk.is_own_idea or ours is None or self._is_ours(old):
            return []
        self.core.steps.clear()  # nothing was written yet
        self._others_items = len(old)
        return [Cue.TROUBLE, Notice.MISSION_TAKEN]

    def _is_ours(self, items: Sequence[MissionItem]) -> bool:
        """Return whether a list as it goes over the wire is our mission."""
        return self.core.has_items(self.core.autopilot.lists.form.own_items(items))

    def mission_read(self) -> Sequence[Signal]:
        """Look at the vehicle's mission, which was read again."""
        ours, items = self.core.ours, self._lists.mission_items
        if ours is None:
            return [Notice.MISSION_HEARD]
        if self._is_ours(items):
            return []
        self._others_items = len(items)
        return [Notice.MISSION_TAKEN, Notice.MISSION_HEARD]

    def mission_taken(self, now_s: float) -> Sequence[Signal]:
        """Leave a mission alone that somebody else put in the place of ours."""
        core, count = self.core, self._others_items
        core.ours = None
        text = f"another station changed the mission: {count} items"
        core.voice.tell(now_s, EventName.MISSION_CHANGED, text, count)
        if core.state is State.READY:
            core.target = None
            return []
        is_ours_to_leave = core.state in _ON_OUR_MISSION or self._desk.is_own_idea
        return [Cue.TAKEN_OVER] if is_ours_to_leave else []
