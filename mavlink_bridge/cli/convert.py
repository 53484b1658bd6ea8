"""``pbpp convert``: a fence, a mission, rally points or parameters from one file format to another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import is_same_file, remarks_document, warn
from mavlink_bridge.cli.field_files import read_file
from mavlink_bridge.cli.kept_files import write_kept
from mavlink_bridge.cli.terminal import echo, print_json
from mavlink_bridge.cli.values import position_from
from mavlink_bridge.errors import UsageError
from missions.formats import Part, format_of, parts_of, write_situation
from missions.vehicle import known_ardupilot
from missions.words import counted, mission_items

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.convert import ConvertOptions
    from missions.situation import Situation


def convert(options: ConvertOptions) -> None:
    """Write OUT, with a word of what it could not hold."""
    if is_same_file(options.source, options.output):
        raise UsageError(f"{options.output} is the same file as IN; choose another OUT")
    part = _part(options.only)
    situation = _with_return_point(read_file(options.source, options), options.return_point)
    _check_choice(situation, options.source, options.output, part)
    written = write_situation(situation, options.output, part, write=write_kept)
    left_out = _left_out(situation, written, options.output) if part is None else []
    warn(left_out)
    document = {
        "status": "ok",
        "command": "convert",
        "source": str(options.source),
        "outputs": [str(options.output)],
        "parts": [str(one) for one in written],
        "left_out": [str(one) for one in parts_of(situation) if one not in written],
        **remarks_document((), (*situation.remarks, *left_out)),
    }
    if options.json_output:
        print_json(document)
    elif not options.quiet:
        echo(f"Wrote {options.output}: {', '.join(_count(situation, one) for one in written)}")


def _part(only: str | None) -> Part | None:
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
        raise UsageError("--return-point needs a fence, and IN has none")
    fence = replace(situation.fence.value, return_point=position)
    return replace(situation, fence=replace(situation.fence, value=fence))


def _check_choice(situation: Situation, source: Path, output: Path, part: Part | None) -> None:
    """Ask for a choice where OUT holds one list and IN has several."""
    format_ = format_of(output, "write")
    there = [one for one in parts_of(situation) if one in format_.holds]
    if part is None and len(there) > 1 and not format_.together:
        options = " or ".join(f"--only {one}" for one in there)
        raise UsageError(
            f"{source} holds {' and '.join(there)}, and a {output.suffix} file can hold only one of them: choose with {options}"
        )


def _left_out(situation: Situation, written: tuple[Part, ...], output: Path) -> list[str]:
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
                f"{counted(placeless, 'mission item')} without a place left out: a {output.suffix} file holds the route only"
            )
    fence = situation.fence
    if fence is not None and fence.value.return_point and output.suffix.lower() == ".poly":
        texts.append("the return point is left out: a .poly file holds none")
    return texts


def _count(situation: Situation, part: Part) -> str:
    """Return how much of a part there is, in words."""
    mission, fence, rally = situation.mission, situation.fence, situation.rally
    has_home = known_ardupilot(situation) is not False
    counts = {
        "mission": mission_items(
            mission.value.item_count(has_home=has_home) if mission else 0, has_home=has_home
        ),
        "fence": counted(len(fence.value.zones) if fence else 0, "fence zone"),
        "rally": counted(len(rally.value) if rally else 0, "rally point"),
        "parameters": counted(len(situation.parameters), "parameter"),
    }
    return counts[part]
