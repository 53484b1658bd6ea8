"""Writing telemetry logs the way MAVProxy does."""

from __future__ import annotations

import errno
import os
import struct
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self

from mavlink_bridge.errors import LogError
from mavlink_bridge.tlog.wire import MAGIC_V1, MAGIC_V2, SIGNATURE_BYTES, SIGNED_FLAG

if TYPE_CHECKING:
    from types import TracebackType

SENT_LINK: Final = 3
"""The link number of frames that the writer's side sent."""


class TlogWriter:
    """Appends frames to a telemetry log; a context manager.

    A log that is there already is continued, never overwritten: logs one after the other are a log again.
    Every record is handed to the system at once, so that a crash loses none.

    Parameters
    ----------
    path : pathlib.Path or str

    Raises
    ------
    LogError
        The file cannot be written.
    """

    def __init__(self, path: Path | str) -> None:
        path = Path(path)
        try:
            self._file = open(path, "ab", buffering=0, opener=_open_no_link)  # noqa: SIM115 - Path.open knows no opener
        except OSError as error:
            trouble = "it is a link; give the file itself" if error.errno == errno.ELOOP else error.strerror
            raise LogError(f"{path}: {trouble}", path=str(path)) from error
        self._pending: dict[int, bytes] = {}

    def write(self, time_s: float, data: bytes, link: int = 0) -> None:
        """Write what was received or sent at a time.

        Parameters
        ----------
        time_s : float
            Seconds since the epoch.
        data : bytes
            Bytes of a link as they come: each whole frame in them becomes a record, the begin of one is kept for the next
            call with the same link, and noise between frames is left out.
        link : int, default 0
            0 to 3, `SENT_LINK` for what was sent; it takes the place of the timestamp's low two bits.

        Raises
        ------
        ValueError
            `link` is not 0 to 3.
        """
        if not 0 <= link <= 3:
            raise ValueError(f"link must be 0 to 3, not {link}")
        stamp = struct.pack(">Q", round(time_s * 1e6) & ~3 | link)
        frames, self._pending[link] = _split(self._pending.get(link, b"") + data)
        if frames:
            self._file.write(b"".join(stamp + frame for frame in frames))

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _open_no_link(path: str, flags: int) -> int:
    """Open a file, but none that a link leads to: whoever may write into the folder must not choose what is written to."""
    return os.open(path, flags | getattr(os, "O_NOFOLLOW", 0), 0o666)


def _split(data: bytes) -> tuple[list[bytes], bytes]:
    frames = []
    at = 0
    while at < len(data):
        if data[at] not in {MAGIC_V1, MAGIC_V2}:
            at += 1
            continue
        end = at + _frame_bytes(data[at : at + 3])
        if end > len(data):
            break
        frames.append(data[at:end])
        at = end
    return frames, data[at:]


def _frame_bytes(head: bytes) -> int:
    # Of the first three bytes: magic, payload length, incompatibility flags (MAVLink 2).
    if len(head) < 3:
        return 3
    if head[0] == MAGIC_V1:
        return 8 + head[1]
    return 12 + head[1] + SIGNATURE_BYTES * (head[2] & SIGNED_FLAG)
