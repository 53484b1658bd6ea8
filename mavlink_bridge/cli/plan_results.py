"""What is done with a plan: files, pictures, the JSON document, the report for people."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from mavlink_bridge.cli.common import inform, remarks_document, warn
from mavlink_bridge.cli.home_parts import parts_document, with_parts
from mavlink_bridge.cli.kept_files import write_kept
from mavlink_bridge.cli.pictures import draw, stills
from mavlink_bridge.cli.terminal import echo
from mavlink_bridge.cli.way_home import RouteWays
from missions.checking.holding import hold_info
from missions.checking.home_part import drive_end
from missions.fence import CircleZone, PolygonZone, ZoneKind
from missions.picture.plans import plan_scene
from missions.request import GoTo
from missions.words import counted

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from mavlink_bridge.console.one_file import StillPage
    from mavlink_bridge.console.view.fields import Where
    from missions.drive_model.stopping import HoldCheck
    from missions.geo import LatLon
    from missions.picture.scene import PictureScene
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation


def write_outputs(
    planned: Plan,
    situation: Situation,
    outputs: list[Path],
    plots: list[Path],
    *,
    asked: tuple[Request, Where] | None = None,
    blocks: bool = False,
    ways: RouteWays | None = None,
) -> list[Path]:
    """Write the mission and draw the plan; return the files."""
    for path in outputs:
        planned.write(path, situation, write=write_kept)

    def scene() -> PictureScene:
        plain = with_parts(plan_scene(planned, blocks=blocks), planned.items)
        return plain if ways is None or plain.tracks else ways.drawn(plain)

    def page(drawn: PictureScene) -> StillPage:
        request, where = asked or (GoTo(), "file")
        page: StillPage = stills().plan_still(drawn, planned, situation, request, where)
        return page

    return [*outputs, *draw(scene, page, plots)]


def plan_document(planned: Plan) -> dict[str, object]:
    """Return the JSON document of a plan."""
    fence = planned.fence
    return {
        "status": "ok",
        "command": "plan",
        "method": planned.method,
        "start": list(planned.start),
        "targets": [list(target) for target in planned.targets],
        "path": [list(position) for position in planned.path],
        "length_m": round(planned.length_m, 3),
        "straight_line_m": round(planned.straight_line_m, 3),
        "duration_s": round(planned.duration_s, 1),
        "clearance_m": planned.clearance_m,
        "start_clearance_m": planned.start_clearance_m,
        "drawn_clearance_m": _finite(planned.drawn_clearance_m),
        "driven_clearance_m": _finite(planned.driven_clearance_m),
        "fence": {
            "inclusion_polygons": fence.count(ZoneKind.INCLUSION, PolygonZone),
            "exclusion_polygons": fence.count(ZoneKind.EXCLUSION, PolygonZone),
            "inclusion_circles": fence.count(ZoneKind.INCLUSION, CircleZone),
            "exclusion_circles": fence.count(ZoneKind.EXCLUSION, CircleZone),
            "vertices": fence.vertex_count,
            "union": planned.ground.union,
        },
        "obstacles": [
            {
                "name": one.name,
                "position": list(one.position),
                "radius_m": round(one.radius_m, 2),
                "taken_for_m": round(planned.ground.obstacles.radius_m(one), 2),
            }
            for one in planned.ground.obstacles.known
        ],
        "stopping": hold_document(planned.hold),
        "blocks": planned.blocks,
        "mission_items": len(planned.items) + planned.vehicle.home_items,
        "extrapolated": list(planned.extrapolated),
        **remarks_document(planned.info, planned.warnings),
    }


def hold_document(hold: HoldCheck | None) -> dict[str, object] | None:
    """Return for the JSON document what HOLD does on a route; null where that is not known."""
    if hold is None:
        return None
    worst = hold.worst
    return {
        "speed_mps": round(hold.speed_mps, 2),
        "distance_m": round(hold.stopping_m, 2),
        **({} if hold.aside_m is None else {"aside_m": round(hold.aside_m, 2)}),
        "source": hold.source,
        "leaves_fence": worst
        and {
            "at": list(worst.at),
            "speed_mps": round(worst.speed_mps, 2),
            "distance_m": round(worst.stopping_m, 2),
            "to_fence_m": round(worst.to_fence_m, 2),
            "beyond_m": round(worst.beyond_m, 2),
            "fence": worst.fence,
        },
    }


def _finite(value_m: float | None) -> float | None:
    return None if value_m is None or value_m == float("inf") else round(value_m, 4)


class Told:
    """A plan as it is printed: warnings, files and pictures, and the report for people; before anything is done with it.

    Parameters
    ----------
    outputs, plots : list of Path
        Where the mission and its pictures go.
    places : mapping of str to LatLon, optional
        Where ways home may lead, beside home and the rally points; None looks for no ways.
    asked : tuple of Request and str
        What was asked, and where the fence is from: ``file``, ``log`` or ``vehicle``.
    blocks : bool
        Draw the blocks of the free space too.
    is_silent : bool
        Print no report.
    drives : bool
        Whether the vehicle drives it at once: what HOLD does is told too.
    """

    def __init__(
        self,
        outputs: list[Path],
        plots: list[Path],
        places: Mapping[str, LatLon] | None,
        *,
        asked: tuple[Request, Where],
        blocks: bool,
        is_silent: bool,
        drives: bool = False,
    ) -> None:
        self._places = places
        self._ways: RouteWays | None = None
        self._outputs = outputs
        self._plots = plots
        self._asked = asked
        self._blocks = blocks
        self._is_silent = is_silent
        self._drives = drives
        self._plan: Plan | None = None
        self._planning_s = 0.0
        self._remarks: tuple[str, ...] = ()
        self._taken: tuple[str, ...] = ()
        self._written: list[Path] = []

    def tell(self, planned: Plan, planning_s: float, situation: Situation, taken: Iterable[str] = ()) -> None:
        """Report a plan, and what it was taken from; a later one is the route made anew."""
        self._taken = tuple(taken)
        if self._places is not None:
            self._ways = RouteWays.of(planned, situation, self._places)
        inform((*self._taken, *planned.info, *(hold_info(planned.hold) if self._drives else ())))
        warn(planned.warnings)
        self._written = write_outputs(
            planned,
            situation,
            self._outputs,
            self._plots,
            asked=self._asked,
            blocks=self._blocks,
            ways=self._ways,
        )
        if not self._is_silent:
            if self._plan is not None:
                echo("New route:")
            report_plan(planned, self._written, self._ways)
            sys.stdout.flush()
        self._plan, self._planning_s, self._remarks = planned, planning_s, situation.remarks

    def document(self) -> dict[str, object]:
        """Return the newest plan for the JSON document."""
        assert self._plan is not None
        return {
            **plan_document(self._plan),
            **remarks_document((*self._taken, *self._plan.info), (*self._remarks, *self._plan.warnings)),
            "ways_home": self._ways.document() if self._ways is not None else None,
            "way_home_inside": parts_document(self._plan.items),
            "planning_s": round(self._planning_s, 6),
            "outputs": [str(path) for path in self._written],
        }


def arrival_document(arrival: Mapping[str, object] | None) -> dict[str, object]:
    """Return a drive for the JSON document: the event's data, null where nothing was driven."""
    names = ("driven_m", "took_s", "least_clearance_m", "breaches")
    return {"arrived": arrival is not None, "drive": arrival and {name: arrival[name] for name in names}}


