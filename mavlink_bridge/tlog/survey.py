"""What a log holds, from the frames' headers alone: who sent which messages, how many, and when."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mavlink_bridge.tlog.reader import TlogReader
from mavlink_bridge.tlog.wire import NAME_OF_ID

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from mavlink_bridge.tlog.damage import Damage
    from mavlink_bridge.tlog.walk import Block


@dataclass(frozen=True, slots=True)
class Traffic:
    """All messages of one type from one sender.

    Parameters
    ----------
    system, component : int
        The sender.
    message_id : int
    name : str
        MAVLink's name of the message; ``UNKNOWN_1234`` of an id our dialect does not have.
    count : int
    first_s, last_s : float
        When the first and the last came, in the log's time.
    """

    system: int
    component: int
    message_id: int
    name: str
    count: int
    first_s: float
    last_s: float

    @property
    def rate_hz(self) -> float:
        """Mean rate between the first and the last; 0 of a single one."""
        span_s = self.last_s - self.first_s
        return (self.count - 1) / span_s if span_s > 0 else 0.0


def survey(path: Path) -> tuple[list[Traffic], Damage]:
    """Count a log's messages by sender and type; checksums are not looked at.

    Parameters
    ----------
    path : pathlib.Path

    Returns
    -------
    traffic : list of Traffic
        Ordered by system, component and message id.
    damage : Damage

    Raises
    ------
    LogError
        The file is missing, unreadable, empty, or holds no MAVLink frame.
    """
    reader = TlogReader(path, [])
    count = TrafficCount()
    for block, _ in reader.blocks():
        count.take(block)
    return count.rows, reader.damage


class TrafficCount:
    """Counts messages by sender and type, block by block."""

    def __init__(self) -> None:
        self._found: dict[int, Traffic] = {}

    def take(self, block: Block) -> None:
        """Count a block's messages."""
        for key, traffic in _block_traffic(block).items():
            known = self._found.get(key)
            self._found[key] = traffic if known is None else _joined(known, traffic)

    @property
    def rows(self) -> list[Traffic]:
        """What was counted, ordered by system, component and message id."""
        return [self._found[key] for key in sorted(self._found)]


def _block_traffic(block: Block) -> dict[int, Traffic]:
    system, component = block.senders(np.arange(len(block.which)))
    ids = block.scan.ids[block.which].astype(np.int64)
    keys = system.astype(np.int64) << 32 | component.astype(np.int64) << 24 | ids
    order = np.argsort(keys, kind="stable")
    edges = np.flatnonzero(np.diff(keys[order], prepend=-1))
    counts = np.diff(edges, append=len(order))
    time_s: NDArray[np.float64] = block.time_us[order] / 1e6
    rows = zip(
        keys[order][edges].tolist(),
        counts.tolist(),
        np.minimum.reduceat(time_s, edges).tolist(),
        np.maximum.reduceat(time_s, edges).tolist(),
        strict=True,
    )
    return {key: _traffic(key, *row) for key, *row in rows}


def _traffic(key: int, count: int, first_s: float, last_s: float) -> Traffic:
    message_id = key & 0xFFFFFF
    name = NAME_OF_ID.get(message_id, f"UNKNOWN_{message_id}")
    return Traffic(key >> 32, key >> 24 & 0xFF, message_id, name, count, first_s, last_s)


def _joined(one: Traffic, other: Traffic) -> Traffic:
    first_s, last_s = min(one.first_s, other.first_s), max(one.last_s, other.last_s)
    return replace(one, count=one.count + other.count, first_s=first_s, last_s=last_s)
