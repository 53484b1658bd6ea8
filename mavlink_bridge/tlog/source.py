"""The bytes of a log in windows of bounded size, whatever the log's size: memory-mapped, or unpacked on the way if it is gzip."""

from __future__ import annotations

import mmap
import zlib
from typing import TYPE_CHECKING, BinaryIO, Final, Protocol, Self

from mavlink_bridge.errors import LogError
from mavlink_bridge.tlog.dataflash import HEAD, as_telemetry

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager
    from pathlib import Path

# Half a megabyte: many frames at once for numpy, and little memory for any log. Chosen, not measured.
WINDOW_BYTES: Final = 1 << 19
_GZIP: Final = 31
"""What zlib calls a stream with gzip's header and checksum."""
_PACKED_BYTES: Final = 1 << 10  # of a packed log, read at once


class Source(Protocol):
    """A log's bytes; windows are asked for with offsets that never go back."""

    cut_short: bool
    """Whether the log's packing (gzip) broke before its end."""

    def window(self, begin: int) -> tuple[bytes, bool]:
        """Return up to `WINDOW_BYTES` bytes from an offset on, and whether they reach the log's end."""
        ...


class LogFile:
    """A log on disk, opened anew for each walk through it.

    Parameters
    ----------
    path : pathlib.Path

    Raises
    ------
    LogError
        There is no such file, it cannot be read, or it is empty.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with self._opened() as file:
            head = file.read(_PACKED_BYTES)
        if not head:
            raise LogError(f"{path}: the file is empty", path=str(path))
        self._is_gzip = _unpacks(head)
        begin = zlib.decompressobj(wbits=_GZIP).decompress(head, len(HEAD)) if self._is_gzip else head
        self._telemetry = as_telemetry(self._pieces, path) if begin.startswith(HEAD) else None

    def _pieces(self) -> Iterator[bytes]:
        """Yield the log as it is unpacked, piece by piece."""
        with self._opened() as file:
            if self._is_gzip:
                yield from _GzipSource(file).pieces()
            else:
                while piece := file.read(WINDOW_BYTES):
                    yield piece

    def open(self) -> AbstractContextManager[Source]:
        """Open the log from its begin."""
        if self._telemetry is not None:
            return _MadeSource(self._telemetry)
        return _GzipSource(self._opened()) if self._is_gzip else _MappedSource(self._opened())

    def _opened(self) -> BinaryIO:
        if self.path.exists() and not self.path.is_file():
            raise LogError(f"{self.path}: not a regular file", path=str(self.path))
        try:
            return self.path.open("rb")
        except OSError as error:
            raise LogError(f"{self.path}: {error.strerror}", path=str(self.path)) from error


class _MappedSource:
    # Each window is mapped on its own: a log of any size holds no more memory than a window.
    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.cut_short = False

    def __enter__(self) -> Source:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def window(self, begin: int) -> tuple[bytes, bool]:
        size = self._file.seek(0, 2)
        end = min(begin + WINDOW_BYTES, size)
        if begin >= end:
            return b"", True
        aligned = begin - begin % mmap.ALLOCATIONGRANULARITY
        with mmap.mmap(self._file.fileno(), end - aligned, access=mmap.ACCESS_READ, offset=aligned) as mapped:
            return mapped[begin - aligned :], end == size


class _MadeSource:
    # What is in memory already.
    def __init__(self, data: bytes) -> None:
        self._data = data
        self.cut_short = False

    def __enter__(self) -> Source:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def window(self, begin: int) -> tuple[bytes, bool]:
        end = begin + WINDOW_BYTES
        return self._data[begin:end], end >= len(self._data)


class _GzipSource:
    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._pieces = self._unpacked()
        self._buffer = b""
        self._buffer_at = 0
        self._is_done = False
        self.cut_short = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def pieces(self) -> Iterator[bytes]:
        """Yield all of it, piece by piece."""
        return self._pieces

    def window(self, begin: int) -> tuple[bytes, bool]:
        parts = [self._buffer[begin - self._buffer_at :]]
        held = len(parts[0])
        while held <= WINDOW_BYTES and not self._is_done:
            piece = next(self._pieces, None)
            if piece is None:
                self._is_done = True
            else:
                parts.append(piece)
                held += len(piece)
        self._buffer = b"".join(parts)
        self._buffer_at = begin
        return self._buffer[:WINDOW_BYTES], held <= WINDOW_BYTES

    def _unpacked(self) -> Iterator[bytes]:
        unpacker = None
        # A small part at a time, as all of the part in which the packing breaks is lost.
        while part := self._file.read(_PACKED_BYTES):
            while part:
                unpacker = unpacker or zlib.decompressobj(wbits=_GZIP)
                try:
                    yield unpacker.decompress(part, WINDOW_BYTES)
                except zlib.error:
                    self.cut_short = True
                    return
                part = unpacker.unconsumed_tail
                if unpacker.eof:  # another member may follow
                    part, unpacker = unpacker.unused_data, None
        if unpacker is not None:
            self.cut_short = True
            yield unpacker.flush()


def _unpacks(head: bytes) -> bool:
    # Two magic bytes are too few: a damaged log may begin with them.
    try:
        zlib.decompressobj(wbits=_GZIP).decompress(head)
    except zlib.error:
        return False
    return True
