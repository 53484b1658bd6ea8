"""Who we talk to and who we are: the filter before every protocol machine."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.autopilots import ARDUPILOT, AutopilotTable

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame, MissionType


@dataclass(frozen=True, slots=True)
class Peer:
    """The vehicle's component a machine talks to, and the identity it talks with.

    Parameters
    ----------
    system, component : int
        MAVLink ids of the vehicle's autopilot.
    own_system, own_component : int
        MAVLink ids we send with.
    autopilot : AutopilotTable
        Which autopilot it is: how it transfers lists, what its modes are called.

    Raises
    ------
    ValueError
        Both ends are the same: our own echoes could not be distinguished from answers.
    """

    system: int
    component: int
    own_system: int
    own_component: int
    autopilot: AutopilotTable = field(default=ARDUPILOT, compare=False, repr=False)

    def __post_init__(self) -> None:
        if (self.system, self.component) == (self.own_system, self.own_component):
            raise ValueError(
                f"the vehicle and pbpp cannot have the same ids ({self.system}/{self.component})"
            )

    def accepts(self, frame: Frame, mission_type: MissionType | None = None) -> bool:
        """Return whether a frame comes from the peer, is meant for us or for everyone, and has the mission type asked for.

        Messages without a target or without a mission type pass those parts of the test.
        """
        if (frame.system, frame.component) != (self.system, self.component):
            return False
        message = frame.message
        if getattr(message, "target_system", 0) not in (0, self.own_system):
            return False
        if getattr(message, "target_component", 0) not in (0, self.own_component):
            return False
        return mission_type is None or getattr(message, "mission_type", mission_type) == mission_type
