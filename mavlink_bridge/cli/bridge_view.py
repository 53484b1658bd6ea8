"""The bridge's live view in a terminal: the sections that the page shows too, in a few lines, a small map, and what is typed."""

from __future__ import annotations

import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console, Group  # the type: `drawing.console` makes one
from rich.live import Live
from rich.table import Table
from rich.text import Text

from mavlink_bridge.cli.drawing import cell
from mavlink_bridge.cli.drawing import console as terminal_console
from mavlink_bridge.cli.keyboard import Keyboard
from mavlink_bridge.cli.typed import CONFIRM, HELP
from mavlink_bridge.console.view.drives import DriveShown
from mavlink_bridge.console.view.instruments import LATE_S, Instruments
from mavlink_bridge.director import Severity, State
from missions.picture import Sketch, sketch_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from types import TracebackType
    from typing import Self

    from mavlink_bridge.console.view.sections import DriveView, LinkView, VehicleView
    from mavlink_bridge.director import Director, Event
    from mavlink_bridge.mavlink.messages import Frame
    from missions.geo import LatLon
    from missions.planned import Plan

    Row = tuple[str, str | Text]

# Chosen, not measured.
_EVERY_S = 0.5  # quick enough to watch
_MAP_COLUMNS = 80
_EVENT_LINES = 4  # of the terminal are left to what is told above the view
_FEWEST_MAP_LINES = 8
_MOST_PLACES = 2000  # of the track on the map; chosen, bounds the memory of a long drive

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

    Attributes
    ----------
    keyboard : Keyboard
        What is typed; the view shows it as long as it is on the terminal.
    link_trouble : str or None
        Why the link is closed, while it is.
    """

    def __init__(self, director: Director, console: Console | None = None) -> None:
        self._director = director
        self._console = console or terminal_console()
        self._live = Live(console=self._console, auto_refresh=False, vertical_overflow="crop", transient=True)
        self._instruments = Instruments()
        self._drive = DriveShown()
        self._track: list[LatLon] = []
        self._map: tuple[Plan, int, int, Sketch] | None = None
        self._due_s = 0.0
        self._typing = ""
        self._answer: Text | None = None
        self.keyboard = Keyboard()
        self.link_trouble: str | None = None

    def __enter__(self) -> Self:
        self.keyboard.take()
        self._live.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.transient = False  # what was seen last stays
        self._live.__exit__(kind, error, trace)
        self.keyboard.give_back()

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Clear the terminal of the view, for as long as the context lasts; for good where it ends in an error: what was seen is old by then."""
        self._live.stop()
        self.keyboard.give_back()
        yield
        self.keyboard.take()
        self._live.start()

    def hear(self, frames: Iterable[Frame], now_s: float) -> None:
        """Take what was heard on the link."""
        peer = self._director.peer
        for frame in frames:
            if peer is not None and (frame.system, frame.component) == (peer.system, peer.component):
                self._instruments.receive(frame, now_s)
        self._instruments.take_texts()  # which stand in the events, where they matter

    def tell(self, event: Event) -> None:
        """Show an event above the view; progress stands in the view itself."""
        if event.name != "progress":
            clock = time.strftime("%H:%M:%S", time.localtime(event.time_s))
            self._live.console.print(cell(f"{clock} {event.text}", _STYLES.get(event.severity, "")))

    def note(self, text: str, *, is_warning: bool) -> None:
        """Show news that are no event, above the view."""
        self._live.console.print(_styled(text, is_warning=is_warning))
        self._due_s = 0.0

    def answer(self, text: str, *, is_warning: bool) -> None:
        """Show the answer to a typed line, above the view and as the last one in it."""
        self._answer = _styled(text, is_warning=is_warning)
        self.note(text, is_warning=is_warning)

    def show(self, now_s: float) -> None:
        """Bring the view up to date: a few times a second at most, and at once where something is typed."""
        typing = self.keyboard.typing
        if now_s < self._due_s and typing == self._typing:
            return
        self._due_s, self._typing = now_s + _EVERY_S, typing
        pose = self._director.situation.pose
        if pose is not None and (not self._track or self._track[-1] != pose.value.position):
            self._track = [*self._track[-_MOST_PLACES:], pose.value.position]
        rows = self._rows(now_s)
        table = Table.grid(padding=(0, 2))
        for name, value in rows:
            table.add_row(cell(name, "dim"), cell(value))
        lines = self._console.height - 1 - _EVENT_LINES - sum(map(self._height_of, rows))
        self._live.update(Group(table, Text(self._drawn_map(lines))), refresh=True)

    def _shortened(self, text: Text) -> Text:
        """Return a text in one line; the whole of it stands above the view."""
        short = text.copy()
        short.truncate(self._value_columns, overflow="ellipsis")
        return short

    @property
    def _value_columns(self) -> int:
        """How wide the terminal is beside the names of rows."""
        return max(10, self._console.width - 12)

    def _height_of(self, row: Row) -> int:
        """Return how many lines a row takes."""
        return 1 + (len(row[1]) - 1) // self._value_columns

    def _drawn_map(self, lines: int) -> str:
        """Return the map of the plan that stands, with the rover in it, in so many lines; nothing where they are too few."""
        plan, columns = self._director.plan, min(_MAP_COLUMNS, self._console.width)
        if plan is None or lines < _FEWEST_MAP_LINES:
            return ""
        if self._map is None or self._map[0] is not plan:
            self._track = self._track[-1:]
        try:
            if self._map is None or self._map[0] is not plan or self._map[1:3] != (columns, lines):
                drawn = sketch_of(plan, columns=columns, lines=lines, encoding=self._console.encoding)
                self._map = plan, columns, lines, drawn
            pose = self._director.situation.pose
            here = (pose.value.position, pose.value.heading_deg) if pose is not None else (None, None)
            return self._map[3].text(self._track, *here).rstrip("\n")
        except Exception as error:  # noqa: BLE001 - no picture is worth a drive
            return f"the map cannot be drawn: {type(error).__name__}: {error}"

    def _rows(self, now_s: float) -> list[Row]:
        """Return what the sections say, a line each."""
        director = self._director
        heard_s, trouble = director.heard_s, self.link_trouble or ""
        is_lost = director.state is State.LOST
        link = self._instruments.link(heard_s, now_s, is_lost=is_lost, trouble=trouble)
        drive = self._drive.view(director, "", now_s, can_resume=False)
        vehicle = self._instruments.vehicle(director.situation)
        rows = [*_link_rows(link, now_s), ("state", _state_text(drive, now_s))]
        rows += _vehicle_rows(vehicle, link, now_s)
        rows += _drive_rows(drive) if drive.is_driving else _route_rows(director.plan)
        if drive.way_home:
            is_none = drive.way_home.startswith("none: ")
            rows.append(("way home", cell(drive.way_home, "yellow" if is_none else "")))
        if drive.awaits_upload:
            rows.append(("plan", cell(CONFIRM, "bold")))
        if self._answer is not None:
            rows.append(("answer", self._shortened(self._answer)))
        if self.keyboard.is_shown_by_us:
            typed = f"{self._typing[-self._value_columns + 1 :]}_"
            rows.append((">", cell(typed) if self._typing else self._shortened(cell(HELP, "dim"))))
        return rows


