"""Targets that come by the stream: who asked for what, told from what is only said again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

from mavlink_bridge.director.addressed import is_command_to
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.fold import TargetMessage
from mavlink_bridge.mavlink import messages as m
from missions.geo import distance_m, from_e7

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.mavlink.modes import Modes
    from missions.geo import LatLon
    from missions.situation import Situation

_SOURCES: dict[str, TargetSource] = {
    TargetMessage.REPOSITION: TargetSource.REPOSITION,
    TargetMessage.POSITION_TARGET: TargetSource.POSITION_TARGET,
    TargetMessage.GUIDED_ITEM: TargetSource.GUIDED_ITEM,
}
_CLICKS = frozenset(
    {TargetSource.REPOSITION, TargetSource.POSITION_TARGET, TargetSource.GUIDED_ITEM, TargetSource.ECHO}
)
_SAME_M = 0.2  # far more than the rounding of the wire (1 cm), far less than two clicks differ by; chosen, not measured
_SAID_AGAIN_S = 3.0  # ground stations repeat a command that is not acknowledged within about a second; chosen, not measured
_ECHO_MOVED_M = 0.5  # the vehicle reports the target that it was given a little off; chosen, not measured


class HomeCall(StrEnum):
    """Why the vehicle is called home."""

    RTL = "RTL"
    BATTERY = "low battery"
    GCS = "no ground station heard"
    BREACH = "fence breach"


@dataclass(frozen=True, slots=True)
class Target:
    """A place somebody wants the vehicle at.

    Parameters
    ----------
    position : LatLon
        The place.
    source : TargetSource
        How it came.
    is_to_us : bool
        Whether our own component was asked for it; then a COMMAND_ACK is waited for, and the vehicle heard nothing.
    asker : tuple of int, optional
        System and component id that sent it.
    is_again : bool
        Whether it only says again what was said a moment ago.
    call : HomeCall, optional
        Why it is called home: the place is the nearest one once it stands, and the position only a guess until then.
    """

    position: LatLon
    source: TargetSource
    is_to_us: bool = False
    asker: tuple[int, int] | None = None
    is_again: bool = False
    call: HomeCall | None = None

    @property
    def is_home(self) -> bool:
        """Whether the vehicle is called home."""
        return self.call is not None

    @property
    def has_set_off(self) -> bool:
        """Whether it may have set the vehicle going, off any route of ours: HOLD follows at once."""
        return self.is_click or self.call in (HomeCall.RTL, HomeCall.BREACH)

    @property
    def is_click(self) -> bool:
        """Whether it may set the vehicle going, straight, before any plan exists."""
        return self.source in _CLICKS and not self.is_to_us

    def sets_going(self, mode: int | None, modes: Modes) -> bool:
        """Return whether it has made a vehicle in this mode drive straight to it."""
        is_command = self.source is TargetSource.REPOSITION
        return self.is_click and (is_command or (mode is not None and mode == modes.guided))


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
        self._commands_count_anew = False

    def look(
        self,
        frame: Frame,
        before: Situation,
        after: Situation,
        now_s: float,
        identity: tuple[int, int],
        modes: Modes,
    ) -> Target | None:
        """Return the target that a frame brought, None where it brought none that is heeded."""
        target = self._asked(frame, before, after, identity) or self._echoed(frame, after, modes)
        if target is None or target.source not in self._sources:
            return None
        is_same = is_same_place(self._newest, target.position)
        is_again = is_same and now_s - self._said_s < _SAID_AGAIN_S
        if target.source is TargetSource.REPOSITION and self._commands_count_anew:
            is_again = self._commands_count_anew = False
        self._newest, self._said_s = target.position, now_s
        return replace(target, is_again=is_again)

    def take(self, position: LatLon, now_s: float) -> None:
        """Take notice of a target from elsewhere, so that the vehicle's echo of it is not taken for a new one."""
        self._newest, self._said_s = position, now_s

    def let_go(self) -> None:
        """Take the next command for a new one, wherever to; what is streamed counts on."""
        self._commands_count_anew = True

    def _asked(
        self, frame: Frame, before: Situation, after: Situation, identity: tuple[int, int]
    ) -> Target | None:
        known = after.target
        if known is None or known is before.target:
            return None
        return Target(
            known.value,
            _SOURCES[known.source],
            is_to_us=is_command_to(frame, identity, after.system),
            asker=(frame.system, frame.component),
        )

    def _echoed(self, frame: Frame, after: Situation, modes: Modes) -> Target | None:
        """Take the vehicle's echo for a target: in GUIDED only, in AUTO it may be a corner of its own avoidance."""
        message = frame.message
        if not isinstance(message, m.PositionTargetGlobalInt) or modes.guided is None:
            return None
        if after.mode != modes.guided:
            return None
        if frame.system != after.system or (message.lat_int, message.lon_int) == (0, 0):
            return None
        position = from_e7(message.lat_int, message.lon_int)
        if self._newest is not None and distance_m(self._newest, position) < _ECHO_MOVED_M:
            return None
        return Target(position, TargetSource.ECHO)


def is_same_place(a: LatLon | None, b: LatLon | None) -> bool:
    """Return whether two places are one, but for the rounding of the wire."""
    return a is b or (a is not None and b is not None and distance_m(a, b) < _SAME_M)
