"""What a page in one file shows of a plan, of a checked mission, of a log: bounded, however long the log."""

from __future__ import annotations

import math
from dataclasses import fields, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from mavlink_bridge.console.one_file import NamedLine, NamedMark, StillMoment, StillPage, page_bytes
from mavlink_bridge.console.view.fields import field_sections, mission_view
from mavlink_bridge.console.view.places import place, places
from mavlink_bridge.console.view.plans import checked_view, plan_view
from mavlink_bridge.console.view.sections import FenceView, PlanView
from missions.picture.outlines import line_on_earth
from missions.picture.plans import plan_scene
from missions.request import GoTo

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from mavlink_bridge.console.recording import Moment, RecordedSections, Recording
    from mavlink_bridge.console.view.fields import Where
    from mavlink_bridge.console.view.sections import EventView, TrackRow
    from missions.checking.check import MissionCheck
    from missions.geo import LatLon
    from missions.picture.scene import PictureScene
    from missions.planned import Plan
    from missions.request import Request
    from missions.situation import Situation

# What a log's page holds at the most, whatever the log: chosen, so that the file stays below 5 MB.
_MOST_MOMENTS: Final = 1000
_MOST_ROWS: Final = 5000
_MOST_EVENTS: Final = 500  # the page keeps no more
_MOST_DRAWINGS: Final = 40  # plans and fences with all that is drawn of them

_CHANGING: Final = ("link", "vehicle", "drive")
"""Sections of which only the fields that differ are kept."""


def plan_page(planned: Plan, situation: Situation, request: Request) -> bytes:
    """Return a plan's page, as ``pbpp plan --plot FILE.html`` writes it.

    Parameters
    ----------
    planned : missions.planned.Plan
        The plan.
    situation : Situation
        What it was made in.
    request : Request
        What was asked.
    """
    return page_bytes(plan_still(plan_scene(planned), planned, situation, request, "file"))


def plan_still(
    scene: PictureScene, planned: Plan, situation: Situation, request: Request, where: Where
) -> StillPage:
    """Return what a plan's page shows: the plan, its field, and the lines that its picture has besides."""
    sections = field_sections(situation, request, where)
    sections |= {"plan": plan_view(planned, situation, request)}
    return StillPage(title=scene.title, sections=sections, lines=_lines(scene))


def check_still(
    scene: PictureScene,
    checked: MissionCheck,
    planned: Plan,
    situation: Situation,
    request: Request,
    where: Where,
    warnings: Sequence[str],
    rally: Sequence[LatLon] | None = None,
) -> StillPage:
    """Return what the page of a checked mission shows; with rally points that were chosen for it, in place of the vehicle's."""
    view = replace(checked_view(checked, planned, request), warnings=tuple(warnings))
    sections = field_sections(situation, request, where) | {"plan": view}
    if rally is not None:
        sections |= {"rally": places(rally)}
    return StillPage(title=scene.title, sections=sections, lines=_lines(scene))


def files_still(scene: PictureScene, situation: Situation, notes: Sequence[str]) -> StillPage:
    """Return what a page shows of a file that nothing was planned or checked for: its field and mission, and a picture's lines and marks."""
    mission = mission_view(situation, matches_plan=False, current_seq=None)
    marks = [(mark.name, line_on_earth(scene.ground.frame, mark.point[None])[0]) for mark in scene.marks]
    return StillPage(
        title=scene.title,
        sections=field_sections(situation, GoTo(), "file") | {"mission": mission},
        notes=notes,
        lines=_lines(scene),
        marks=[NamedMark(name, place(at)) for name, at in marks],
    )


def log_still(
    title: Sequence[str],
    recording: Recording,
    sections: RecordedSections,
    notes: Sequence[str] = (),
    breaches: Iterable[tuple[str, LatLon]] = (),
    targets: Iterable[LatLon] = (),
) -> StillPage:
    """Return what a log's page shows: its moments, events and track, thinned to what can be seen."""
    moments, left_out = _moments(recording, sections)
    marks = [NamedMark(name, place(at)) for name, at in breaches]
    marks += [NamedMark("target", place(at), "target") for at in dict.fromkeys(targets)]
    drawn = f"of {left_out} more plans and fences only the lines are drawn" if left_out else ""
    return StillPage(
        title=(*title, drawn) if drawn else tuple(title),
        sections={"replay": sections.at(recording.begin_s)["replay"]},
        events=_events(recording.events),
        track=_rows(recording.track.rows),
        moments=moments,
        notes=notes,
        marks=marks,
    )


