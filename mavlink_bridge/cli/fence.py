"""``pbpp fence``: fences made fit for the vehicle."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import is_same_file, remarks_document
from mavlink_bridge.cli.field_files import read_fence_file
from mavlink_bridge.cli.kept_files import write_kept
from mavlink_bridge.cli.options.fence import ACTIONS
from mavlink_bridge.cli.terminal import echo, print_json
from mavlink_bridge.errors import UsageError
from missions.fence import ZoneKind
from missions.formats import Part, check_writable_format, format_of, write_situation
from missions.ground.merged_fence import merged_fence
from missions.words import counted

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.fence import FenceOptions


def fence(options: FenceOptions) -> None:
    """Merge a fence's inclusions, and write it."""
    if options.action not in ACTIONS:
        raise UsageError(f"{options.action!r}: expected {' or '.join(ACTIONS)}")
    if is_same_file(options.source, options.output):
        raise UsageError(f"{options.output} is the same file as FILE; choose another -o FILE")
    check_writable_format(options.output, Part.FENCE)
    situation = read_fence_file(options.source, options)
    known = situation.fence
    assert known is not None
    merged = merged_fence(known.value)
    situation = replace(situation, fence=replace(known, value=merged))
    part = None if format_of(options.output, "write").together else Part.FENCE
    write_situation(situation, options.output, part, write=write_kept)
    before = sum(zone.kind is ZoneKind.INCLUSION for zone in known.value.zones)
    if options.json_output:
        print_json(
            {
                "status": "ok",
                "command": "fence",
                "action": options.action,
                "source": str(options.source),
                "outputs": [str(options.output)],
                "merged_inclusions": before if before > 1 else 0,
                "zones": len(merged.zones),
                "vertices": merged.vertex_count,
                **remarks_document((), situation.remarks),
            }
        )
    elif not options.quiet:
        told = (
            f"{before} inclusions merged into one"
            if before > 1
            else f"{counted(before, 'inclusion')}, nothing to merge"
        )
        echo(f"Wrote {options.output}: {told}; {counted(len(merged.zones), 'zone')} in all")
