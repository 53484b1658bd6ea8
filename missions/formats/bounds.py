"""How much of a file is read: a small hostile file must not fill the memory, and a large honest one is told what is too large."""

from __future__ import annotations

from missions.errors import MissionFormatError

# Chosen: each is some ten times the largest honest file that is known, and together they keep reading below 1 GB
MOST_BYTES = 100_000_000
MOST_LINES = 1_000_000
MOST_XML_ELEMENTS = 500_000
MOST_JSON_VALUES = 3_000_000
MOST_POSITIONS = 1_000_000
MOST_FEATURES = 100_000
MOST_ITEMS = 65_536  # seq is 16 bits in MAVLink
MOST_COLUMNS = 1_000
MOST_DEEP = 100


def check_bound(count: int, most: int, what: str, source: str) -> None:
    """Check that there are not too many of something.

    Raises
    ------
    MissionFormatError
        There are; the message names the bound.
    """
    if count > most:
        raise MissionFormatError(
            f"{source}: more than {most:,} {what}, the limit",
            file=source,
            most=most,
            advice="cut the file down to the area around the field",
        )


def lines_of(text: str, source: str) -> list[str]:
    """Return the lines of a text.

    Raises
    ------
    MissionFormatError
        There are too many.
    """
    check_bound(text.count("\n"), MOST_LINES, "lines", source)
    return text.split("\n")  # and not at form feeds and other marks, which editors do not count


def check_depth(depth: int, where: str) -> None:
    """Check that something is not nested too deeply.

    Raises
    ------
    MissionFormatError
        It is; the message names the bound.
    """
    if depth > MOST_DEEP:
        raise MissionFormatError(f"{where}: nested more than {MOST_DEEP} levels deep", where=where)
