"""Files with fences and missions, as commands read them: what of a map is not said in it, and what is told of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import warn
from mavlink_bridge.errors import UsageError
from missions.errors import FenceError
from missions.fence import ZoneKind
from missions.formats import Choices, fence_of, mission_of, read_situation
from missions.formats.calibration import SUFFIX, read_calibration
from missions.formats.features import Role
from missions.formats.parameters import read_path
from missions.situation import Known

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.shared import MapOptions
    from missions.situation import Mission, Situation

_WORDS = ("inclusion", "exclusion", "route", "ignore", "waypoint", "home", "rally point", "return point")


def _choices(options: MapOptions, *, by_name: bool) -> Choices:
    """Return what is said beside a file; by name only of the file whose names they are.

    Raises
    ------
    UsageError
        An option is not what it has to be.
    """
    if options.outermost not in (None, "inclusion"):
        raise UsageError(f"--outermost {options.outermost!r}: expected inclusion")
    said = {}
    for text in options.role:
        name, _, word = text.rpartition("=")
        if not name.strip() or word not in _WORDS:
            raise UsageError(f"--role {text!r}: expected NAME=ROLE, where ROLE is one of {', '.join(_WORDS)}")
        said[name] = Role.DRAWING if word == "ignore" else Role(word)
    return Choices(said if by_name else {}, options.outermost is not None, options.ignore_points)


def read_file(path: Path, options: MapOptions, *, by_name: bool = True) -> Situation:
    """Read a file, and tell what was passed over or taken for something.

    Parameters
    ----------
    path : Path
        The file.
    options : MapOptions
        What is said beside it.
    by_name : bool
        Whether the names of ``--role`` are those of this file.

    Raises
    ------
    MissionFormatError
        It cannot be read.
    """
    situation = read_situation(path, _choices(options, by_name=by_name))
    warn(situation.remarks)
    return situation


def read_fence_file(path: Path, options: MapOptions) -> Situation:
    """Read a file that must hold a fence, and leave out the exclusions that are far from every inclusion.

    Raises
    ------
    MissionFormatError
        It cannot be read.
    FenceMissingError
        It holds no fence.
    """
    from missions.ground.fence_reach import REACH_M, is_wide, within_reach  # noqa: PLC0415 - shapely, which files alone do without

    situation = read_file(path, options)
    fence, left_out, cut = within_reach(fence_of(situation, path))
    if fence.zones and is_wide(*fence.zones) and all(zone.kind is ZoneKind.EXCLUSION for zone in fence.zones):
        raise FenceError(
            f"{path}: its exclusions cover a larger area than can be planned, and no inclusion limits it",
            file=str(path),
            advice="draw an inclusion around the field; exclusions far outside it are then left out",
        )
    far = f"more than {REACH_M / 1000:g} km from every inclusion"
    counts = {f"exclusions left out, {far}": left_out, f"exclusions cut, parts of them {far}": cut}
    more = [f"{path}: {what}: {count}" for what, count in counts.items() if count]
    warn(more)
    known = Known(fence, None, str(path))
    return replace(
        situation, fence=known, reading=replace(situation.reading, remarks=(*situation.remarks, *more))
    )


def read_mission_file(path: Path, options: MapOptions) -> Mission:
    """Read a file that must hold a mission, and is not the one whose names ``--role`` gives.

    Raises
    ------
    MissionFormatError
        It cannot be read, or holds no mission.
    """
    return mission_of(read_file(path, options, by_name=False), path)


def read_vehicle_file(path: Path) -> Situation:
    """Read a file of parameters, whatever its suffix, with the firmware's version where it names it, and tell what was passed over; or a calibration (.toml).

    Raises
    ------
    MissionFormatError
        It cannot be read.
    """
    if path.suffix.lower() == SUFFIX:
        return read_calibration(path)
    situation = read_path(path)
    warn(situation.remarks)
    return situation


def with_mission_home(situation: Situation, mission: Mission, source: str) -> Situation:
    """Let a mission start at its own home where there is no vehicle that has one: a fence file's home counts only where the mission has none."""
    return situation if mission.home is None else replace(situation, home=Known(mission.home, None, source))
