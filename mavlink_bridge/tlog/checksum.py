"""MAVLink's checksum (CRC-16/MCRF4XX with the message's seed byte at the end) over many frames of one buffer.

The standard library has a fast CRC of the same polynomial, `binascii.crc_hqx`, but taken from the other end of each byte. Fed with the
bits of each byte reversed it gives MAVLink's CRC with its bits reversed.
"""

from __future__ import annotations

from binascii import crc_hqx
from typing import TYPE_CHECKING

import numpy as np

from mavlink_bridge.tlog.wire import CRC_SEED, ID_LIMIT

if TYPE_CHECKING:
    from numpy.typing import NDArray

_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_REVERSED_BITS = np.frombuffer(_REVERSED, np.uint8)
_REVERSED_SEED = _REVERSED_BITS[CRC_SEED].astype(np.uint16)
_STEP = np.array([crc_hqx(bytes([byte]), 0) for byte in range(256)], np.uint16)


def crc_match(data: bytes, frame_at: int, crc_at: int, message_id: int) -> bool:
    """Return for one frame whether its checksum is right; the arguments are those of `crc_matches`."""
    covered = data[frame_at + 1 : crc_at] + bytes([CRC_SEED[message_id]])
    crc = crc_hqx(covered.translate(_REVERSED), 0xFFFF)
    return crc == int.from_bytes(data[crc_at : crc_at + 2].translate(_REVERSED), "big")


def crc_matches(
    data: bytes, frame_at: NDArray[np.int64], crc_at: NDArray[np.int64], ids: NDArray[np.uint32]
) -> NDArray[np.bool_]:
    """Return for each frame whether its checksum is right.

    Parameters
    ----------
    data : bytes
        The buffer.
    frame_at, crc_at : (n,) array
        Where each frame's magic byte and its checksum stand in the buffer.
    ids : (n,) array
        Message ids; for an id outside the dialect the answer is worthless.

    Returns
    -------
    (n,) array of bool
    """
    spans = zip((frame_at + 1).tolist(), crc_at.tolist(), strict=True)
    crc = np.array([crc_hqx(data[begin:end].translate(_REVERSED), 0xFFFF) for begin, end in spans], np.uint16)
    seeds = _REVERSED_SEED[np.minimum(ids, ID_LIMIT)]
    crc = (crc << np.uint16(8)) ^ _STEP[(crc >> np.uint16(8)) ^ seeds]
    view = np.frombuffer(data, np.uint8)
    high, low = _REVERSED_BITS[view[crc_at]], _REVERSED_BITS[view[crc_at + 1]]
    matches: NDArray[np.bool_] = crc == (high.astype(np.uint16) << np.uint16(8) | low)
    return matches
