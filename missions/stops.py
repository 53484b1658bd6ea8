"""How far the vehicle was seen to roll on after HOLD or disarming, and how far its owner says it does.

HOLD, MANUAL with centred sticks and disarming do not brake: the throttle goes to 0 and the rover rolls (docs/drive-model.md). How far is
each rover's own. In MANUAL somebody may drive or brake, so that what is seen there tells nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from missions.geo import distance_m

if TYPE_CHECKING:
    from missions.geo import LatLon

LEAST_MPS = 0.5
"""Slower stops are not counted: the way is no longer than a position's noise. Chosen, not measured."""

STANDING_MPS = 0.15
"""A stop has ended: beyond the noise of a position that stands; chosen, not measured."""

NEARLY_MPS = 0.3
"""A stop that ends early, by another mode, counts from here on; what was left of it is added. As the bridge plans from there."""

CLASS_MPS = 0.5
"""The worst stop of each class of speeds is kept; so wide is one. Chosen, not measured."""

_GAINED_MPS = (
    0.3  # faster than before by more: it is driven or pushed, and rolls no more; chosen, not measured
)
_LONGEST_S = 60.0  # the longest measured one took 12 s
_JUMP_M = 1.0  # farther than its first speed allows: the fix has jumped; chosen, not measured


@dataclass(frozen=True, slots=True)
class Stop:
    """One way to a standstill.

    Parameters
    ----------
    speed_mps : float
        The speed at its begin.
    distance_m : float
        How far the vehicle rolled until it stood.
    """

    speed_mps: float
    distance_m: float


@dataclass(frozen=True, slots=True)
class Rolling:
    """A stop under way.

    Parameters
    ----------
    begun_s : float
        When the mode or the disarming that began it was heard.
    first : tuple of LatLon and float, optional
        The first position after that, and the speed there.
    last : tuple of LatLon and float, optional
        The newest ones.
    first_s : float
        When the first was heard.
    last_s : float
        When the newest was.
    """

    begun_s: float
    first: tuple[LatLon, float] | None = None
    last: tuple[LatLon, float] | None = None
    first_s: float = 0.0
    last_s: float = 0.0

    def moved(self, place: LatLon, speed_mps: float, time_s: float) -> Rolling:
        """Return it with another position."""
        if self.first is None:
            here = (place, speed_mps)
            return replace(self, first=here, last=here, first_s=time_s, last_s=time_s)
        return replace(self, last=(place, speed_mps), last_s=time_s)

    def is_lost(self, speed_mps: float, time_s: float) -> bool:
        """Return whether a newer speed shows that it rolls no more, or never did."""
        if time_s > self.begun_s + _LONGEST_S:
            return True
        if self.last is None:
            return speed_mps < LEAST_MPS
        return speed_mps > self.last[1] + _GAINED_MPS

    @property
    def stop(self) -> Stop | None:
        """The stop, once it stands or nearly does; what is left is added as if the speed fell evenly with the way, as measured rovers' did."""
        if self.first is None or self.last is None or self.last[1] > NEARLY_MPS:
            return None
        speed_mps = self.first[1]
        rolled_m = distance_m(self.first[0], self.last[0])
        if rolled_m > speed_mps * (self.last_s - self.first_s) + _JUMP_M:
            return None
        return Stop(speed_mps, rolled_m * speed_mps / (speed_mps - self.last[1]))


@dataclass(frozen=True, slots=True)
class Stops:
    """What is known of a vehicle's stops.

    Parameters
    ----------
    given : tuple of Stop
        What its owner says (``--stopping``).
    own : tuple of Stop
        Those that were seen, by speed: the longest of each class.
    rolling : Rolling, optional
        The one under way.
    """

    given: tuple[Stop, ...] = ()
    own: tuple[Stop, ...] = ()
    rolling: Rolling | None = None

    def begun(self, time_s: float) -> Stops:
        """Return them when the vehicle begins to roll."""
        return replace(self, rolling=Rolling(time_s))

    def moved(self, place: LatLon, speed_mps: float, time_s: float) -> Stops:
        """Return them after a position of the vehicle."""
        rolling = self.rolling
        if rolling is None:
            return self
        if rolling.is_lost(speed_mps, time_s):
            return self.ended()
        after = replace(self, rolling=rolling.moved(place, speed_mps, time_s))
        return after.ended() if speed_mps <= STANDING_MPS else after

    def ended(self) -> Stops:
        """Return them when the vehicle rolls no more: it stands, or is in another mode."""
        stop = self.rolling.stop if self.rolling is not None else None
        return replace(self, own=self.own if stop is None else _with_worst(self.own, stop), rolling=None)


def _with_worst(known: tuple[Stop, ...], stop: Stop) -> tuple[Stop, ...]:
    classes = {_class(one): one for one in known}
    if stop.distance_m > classes.get(_class(stop), Stop(0.0, 0.0)).distance_m:
        classes[_class(stop)] = stop
    return tuple(classes[number] for number in sorted(classes))


def _class(stop: Stop) -> int:
    return int(stop.speed_mps / CLASS_MPS)
