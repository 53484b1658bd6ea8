"""The chain of records through a whole log, window by window.

A record is believed where the one before ends exactly there, the magic byte stands where it should and the timestamps lie within a day.
Where this breaks, the last frame must prove itself by its checksum, and the search goes on for the next one that does. A frame of an
unknown id has no checksum we could check; it is believed where a record follows it that fits.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from mavlink_bridge.errors import LogError
from mavlink_bridge.tlog.follow import Follower
from mavlink_bridge.tlog.scan import Scan
from mavlink_bridge.tlog.wire import MAX_FRAME_BYTES, TIMESTAMP_BYTES

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from mavlink_bridge.tlog.source import LogFile, Source

# A frame proves itself by the next ones, which must lie in the same window.
_OVERLAP_BYTES: Final = 4 * MAX_FRAME_BYTES


@dataclass(frozen=True, slots=True)
class Block:
    """The frames of one window, in the log's order.

    Parameters
    ----------
    scan : Scan
        The window they stand in.
    which : (n,) array of int
        Their indices among the scan's candidates.
    time_us : (n,) array of uint64
        Their timestamps in microseconds since the epoch, the link number still in the low two bits; 0 in a raw log.
    """

    scan: Scan
    which: NDArray[np.int64]
    time_us: NDArray[np.uint64]

    def times(self, places: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
        """Return the times in seconds and the link numbers of the frames at these places in the block."""
        time_us = self.time_us[places]
        return time_us / 1e6, (time_us & np.uint64(3)).astype(np.uint8)

    def senders(self, places: NDArray[np.int64]) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return the system and component ids of the frames at these places in the block."""
        scan, which = self.scan, self.which[places]
        system_at = scan.at[which] + np.where(scan.is_v2[which], 5, 3)
        return scan.view[system_at], scan.view[system_at + 1]


class Walk:
    """One walk through a log.

    Parameters
    ----------
    source : Source
    gap_bytes : int
        Bytes before each frame: 8 for a log with timestamps, 0 for a raw one.

    Attributes
    ----------
    tally : Counter of str
        The fields of `Damage` so far, without what only decoding finds.
    """

    def __init__(self, source: Source, gap_bytes: int) -> None:
        self._source = source
        self._gap_bytes = gap_bytes
        self.tally: Counter[str] = Counter()

    def __iter__(self) -> Iterator[Block]:
        begin = search_at = loose = 0
        time_us: int | None = None
        is_end = False
        while not is_end:
            data, is_end = self._source.window(begin)
            horizon = len(data) if is_end else len(data) - _OVERLAP_BYTES
            scan = Scan(data, self._gap_bytes, horizon)
            follower = Follower(scan, time_us, self.tally)
            search_at, loose = follower.follow(search_at, loose)
            chain = follower.chain()
            if len(chain):
                block = Block(scan, chain, follower.times())
                time_us = int(block.time_us[-1])
                self._count(block)
                yield block
            if is_end:
                follower.count_tail(loose)
            advance = max(loose, horizon - self._gap_bytes)
            begin, search_at, loose = begin + advance, max(search_at, horizon) - advance, loose - advance
        self.tally["broken_gzip"] = int(self._source.cut_short)

    def _count(self, block: Block) -> None:
        self.tally["frames"] += len(block.which)
        self.tally["unknown_ids"] += int((~block.scan.is_known[block.which]).sum())


def find_gap_bytes(file: LogFile) -> int:
    """Find out whether a log has timestamps, by how its first good frames follow one another.

    Returns
    -------
    int
        Bytes before each frame: 8 or 0.

    Raises
    ------
    LogError
        There is no MAVLink frame in the file, or it is of another kind.
    """
    begin = 0
    is_end = False
    with file.open() as source:
        while not is_end:
            data, is_end = source.window(begin)
            if begin == 0:
                _check_kind(bytes(data[:16]), file.path)
            scan = Scan(data, TIMESTAMP_BYTES, len(data))
            known = np.flatnonzero(scan.is_known)
            good = known[scan.intact(known)]
            if len(good):
                return _vote(scan.at[good], scan.end[good], file.path)
            if ((scan.step >= 0) & (scan.step[scan.step] >= 0)).any():
                return TIMESTAMP_BYTES  # ids foreign to us, but three records in a row that fit
            begin += len(data) - MAX_FRAME_BYTES
    raise LogError(f"{file.path}: no MAVLink messages in it", path=str(file.path))


def _check_kind(head: bytes, path: Path) -> None:
    from missions.formats.foreign_files import kind_of  # noqa: PLC0415 - formats are slow to come, only for such files

    kind = kind_of(head)
    if kind is not None:
        what, advice = kind
        raise LogError(f"{path} is {what}; expected a telemetry log (.tlog)", path=str(path), advice=advice)


def _vote(at: NDArray[np.int64], end: NDArray[np.int64], path: Path) -> int:
    timed = int(np.isin(end + TIMESTAMP_BYTES, at).sum())
    bare = int(np.isin(end, at).sum())
    if timed == bare:
        is_raw = at[0] < TIMESTAMP_BYTES or ".raw" in path.suffixes
        return 0 if is_raw else TIMESTAMP_BYTES
    return TIMESTAMP_BYTES if timed > bare else 0
