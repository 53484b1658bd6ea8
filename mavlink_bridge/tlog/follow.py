"""The chain of records through one window, and the search for its next link after damage."""

from __future__ import annotations

from bisect import bisect_left
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mavlink_bridge.tlog.scan import NEAR_US, NOWHERE, Scan, near
from mavlink_bridge.tlog.wire import MAGIC_V1, MAGIC_V2, MAX_FRAME_BYTES, TIMESTAMP_BYTES

if TYPE_CHECKING:
    from collections import Counter

    from numpy.typing import NDArray


class Follower:
    """Follows the chain of records through one window.

    Parameters
    ----------
    scan : Scan
        The window.
    time_us : int or None
        The last timestamp before the window.
    tally : Counter of str
        Counted up: the fields of `Damage` that the walk finds.

    """

    def __init__(self, scan: Scan, time_us: int | None, tally: Counter[str]) -> None:
        self._scan = scan
        self._gap_bytes = scan.gap_bytes
        self._time_before_us = time_us
        self._time_us = time_us
        self._tally = tally
        self._untimed: list[int] = []
        self._runs: list[NDArray[np.int64]] = []

    def follow(self, search_at: int, loose: int) -> tuple[int, int]:
        """Follow the chain as far as the window goes.

        Parameters
        ----------
        search_at : int
            Frames are looked for from this offset on.
        loose : int
            Where the last record ended, and so the next one should begin; negative if that was before the window.

        Returns
        -------
        search_at, loose : int
            The same at the end: all before `search_at` has been searched, bytes from `loose` on belong to nothing yet.
        """
        size = len(self._scan.data)
        index = self._next(search_at, loose, loose)
        while index is not None:
            self._open_run(index, loose)
            run, is_cut = self._scan.run(index)
            self._runs.append(run)
            last = int(run[-1])
            if last not in self._untimed[-1:]:
                self._time_us = int(self._scan.time_us[last])
            end = int(self._scan.end[last])
            search_at = loose = end
            if is_cut:
                break
            if self._scan.is_intact(last):
                index = None if end == size else self._next(end, end, end)
            else:
                search_at = int(self._scan.at[last]) + 1
                index = self._next(search_at, end, end)
                loose = self._settle(last, index)
        return search_at, loose

    def chain(self) -> NDArray[np.int64]:
        """Return the indices of the frames found, among the scan's candidates."""
        return np.concatenate([np.zeros(0, np.int64), *self._runs])

    def times(self) -> NDArray[np.uint64]:
        """Return the timestamp of each frame of the chain, mended where it is missing or stands alone far off."""
        chain = self.chain()
        times = self._scan.time_us[chain]
        if not self._gap_bytes or (len(self._runs) == 1 and not self._untimed):
            return times  # within a run all timestamps are near
        is_missing = np.isin(chain, self._untimed)
        known = np.flatnonzero(~is_missing)
        first = times[known[0]] if len(known) else np.uint64(0)
        before_us = first if self._time_before_us is None else np.uint64(self._time_before_us)
        before, after = np.concatenate(([before_us], times[:-1])), np.concatenate((times[1:], times[-1:]))
        is_wrong = ~near(times, before) & ~near(times, after) & near(before, after) & ~is_missing
        self._tally["wrong_timestamps"] += int(is_wrong.sum())
        for place in np.flatnonzero(is_missing | is_wrong).tolist():
            times[place] = times[place - 1] if place else before_us
        return times

    def count_tail(self, loose: int) -> None:
        """Count what stands after the log's last record."""
        data = self._scan.data
        loose = self._count_orphans(loose, len(data), self._time_us)
        rest = data[max(loose, 0) :]
        head = rest[self._gap_bytes : self._gap_bytes + 1]
        is_record = len(rest) < self._gap_bytes + MAX_FRAME_BYTES and (
            not head or head[0] in {MAGIC_V1, MAGIC_V2}
        )
        if rest and is_record:
            self._tally["truncated_bytes"] += len(rest)
        else:
            self._count_skipped(len(data) - loose)

    def _open_run(self, index: int, loose: int) -> None:
        # Count what lies before a frame that does not simply follow, and find whether the 8 bytes before it are its timestamp.
        scan = self._scan
        begin = int(scan.at[index]) - self._gap_bytes
        has_time = begin == loose or (
            begin > loose and (self._is_near(index) or self._scan.step[index] != NOWHERE)
        )
        if self._gap_bytes and not has_time:
            begin += self._gap_bytes
            self._untimed.append(index)
            self._tally["untimed_frames"] += 1
        reference_us = int(scan.time_us[index]) if self._time_us is None else self._time_us
        loose = self._count_orphans(loose, begin, reference_us)
        self._count_skipped(begin - loose)

    def _settle(self, last: int, index: int | None) -> int:
        # What becomes of a frame that could not prove itself, now that the next one is found; gives where loose bytes begin.
        scan = self._scan
        end = int(scan.end[last])
        begin = len(scan.data) if index is None else int(scan.at[index]) - self._gap_bytes
        if not scan.is_known[last] and begin >= end:
            return end
        self._runs[-1] = self._runs[-1][:-1]
        if begin == end or end == len(scan.data):
            self._tally["bad_crcs"] += 1
            return end
        return int(scan.at[last]) - (0 if last in self._untimed else self._gap_bytes)

    def _next(self, search_at: int, expected: int, loose: int) -> int | None:
        indices, offsets = self._promising
        for place in range(bisect_left(offsets, search_at), len(offsets)):
            if self._is_believed(indices[place], expected, loose):
                return indices[place]
        return None

    @cached_property
    def _promising(self) -> tuple[list[int], list[int]]:
        scan = self._scan
        may_be = scan.is_known | (scan.step != NOWHERE) | (scan.end == len(scan.data))
        indices = np.flatnonzero(may_be[: scan.limit])
        return indices.tolist(), scan.at[indices].tolist()

    def _is_believed(self, index: int, expected: int, loose: int) -> bool:
        scan = self._scan
        begin = int(scan.at[index]) - self._gap_bytes
        has_successor = self._scan.step[index] != NOWHERE
        if begin == expected and has_successor:
            return True
        if scan.is_known[index]:
            return scan.is_intact(index)
        if begin == expected and int(scan.end[index]) == len(scan.data):
            return True
        return has_successor and begin >= loose and self._is_near(index)

    def _is_near(self, index: int) -> bool:
        return self._time_us is None or abs(int(self._scan.time_us[index]) - self._time_us) <= NEAR_US

    def _count_orphans(self, begin: int, end: int, reference_us: int | None) -> int:
        # Timestamps in a row; the last one counts only if a good record or the log's end follows, else it heads a damaged record.
        if begin < 0 or reference_us is None or not self._gap_bytes:
            return begin
        place = begin
        while place + TIMESTAMP_BYTES <= end:
            time_us = int.from_bytes(self._scan.data[place : place + TIMESTAMP_BYTES], "big")
            if abs(time_us - reference_us) > NEAR_US:
                break
            place += TIMESTAMP_BYTES
        if begin < place < end:
            place -= TIMESTAMP_BYTES
        self._tally["orphan_timestamps"] += (place - begin) // TIMESTAMP_BYTES
        return place

    def _count_skipped(self, count: int) -> None:
        if count > 0:
            self._tally["gaps"] += 1
            self._tally["skipped_bytes"] += count
