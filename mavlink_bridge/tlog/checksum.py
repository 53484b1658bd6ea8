"""MAVLink's checksum (CRC-16/MCRF4XX with the message's seed byte at the end) over many frames of one buffer.

The standard library has a fast CRC of the same polynomial, `binascii.crc_hqx`, but taken from the other end of each byte. A buffer with
the bits of each byte reversed, made once, gives MAVLink's CRC with its bits reversed.
"""

from __future__ import annotations

from binascii import crc_hqx
from typing import TYPE_CHECKING

import numpy as np

from mavlink_bridge.tlog.wire import CRC_SEED, ID_LIMIT

if TYPE_CHECKING:
    from numpy.typing import NDArray

_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_REVERSED_SEED = np.frombuffer(_REVERSED, np.uint8)[CRC_SEED].astype(np.uint16)
_STEP = np.array([crc_hqx(bytes([byte]), 0) for byte in range(256)], np.uint16)


def reverse_bits(data: bytes) -> bytes:
    """Give the buffer with the bits of each byte reversed."""
    return data.translate(_REVERSED)


def crc_match(flipped: bytes, frame_at: int, crc_at: int, message_id: int) -> bool:
    """Say for one frame whether its checksum is right; the arguments are those of `crc_matches`."""
    crc = crc_hqx(flipped[frame_at + 1 : crc_at], 0xFFFF)
    crc = crc_hqx(_REVERSED[CRC_SEED[message_id] :][:1], crc)
    return crc == int.from_bytes(flipped[crc_at : crc_at + 2], "big")


def crc_matches(
    flipped: bytes, frame_at: NDArray[np.int64], crc_at: NDArray[np.int64], ids: NDArray[np.int32]
) -> NDArray[np.bool_]:
    """Say for each frame whether its checksum is right.

    Parameters
    ----------
    flipped : bytes
        The buffer after `reverse_bits`.
    frame_at, crc_at : (n,) array
        Where each frame's magic byte and its checksum stand in the buffer.
    ids : (n,) array
        Message ids; of an id outside the dialect the answer means nothing.

    Returns
    -------
    (n,) array of bool
    """
    spans = zip((frame_at + 1).tolist(), crc_at.tolist(), strict=True)
    crc = np.array([crc_hqx(flipped[begin:end], 0xFFFF) for begin, end in spans], np.uint16)
    seeds = _REVERSED_SEED[np.minimum(ids, ID_LIMIT)]
    crc = (crc << np.uint16(8)) ^ _STEP[(crc >> np.uint16(8)) ^ seeds]
    view = np.frombuffer(flipped, np.uint8)
    stored = (view[crc_at].astype(np.uint16) << np.uint16(8)) | view[crc_at + 1]
    matches: NDArray[np.bool_] = crc == stored
    return matches
