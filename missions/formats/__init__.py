"""Files with fences, missions, rally points and parameters; the suffix chooses the format (docs/files.md).

Each format is one module with ``read(text, source) -> Situation``, ``write(situation) -> str`` or both; those of maps take `Choices`, too.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from missions.errors import FenceMissingError, MissionFormatError
from missions.formats import (
    fen,
    geojson,
    gpx,
    kml,
    parameters,
    poly,
    positions_csv,
    qgc_plan,
    text_lists,
    waypoints,
)
from missions.formats.choices import NO_CHOICES, Choices
from missions.formats.files import write_file
from missions.formats.foreign_files import kind_of_suffix
from missions.formats.parameters import read_parameters
from missions.formats.parts import Part, only, parts_of
from missions.formats.texts import read_text
from missions.situation import Known, Situation

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from missions.fence import Fence
    from missions.formats.files import Writer
    from missions.situation import Mission

__all__ = [
    "FORMATS",
    "NO_CHOICES",
    "Choices",
    "Format",
    "Part",
    "check_writable_format",
    "fence_of",
    "format_of",
    "mission_of",
    "parts_of",
    "read_fence",
    "read_mission",
    "read_parameters",
    "read_situation",
    "write_fence",
    "write_mission",
    "write_parameters",
    "write_situation",
]


class Format(NamedTuple):
    """A file format.

    Parameters
    ----------
    read : callable or None
        From a text and the name of its file to a situation, for maps also by `Choices`; None where it is no text.
    write : callable or None
        From a situation to a text; None where it is only read.
    holds : tuple of Part
        What can be written into a file.
    together : bool
        Whether a file can hold all of that at once; else one part, the first that is there.
    is_map : bool
        Whether it holds features, which do not always say what they are.
    """

    read: Callable[..., Situation] | None
    write: Callable[[Situation], str] | None
    holds: tuple[Part, ...]
    together: bool = True
    is_map: bool = False


_LISTS = (Part.MISSION, Part.FENCE, Part.RALLY)
_PLAN = Format(qgc_plan.read, qgc_plan.write, _LISTS)
_WAYPOINTS = Format(text_lists.read, waypoints.write, _LISTS, together=False)
_GEOJSON = Format(geojson.read, geojson.write, _LISTS, is_map=True)
_PARAMETERS = Format(parameters.read, parameters.write, (Part.PARAMETERS,))
_GIS = Format(None, None, (), is_map=True)

FORMATS: dict[str, Format] = {
    ".plan": _PLAN,
    ".waypoints": _WAYPOINTS,
    ".txt": _WAYPOINTS,
    ".fen": Format(fen.read, fen.write, (Part.FENCE,)),
    ".poly": Format(poly.read, poly.write, (Part.FENCE,)),
    ".geojson": _GEOJSON,
    ".json": _GEOJSON,
    ".kml": Format(kml.read, kml.write, _LISTS, is_map=True),
    ".kmz": Format(kml.read, None, (), is_map=True),
    ".gpx": Format(gpx.read, gpx.write, (Part.MISSION,), is_map=True),
    ".csv": Format(positions_csv.read, positions_csv.write, (Part.MISSION,), is_map=True),
    ".shp": _GIS,
    ".zip": _GIS,
    ".gpkg": _GIS,
    ".parm": _PARAMETERS,
    ".param": _PARAMETERS,
    ".params": _PARAMETERS,
}


def read_situation(path: Path | str, choices: Choices = NO_CHOICES) -> Situation:
    """Read what a file holds: fence, mission, rally points, home, parameters; and remarks on what was skipped or assumed.

    Parameters
    ----------
    path : Path or str
        The suffix chooses the format.
    choices : Choices, optional
        What the features of a map are, where the file does not say it.

    Raises
    ------
    MissionFormatError
        The file is missing, its suffix is unknown, or it cannot be read as its format; the message says where.
    """
    path = Path(path)
    format_ = format_of(path)
    if choices.roles and not format_.is_map:
        raise MissionFormatError(
            f"{path}: --role is for map files; a {path.suffix} file already says what each zone is",
            file=str(path),
            advice="leave --role out; to change a zone, edit the file in the ground station",
        )
    if format_.read is None:
        from missions.formats import gis  # noqa: PLC0415 - its libraries are slow to come

        return gis.read_path(path, choices)
    text, remarks = read_text(path)
    extra = (choices,) if format_.is_map else ()
    situation = format_.read(text, str(path), *extra)
    return replace(situation, reading=replace(situation.reading, remarks=(*remarks, *situation.remarks)))


def read_fence(path: Path | str) -> Fence:
    """Read the fence of a file.

    Raises
    ------
    MissionFormatError
        As `read_situation`.
    FenceMissingError
        The file holds no fence.
    """
    return fence_of(read_situation(path), path)


def fence_of(situation: Situation, path: Path | str) -> Fence:
    """Return the fence of a situation that was read from a file.

    Raises
    ------
    FenceMissingError
        It has none.
    """
    fence = situation.fence
    if fence is None or not fence.value.zones:
        raise FenceMissingError(
            f"{path} contains no fence",
            file=str(path),
            advice="use a file that contains a fence, such as a QGroundControl .plan (--fence FILE)",
        )
    return fence.value


_OTHER_FORMAT_ADVICE = "write a .plan instead: it holds missions, fences and rally points"
_SUFFIX_ADVICE = "the file extension sets the format; use one of these"


def read_mission(path: Path | str) -> Mission:
    """Read the mission of a file.

    Raises
    ------
    MissionFormatError
        As `read_situation`, or the file holds no mission.
    """
    return mission_of(read_situation(path), path)


def mission_of(situation: Situation, path: Path | str) -> Mission:
    """Return the mission of a situation that was read from a file.

    Raises
    ------
    MissionFormatError
        It has none.
    """
    if situation.mission is None:
        raise MissionFormatError(
            f"{path} contains no mission",
            file=str(path),
            advice="use a file that contains a mission, such as a .plan or .waypoints",
        )
    return situation.mission.value


def write_situation(
    situation: Situation, path: Path | str, part: Part | None = None, *, write: Writer = write_file
) -> tuple[Part, ...]:
    """Write what is known and what the format holds, or one part of it; a file is written whole or not at all.

    Parameters
    ----------
    situation : Situation
        What is known.
    path : Path or str
        The suffix chooses the format.
    part : Part, optional
        Write this and nothing else. Default: all that the format holds.
    write : callable
        What puts the bytes into the file.

    Returns
    -------
    tuple of Part
        What was written.

    Raises
    ------
    MissionFormatError
        The suffix is unknown, nothing that the format holds is known, it holds one part at a time and several are known, or the file
        cannot be written.
    """
    path = Path(path)
    format_ = format_of(path, "write", part)
    wanted = [one for one in parts_of(situation) if one in format_.holds and part in (None, one)]
    if not parts_of(situation):
        raise MissionFormatError(
            f"{path}: nothing to write: no mission, fence, rally points or parameters",
            file=str(path),
            advice="check what the input file contains",
        )
    if not wanted:
        held = " or ".join(format_.holds)
        raise MissionFormatError(
            f"{path}: there is no {part or held} to write" if part in (None, *format_.holds)
            else f"{path}: a {path.suffix} file contains no {part}; it contains {held}",
            file=str(path),
            advice="choose another file extension or another input file",
        )  # fmt: skip
    if len(wanted) > 1 and not format_.together:
        raise MissionFormatError(
            f"{path}: a {path.suffix} file contains one list, but there are {' and '.join(wanted)}; choose one",
            file=str(path),
            advice=_OTHER_FORMAT_ADVICE,
        )
    assert format_.write is not None
    try:
        text = format_.write(only(situation, part) if part else situation)
    except MissionFormatError as error:
        details = {"advice": _OTHER_FORMAT_ADVICE, **error.details}
        raise MissionFormatError(f"{path}: {error}", file=str(path), **details) from None
    write(path, text.encode())
    return tuple(wanted)


def write_mission(situation: Situation, path: Path | str, *, write: Writer = write_file) -> None:
    """Write the situation's mission, and in formats that hold them its fence, rally points and home.

    Raises
    ------
    MissionFormatError
        The suffix is unknown or its format holds no missions, or the file cannot be written.
    """
    path = Path(path)
    check_writable_format(path)
    part = None if format_of(path, "write").together else Part.MISSION
    write_situation(situation, path, part, write=write)


def write_fence(fence: Fence, path: Path | str) -> None:
    """Write a fence.

    Raises
    ------
    MissionFormatError
        The suffix is unknown, its format cannot hold the fence, or the file cannot be written.
    """
    write_situation(Situation(fence=Known(fence, None, str(path))), path, Part.FENCE)


def write_parameters(values: Mapping[str, float], path: Path | str) -> None:
    """Write parameters.

    Raises
    ------
    MissionFormatError
        The suffix is not that of a parameter file, or the file cannot be written.
    """
    write_situation(Situation(parameters=values), path, Part.PARAMETERS)


def check_writable_format(path: Path, part: Part = Part.MISSION) -> None:
    """Check, before any work is done, that a mission (or another part) can be written to a path with this suffix.

    Raises
    ------
    MissionFormatError
        The suffix is unknown or its format does not hold that part.
    """
    if part not in format_of(path, "write", part).holds:
        raise MissionFormatError(
            f"{path}: a {path.suffix} file contains no {part}; supported: {_known(part)}",
            file=str(path),
            advice=_SUFFIX_ADVICE,
        )


def format_of(path: Path, verb: str = "read", part: Part | None = None) -> Format:
    """Return the format of a path's suffix that can ``read`` or ``write`` a part.

    Raises
    ------
    MissionFormatError
        It has none.
    """
    if str(path) == "-":
        stream = "standard input is not read" if verb == "read" else "standard output is not written"
        raise MissionFormatError(
            f"-: {stream}", file="-", advice="give a file, whose extension sets the format"
        )
    found = FORMATS.get(path.suffix.lower())
    foreign = kind_of_suffix(path.suffix) if verb == "read" and found is None else None
    if foreign is not None:
        raise MissionFormatError(
            f"{path} is {foreign[0]}; supported: {_known(part, reading=True)}",
            file=str(path),
            advice=foreign[1],
        )
    if found is None or (verb == "write" and found.write is None):
        raise MissionFormatError(
            f"{path}: cannot {verb} files with extension {path.suffix!r}; "
            f"supported: {_known(part, reading=verb == 'read')}",
            file=str(path),
            advice=_SUFFIX_ADVICE,
        )
    return found


def _known(part: Part | None = None, *, reading: bool = False) -> str:
    suffixes = (
        suffix
        for suffix, format_ in FORMATS.items()
        if (reading or format_.write) and (part is None or part in format_.holds)
    )
    return ", ".join(suffixes)
