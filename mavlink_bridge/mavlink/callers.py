"""Who is answered on a port that everybody may send to: those that speak MAVLink, lately, and not too many.

A datagram's source address costs nothing to forge, so that none is remembered for what it sends until that has decoded to a frame which is to be
believed, and none for ever.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

SourceT = TypeVar("SourceT")

FORGOTTEN_AFTER_S = 10.0
"""As MAVSDK forgets remotes: ten missed heartbeats. Whoever speaks again is answered again."""

MOST_CALLERS = 32
"""A vehicle, ground stations and companions are a handful; each of our messages is sent to every one."""

_REGULAR_AFTER_S = 2.0
"""Whoever still speaks after so long is no single datagram with a forged address: heartbeats come every second."""


@dataclass(slots=True)
class _Caller:
    first_s: float
    last_s: float

    @property
    def is_regular(self) -> bool:
        return self.last_s - self.first_s >= _REGULAR_AFTER_S


class Callers(Generic[SourceT]):
    """The sources that are answered.

    When there are too many, the one that spoke only for a moment, longest ago, makes room for a new one; where all speak regularly the new one
    has to wait, so that no flood drives the vehicle out.
    """

    def __init__(self) -> None:
        self._callers: dict[SourceT, _Caller] = {}

    def heard(self, source: SourceT, now_s: float) -> None:
        """Note that MAVLink came from a source."""
        self._forget(now_s)
        caller = self._callers.get(source)
        if caller is not None:
            caller.last_s = now_s
        elif len(self._callers) < MOST_CALLERS or self._makes_room():
            self._callers[source] = _Caller(now_s, now_s)

    def answered(self, now_s: float) -> Sequence[SourceT]:
        """Return the sources that are sent to now."""
        self._forget(now_s)
        return list(self._callers)

    def _forget(self, now_s: float) -> None:
        """Forget who is silent; the last one to speak stays, as in pymavlink, so that a vehicle in a radio's shadow is still called."""
        newest = max(self._callers, key=lambda source: self._callers[source].last_s, default=None)
        silent = [
            source
            for source, caller in self._callers.items()
            if now_s - caller.last_s > FORGOTTEN_AFTER_S and source != newest
        ]
        for source in silent:
            del self._callers[source]

    def _makes_room(self) -> bool:
        passing = [source for source, caller in self._callers.items() if not caller.is_regular]
        if passing:
            del self._callers[min(passing, key=lambda source: self._callers[source].last_s)]
        return bool(passing)
