"""What was sent lately, so that an echo of it is not taken for somebody else with our ids.

A half-duplex radio, a hub that repeats to everybody, or somebody who reflects what he hears: what comes back byte for byte as we sent it shows
nothing about anybody else, whatever it says and whether it is signed or not.
"""

from __future__ import annotations

_MOST = 4096
"""Frames that are remembered: some minutes of a bridge at work, half a minute of the quickest upload, less than 2 MB at the longest."""


class SentFrames:
    """The frames sent lately, byte for byte.

    Parameters
    ----------
    most : int
        How many are remembered; of more the oldest are forgotten.
    """

    def __init__(self, most: int = _MOST) -> None:
        self._most = most
        self._frames: dict[bytes, None] = {}

    def __len__(self) -> int:
        return len(self._frames)

    def __contains__(self, frame: bytes) -> bool:
        return frame in self._frames

    def remember(self, frame: bytes) -> None:
        """Note a frame that is sent now."""
        self._frames.pop(frame, None)  # its number comes round every 256 frames: it is as young as this one
        self._frames[frame] = None
        if len(self._frames) > self._most:
            del self._frames[next(iter(self._frames))]
