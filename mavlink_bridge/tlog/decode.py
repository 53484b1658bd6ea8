"""Whole blocks of frames to messages: each message type's fields as columns, in one go."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from mavlink_bridge.tlog.build import build
from mavlink_bridge.tlog.wire import CLASS_OF_ID, ID_LIMIT, Layout, layout_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from mavlink_bridge.mavlink.messages import Message
    from mavlink_bridge.tlog.scan import Scan
    from mavlink_bridge.tlog.walk import Block


def wanted_ids(wanted: Iterable[type[Message]]) -> NDArray[np.bool_]:
    """Make the table, by message id, of which types are wanted.

    Raises
    ------
    ValueError
        One of the classes is not a message on the wire.
    """
    is_wanted = np.zeros(ID_LIMIT + 1, bool)
    is_wanted[[layout_of(message_class).message_id for message_class in wanted]] = True
    return is_wanted


def select(block: Block, is_wanted: NDArray[np.bool_]) -> tuple[NDArray[np.int64], int]:
    """Return the places in a block of the wanted frames whose checksum is right, and how many had a wrong one."""
    ids = block.scan.ids[block.which]
    places = np.flatnonzero(is_wanted[np.minimum(ids, ID_LIMIT)])
    good = block.scan.intact(block.which[places])
    return places[good], len(places) - int(good.sum())


def decode(scan: Scan, which: NDArray[np.int64]) -> list[Message]:
    """Decode frames of our message types.

    Parameters
    ----------
    scan : Scan
    which : (n,) array of int
        Indices among the scan's candidates.

    Returns
    -------
    list of Message
        In the order of ``which``.
    """
    messages: list[Any] = [None] * len(which)
    for message_id, places in _by_id(scan.ids[which]):
        message_class = CLASS_OF_ID[message_id]
        layout = layout_of(message_class)
        decoded = build(message_class, _values(layout, payloads(scan, which[places], layout)))
        for place, message in zip(places.tolist(), decoded, strict=True):
            messages[place] = message
    return messages


def payloads(scan: Scan, which: NDArray[np.int64], layout: Layout) -> NDArray[np.void]:
    """Return the payloads of frames of one message type as a structured array, what MAVLink 2 left off filled with zeros."""
    width = layout.dtype.itemsize
    rows = scan.words(f"V{width}")[scan.payload_at(which)].view(np.uint8).reshape(len(which), width)
    lengths = scan.payload_bytes[which]
    short = np.flatnonzero(lengths < width)
    rows[short] *= np.arange(width) < lengths[short, None]
    structured: NDArray[np.void] = rows.reshape(-1).view(layout.dtype)
    return structured


def texts(column: NDArray[np.bytes_]) -> list[str]:
    """Return NUL-terminated texts as strings, what is not ASCII replaced, as pymavlink does."""
    return [_text(text) for text in column.tolist()]


@lru_cache(maxsize=8192)
def _text(text: bytes) -> str:
    return text.split(b"\0", 1)[0].decode("ascii", "replace")


def _values(layout: Layout, rows: NDArray[np.void]) -> list[list[Any]]:
    names = layout.dtype.names or ()
    return [_column(rows[name], is_text=is_text) for name, is_text in zip(names, layout.texts, strict=True)]


def _column(column: NDArray[Any], *, is_text: bool) -> list[Any]:
    """Return a field's values; where each is a list of numbers, as tuples."""
    if is_text:
        return texts(column)
    return column.tolist() if column.ndim == 1 else list(map(tuple, column.tolist()))


def _by_id(ids: NDArray[np.uint32]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    order = np.argsort(ids, kind="stable")
    if len(order):
        cuts = np.flatnonzero(np.diff(ids[order])) + 1
        for places in np.split(order, cuts):
            yield int(ids[places[0]]), places
