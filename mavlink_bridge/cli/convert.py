"""``pbpp convert``: a fence, a mission, rally points or parameters from one file format to another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mavlink_bridge.cli.common import JsonOption, QuietOption, is_same_file, print_json, warn
from mavlink_bridge.cli.field_files import (
    IgnorePointsOption,
    MapOptions,
    OutermostOption,
    RoleOption,
    read_file,
)
from mavlink_bridge.cli.terminal import echo
from mavlink_bridge.cli.values import position_from
from mavlink_bridge.errors import UsageError

if TYPE_CHECKING:
    from missions.formats import Part
    from missions.situation import Situation


def convert(
    source: Annotated[
        Path, typer.Argument(metavar="IN", help="What to read: .plan, .waypoints, .fen, .poly, .geojson, …")
    ],
    output: Annotated[
        Path, typer.Argument(metavar="OUT", help="What to write: .plan, .waypoints, .geojson, .kml, .gpx, …")
    ],
    only: Annotated[
        str | None,
        typer.Option(
            metavar="mission|fence|rally", help="Write this part only, where IN holds more than OUT can."
        ),
    ] = None,
    return_point: Annotated[
        str | None,
        typer.Option(metavar="LAT,LON", help="The fence's return point, which .fen files must have."),
    ] = None,
    role: RoleOption = None,
    outermost: OutermostOption = None,
    ignore_points: IgnorePointsOption = False,
    json_output: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Convert a file with a fence, a mission, rally points or parameters; the suffixes choose the formats.

    For example:

    `pbpp convert field.kml field.plan`

    `pbpp convert field.plan fence.waypoints --only fence`

    `pbpp convert mission.waypoints route.gpx`

    `pbpp convert farm.kml field.plan --outermost inclusion --ignore-points`
    """
    from mavlink_bridge.cli.kept_files import write_kept  # noqa: PLC0415 - quick help
    from missions.formats import parts_of, write_situation  # noqa: PLC0415

    if is_same_file(source, output):
        raise UsageError(f"{output} would be written over what it is made of; give another OUT")
    part = _part(only)
    situation = read_file(source, MapOptions(role, outermost, ignore_points))
    situation = _with_return_point(situation, return_point)
    _check_choice(situation, source, output, part)
    written = write_situation(situation, output, part, write=write_kept)
    left_out = _left_out(situation, written, output) if part is None else []
    warn(left_out)
    warnings = [*situation.remarks, *left_out]
    document = {
        "status": "ok",
        "command": "convert",
        "source": str(source),
        "outputs": [str(output)],
        "parts": [str(one) for one in written],
        "left_out": [str(one) for one in parts_of(situation) if one not in written],
        "warnings": warnings,
    }
    if json_output:
        print_json(document)
    elif not quiet:
        echo(f"Wrote {output}: {', '.join(_count(situation, one) for one in written)}")


def _part(only: str | None) -> Part | None:
    from missions.formats import Part  # noqa: PLC0415 - quick help

    if only is None:
        return None
    if only not in list(Part):
        raise UsageError(f"--only {only!r}: expected one of {', '.join(Part)}")
    return Part(only)


def _with_return_point(situation: Situation, return_point: str | None) -> Situation:
    if return_point is None:
        return situation
    position = position_from("--return-point", return_point)
    if situation.fence is None:
        raise UsageError("--return-point belongs to a fence, and IN holds none")
    fence = replace(situation.fence.value, return_point=position)
    return replace(situation, fence=replace(situation.fence, value=fence))


def _check_choice(situation: Situation, source: Path, output: Path, part: Part | None) -> None:
    """Ask for a choice where OUT holds one list and IN has several."""
    from missions.formats import format_of, parts_of  # noqa: PLC0415 - quick help

    format_ = format_of(output, "write")
    there = [one for one in parts_of(situation) if one in format_.holds]
    if part is None and len(there) > 1 and not format_.together:
        options = " or ".join(f"--only {one}" for one in there)
        raise UsageError(
            f"{source} holds {' and '.join(there)}, and a {output.suffix} file one of them: choose with {options}"
        )


def _left_out(situation: Situation, written: tuple[Part, ...], output: Path) -> list[str]:
    from missions.formats import parts_of  # noqa: PLC0415 - quick help

    texts = [
        f"{_count(situation, one)} left out: a {output.suffix} file holds no {one}"
        for one in parts_of(situation)
        if one not in written
    ]
    mission = situation.mission
    if mission is not None and output.suffix.lower() in (".gpx", ".csv"):
        placeless = sum(not item.is_placed for item in mission.value.items)
        if placeless:
            texts.append(
                f"{placeless} mission items without a place left out: a {output.suffix} file holds the route only"
            )
    fence = situation.fence
    if fence is not None and fence.value.return_point and output.suffix.lower() == ".poly":
        texts.append("the return point is left out: a .poly file holds none")
    return texts


def _count(situation: Situation, part: Part) -> str:
    """Return how much of a part there is, in words."""
    mission, fence, rally = situation.mission, situation.fence, situation.rally
    counts = {
        "mission": (len(mission.value.items) if mission else 0, "mission item"),
        "fence": (len(fence.value.zones) if fence else 0, "fence zone"),
        "rally": (len(rally.value) if rally else 0, "rally point"),
        "parameters": (len(situation.parameters), "parameter"),
    }
    count, word = counts[part]
    return f"{count} {word}{'s' * (count != 1)}"
