"""``pbpp bridge``: the director on a live link, for hours."""

from __future__ import annotations

import contextlib
import sys
import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import typer

from mavlink_bridge.backup.drive_note import DriveNotes
from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.cli.bridge_view import LiveView
from mavlink_bridge.cli.common import inform, warn
from mavlink_bridge.cli.failing import Level, exit_code_of, telling
from mavlink_bridge.cli.interrupting import AtHand, interruptible
from mavlink_bridge.cli.keyboard import Keyboard
from mavlink_bridge.cli.link_notes import tell_echoes
from mavlink_bridge.cli.live import BackupKeeper, PlanMaker, WaysMaker, director_at_hand
from mavlink_bridge.cli.opening import Opening
from mavlink_bridge.cli.permissions import check_permissions
from mavlink_bridge.cli.plan_request import request_from_options
from mavlink_bridge.cli.recording import open_recording
from mavlink_bridge.cli.run_log import RunLog, SafeTeller
from mavlink_bridge.cli.session import signing_of
from mavlink_bridge.cli.terminal import echo, print_json, say
from mavlink_bridge.cli.typed import CONFIRM, understood
from mavlink_bridge.cli.values import given_places
from mavlink_bridge.cli.vehicle_options import described_vehicle
from mavlink_bridge.director import AT_WORK, Director, EventName, Orders, Severity
from mavlink_bridge.director.orders import DEFAULT_SOURCES, Homing, ObstacleSource, TargetSource
from mavlink_bridge.errors import LinkError, UsageError
from mavlink_bridge.link import ONE_SHOT_IDENTITY, now_s, open_link, parse_connection
from mavlink_bridge.mavlink.echoes import SentFrames
from mavlink_bridge.protocol.outcomes import ends_in_words
from mavlink_bridge.replay.journal import Call
from missions.checking.holding import hold_info
from missions.geo import LatLon
from missions.situation import Situation

if TYPE_CHECKING:
    from collections.abc import Callable

    from mavlink_bridge.backup.drive_note import DriveNote
    from mavlink_bridge.backup.vehicle_mark import VehicleMark
    from mavlink_bridge.cli.options.bridge import BridgeOptions
    from mavlink_bridge.cli.options.shared import CommonOptions
    from mavlink_bridge.director import Event
    from mavlink_bridge.link import Link
    from mavlink_bridge.mavlink.messages import Frame, Message
    from mavlink_bridge.mavlink.signing import Signing
    from mavlink_bridge.replay.journal import JournalWriter
    from mavlink_bridge.tlog import TlogWriter
    from missions.planned import Plan

# Between attempts to open a link anew: doubled up to half a minute. Chosen, not measured.
_BACKOFF_S = (0.5, 1.0, 2.0, 4.0, 8.0, 15.0, 30.0)
_OBSTACLES_TEXT = "routes are planned around reported obstacles; this protects no person: a sensor may miss one, and the rover rolls on after HOLD"
_LINK_LOOK_S = 0.25  # how soon an interrupt is seen while waiting for that
_BY_ROUTE = (
    "--rtl-by-route: the first RTL is answered with HOLD and a verified way home around the fences in AUTO. RTL again 4 s or more later, or any other mode, "
    "is left to you at once; that RTL drives straight, through any fence on the way"
)
_PAGES_LOOK_S = 0.05  # so soon what a page asks for is done; chosen: less than a person notices
_OPENING_LOOK_S = 0.05  # and while a link is being opened