def report_plan(planned: Plan, written: list[Path], ways: RouteWays | None = None) -> None:
    """Print a plan for people, and where it was written."""
    along = f"{planned.drawn_clearance_m:.2f} m along straight legs"
    if planned.clearance_m is None:
        promise = f"{along}, nothing promised while driving"
    elif planned.start_clearance_m is not None:  # the straight legs count the start's too
        promise = f"at least {planned.clearance_m:g} m while driving, but {planned.start_clearance_m:g} m while leaving the start"
    else:
        promise = f"at least {planned.clearance_m:g} m while driving ({along})"
    if planned.extrapolated:
        promise += ", extrapolated beyond what was measured"
    waypoints = sum(item.is_placed for item in planned.items[: drive_end(planned.items)])
    turns = planned.turn_count
    echo(
        f"Route: {planned.length_m:.1f} m ({planned.straight_line_m:.1f} m in a straight line), "
        f"about {planned.duration_s:.0f} s, {counted(waypoints, 'waypoint')} ({counted(turns, 'turn')})"
    )
    echo(f"Fence clearance: {promise}")
    if ways is not None:
        echo(ways.sentence)
    for path in written:
        echo(f"Wrote {path}")


def report_end(arrival: Mapping[str, object] | None, backup: Path | None, *, verified: bool) -> None:
    """Print for people what was done with a plan."""
    if verified:
        echo("Uploaded and verified")
    if backup is not None:
        echo(f"The previous mission is saved in {backup}")
    if arrival is not None:
        least = arrival["least_clearance_m"]
        kept = f"least clearance {least:.2f} m" if isinstance(least, float) else "no fence near"
        echo(
            f"Arrived after {arrival['driven_m']:.1f} m in {arrival['took_s']:.0f} s; {kept} while driving, "
            f"fence breaches: {arrival['breaches']}"
        )
