"""QGC WPL 110: tab-separated items, one a line, with missions, fences (5000 to 5004) or rally points (5100).

Twelve columns: seq, current, frame, command, param1 to param4, latitude, longitude, altitude, autocontinue. A mission's first line is
home; Mission Planner pads it with command 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from missions.errors import FenceError, InvalidPositionError, MissionFormatError
from missions.fence import fence_from_items, fence_to_items
from missions.formats.numbers import number, place_e7, whole
from missions.geo import LatLon
from missions.items import Command, MissionItem, file_frame, with_home
from missions.rally import rally_from_items, rally_to_items
from missions.situation import Known, Mission, Situation

if TYPE_CHECKING:
    from collections.abc import Sequence

_HEADER = "QGC WPL 110"
_FENCE_COMMANDS = range(5000, 5005)


def read(text: str, source: str) -> Situation:
    """Read a file's text.

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    lines = text.splitlines()
    if not is_waypoint_text(text):
        raise MissionFormatError(f"{source}: line 1: expected {_HEADER!r}", file=source, line=1)
    numbered = [
        (number, line.strip())
        for number, line in enumerate(lines[1:], start=2)
        if line.strip() and not line.strip().startswith("#")
    ]
    items = [_item(line, f"{source}: line {number}") for number, line in numbered]
    line_numbers = [number for number, _ in numbered]
    return _situation(items, line_numbers, source)


def is_waypoint_text(text: str) -> bool:
    """Return whether a text begins as this format does."""
    return any(line.split() == _HEADER.split() for line in text[:100].splitlines()[:1])


def write(situation: Situation) -> str:
    """Return the text of a file with the situation's mission, home first; without one its fence, else its rally points."""
    mission, fence, rally = situation.mission, situation.fence, situation.rally
    if mission is not None:
        home = mission.value.home or (situation.home and situation.home.value) or LatLon(0.0, 0.0)
        return format_items(with_home(mission.value.items, home))
    if fence is not None:
        return format_items(fence_to_items(fence.value))
    assert rally is not None
    return format_items(rally_to_items(rally.value))


def format_items(items: Sequence[MissionItem]) -> str:
    """Return the text of a file with items as they stand (a mission with its home item)."""
    rows = [
        "\t".join(
            [
                *(str(int(value)) for value in (seq, item.current, file_frame(item.frame), item.command)),
                *(f"{param:.9g}" for param in item.params),  # as exact as the wire's 32 bits
                *(f"{value_e7 / 1e7:.8f}" for value_e7 in (item.lat_e7, item.lon_e7)),
                f"{item.alt_m:.6f}",
                str(int(item.autocontinue)),
            ]
        )
        for seq, item in enumerate(items)
    ]
    return "\n".join([_HEADER, *rows]) + "\n"


def _item(line: str, where: str) -> MissionItem:
    columns = line.split("\t") if "\t" in line else line.split()
    if len(columns) != 12:
        raise MissionFormatError(f"{where}: {len(columns)} columns; expected 12", where=where)
    try:
        _, current, frame, command, *params, lat_deg, lon_deg, alt_m, autocontinue = map(number, columns)
    except ValueError as error:
        raise MissionFormatError(f"{where}: {error}; expected numbers", where=where) from None
    try:
        seen = whole(command, "command", 65535)
        return MissionItem(
            seen,
            whole(frame, "frame", 255),
            (params[0], params[1], params[2], params[3]),
            *place_e7(seen, lat_deg, lon_deg),
            alt_m,
            bool(whole(current, "current", 255)),
            bool(whole(autocontinue, "autocontinue", 255)),
        )
    except (ValueError, InvalidPositionError) as error:
        raise MissionFormatError(f"{where}: {error}", where=where) from None


def _situation(items: list[MissionItem], line_numbers: list[int], source: str) -> Situation:
    if not items:
        raise MissionFormatError(f"{source}: no items after the first line", file=source)
    home, rest = _split_home(items)
    home_known = Known(home, None, source) if home else None
    if any(item.command in _FENCE_COMMANDS for item in rest):
        try:
            fence = fence_from_items(rest)
        except FenceError as error:
            seq = error.details.get("item")
            line = line_numbers[seq + len(items) - len(rest)] if isinstance(seq, int) else None
            raise MissionFormatError(f"{source}: line {line}: {error}", file=source, line=line) from None
        return Situation(fence=Known(fence, None, source), home=home_known)
    if rest and all(item.command == Command.RALLY_POINT for item in rest):
        return Situation(rally=Known(rally_from_items(rest), None, source), home=home_known)
    if len(rest) == len(items):
        raise MissionFormatError(
            f"{source}: line {line_numbers[0]}: command {items[0].command}; a mission's first line is its home (command 16)",
            file=source,
            line=line_numbers[0],
        )
    return Situation(mission=Known(Mission(tuple(rest), home), None, source), home=home_known)


def _split_home(items: list[MissionItem]) -> tuple[LatLon | None, list[MissionItem]]:
    """Take off the home line that Mission Planner writes even before fences and rally points."""
    first = items[0]
    if first.command not in (0, Command.NAV_WAYPOINT):
        return None, items
    return (first.position if _is_place(first) else None), items[1:]


def _is_place(item: MissionItem) -> bool:
    return (item.lat_e7, item.lon_e7) != (0, 0)
