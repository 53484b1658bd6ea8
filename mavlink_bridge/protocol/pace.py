"""How long a transfer may take: so that every machine ends, whatever the vehicle does, and it is known beforehand when.

A transfer has `ALLOWANCE_S` in hand. Time takes from it, each new item gives a second back, never beyond what there was at first. So a
vehicle that sends nothing new is left after that long, one that sends less than an item a second soon after, and a list of n items takes no
longer than `ALLOWANCE_S` + n seconds, nor any list longer than `MOST_S`.
"""

from __future__ import annotations

import math

MOST_S = 600.0
"""The longest that a whole list may take, all repeats included: a person stands beside it. 655 items over a radio of 1000 bytes a second take 140 s."""

ALLOWANCE_S = 60.0
"""The longest without progress: 40 items at 40 % loss each way took up to 83 s a push, which is less than an item a second."""

_JUDGED_AFTER_S = 20.0
"""Before it a list is not called too long for its bound: a link may begin with a stall."""


def bound_s(items: int) -> float:
    """Return the longest time that the transfer of a list of so many items may take, in seconds."""
    return min(ALLOWANCE_S + items, MOST_S)


class Pace:
    """The time that one transfer has left.

    Parameters
    ----------
    most_s : float
        Its longest time, whatever its progress.
    """

    def __init__(self, most_s: float = MOST_S) -> None:
        self._most_s = most_s
        self._begun_s = math.inf
        self._stalls_at_s = math.inf
        self._done = 0

    @property
    def deadline_s(self) -> float:
        """When the time is over if nothing more comes."""
        return min(self._stalls_at_s, self._begun_s + self._most_s)

    def start(self, now_s: float) -> None:
        """Begin to count the time."""
        self._begun_s = now_s
        self._stalls_at_s = now_s + ALLOWANCE_S

    def advance(self, done: int, now_s: float) -> None:
        """Note how many items are done; what was done once before gives nothing back."""
        if done > self._done:
            self._stalls_at_s = min(self._stalls_at_s + (done - self._done), now_s + ALLOWANCE_S)
            self._done = done

    def is_over(self, now_s: float) -> bool:
        """Return whether the time is over."""
        return now_s >= self.deadline_s

    def is_hopeless(self, done: int, count: int, since_s: float, now_s: float) -> bool:
        """Return whether a list of which ``done`` of ``count`` items came since ``since_s`` cannot be complete in time at that rate."""
        took_s = now_s - since_s
        if took_s < _JUDGED_AFTER_S:
            return False
        per_s = done / took_s
        left_s = self._begun_s + self._most_s - now_s
        if per_s < 1.0:
            left_s = min(left_s, (self._stalls_at_s - now_s) / (1.0 - per_s))
        return done + per_s * left_s < count