def _link_rows(link: LinkView, now_s: float) -> list[Row]:
    """Return the row of a link that is late, lost or closed: since when, and what is done about it."""
    if link.state == "ok":
        return []
    last = "no vehicle heard yet"
    if link.heard_s is not None:
        last = f"last heard {_age(max(0.0, now_s - link.heard_s))} ago"
    if link.state in ("late", "listening"):
        return [("link", cell(last, "yellow"))] if link.state == "late" else []
    return [("link", cell(f"LINK LOST: {last}" + (f" ({link.trouble})" if link.trouble else ""), "bold red"))]


def _state_text(drive: DriveView, now_s: float) -> str:
    since_s = now_s - drive.since_s if drive.since_s is not None else 0.0
    return f"{drive.state_text}, for {_age(since_s)}"


def _vehicle_rows(vehicle: VehicleView, link: LinkView, now_s: float) -> list[Row]:
    """Return what the vehicle reports of itself, with its age where that is not current."""
    rows: list[Row] = []
    if vehicle.mode is not None:
        battery = [f"{vehicle.battery_percent} %"] if vehicle.battery_percent is not None else []
        battery += [f"{vehicle.battery_v:.1f} V"] if vehicle.battery_v is not None else []
        facts = [
            f"system {vehicle.system}",
            vehicle.mode_text,
            "armed" if vehicle.armed else "disarmed",
            *([vehicle.fix_text] if vehicle.fix_text else []),
            *([f"battery {' '.join(battery)}"] if battery else []),
        ]
        rows.append(("vehicle", _of_then(", ".join(facts), link.heard_s, now_s)))
    if vehicle.position is not None:
        lon_deg, lat_deg = vehicle.position
        facts = [f"{lat_deg:.7f},{lon_deg:.7f}"]
        facts += [f"heading {vehicle.heading_deg:.0f}°"] if vehicle.heading_deg is not None else []
        facts += [f"{vehicle.speed_mps:.1f} m/s"] if vehicle.speed_mps is not None else []
        rows.append(("position", _of_then(", ".join(facts), vehicle.position_s, now_s)))
    return rows


def _drive_rows(drive: DriveView) -> list[Row]:
    """Return how the drive goes."""
    left = (
        f"{drive.left_m:.0f} of {drive.length_m:.0f} m, about {drive.eta_s:.0f} s, to item {drive.next_seq}"
    )
    kept = "no fence near"
    if drive.least_clearance_m is not None:
        kept = f"{drive.least_clearance_m:.1f} m, the least so far"
        kept += f"; {drive.asked_m:g} m promised" if drive.asked_m is not None else ""
    aside = f"{drive.deviation_m:.1f} m beside the route"
    aside += "" if drive.corridor_ok else ", OUTSIDE the predicted corridor"
    text = f"{kept}; {aside}" + (f"; {drive.breaches} breaches" if drive.breaches else "")
    return [("left", left), ("clearance", cell(text, "" if drive.corridor_ok else "yellow"))]


def _route_rows(plan: Plan | None) -> list[Row]:
    return (
        []
        if plan is None
        else [("route", f"{plan.length_m:.0f} m, {len(plan.items) + plan.vehicle.home_items} items")]
    )


def _of_then(text: str, time_s: float | None, now_s: float) -> Text:
    """Return a text, with its age where it is not current."""
    if time_s is None or now_s - time_s < LATE_S:
        return cell(text)
    return cell(f"{text} ({_age(now_s - time_s)} old)", "yellow")


def _styled(text: str, *, is_warning: bool) -> Text:
    return cell(text, "yellow" if is_warning else "bold")


def _age(seconds: float) -> str:
    if seconds < 100:
        return f"{max(0.0, seconds):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.0f} h"
