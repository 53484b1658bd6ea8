"""How long an answer takes, estimated from those that came (Jacobson 1988, as in RFC 6298)."""

from __future__ import annotations

import math


class RoundTrip:
    """Smoothed round-trip time and its variation; samples of repeated messages must be left out (Karn)."""

    def __init__(self, first_guess_s: float = 0.25) -> None:
        self._mean_s = first_guess_s
        self._variation_s = first_guess_s / 2
        self._is_guess = True
        self._least_s = math.inf

    @property
    def is_known(self) -> bool:
        """Whether one was measured."""
        return self._least_s < math.inf

    @property
    def least_s(self) -> float:
        """Shortest round-trip time so far, infinite before the first."""
        return self._least_s

    @property
    def mean_s(self) -> float:
        """Smoothed round-trip time."""
        return self._mean_s

    @property
    def variation_s(self) -> float:
        """Smoothed deviation from the mean."""
        return self._variation_s

    def guess(self, bound_s: float) -> None:
        """Take a time within which an answer came, to one of several questions perhaps; the first sample replaces it."""
        if self._is_guess:
            self._mean_s, self._variation_s = bound_s, bound_s / 2

    def observe(self, sample_s: float) -> None:
        """Take one measured round trip."""
        self._least_s = min(self._least_s, sample_s)
        if self._is_guess:
            self._mean_s, self._variation_s, self._is_guess = sample_s, sample_s / 2, False
            return
        self._variation_s += (abs(sample_s - self._mean_s) - self._variation_s) / 4
        self._mean_s += (sample_s - self._mean_s) / 8

    def timeout_s(self, least_s: float, most_s: float) -> float:
        """Return the time after which an answer is overdue."""
        return min(max(self._mean_s + 4 * self._variation_s, least_s), most_s)