def bridge(options: BridgeOptions) -> None:
    """Run the director on a link until its single job is done, or for ever."""
    check_permissions(upload=options.upload, drive=options.drive, arm=options.arm)
    orders = _orders(options)
    if orders.obstacle_sources:
        inform((_OBSTACLES_TEXT,))
    if orders.homing.by_route:
        inform([_BY_ROUTE])
    described = described_vehicle(options)
    with contextlib.ExitStack() as stack:
        notes, troubles = DriveNotes(BackupStore().folder).read()
        warn(map(str, troubles))
        recorder, journal = _recorders(stack, options.log, orders, described, notes)
        director = Director(orders, described, notes)
        view = _view(stack, director, is_wanted=not options.is_silent)
        tell = view.tell if view else teller(options)
        log_of_run = RunLog(recorder, journal) if recorder is not None and journal is not None else None
        tell = SafeTeller(tell, lambda: director.state not in AT_WORK)
        shell = BridgeShell(director, options.connect, tell, view, log_of_run)
        shell.run(signing_of(options.signing_key), options.timeout)
    trouble = shell.director.trouble
    if trouble is not None and shell.director.is_done:
        if options.json_output:
            raise typer.Exit(exit_code_of(trouble))
        raise trouble


def _orders(options: BridgeOptions) -> Orders:
    return Orders(
        identity=(options.source_system, options.source_component) if options.source_system else None,
        own_component=options.source_component,
        system=options.system,
        any_vehicle=options.any_vehicle,
        request=replace(
            request_from_options(
                None, options.target, options.clearance, options.corner_allowance, options.snap, "optimal"
            ),
            trusts_model=options.trust_model,
            accepts_less=options.accept_less,
            escape=options.escape,
        ),
        upload=options.upload,
        drive=options.drive,
        arm=options.arm,
        confirm=options.confirm,
        once=options.once,
        announce=True,
        target_sources=target_sources(options.target_from),
        obstacle_sources=_obstacle_sources(options.obstacles_from),
        obstacle_growth_mps=options.obstacle_growth,
        obstacle_keep_s=options.obstacle_keep,
        patience_s=options.timeout,
        homing=_homing(options),
    )


def target_sources(given: list[str]) -> frozenset[TargetSource]:
    """Return where targets may come from.

    Raises
    ------
    UsageError
        One is not known.
    """
    choices = [source for source in TargetSource if source is not TargetSource.HOME]
    if unknown := set(given) - set(choices):
        raise UsageError(f"--target-from {min(unknown)!r}: expected one of {', '.join(choices)}")
    return frozenset(map(TargetSource, given)) or DEFAULT_SOURCES


def _homing(options: BridgeOptions) -> Homing:
    """Return what is known of ways home, and when one is driven.

    Raises
    ------
    UsageError
        An option without those that it rests on.
    """
    if options.rtl_by_route and not options.drive:
        raise UsageError("--rtl-by-route needs --upload --drive: it switches the vehicle to HOLD and AUTO")
    if options.rtl_by_route and options.once:
        raise UsageError(
            "--rtl-by-route does not go with --once: a bridge that has ended cannot bring the vehicle home"
        )
    for name, value in (
        ("--battery-percent", options.battery_percent),
        ("--battery-volts", options.battery_volts),
        ("--gcs-timeout", options.gcs_timeout),
    ):
        if value is not None and not options.rtl_by_route:
            raise UsageError(f"{name} needs --rtl-by-route: it says when the vehicle is brought home")
    return Homing(
        is_kept=not options.once,
        places=given_places(options.place),
        by_route=options.rtl_by_route,
        battery_percent=options.battery_percent,
        battery_volts=options.battery_volts,
        gcs_timeout_s=options.gcs_timeout,
    )


def _obstacle_sources(texts: list[str]) -> frozenset[ObstacleSource]:
    names = [name for text in texts for name in text.split(",")]
    if unknown := set(names) - set(ObstacleSource):
        raise UsageError(f"--obstacles-from {min(unknown)}: expected one of {', '.join(ObstacleSource)}")
    return frozenset(map(ObstacleSource, names))


