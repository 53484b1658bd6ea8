"""On which line of its file each item of a mission stands, for reports that point there: QGC WPL and .plan, the formats that keep items.

A .plan is walked, not read again: from each object only what leads to the items is looked into, the rest is passed over.
"""

from __future__ import annotations

import json
import re
from bisect import bisect_right
from itertools import accumulate
from typing import TYPE_CHECKING

from missions.errors import MissionFormatError
from missions.formats.texts import read_text
from missions.formats.waypoints import is_waypoint_text

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

_BLANK = re.compile(r"[\s,:]*")
_DECODER = json.JSONDecoder()


def item_lines(path: Path) -> tuple[int, ...]:
    """Return the line of each item, home's first (1 where it has none of its own); nothing where the format has no items, or it cannot be read."""
    try:
        text = read_text(path).text
        if path.suffix.lower() == ".plan":
            return _of_plan(text)
        return _of_list(text) if is_waypoint_text(text) else ()
    except (MissionFormatError, OSError, ValueError, LookupError, RecursionError):
        return ()


def _of_list(text: str) -> tuple[int, ...]:
    rows = [
        (number, line.split()[0])
        for number, line in enumerate(text.splitlines(), start=1)
        if number > 1 and line.strip() and not line.strip().startswith("#")
    ]
    lines = tuple(number for number, _ in rows)
    return lines if rows and float(rows[0][1]) == 0 else (1, *lines)


def _of_plan(text: str) -> tuple[int, ...]:
    places = [_value(text, _value(text, 0, "mission"), "items")]
    items = [item for _, item in _members(text, places[0])]
    found = []
    for item in items:
        transects = dict(_members(text, item)).get("TransectStyleComplexItem")
        inner = None if transects is None else dict(_members(text, transects)).get("Items")
        found += [item] if inner is None else [one for _, one in _members(text, inner)]
    ends = list(accumulate(len(line) for line in text.splitlines(keepends=True)))
    return (1, *(bisect_right(ends, place) + 1 for place in found))


def _value(text: str, container: int, key: str) -> int:
    """Return where the value of a key stands; of a key that is there twice the last one, as JSON readers do."""
    return dict(_members(text, container))[key]


def _members(text: str, container: int) -> Iterator[tuple[str, int]]:
    """Return each member of an object or array, and where its value stands; no member of anything else.

    Raises
    ------
    ValueError, LookupError
        It is no JSON.
    """
    at = _after_blank(text, container)
    opening = text[at]
    if opening not in "{[":
        return
    at = _after_blank(text, at + 1)
    while text[at] not in "}]":
        key = ""
        if opening == "{":
            key, at = _DECODER.raw_decode(text, at)
            at = _after_blank(text, at)
        yield key, at
        _, at = _DECODER.raw_decode(text, at)
        at = _after_blank(text, at)


def _after_blank(text: str, at: int) -> int:
    match = _BLANK.match(text, at)
    assert match is not None  # it may be empty
    return match.end()
