"""How far a rover is off its path, and the shape of a route at a corner."""

from __future__ import annotations

import math
from typing import NamedTuple

KEPT_ACROSS = 0.3
"""What is left to either side, at the least, of an error that a corner turns from sideways to lengthways."""


class Stray(NamedTuple):
    """How far beyond its band a rover may be to the left and to the right of its path; it dies away with time.

    A tuple, because tens of thousands are made for one plan.

    Parameters
    ----------
    left_m, right_m : float
        At time 0, which is the middle of the corner it comes from.
    """

    left_m: float = 0.0
    right_m: float = 0.0

    @property
    def widest_m(self) -> float:
        """The larger of the two."""
        return max(self.left_m, self.right_m)

    def after(self, time_s: float, gain_per_s: float) -> Stray:
        """Return what is left of the stray after a time."""
        if not (self.left_m or self.right_m):
            return self
        left = math.exp(-gain_per_s * time_s) if time_s > 0 else 1.0
        return Stray(self.left_m * left, self.right_m * left)

    def turned(self, turn_deg: float) -> Stray:
        """Return the stray as seen from the next leg."""
        if not (self.left_m or self.right_m):
            return self
        cosine = math.cos(math.radians(turn_deg))
        same, other = (cosine, 0.0) if cosine > 0 else (0.0, -cosine)
        least_m = KEPT_ACROSS * self.widest_m * abs(math.sin(math.radians(turn_deg)))
        return Stray(
            max(same * self.left_m + other * self.right_m, least_m),
            max(same * self.right_m + other * self.left_m, least_m),
        )

    def seen_from(self, turn_deg: float) -> Stray:
        """Return the stray as at a right turn: the outside left, the inside right."""
        return self if turn_deg >= 0 else Stray(self.right_m, self.left_m)

    def widened(self, more_m: float) -> Stray:
        """Return the stray with more to either side."""
        return Stray(self.left_m + more_m, self.right_m + more_m)

    def wider(self, other: Stray) -> Stray:
        """Return to each side the larger of two strays."""
        return Stray(max(self.left_m, other.left_m), max(self.right_m, other.right_m))

    def swung(self, turn_deg: float, swing_m: float) -> Stray:
        """Return the stray with a swing to the outside of a turn added."""
        if turn_deg >= 0:
            return Stray(self.left_m + swing_m, self.right_m)
        return Stray(self.left_m, self.right_m + swing_m)


class Bend(NamedTuple):
    """The shape of a route at a corner.

    Parameters
    ----------
    turn_deg : float
        Change of course, to the right positive.
    whole_deg : float
        That of the corners close before it included.
    shorter_run_m : float
        How far the route goes nearly straight on before the corner or after it, whichever is less.
    speed_mps : float
        The larger of the speeds asked for before and after it.
    changes_speed : bool
        Whether another speed is asked for after it, which was measured on straight lines only.
    """

    turn_deg: float
    whole_deg: float
    shorter_run_m: float
    speed_mps: float
    changes_speed: bool = False

    @property
    def widest_deg(self) -> float:
        """The larger of the two turns, where they are to the same side."""
        widest_deg = abs(self.turn_deg)
        if self.whole_deg * self.turn_deg > 0:
            widest_deg = max(widest_deg, abs(self.whole_deg))
        return min(widest_deg, 180.0)
