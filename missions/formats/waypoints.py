"""QGC WPL 110: items, one a line, with missions, fences (5000 to 5004) or rally points (5100); also the older version 100.

Twelve columns, with tabs or blanks between: seq, current, frame, command, param1 to param4, latitude, longitude, altitude, autocontinue.
A mission's line of seq 0 is home; Mission Planner pads it with command 0. A list that begins with seq 1 has none.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from missions.errors import FenceError, InvalidPositionError, MissionFormatError
from missions.fence import fence_from_items, fence_to_items
from missions.formats.bounds import MOST_ITEMS, check_bound, lines_of
from missions.formats.numbers import number, whole, without_nan, xy_for_file, xy_from_file
from missions.geo import LatLon
from missions.items import Command, MissionItem, file_frame, with_home
from missions.rally import rally_from_items, rally_to_items
from missions.situation import Known, Mission, Reading, Situation

_HEADER = "QGC WPL 110"
_VERSIONS = ("110", "100")
_FENCE_COMMANDS = range(5000, 5006)
_BY_SEQ = frozenset({Command.DO_JUMP, Command.DO_SET_MISSION_CURRENT})
_MOST_SEQ = 65535  # 16 bits in MAVLink

_COMMANDS_100: dict[int, Command] = {
    2: Command.NAV_TAKEOFF,
    3: Command.NAV_RETURN_TO_LAUNCH,
    4: Command.NAV_LAND,
    24: Command.NAV_TAKEOFF,
    25: Command.NAV_WAYPOINT,
    26: Command.NAV_LAND,
    27: Command.NAV_LOITER_UNLIM,
}
"""What version 100 numbered otherwise, as pymavlink reads it."""

_COLUMNS_100 = (0, 7, 1, 2, 5, 6, 3, 4, 9, 8, 10, 12)
"""Where version 100 has what version 110 has in its twelve columns."""


class _Row(NamedTuple):
    line: int
    seq: int
    item: MissionItem


def read(text: str, source: str) -> Situation:
    """Read a file's text.

    Raises
    ------
    MissionFormatError
        With the line and what was expected there.
    """
    lines = lines_of(text, source)
    words = lines[0].split()
    version = words[2] if len(words) == 3 and words[:2] == ["QGC", "WPL"] else None
    if version is None:
        raise MissionFormatError(f"{source}: line 1: expected {_HEADER!r}", file=source, line=1)
    if version not in _VERSIONS:
        raise MissionFormatError(
            f"{source}: line 1: unknown version QGC WPL {version}; supported: 110 and 100",
            file=source,
            line=1,
            advice="save the file from the ground station again, as QGC WPL 110 or as .plan",
        )
    check_bound(sum(map(bool, lines)) - 1, MOST_ITEMS, "items", source)
    rows = [
        _row(line.split(), version, f"{source}: line {count}", count)
        for count, line in enumerate(lines[1:], start=2)
        if line.strip() and not line.strip().startswith("#")
    ]
    if not rows:
        raise MissionFormatError(f"{source}: no items after the first line", file=source)
    return _situation(rows, _seq_remarks(rows, source), source)


def is_waypoint_text(text: str) -> bool:
    """Return whether a text begins as this format does."""
    return any(line.split()[:2] == _HEADER.split()[:2] for line in text[:100].splitlines()[:1])


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
    """Return the text of a file with items as they stand (a mission with its home item).

    Raises
    ------
    MissionFormatError
        A parameter is not set (NaN), and what that means cannot be written.
    """
    return "\n".join([_HEADER, *(_line(seq, item) for seq, item in enumerate(items))]) + "\n"


def _line(seq: int, item: MissionItem) -> str:
    try:
        item = without_nan(item)  # Mission Planner refuses lines with "nan"
    except MissionFormatError as error:
        raise MissionFormatError(f"item {seq}: {error}", **error.details) from None
    return "\t".join(
        [
            *(str(int(value)) for value in (seq, item.current, file_frame(item.frame), item.command)),
            *(f"{param:.9g}" for param in item.params),  # as exact as the wire's 32 bits
            *(f"{value:.8f}" for value in xy_for_file(item)),
            f"{item.alt_m:.6f}",
            str(int(item.autocontinue)),
        ]
    )


def _row(columns: list[str], version: str, where: str, line: int) -> _Row:
    expected = 12 if version == "110" else 13
    if len(columns) != expected:
        raise MissionFormatError(f"{where}: {len(columns)} columns; expected {expected}", where=where)
    if version == "100":
        columns = [columns[i] for i in _COLUMNS_100]
    try:
        seq, current, frame, command, *params, lat, lon, alt_m, autocontinue = map(number, columns)
        seen, frame = whole(command, "command", 65535), whole(frame, "frame", 255)
        if version == "100":
            seen = _command_100(seen)
        item = MissionItem(
            seen,
            frame,
            (params[0], params[1], params[2], params[3]),
            *xy_from_file(seen, frame, lat, lon),
            alt_m,
            bool(whole(current, "current", 255)),
            bool(whole(autocontinue, "autocontinue", 255)),
        )
        return _Row(line, whole(seq, "seq", _MOST_SEQ), item)
    except (ValueError, InvalidPositionError) as error:
        raise MissionFormatError(f"{where}: {error}", where=where) from None


def _command_100(action: int) -> int:
    if action not in _COMMANDS_100:
        raise ValueError(
            f"action {action} of QGC WPL 100; supported: {', '.join(map(str, sorted(_COMMANDS_100)))}"
        )
    return _COMMANDS_100[action]


def _seq_remarks(rows: Sequence[_Row], source: str) -> tuple[str, ...]:
    """Look at how items are numbered: from 0 (home) or from 1, each one more than the one before.

    Ground stations go by the order of the lines. So does this reader, with a remark; but not where a jump goes by number.
    """
    first = rows[0]
    if first.seq not in (0, 1):
        raise MissionFormatError(
            f"{source}: line {first.line}: seq {first.seq}; expected seq 0 (home) or 1; is the file truncated?",
            file=source,
            line=first.line,
        )
    odd = next((pair for pair in itertools.pairwise(rows) if pair[1].seq != pair[0].seq + 1), None)
    if odd is None:
        return ()
    before, after = odd
    problem = f"{source}: line {after.line}: seq {after.seq} follows seq {before.seq}"
    jump = next((row for row in rows if row.item.command in _BY_SEQ), None)
    if jump is not None:
        raise MissionFormatError(
            f"{problem}, but line {jump.line} jumps to an item by its seq; renumber the items",
            file=source,
            line=after.line,
        )
    return (f"{problem}: items are read in line order",)


def _situation(rows: list[_Row], remarks: tuple[str, ...], source: str) -> Situation:
    home, rest = _split_home(rows)
    listed = {row.item.command for row in rest}
    known = Situation(home=Known(home, None, source) if home else None, reading=Reading(remarks=remarks))
    if listed & set(_FENCE_COMMANDS) or Command.RALLY_POINT in listed:
        rest, more = _without_more_homes(rest, home, source)
        listed = {row.item.command for row in rest}
        known = replace(known, reading=Reading(remarks=(*remarks, *more)))
    if listed & set(_FENCE_COMMANDS):
        try:
            fence = fence_from_items([row.item for row in rest])
        except FenceError as error:
            index = error.details.get("item")
            line = rest[index].line if isinstance(index, int) else None
            advice = {name: value for name, value in error.details.items() if name == "advice"}
            raise MissionFormatError(
                f"{source}: line {line}: {error}", file=source, line=line, **advice
            ) from None
        return replace(known, fence=Known(fence, None, source))
    if listed == {Command.RALLY_POINT}:
        return replace(known, rally=Known(rally_from_items(row.item for row in rest), None, source))
    if len(rest) == len(rows) and rows[0].seq == 0:
        raise MissionFormatError(
            f"{source}: line {rows[0].line}: command {rows[0].item.command}; seq 0 must be home (command 16)",
            file=source,
            line=rows[0].line,
            advice="add a home line before it, or number the items from 1",
        )
    return replace(known, mission=Known(Mission(tuple(row.item for row in rest), home), None, source))


def _split_home(rows: list[_Row]) -> tuple[LatLon | None, list[_Row]]:
    """Take off the home line of seq 0, which Mission Planner writes even before fences and rally points."""
    first = rows[0]
    if first.seq != 0 or first.item.command not in (0, Command.NAV_WAYPOINT):
        return None, rows
    position = first.item.position if (first.item.lat_e7, first.item.lon_e7) != (0, 0) else None
    return position, rows[1:]


def _without_more_homes(
    rows: list[_Row], home: LatLon | None, source: str
) -> tuple[list[_Row], tuple[str, ...]]:
    """Take off the second home line that some versions of Mission Planner write before a fence (MissionPlanner #2635)."""
    count = 0
    while rows[count].item.command == Command.NAV_WAYPOINT and rows[count].item.position in (
        home,
        LatLon(0.0, 0.0),
    ):
        count += 1
    remarks = tuple(f"{source}: line {row.line}: second home line skipped" for row in rows[:count])
    return rows[count:], remarks
