"""Targets that come by the stream: who asked for what, told from what is only said again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge import messages as m
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.rover import GUIDED_MODE
from missions.geo import distance_m, from_e7

if TYPE_CHECKING:
    from mavlink_bridge.messages import Frame
    from missions.geo import LatLon
    from missions.situation import Situation

_SOURCES = {
    "DO_REPOSITION": TargetSource.REPOSITION,
    "SET_POSITION_TARGET_GLOBAL_INT": TargetSource.POSITION_TARGET,
    "MISSION_ITEM with current 2": TargetSource.GUIDED_ITEM,
}
CLICKS = frozenset(
    {TargetSource.REPOSITION, TargetSource.POSITION_TARGET, TargetSource.GUIDED_ITEM, TargetSource.ECHO}
)
"""Targets that may set the vehicle going, straight."""

_SAME_M = 0.2
_SAID_AGAIN_S = 3.0
_ECHO_MOVED_M = 0.5


@dataclass(frozen=True, slots=True)
class Target:
    """A place somebody wants the vehicle at.

    Parameters
    ----------
    position : LatLon
        The place.
    source : TargetSource
        How it came.
    command : int, optional
        The command that asked our own component for it and waits for a COMMAND_ACK.
    asker : tuple of int, optional
        System and component id that sent it.
    """

    position: LatLon
    source: TargetSource
    command: int | None = None
    asker: tuple[int, int] | None = None


class TargetWatch:
    """Finds targets in the stream.

    Parameters
    ----------
    sources : frozenset of TargetSource
        The ones that are heeded.
    """

    def __init__(self, sources: frozenset[TargetSource]) -> None:
        self._sources = sources
        self._newest: LatLon | None = None
        self._said_s = 0.0

    def look(
        self, frame: Frame, before: Situation, after: Situation, now_s: float, identity: tuple[int, int]
    ) -> Target | None:
        """Give the target that a frame brought, None where it brought none or only said it again."""
        target = self._asked(frame, before, after, identity) or self._echoed(frame, after)
        if target is None or target.source not in self._sources:
            return None
        is_same = self._newest is not None and distance_m(self._newest, target.position) < _SAME_M
        is_again = is_same and now_s - self._said_s < _SAID_AGAIN_S
        self._newest, self._said_s = target.position, now_s
        return None if is_again else target

    def take(self, position: LatLon, now_s: float) -> None:
        """Take notice of a target from elsewhere, so that the vehicle's echo of it is not taken for a new one."""
        self._newest, self._said_s = position, now_s

    def _asked(
        self, frame: Frame, before: Situation, after: Situation, identity: tuple[int, int]
    ) -> Target | None:
        known = after.target
        if known is None or known is before.target:
            return None
        message = frame.message
        is_to_us = getattr(message, "target_component", None) == identity[1]
        command = message.command if isinstance(message, m.CommandInt | m.CommandLong) else None
        return Target(
            known.value,
            _SOURCES[known.source],
            command=command if is_to_us else None,
            asker=(frame.system, frame.component),
        )

    def _echoed(self, frame: Frame, after: Situation) -> Target | None:
        """Take the vehicle's echo for a target: in GUIDED only, in AUTO it may be a corner of its own avoidance."""
        message = frame.message
        if not isinstance(message, m.PositionTargetGlobalInt) or after.mode != GUIDED_MODE:
            return None
        if frame.system != after.system or (message.lat_int, message.lon_int) == (0, 0):
            return None
        position = from_e7(message.lat_int, message.lon_int)
        if self._newest is not None and distance_m(self._newest, position) < _ECHO_MOVED_M:
            return None
        return Target(position, TargetSource.ECHO)
