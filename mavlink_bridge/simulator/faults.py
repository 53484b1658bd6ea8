"""A bad link, seeded: loss, duplicates, reordering, latency, jitter, bit errors, silence. One `FaultyLink` is one direction."""

from __future__ import annotations

import heapq
import random
from dataclasses import dataclass
from typing import Generic, TypeVar

Payload = TypeVar("Payload")

REORDER_S = 0.05
"""How long a reordered payload is held back, so that later ones overtake it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Faults:
    """How bad a link is.

    Parameters
    ----------
    loss, duplicate, reorder : float
        Probabilities, 0 to 1, for each payload.
    latency_s, jitter_s : float
        Every payload is late by the latency and a random part of the jitter; jitter lets payloads overtake each other.
    bit_error : float
        Probability that one bit of a payload of bytes is flipped; other payloads are lost instead.
    silence : tuple of float, optional
        From when and for how long nothing comes through, in seconds.
    """

    loss: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    latency_s: float = 0.0
    jitter_s: float = 0.0
    bit_error: float = 0.0
    silence: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        for name in ("loss", "duplicate", "reorder", "bit_error"):
            value = getattr(self, name)
            if not 0.0 <= value <= 1.0:
                raise ValueError(f"{name} {value:g} is not a probability from 0 to 1")
        for name in ("latency_s", "jitter_s"):
            value = getattr(self, name)
            if not 0.0 <= value < float("inf"):
                raise ValueError(f"{name} {value:g} is not a time in seconds")


class FaultyLink(Generic[Payload]):
    """One direction of a link, sans-IO: what is pushed comes out late, twice, damaged or never.

    Parameters
    ----------
    faults : Faults
        How bad it is.
    seed : int
        The same seed and the same pushes give the same link.
    """

    def __init__(self, faults: Faults, seed: int = 0) -> None:
        self._faults = faults
        self._random = random.Random(seed)  # noqa: S311 - a simulation, no secret
        self._queue: list[tuple[float, int, Payload]] = []
        self._count = 0

    @property
    def deadline_s(self) -> float | None:
        """When the next payload comes out; None while there is none."""
        return self._queue[0][0] if self._queue else None

    def push(self, payload: Payload, now_s: float) -> None:
        """Put a payload in."""
        faults, chance = self._faults, self._random.random
        silent = faults.silence is not None and 0.0 <= now_s - faults.silence[0] < faults.silence[1]
        lost = chance() < faults.loss
        copies = 2 if chance() < faults.duplicate else 1
        if silent or lost:
            return
        for _ in range(copies):
            damaged = chance() < faults.bit_error
            if damaged and not isinstance(payload, bytes):
                continue
            due_s = now_s + faults.latency_s + faults.jitter_s * chance()
            if chance() < faults.reorder:
                due_s += REORDER_S
            self._count += 1
            heapq.heappush(self._queue, (due_s, self._count, self._flipped(payload) if damaged else payload))

    def due(self, now_s: float) -> list[Payload]:
        """Take out what has come through by now, in order of arrival."""
        arrived = []
        while self._queue and self._queue[0][0] <= now_s + 1e-9:
            arrived.append(heapq.heappop(self._queue)[2])
        return arrived

    def _flipped(self, payload: Payload) -> Payload:
        assert isinstance(payload, bytes)
        damaged = bytearray(payload)
        if damaged:
            damaged[self._random.randrange(len(damaged))] ^= 1 << self._random.randrange(8)
        return type(payload)(damaged)