def _lines(scene: PictureScene) -> tuple[NamedLine, ...]:
    """Return the lines of a picture that are no part of its route: ways home, lines to rally points, blocks."""
    frame = scene.ground.frame
    found = [(track.name, track.points) for track in scene.tracks]
    found += [("", np.vstack((block, block[:1]))) for block in scene.blocks]
    return tuple(NamedLine(name, places(line_on_earth(frame, points))) for name, points in found)


def _moments(recording: Recording, sections: RecordedSections) -> tuple[list[StillMoment], int]:
    """Return the moments that are kept, and of how many plans and fences the drawing is left out."""
    found: list[StillMoment] = []
    before: dict[str, Any] = {}
    drawings = _Drawings()
    for moment in _chosen(recording.moments):
        now = {
            name: drawings.of(value) for name, value in sections.at(moment.time_s).items() if name != "replay"
        }
        if not before:
            whole, parts = now, {}
        else:
            whole = {
                name: value
                for name, value in now.items()
                if name not in _CHANGING and value is not before[name] and value != before[name]
            }
            parts = {name: changed for name in _CHANGING if (changed := _changed(before[name], now[name]))}
        if whole or parts:
            found.append(StillMoment(round(moment.time_s, 2), whole, parts))
        before = now
    return found, drawings.left_out


class _Drawings:
    """Keeps how much is drawn within bounds: beyond them a plan is its legs, and a fence its zones."""

    def __init__(self) -> None:
        self._seen: dict[str, Any] = {}
        self.left_out = 0

    def of(self, value: Any) -> Any:  # noqa: ANN401 - a section
        """Return a section as it is kept: the same one for the same facts."""
        if not isinstance(value, PlanView | FenceView):
            return value
        key = f"{type(value).__name__} {value.id}"
        kept = self._seen.get(key)
        if kept is not None and replace(value, **_DRAWN[type(value)]) == replace(kept, **_DRAWN[type(value)]):
            return kept
        if len(self._seen) >= _MOST_DRAWINGS:
            self.left_out += key not in self._seen
            value = replace(value, **_DRAWN[type(value)])
        self._seen[key] = value
        return value


_DRAWN: Final[dict[type, dict[str, Any]]] = {
    PlanView: {"corridor": None, "profile": ()},
    FenceView: {"meant": None},
}
"""What of a plan and of a fence is much, and is left out where there are too many."""


def _chosen(moments: Sequence[Moment]) -> list[Moment]:
    """Return the moments at which something was decided, and others between them, evenly."""

    def facts(moment: Moment) -> tuple[object, ...]:
        return (moment.drive.state, moment.plan, moment.situation.fence, moment.situation.mission)

    decided = {0, len(moments) - 1}
    for number, (a, b) in enumerate(pairwise(moments), 1):
        if any(one is not other for one, other in zip(facts(a), facts(b), strict=True)):
            decided.add(number)
    kept = set(_evenly(sorted(decided), _MOST_MOMENTS // 2))
    kept.update(_evenly(range(len(moments)), _MOST_MOMENTS - len(kept)))
    return [moments[number] for number in sorted(kept)]


def _evenly(numbers: Sequence[int], most: int) -> Sequence[int]:
    return numbers[:: max(1, math.ceil(len(numbers) / most))]


def _changed(before: Any, now: Any) -> Mapping[str, Any]:  # noqa: ANN401 - two sections of one kind
    pairs = ((one.name, getattr(before, one.name), getattr(now, one.name)) for one in fields(now))
    return {name: new for name, old, new in pairs if new != old}


def _events(events: Sequence[EventView]) -> list[EventView]:
    """Return the newest events; where there are too many the vehicle's own texts are left out first."""
    texts = [one for one in events if one.name == "statustext"]
    decisions = [one for one in events if one.name != "statustext"][-_MOST_EVENTS:]
    room = _MOST_EVENTS - len(decisions)
    kept = sorted((*decisions, *(texts[-room:] if room else ())), key=lambda one: one.time_s)
    return [replace(one, id=number) for number, one in enumerate(kept, 1)]


def _rows(rows: Sequence[TrackRow]) -> list[TrackRow]:
    """Return the track: evenly thinned, its modes' changes kept."""
    every = max(1, math.ceil(len(rows) / _MOST_ROWS))
    last = len(rows) - 1
    return [
        row
        for number, row in enumerate(rows)
        if number % every == 0 or number == last or row[4] != rows[number - 1][4]
    ]
