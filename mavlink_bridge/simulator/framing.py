"""Cut a byte stream into MAVLink frames without looking into them, so that a link can lose whole frames."""

from __future__ import annotations

_V1, _V2 = 0xFE, 0xFD  # the first byte of a frame
_SIGNED = 1  # MAVLINK_IFLAG_SIGNED


class FrameSplitter:
    """Takes bytes as they come and gives whole frames; what is no frame is passed on as it is."""

    def __init__(self) -> None:
        self._rest = b""

    def split(self, data: bytes) -> list[bytes]:
        """Return the complete frames so far."""
        self._rest += data
        frames = []
        while self._rest:
            length = _length(self._rest)
            if length is None or length > len(self._rest):
                break
            frames.append(self._rest[:length])
            self._rest = self._rest[length:]
        return frames


def _length(data: bytes) -> int | None:
    """Return the length of the frame or of the junk at the beginning; None while too little has come."""
    if data[0] not in (_V1, _V2):
        starts = [place for place in (data.find(_V1), data.find(_V2)) if place > 0]
        return min(starts, default=len(data))
    if len(data) < 3:
        return None
    if data[0] == _V1:
        return data[1] + 8
    return data[1] + 12 + (13 if data[2] & _SIGNED else 0)
