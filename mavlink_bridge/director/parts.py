"""The parts of the director, made in an order in which each knows only those before it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.director.adopter import Adopter
from mavlink_bridge.director.drive_supervisor import DriveSupervisor
from mavlink_bridge.director.fence_guard import FenceGuard
from mavlink_bridge.director.halter import Halter
from mavlink_bridge.director.hand_over import HandOver
from mavlink_bridge.director.hold_watch import HoldWatch
from mavlink_bridge.director.home_caller import HomeCaller
from mavlink_bridge.director.home_keeper import HomeKeeper
from mavlink_bridge.director.identity_guard import IdentityGuard
from mavlink_bridge.director.learner import Learner
from mavlink_bridge.director.list_watch import ListWatch
from mavlink_bridge.director.mission_writer import MissionWriter
from mavlink_bridge.director.obstacle_watch import ObstacleWatch
from mavlink_bridge.director.route_desk import RouteDesk
from mavlink_bridge.director.starter import Starter
from mavlink_bridge.director.target_inbox import TargetInbox

if TYPE_CHECKING:
    from mavlink_bridge.backup.drive_note import DriveNote
    from mavlink_bridge.director.core import Core, Part


class Parts:
    """All parts, and the orders in which they hear.

    Parameters
    ----------
    core : Core
        What they share.
    notes : tuple of DriveNote
        The drives that earlier runs have begun.

    Attributes
    ----------
    hearers : tuple of Part
        Those that hear frames: what the vehicle does, then who has it, then how the drive goes, then what it rests on, and last what is wanted.
    timed : tuple of Part
        Those that have timers. A vehicle that has fallen silent ends what the parts before would go on with, but not what they have done.
    """

    def __init__(self, core: Core, notes: tuple[DriveNote, ...]) -> None:
        self.core: Core = core
        self.learner: Learner = Learner(core)
        self.lists: ListWatch = ListWatch(core)
        self.obstacles: ObstacleWatch = ObstacleWatch(core)
        self.inbox: TargetInbox = TargetInbox(core)
        self.keeper: HomeKeeper = HomeKeeper(core)
        self.halter: Halter = Halter(core, self.lists)
        self.driver: DriveSupervisor = DriveSupervisor(core, self.halter)
        self.hold_watch: HoldWatch = HoldWatch(core, self.halter, self.driver)
        self.desk: RouteDesk = RouteDesk(
            core, self.lists, self.halter, self.keeper, self.driver, self.hold_watch
        )
        self.writer: MissionWriter = MissionWriter(core, self.lists, self.halter, self.desk)
        self.adopter: Adopter = Adopter(core, self.lists, self.halter, self.driver, self.desk, notes)
        self.fence: FenceGuard = FenceGuard(core)
        self.starter: Starter = Starter(
            core, self.lists, self.halter, self.driver, self.desk, self.adopter, self.fence
        )
        self.caller: HomeCaller = HomeCaller(core, self.inbox, self.halter, self.keeper)
        self.hand_over: HandOver = HandOver(core, self.halter, self.driver, self.caller)
        self.guard: IdentityGuard = IdentityGuard(core, self.learner, self.halter, self.inbox, self.writer)
        self.hearers: tuple[Part, ...] = (
            self.learner,
            self.hand_over,
            self.halter,
            self.caller,
            self.guard,
            self.driver,
            self.hold_watch,
            self.lists,
            self.fence,
            self.obstacles,
            self.inbox,
            self.adopter,
            self.starter,
        )
        self.timed: tuple[Part, ...] = (
            self.halter,
            self.hold_watch,
            self.desk,
            self.driver,
            self.learner,
            self.lists,
            self.fence,
            self.obstacles,
            self.adopter,
            self.caller,
            self.keeper,
        )
