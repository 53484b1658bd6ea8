"""Files with fences, missions and parameters; the suffix chooses the format.

Each format is one module with ``read(text, source) -> Situation`` and, where it can be written, ``write(situation) -> str``.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

from missions.errors import FenceMissingError, MissionFormatError
from missions.formats import qgc_plan, waypoints
from missions.formats.parameters import read_parameters

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from missions.fence import Fence
    from missions.situation import Mission, Situation

__all__ = ["FORMATS", "read_fence", "read_mission", "read_parameters", "read_situation", "write_mission"]


class Format(NamedTuple):
    """A file format's two directions; None where there is none."""

    read: Callable[[str, str], Situation] | None
    write: Callable[[Situation], str] | None


FORMATS: dict[str, Format] = {
    ".plan": Format(qgc_plan.read, qgc_plan.write),
    ".waypoints": Format(waypoints.read, waypoints.write),
    ".txt": Format(waypoints.read, waypoints.write),
}


def read_situation(path: Path) -> Situation:
    """Read what a file tells: fence, mission, rally points, home.

    Raises
    ------
    MissionFormatError
        The file is missing, its suffix is unknown, or it cannot be read as its format; says where.
    """
    read = _format(path, "read").read
    assert read is not None
    return read(_text(path), str(path))


def read_fence(path: Path) -> Fence:
    """Read the fence of a file.

    Raises
    ------
    MissionFormatError
        As `read_situation`.
    FenceMissingError
        The file holds no fence.
    """
    fence = read_situation(path).fence
    if fence is None or not fence.value.zones:
        raise FenceMissingError(f"{path} holds no fence", file=str(path))
    return fence.value


def read_mission(path: Path) -> Mission:
    """Read the mission of a file.

    Raises
    ------
    MissionFormatError
        As `read_situation`, or the file holds no mission.
    """
    mission = read_situation(path).mission
    if mission is None:
        raise MissionFormatError(f"{path} holds no mission", file=str(path))
    return mission.value


def write_mission(situation: Situation, path: Path) -> None:
    """Write the situation's mission, and in formats that hold them its fence, rally points and home.

    Raises
    ------
    MissionFormatError
        The suffix is unknown, or the file cannot be written.
    """
    write = _format(path, "write").write
    assert write is not None
    whole = path.with_name(f".{path.name}.part")  # so that nobody ever finds half a mission
    try:
        whole.write_text(write(situation), encoding="utf-8", newline="\n")
        whole.replace(path)
    except OSError as error:
        with suppress(OSError):
            whole.unlink()
        raise MissionFormatError(f"{path} cannot be written: {error.strerror}", file=str(path)) from None


def check_writable_format(path: Path) -> None:
    """Check, before any work is done, that a mission can be written to a path with this suffix.

    Raises
    ------
    MissionFormatError
        The suffix is unknown or its format is only read.
    """
    _format(path, "write")


def _format(path: Path, verb: str) -> Format:
    found = FORMATS.get(path.suffix.lower())
    if found is None or getattr(found, verb) is None:
        known = ", ".join(suffix for suffix, format_ in FORMATS.items() if getattr(format_, verb))
        raise MissionFormatError(
            f"{path}: no format to {verb} for the suffix {path.suffix!r}; known are {known}",
            file=str(path),
        )
    return found


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise MissionFormatError(f"{path} cannot be read: {error.strerror}", file=str(path)) from None
    except UnicodeDecodeError as error:
        raise MissionFormatError(f"{path} is not a text file (byte {error.start})", file=str(path)) from None
