"""The bridge's live view in a terminal: what the vehicle does, and a small map."""

from __future__ import annotations

import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from mavlink_bridge.director import Severity
from mavlink_bridge.rover import MODE_NAMES
from missions.picture import sketch_plan

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType
    from typing import Self

    from mavlink_bridge.director import Director, Event
    from missions.geo import LatLon

_TABLE_EVERY_S = 0.5
_MAP_EVERY_S = 10.0
_MAP_COLUMNS = 72
_MOST_PLACES = 2000
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
        self._console = console or Console()
        self._live = Live(console=self._console, auto_refresh=False)
        self._track: list[LatLon] = []
        self._map = ""
        self._mapped: object = None
        self._table_due_s = self._map_due_s = 0.0

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
            self._live.console.print(Text(f"{clock} {event.text}", style=_STYLES.get(event.severity, "")))

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
        self._live.update(Group(self._table(), Text(self._map)), refresh=True)

    def _table(self) -> Table:
        director, situation = self._director, self._director.situation
        table = Table.grid(padding=(0, 2))
        rows = [("state", director.state.replace("_", " "))]
        if situation.mode is not None:
            armed = "armed" if situation.armed else "disarmed"
            rows.append(
                (
                    "vehicle",
                    f"system {situation.system}, {MODE_NAMES.get(situation.mode, situation.mode)}, {armed}",
                )
            )
        if situation.pose is not None:
            rows.append(("position", str(situation.pose.value.position)))
        if (drive := director.drive) is not None and director.plan is not None:
            rows.append(("left", f"{drive.distance_left_m:.0f} m, about {drive.time_left_s:.0f} s"))
            rows.append(("clearance", f"{drive.least_clearance_m:.1f} m at the nearest so far"))
        elif director.plan is not None:
            rows.append(("route", f"{director.plan.length_m:.0f} m, {len(director.plan.items)} items"))
        for name, value in rows:
            table.add_row(Text(name, style="dim"), value)
        return table