class Beside(Protocol):
    """A machine that may run beside the director on its link: it has the names of one, without an end."""

    @property
    def deadline_s(self) -> float | None:
        """When it wants its timer."""
        ...

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame."""
        ...

    def handle_timer(self, now_s: float) -> None:
        """Take notice that time has passed."""
        ...

    def messages_to_send(self) -> list[Message]:
        """Return and forget what is to be sent, after what the director sends."""
        ...


class Pages(Protocol):
    """Pages that show the bridge, and ask things of it."""

    def hear(self, frames: list[Frame], now_s: float) -> None:
        """Take what was heard."""
        ...

    def step(self, now_s: float) -> None:
        """Do what was asked for; before anything is sent."""
        ...

    def show(self, now_s: float) -> None:
        """Be brought up to date; after everything is sent."""
        ...

    def tell(self, event: Event) -> None:
        """Take an event."""
        ...

    def link_opened(self) -> None:
        """Take notice that the link is open."""
        ...

    def link_closed(self, why: str) -> None:
        """Take notice that it is closed, and why."""
        ...


@dataclass(eq=False)
class _Journaled:
    """The director as a machine, with every call that is no frame written down."""

    director: Director
    writer: RunLog | None
    beside: Beside | None = None
    frames: int = 0

    def call(self, name: str, now_s: float, target: object = None, text: str = "") -> None:
        if self.writer is not None:
            place = target if isinstance(target, LatLon) else None
            self.writer.call(Call(self.frames, now_s, name, place, text))

    @property
    def is_done(self) -> bool:
        return self.director.is_done

    @property
    def deadline_s(self) -> float | None:
        times = [self.director.deadline_s, self.beside.deadline_s if self.beside is not None else None]
        return min((time_s for time_s in times if time_s is not None), default=None)

    @property
    def progress(self) -> tuple[int, int]:
        return self.director.progress

    def start(self, now_s: float) -> None:
        """Do nothing: the director has begun before any link was open, and lives on over several."""

    def receive(self, frame: Frame, now_s: float) -> None:
        self.director.receive(frame, now_s)
        self.frames += 1
        if self.beside is not None:
            self.beside.receive(frame, now_s)

    def handle_timer(self, now_s: float) -> None:
        deadline_s = self.director.deadline_s
        if deadline_s is not None and deadline_s <= now_s:
            self.call("timer", now_s)
            self.director.handle_timer(now_s)
        if self.beside is not None:
            self.beside.handle_timer(now_s)

    def messages_to_send(self) -> list[Message]:
        messages = self.director.messages_to_send()
        return messages + self.beside.messages_to_send() if self.beside is not None else messages


class BridgeShell:
    """Sockets, clock, keyboard and files around one director.

    Parameters
    ----------
    director : Director
        The director.
    connection : str
        Its link.
    tell : callable
        Takes its events.
    view : LiveView or None
        Shows it in the terminal.
    log : RunLog or None
        Records it.
    backups : BackupStore, optional
        Where old missions are kept.
    """

    def __init__(
        self,
        director: Director,
        connection: str,
        tell: Callable[[Event], None],
        view: LiveView | None,
        log: RunLog | None,
        backups: BackupStore | None = None,
    ) -> None:
        self._connection = connection
        self.director = director
        self._view = view
        self._written = _Journaled(self.director, log)
        self._tell = tell
        self._log = log
        self._backups = BackupKeeper(
            self.director,
            str(parse_connection(connection)),
            backups,
            journal=lambda name, now, text: self._written.call(name, now, text=text),
        )
        self._plans = PlanMaker(self.director)
        self._ways = WaysMaker(self.director)
        self._keyboard = view.keyboard if view is not None else Keyboard()
        self._asked_for: Plan | None = None  # the plan that waits for a yes, as was printed
        self._pages: Pages | None = None

    @property
    def call(self) -> Callable[..., None]:
        """Notes a call of the director in the journal; for who makes one beside the shell."""
        return self._written.call

    def vehicle(self) -> VehicleMark | None:
        """Return which vehicle it is; None before it was found."""
        return self._backups.vehicle()

    def show_on(self, pages: Pages, beside: Beside) -> None:
        """Show the bridge on pages, too, and let them ask things of it."""
        self._pages, self._written.beside = pages, beside

    def run(self, signing: Signing | None, timeout_s: float) -> None:
        """Run until the single job is done, or for ever; a link that breaks is opened again."""
        begun_s = now_s()
        self._written.call("start", begun_s)
        self.director.start(begun_s)
        with (
            interruptible(self._at_hand(None)),
            ends_in_words(lambda: self._backups.writing, last_words=self._backups.release),
        ):
            self._keep_linked(signing, timeout_s)

    def _at_hand(self, link: Link | None) -> AtHand:
        """Return the vehicle as an interrupt finds it."""
        at_hand = director_at_hand(self.director, link)
        return replace(
            at_hand,
            aside=self._view.aside if self._view is not None else contextlib.nullcontext,
            keyboard=self._keyboard,
        )

    def _keep_linked(self, signing: Signing | None, timeout_s: float) -> None:
        sent = SentFrames()
        failures = 0
        while not self.director.is_done:
            try:
                identity = self.director.identity or ONE_SHOT_IDENTITY
                opening = Opening(
                    partial(
                        open_link,
                        self._connection,
                        identity,
                        recorder=self._log,
                        signing=signing,
                        timeout_s=timeout_s,
                        sent=sent,
                    )
                )
                if not self._is_opened(opening):
                    return
                with (
                    opening.link() as link,
                    interruptible(self._at_hand(link)),
                    ends_in_words(lambda: self._backups.writing, causes=KeyboardInterrupt),
                ):
                    failures = 0
                    if self._view is not None:
                        self._view.link_trouble = None
                    if self._pages is not None:
                        self._pages.link_opened()
                    self._run_link(link)
            except LinkError as error:
                if self.director.orders.once:
                    raise
                wait_s = _BACKOFF_S[min(failures, len(_BACKOFF_S) - 1)]
                failures += 1
                self._link_closed(f"{error}; trying again in {wait_s:g} s")
                self._idle(wait_s)

    def _is_opened(self, opening: Opening) -> bool:
        """Wait until a link is open or cannot be; return whether that came before the director's end."""
        while not opening.is_over and not self.director.is_done:
            self._idle(_OPENING_LOOK_S)
        return opening.is_over

    def _run_link(self, link: Link) -> None:
        def step() -> None:
            now = link.now_s()
            tell_echoes(link)
            if not self.director.is_done:
                self._listen_to_keyboard(now)
                self._hand_over_plan(now)
            if self._pages is not None:
                self._pages.step(now)
            self._keep_backup(now)
            if self.director.identity is not None and link.identity != self.director.identity:
                link.speak_as(self.director.identity)

        def sent() -> None:  # nothing that is printed holds up what is sent
            self._tell_all()
            self._show(link.now_s())

        def heard(frames: list[Frame]) -> None:
            if self._view is not None:
                self._view.hear(frames, link.now_s())
            if self._pages is not None:
                self._pages.hear(frames, link.now_s())

        link.run(
            self._written,
            on_frames=heard,
            on_step=step,
            on_sent=sent,
            longest_wait_s=self._longest_wait_s,
        )

    def _longest_wait_s(self) -> float:
        wait_s = self._plans.longest_wait_s()
        return wait_s if self._pages is None else min(wait_s, _PAGES_LOOK_S)

    def _show(self, now: float) -> None:
        if self._view is not None:
            self._view.show(now)
        if self._pages is not None:
            self._pages.show(now)

    def _link_closed(self, why: str) -> None:
        self._note(f"link: {why}", is_warning=True)
        if self._view is not None:
            self._view.link_trouble = why
        if self._pages is not None:
            self._pages.link_closed(why)

    def _idle(self, wait_s: float) -> None:
        """Let time pass without a link, so that the director notices."""
        until_s = now_s() + wait_s
        while now_s() < until_s and not self.director.is_done:
            self._listen_to_keyboard(now_s())
            self._written.handle_timer(now_s())
            if self._pages is not None:
                self._pages.step(now_s())
            self._tell_all()
            self._show(now_s())
            time.sleep(min(_LINK_LOOK_S, max(0.0, until_s - now_s())))

    def _keep_backup(self, now: float) -> None:
        warn(self._backups.step(now))

    def _hand_over_plan(self, now: float) -> None:
        if (made := self._plans.take()) is not None:
            self._written.call("plan_made", now)
            self.director.plan_made(*made, now)
        if (ways := self._ways.take()) is not None:
            self._written.call("ways_made", now)
            self.director.ways_made(*ways, now)

    def _listen_to_keyboard(self, now: float) -> None:
        line = self._keyboard.line()
        if not line:
            return
        typed = understood(line, self.director)
        if self._view is not None:
            self._view.answer(typed.answer, is_warning=not typed.is_taken)
        else:
            self._note(typed.answer, is_warning=not typed.is_taken)
        if typed.confirms:
            self._written.call("confirm", now)
            self.director.confirm(now)
        elif typed.target is not None:
            self._written.call("target", now, typed.target)
            self.director.take_target(typed.target, now)
        elif typed.obstacle is not None:
            position, radius_m = typed.obstacle.position, typed.obstacle.radius_m
            self._written.call("obstacle", now, position, str(radius_m))
            self.director.take_obstacle(position, radius_m, now)
        elif typed.clears:
            self._written.call("clear", now)
            self.director.clear_obstacles(now)

    def _note(self, text: str, *, is_warning: bool) -> None:
        """Print a note that is not an event, where it does not disturb: above the view, else on stderr."""
        if self._view is not None:
            self._view.note(text, is_warning=is_warning)
        elif telling().prints(Level.WARNING if is_warning else Level.INFO):
            say(text, typer.colors.YELLOW if is_warning else None)

    def _ask_for_yes(self) -> None:
        """Print once for each plan that it waits for a yes."""
        plan = self.director.plan if self.director.awaits_confirmation else None
        if plan is not None and plan is not self._asked_for:
            self._note(CONFIRM, is_warning=False)
        self._asked_for = plan

    def _tell_all(self) -> None:
        for event in self.director.take_events():
            if self._log is not None:
                self._log.event(event)
            if self._pages is not None:
                self._pages.tell(event)
            self._tell(event)
            if event.name is EventName.PLANNED:
                with self._view.aside() if self._view is not None else contextlib.nullcontext():
                    inform(event.data["info"])  # type: ignore[arg-type]
                    if self.director.orders.drive and self.director.plan is not None:
                        inform(hold_info(self.director.plan.hold))
                    warn(event.data["warnings"])  # type: ignore[arg-type]
        self._ask_for_yes()


