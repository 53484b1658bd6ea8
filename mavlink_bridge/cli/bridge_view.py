"""The bridge's live view in a terminal: what the vehicle does, and a small map."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console, Group  # the type: `drawing.console` makes one
from rich.control import Control
from rich.live import Live
from rich.segment import ControlType
from rich.table import Table
from rich.text import Text

from mavlink_bridge.cli.drawing import cell
from mavlink_bridge.cli.drawing import console as terminal_console
from mavlink_bridge.cli.typed import CONFIRM
from mavlink_bridge.director import Severity, State
from mavlink_bridge.mavlink.autopilots import autopilot_of
from missions.picture import sketch_plan

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType
    from typing import Self

    from mavlink_bridge.director import Director, Event
    from missions.geo import LatLon
    from missions.planned import Plan

# Chosen, not measured: quick enough to watch; the map takes longer to draw and changes slowly.
_TABLE_EVERY_S = 0.5
_MAP_EVERY_S = 10.0
_MAP_COLUMNS = 72
_MOST_PLACES = 2000  # of the track on the map; chosen, bounds the memory of a long drive
_OLD_S = 3.0
"""A heartbeat comes every second, positions more often: what is older than this is marked as old."""

_STYLES = {
    Severity.CRITICAL: "bold red",
    Severity.ERROR: "red",
    Severity.WARNING: "yellow",
    Severity.NOTICE: "bold",
}


class LiveView:
    """Shows a director; a context manager.

    Parameters
    ----------
    director : Director
        What is shown.
    console : Console, optional
        Where; standard output if not given.
    """

    def __init__(self, director: Director, console: Console | None = None) -> None:
        self._director = director
        self._console = console or terminal_console()
        self._live = Live(console=self._console, auto_refresh=False)
        self._track: list[LatLon] = []
        self._map = ""
        self._mapped: object = None
        self._table_due_s = self._map_due_s = 0.0
        self._state: State | None = None
        self._state_since_s = 0.0
        self._answer: Text | None = None
        self.link_trouble: str | None = None  # why the link is closed, while it is

    def __enter__(self) -> Self:
        self._live.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.__exit__(kind, error, trace)

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Clear the terminal of the view, for as long as the context lasts."""
        self._live.stop()
        try:
            yield
        finally:
            self._live.start()

    def tell(self, event: Event) -> None:
        """Show an event above the view; progress stands in the view itself."""
        if event.name != "progress":
            clock = time.strftime("%H:%M:%S", time.localtime(event.time_s))
            self._live.console.print(cell(f"{clock} {event.text}", _STYLES.get(event.severity, "")))

    def note(self, text: str, *, is_warning: bool) -> None:
        """Show news that are no event, above the view."""
        self._live.console.print(_styled(text, is_warning=is_warning))
        self._table_due_s = 0.0

    def answer(self, text: str, *, is_warning: bool) -> None:
        """Show the answer to a typed line, above the view and as the last one in it."""
        if sys.stdin.isatty():  # whose Enter has moved the cursor a line below the view
            self._console.control(Control((ControlType.CURSOR_UP, 1)))
        self._answer = _styled(text, is_warning=is_warning)
        self.note(text, is_warning=is_warning)

    def show(self, now_s: float) -> None:
        """Bring the view up to date, a few times a second at most, the map more rarely."""
        if now_s < self._table_due_s:
            return
        self._table_due_s = now_s + _TABLE_EVERY_S
        pose = self._director.situation.pose
        if pose is not None and (not self._track or self._track[-1] != pose.value.position):
            self._track = [*self._track[-_MOST_PLACES:], pose.value.position]
        plan = self._director.plan
        if plan is not None and (plan is not self._mapped or now_s >= self._map_due_s):
            if plan is not self._mapped:
                self._track = self._track[-1:]
            self._mapped = plan
            self._map_due_s = now_s + _MAP_EVERY_S
            encoding = self._console.encoding
            self._map = sketch_plan(plan, track=self._track, columns=_MAP_COLUMNS, encoding=encoding)
        self._live.update(Group(self._table(now_s), Text(self._map)), refresh=True)

    def _table(self, now_s: float) -> Table:
        director, situation = self._director, self._director.situation
        if director.state is not self._state:
            self._state, self._state_since_s = director.state, now_s
        table = Table.grid(padding=(0, 2))
        rows = self._link_rows(now_s)
        since_s = now_s - self._state_since_s
        rows.append(("state", f"{director.state.replace('_', ' ')}, for {_age(since_s)}"))
        if situation.mode is not None:
            armed = "armed" if situation.armed else "disarmed"
            vehicle = f"system {situation.system}, {autopilot_of(ardupilot=situation.ardupilot).modes.words(situation.mode)}, {armed}"
            rows.append(("vehicle", _of_then(vehicle, director.heard_s, now_s)))
        if (pose := situation.pose) is not None:
            rows.append(("position", _of_then(str(pose.value.position), pose.time_s, now_s)))
        if (drive := director.drive) is not None and director.plan is not None:
            rows.append(("left", f"{drive.distance_left_m:.0f} m, about {drive.time_left_s:.0f} s"))
            rows.append(("clearance", f"{drive.least_clearance_m:.1f} m, the least so far"))
        elif director.plan is not None:
            rows.append(("route", f"{director.plan.length_m:.0f} m, {self._count(director.plan)} items"))
        if (way := director.way_home) is not None:
            rows.append(("way home", f"{way.place.name}, {way.length_m:.0f} m, about {way.time_s:.0f} s"))
        elif director.no_way_home:
            rows.append(("way home", cell(f"none: {director.no_way_home}", "yellow")))
        if director.awaits_confirmation:
            rows.append(("plan", cell(CONFIRM, "bold")))
        if self._answer is not None:
            rows.append(("answer", self._answer))
        for name, value in rows:
            table.add_row(cell(name, "dim"), cell(value))
        return table

    def _count(self, plan: Plan) -> int:
        """Return how many items the list of a plan has on the vehicle."""
        form = autopilot_of(ardupilot=self._director.situation.ardupilot).lists.form
        return len(form.mission_of(plan.items, plan.start))

    def _link_rows(self, now_s: float) -> list[tuple[str, str | Text]]:
        """Return the rows of a lost link: that the vehicle is not heard, since when, and what is done about it."""
        heard_s, why = self._director.heard_s, self.link_trouble
        silent_s = None if heard_s is None else max(0.0, now_s - heard_s)
        is_lost = why is not None or self._director.state is State.LOST
        if not is_lost and (silent_s is None or silent_s < _OLD_S):
            return []
        last = "no vehicle heard yet" if silent_s is None else f"last heard {_age(silent_s)} ago"
        if not is_lost:
            return [("link", cell(last, "yellow"))]
        return [("link", cell(f"LINK LOST: {last}" + (f" ({why})" if why else ""), "bold red"))]


def _of_then(text: str, time_s: float | None, now_s: float) -> Text:
    """Return a text, with its age where it is not current."""
    if time_s is None or now_s - time_s < _OLD_S:
        return cell(text)
    return cell(f"{text} ({_age(now_s - time_s)} old)", "yellow")


def _styled(text: str, *, is_warning: bool) -> Text:
    return cell(text, "yellow" if is_warning else "bold")


def _age(seconds: float) -> str:
    if seconds < 100:
        return f"{max(0.0, seconds):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.0f} h"
