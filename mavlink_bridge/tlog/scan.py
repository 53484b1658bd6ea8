"""All places in one window of bytes where a MAVLink frame may start, and which of them follow one another."""

from __future__ import annotations

from bisect import bisect_left
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from mavlink_bridge.tlog.checksum import crc_match, crc_matches
from mavlink_bridge.tlog.wire import (
    BASE_BYTES,
    FULL_BYTES,
    ID_LIMIT,
    IS_KNOWN,
    MAGIC_V2,
    MAX_FRAME_BYTES,
    SIGNATURE_BYTES,
    SIGNED_FLAG,
    TIMESTAMP_BYTES,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

NOWHERE: Final = -1
"""In `Scan.step`: no candidate stands where this one's successor should."""
LATER: Final = -2
"""In `Scan.step`: the successor is there but beyond the horizon, so it belongs to the next window."""
NEAR_US: Final = 86_400 * 10**6
"""Two records whose timestamps lie closer than this (a day) fit together."""


class Scan:
    """The candidates for frame starts in one window.

    Parameters
    ----------
    data : bytes
        The window.
    gap_bytes : int
        Bytes before each frame: 8 for a log with timestamps, 0 for a raw one.
    horizon : int
        Candidates from this offset on belong to the next window.

    Attributes
    ----------
    at, end : (n,) array of int
        Offsets of each candidate's magic byte and of the byte after it, ascending.
    ids, payload_bytes : (n,) array of int
        Message id and payload length of each.
    is_v2, is_known : (n,) array of bool
        MAVLink 2, and whether the dialect has the id.
    time_us : (n,) array of uint64
        The 8 bytes before each candidate; 0 in a raw log and where there is no room for them.
    step : (n,) array of int
        For each the candidate that follows it as the next record, or `NOWHERE` or `LATER`.
    limit : int
        Candidates from this one on stand beyond the horizon.
    """

    def __init__(self, data: bytes, gap_bytes: int, horizon: int) -> None:
        self.data = data
        self.view: NDArray[np.uint8] = np.frombuffer(data + bytes(MAX_FRAME_BYTES), np.uint8)
        self.gap_bytes = gap_bytes
        self._find()
        self.limit = int(np.searchsorted(self.at, horizon))
        self.time_us = self._times()
        self.step = self._steps()

    def intact(self, which: NDArray[Any]) -> NDArray[np.bool_]:
        """Return for each of these candidates (by index) whether its id is known and its checksum right."""
        at = self.at[which]
        good = crc_matches(self.data, at, self.crc_at(which), self.ids[which])
        sound: NDArray[np.bool_] = good & self.is_known[which]
        return sound

    def words(self, kind: str) -> NDArray[Any]:
        """Return a view of the window with a value of this dtype beginning at every byte."""
        dtype = np.dtype(kind)
        return np.ndarray((len(self.view) - dtype.itemsize + 1,), dtype, self.view.data, strides=(1,))

    def is_intact(self, index: int) -> bool:
        """Return whether this candidate's id is known and its checksum right."""
        if not self.is_known[index]:
            return False
        at = int(self.at[index])
        crc_at = at + (10 if self.is_v2[index] else 6) + int(self.payload_bytes[index])
        return crc_match(self.data, at, crc_at, int(self.ids[index]))

    @cached_property
    def _links(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], list[int]]:
        # The candidates that have a successor or are one, each one's place among them, its successor's place, and the places
        # whose successor is not simply the next: noise that looks like a frame start is seldom linked, so these are few.
        step = self.step
        is_linked = step != NOWHERE
        is_linked[step[step >= 0]] = True
        linked = np.flatnonzero(is_linked)
        place_of = np.cumsum(is_linked) - 1
        following = step[linked]
        following = np.where(following >= 0, place_of[following], following)
        ends = np.flatnonzero(following != np.arange(1, len(linked) + 1))
        return linked, place_of, following, ends.tolist()

    def run(self, index: int) -> tuple[NDArray[np.int64], bool]:
        """Return the candidates from this one on that follow one another, and whether the run goes on in the next window."""
        linked, place_of, following, ends = self._links
        if self.step[index] == NOWHERE:
            return np.array([index]), False
        parts, place = [], int(place_of[index])
        while place >= 0:
            end = ends[bisect_left(ends, place)]
            parts.append(linked[place : end + 1])
            place = int(following[end])
        return np.concatenate(parts), place == LATER

    def crc_at(self, which: NDArray[Any]) -> NDArray[np.int64]:
        """Return the offset of each of these candidates' checksum."""
        offsets: NDArray[np.int64] = self.payload_at(which) + self.payload_bytes[which]
        return offsets

    def payload_at(self, which: NDArray[Any]) -> NDArray[np.int64]:
        """Return the offset of each of these candidates' payload."""
        offsets: NDArray[np.int64] = self.at[which] + np.where(self.is_v2[which], 10, 6)
        return offsets

    def _find(self) -> None:
        size, view = len(self.data), self.view
        # Unsigned bytes wrap round, so one comparison finds both magic bytes.
        at = np.flatnonzero((view[:size] - np.uint8(MAGIC_V2)) < 2)
        is_v2 = view[at] == MAGIC_V2
        payload = view[at + 1].astype(np.int64)
        flags = view[at + 2]
        ids = self.words("<u4")[at + 7] & np.uint32(0xFFFFFF)
        end = at + payload + 12 + SIGNATURE_BYTES * (flags & np.uint8(SIGNED_FLAG))
        sane = flags <= SIGNED_FLAG
        v1 = np.flatnonzero(~is_v2)
        ids[v1] = view[at[v1] + 5]
        end[v1] = at[v1] + payload[v1] + 8
        sane[v1] = (
            ~IS_KNOWN[ids[v1]] | (payload[v1] == BASE_BYTES[ids[v1]]) | (payload[v1] == FULL_BYTES[ids[v1]])
        )
        keep = np.flatnonzero(sane & (end <= size))
        self.at, self.end, self.ids = at[keep], end[keep], ids[keep]
        self.payload_bytes, self.is_v2 = payload[keep], is_v2[keep]
        self.is_known = IS_KNOWN[np.minimum(self.ids, ID_LIMIT)]

    def _times(self) -> NDArray[np.uint64]:
        times = np.zeros(len(self.at), np.uint64)
        if self.gap_bytes:
            first = int(np.searchsorted(self.at, TIMESTAMP_BYTES))
            times[first:] = self.words(">u8")[self.at[first:] - TIMESTAMP_BYTES]
        return times

    def _steps(self) -> NDArray[np.int32]:
        index_at = np.full(len(self.view), NOWHERE, np.int32)
        index_at[self.at] = np.arange(len(self.at), dtype=np.int32)
        step: NDArray[np.int32] = index_at[np.minimum(self.end + self.gap_bytes, len(self.view) - 1)]
        follows = near(self.time_us[step], self.time_us) if self.gap_bytes else self._sound(step)
        step[~follows] = NOWHERE
        step[step >= self.limit] = LATER
        return step

    def _sound(self, step: NDArray[np.int32]) -> NDArray[np.bool_]:
        # Without timestamps nothing but the checksum distinguishes a frame from noise.
        good = self.intact(np.arange(len(self.at)))
        sound: NDArray[np.bool_] = good | (~self.is_known & (step >= 0) & good[step])
        return sound


def near(time_us: NDArray[np.uint64], other_us: NDArray[np.uint64]) -> NDArray[np.bool_]:
    """Return which timestamps lie less than a day apart."""
    # Unsigned differences wrap round, so this holds for all 64 bits.
    is_near: NDArray[np.bool_] = (time_us - other_us + np.uint64(NEAR_US)) <= 2 * NEAR_US
    return is_near
