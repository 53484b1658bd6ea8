"""Files with fences and missions, as commands read them: what of a map is not said in it, and what is told of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from mavlink_bridge.cli.common import warn
from mavlink_bridge.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from missions.formats import Choices
    from missions.situation import Mission, Situation

_PANEL = "Maps: what zones are where the file does not say it"
_WORDS = ("inclusion", "exclusion", "route", "ignore", "waypoint", "home", "rally point", "return point")

RoleOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=inclusion|exclusion|route|ignore",
        help="What the feature of that name is, in KML, GeoJSON and other maps. Repeatable.",
        rich_help_panel=_PANEL,
    ),
]
OutermostOption = Annotated[
    str | None,
    typer.Option(
        metavar="inclusion",
        help="The zone around all others is the inclusion, the others are exclusions.",
        rich_help_panel=_PANEL,
    ),
]
IgnorePointsOption = Annotated[
    bool,
    typer.Option(
        "--ignore-points", help="Leave out pins that do not say what they are.", rich_help_panel=_PANEL
    ),
]


class MapOptions(NamedTuple):
    """The options that say what the features of a map are.

    Parameters
    ----------
    role : list of str or None
        ``NAME=ROLE``, as typed.
    outermost : str or None
        ``inclusion``, as typed.
    ignore_points : bool
        Whether pins are left out.
    """

    role: list[str] | None = None
    outermost: str | None = None
    ignore_points: bool = False

    def of_another_file(self) -> MapOptions:
        """Return the options that go for a second file, too: names are those of the first."""
        return self._replace(role=None)

    def choices(self) -> Choices:
        """Return what is said beside a file.

        Raises
        ------
        UsageError
            An option is not what it has to be.
        """
        from missions.formats import Choices  # noqa: PLC0415 - quick help
        from missions.formats.features import Role  # noqa: PLC0415

        if self.outermost not in (None, "inclusion"):
            raise UsageError(f"--outermost {self.outermost!r}: expected inclusion")
        said = {}
        for text in self.role or []:
            name, _, word = text.rpartition("=")
            if not name.strip() or word not in _WORDS:
                raise UsageError(
                    f"--role {text!r}: expected NAME=ROLE, where ROLE is one of {', '.join(_WORDS)}"
                )
            said[name] = Role.DRAWING if word == "ignore" else Role(word)
        return Choices(said, self.outermost is not None, self.ignore_points)


NO_OPTIONS = MapOptions()


def read_file(path: Path, options: MapOptions = NO_OPTIONS) -> Situation:
    """Read a file, and tell what was passed over or taken for something.

    Raises
    ------
    MissionFormatError
        It cannot be read.
    """
    from missions.formats import read_situation  # noqa: PLC0415 - quick help

    situation = read_situation(path, options.choices())
    warn(situation.remarks)
    return situation


def read_fence_file(path: Path, options: MapOptions = NO_OPTIONS) -> Situation:
    """Read a file that must hold a fence, and leave out the exclusions that are far from every inclusion.

    Raises
    ------
    MissionFormatError
        It cannot be read.
    FenceMissingError
        It holds no fence.
    """
    from missions.errors import FenceError, FenceMissingError  # noqa: PLC0415 - quick help
    from missions.fence import ZoneKind  # noqa: PLC0415
    from missions.fence_reach import REACH_M, is_wide, within_reach  # noqa: PLC0415

    situation = read_file(path, options)
    if situation.fence is None:
        raise FenceMissingError(f"{path} holds no fence", file=str(path))
    fence, left_out, cut = within_reach(situation.fence.value)
    if fence.zones and is_wide(*fence.zones) and all(zone.kind is ZoneKind.EXCLUSION for zone in fence.zones):
        raise FenceError(
            f"{path}: its exclusions reach over more than can be planned, and no inclusion tells which of them matter",
            file=str(path),
            advice="draw an inclusion around the field; exclusions far from it are left out then",
        )
    far = f"more than {REACH_M / 1000:g} km from every inclusion"
    counts = {f"exclusions {far} left out": left_out, f"exclusions whose parts {far} are left out": cut}
    more = [f"{path}: {what}: {count}" for what, count in counts.items() if count]
    warn(more)
    known = replace(situation.fence, value=fence)
    return replace(situation, fence=known, remarks=(*situation.remarks, *more))


def read_mission_file(path: Path, options: MapOptions = NO_OPTIONS) -> Mission:
    """Read a file that must hold a mission.

    Raises
    ------
    MissionFormatError
        It cannot be read, or holds no mission.
    """
    from missions.formats import mission_of  # noqa: PLC0415 - quick help

    return mission_of(read_file(path, options), path)


def read_vehicle_file(path: Path) -> Mapping[str, float]:
    """Read a file of parameters, whatever its suffix, and tell what was passed over.

    Raises
    ------
    MissionFormatError
        It cannot be read.
    """
    from missions.formats.parameters import read_path  # noqa: PLC0415 - quick help

    situation = read_path(path)
    warn(situation.remarks)
    return situation.parameters


def with_mission_home(situation: Situation, mission: Mission, source: str) -> Situation:
    """Let a mission start at its own home where there is no vehicle that has one: a fence file's home counts only where the mission has none."""
    from missions.situation import Known  # noqa: PLC0415 - quick help

    return situation if mission.home is None else replace(situation, home=Known(mission.home, None, source))
