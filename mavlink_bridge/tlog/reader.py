"""Reading telemetry logs: ``.tlog`` (timestamp and frame), ``.raw`` (frames alone), either packed with gzip."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mavlink_bridge.mavlink.messages import Frame, Message
from mavlink_bridge.tlog.build import build
from mavlink_bridge.tlog.damage import Damage
from mavlink_bridge.tlog.decode import decode, payloads, select, texts, wanted_ids
from mavlink_bridge.tlog.raw_time import RawClock
from mavlink_bridge.tlog.source import LogFile
from mavlink_bridge.tlog.walk import Block, Walk, find_gap_bytes
from mavlink_bridge.tlog.wire import LAYOUTS, layout_of

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Collection, Iterator
    from typing import Any

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class LogEntry:
    """A frame of a log.

    Parameters
    ----------
    time_s : float
        Seconds since the epoch, as the log has it: it may jump, also backwards. In a raw log seconds since the vehicle booted.
    link : int
        The low two bits of the timestamp. MAVProxy writes the number of the link the frame came in on there, and 3 for a frame it
        sent; in other programs' logs they mean nothing.
    frame : Frame
    """

    time_s: float
    link: int
    frame: Frame


class TlogReader:
    """The frames of a telemetry log, in its order. Can be iterated over again and again.

    Damage (see `Damage`) is skipped and counted. Frames that a log holds twice come twice. Signatures are not verified.

    Parameters
    ----------
    path : pathlib.Path or str
    wanted : collection of Message types, optional
        What to decode; all types of `mavlink_bridge.mavlink.messages` by default. Of other frames only the header is looked at.

    Raises
    ------
    LogError
        The file is missing, unreadable, empty, or holds no MAVLink frame.
    ValueError
        A wanted class is not a message on the wire.
    """

    def __init__(self, path: Path | str, wanted: Collection[type[Message]] | None = None) -> None:
        self._is_wanted = wanted_ids(LAYOUTS if wanted is None else wanted)
        self._file = LogFile(Path(path))
        self._gap_bytes = find_gap_bytes(self._file)
        self._damage = Damage()

    @property
    def has_timestamps(self) -> bool:
        """Whether the log has timestamps; a raw one has not."""
        return self._gap_bytes > 0

    @property
    def damage(self) -> Damage:
        """What the latest iteration found damaged, as far as it has come."""
        return self._damage

    def __iter__(self) -> Iterator[LogEntry]:
        for block, places in self.blocks():
            yield from entries(block, places)

    def blocks(self) -> Iterator[tuple[Block, NDArray[np.int64]]]:
        """Walk through the log without decoding: each window's frames, and the places among them of the wanted good ones."""
        bad_crcs = 0
        clock = RawClock()
        with self._file.open() as source:
            walk = Walk(source, self._gap_bytes)
            for block in walk:
                if not self._gap_bytes:
                    clock.set_times(block)
                places, bad = select(block, self._is_wanted)
                bad_crcs += bad
                self._damage = _damage(walk.tally, bad_crcs)
                yield block, places
            self._damage = _damage(walk.tally, bad_crcs)


def entries(block: Block, places: NDArray[np.int64]) -> list[LogEntry]:
    """Return frames of a block, decoded."""
    time_s, link = block.times(places)
    system, component = block.senders(places)
    messages = decode(block.scan, block.which[places])
    frames = build(Frame, (system.tolist(), component.tolist(), messages))
    return build(LogEntry, (time_s.tolist(), link.tolist(), frames))


def read_columns(path: Path | str, message_class: type[Message]) -> dict[str, NDArray[Any]]:
    """Read all messages of one type as columns, without making an object of each.

    Parameters
    ----------
    path : pathlib.Path or str
    message_class : type of Message

    Returns
    -------
    dict of str to (n,) array
        The message's fields by name, and ``time_s``, ``link``, ``system``, ``component`` of each.

    Raises
    ------
    LogError, ValueError
        As `TlogReader`.
    """
    layout = layout_of(message_class)
    reader = TlogReader(path, [message_class])
    parts: dict[str, list[NDArray[Any]]] = {}
    for block, places in reader.blocks():
        rows = payloads(block.scan, block.which[places], layout)
        time_s, link = block.times(places)
        system, component = block.senders(places)
        columns: dict[str, NDArray[Any]] = {
            "time_s": time_s,
            "link": link,
            "system": system,
            "component": component,
        }
        for name, is_text in zip(layout.dtype.names or (), layout.texts, strict=True):
            columns[name] = np.array(texts(rows[name]), str) if is_text else rows[name]
        for name, column in columns.items():
            parts.setdefault(name, []).append(column)
    return {name: np.concatenate(columns) for name, columns in parts.items()}


def _damage(tally: Counter[str], bad_crcs: int) -> Damage:
    counts = tally.copy()
    counts["frames"] -= bad_crcs
    counts["bad_crcs"] += bad_crcs
    return Damage(**counts)