def _view(stack: contextlib.ExitStack, director: Director, *, is_wanted: bool) -> LiveView | None:
    """Open the live view where somebody watches a terminal."""
    if not is_wanted or not sys.stdout.isatty():
        return None
    return stack.enter_context(LiveView(director))


def teller(options: CommonOptions) -> Callable[[Event], None]:
    """Return what prints events, those of the levels that are wanted: JSON lines, or lines for people."""
    put = _tell_scripts if options.json_output else _tell_people

    def tell(event: Event) -> None:
        if telling().prints(Level.of_severity(event.severity.name.lower())):
            put(event)

    return tell


def _tell_scripts(event: Event) -> None:
    print_json(event.as_json())
    sys.stdout.flush()


def _tell_people(event: Event) -> None:
    colour = {
        Severity.CRITICAL: typer.colors.RED,
        Severity.ERROR: typer.colors.RED,
        Severity.WARNING: typer.colors.YELLOW,
    }
    clock = time.strftime("%H:%M:%S", time.localtime(event.time_s))
    echo(f"{clock} {event.text}", colour.get(event.severity))


def _recorders(
    stack: contextlib.ExitStack,
    log: Path | None,
    orders: Orders,
    described: Situation,
    notes: tuple[DriveNote, ...],
) -> tuple[TlogWriter | None, JournalWriter | None]:
    if log is None:
        return None, None
    part, recorder, journal = open_recording(stack, log, orders, described, notes)
    if part != log:
        warn((f"{log} exists; recording this run to {part}",))
    return recorder, journal
