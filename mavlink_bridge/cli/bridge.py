"""``pbpp bridge``: the director on a live link, for hours."""

from __future__ import annotations

import contextlib
import sys
import time
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mavlink_bridge.cli.common import (
    AnyVehicleOption,
    ConfigOption,
    JsonOption,
    QuietOption,
    SystemOption,
    TimeoutOption,
    exit_code_of,
    print_json,
    warn,
)
from mavlink_bridge.cli.interrupting import AtHand, interruptible, terminable
from mavlink_bridge.cli.keyboard import Keyboard
from mavlink_bridge.cli.permissions import check_permissions
from mavlink_bridge.cli.plan_request import request_from_options
from mavlink_bridge.cli.terminal import echo, say
from mavlink_bridge.cli.upload import RequiredConnectOption, SigningKeyOption
from mavlink_bridge.cli.values import MOST_M, within
from mavlink_bridge.errors import LinkError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from mavlink_bridge.cli.bridge_view import LiveView
    from mavlink_bridge.cli.opening import Opening
    from mavlink_bridge.cli.run_log import RunLog
    from mavlink_bridge.director import Director, Event, Orders
    from mavlink_bridge.link import Link
    from mavlink_bridge.mavlink.messages import Frame, Message
    from mavlink_bridge.mavlink.signing import Signing
    from mavlink_bridge.replay.journal import JournalWriter
    from mavlink_bridge.tlog import TlogWriter
    from missions.planned import Plan

# Between attempts to open a link anew: doubled up to half a minute. Chosen, not measured.
_BACKOFF_S = (0.5, 1.0, 2.0, 4.0, 8.0, 15.0, 30.0)
_LINK_LOOK_S = 0.25  # how soon an interrupt is seen while waiting for that
_OPENING_LOOK_S = 0.05  # and while a link is being opened


def bridge(
    connect: RequiredConnectOption,
    target: Annotated[
        list[str] | None,
        typer.Option(metavar="LAT,LON", help="The first target; more can be typed or clicked."),
    ] = None,
    target_from: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SOURCE",
            help="typed, reposition, position-target, guided-item, mission, rally or echo; repeatable.",
        ),
    ] = None,
    clearance: Annotated[
        str | None, typer.Option(metavar="M|max", help="Promised while driving. Default: from FENCE_MARGIN.")
    ] = None,
    corner_allowance: Annotated[
        str, typer.Option(metavar="M|auto", help="Room for cut corners on top.")
    ] = "auto",
    snap: Annotated[
        float,
        typer.Option(
            metavar="M", parser=within(0.0, MOST_M, "metres"), help="Move blocked targets to free ground."
        ),
    ] = 0.0,
    vehicle: Annotated[
        Path | None, typer.Option(metavar="FILE.parm", help="Parameters that the vehicle does not report.")
    ] = None,
    upload: Annotated[bool, typer.Option("--upload", help="Write missions to the vehicle.")] = False,
    drive: Annotated[
        bool,
        typer.Option(
            "--drive",
            help="With --upload: switch modes, HOLD before a new route and after arrival, AUTO for a verified one.",
        ),
    ] = False,
    arm: Annotated[bool, typer.Option("--arm", help="With --drive: arm before AUTO.")] = False,
    confirm: Annotated[bool, typer.Option("--confirm", help="Upload a plan only after a typed yes.")] = False,
    once: Annotated[bool, typer.Option("--once", help="End after one job.")] = False,
    log: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.tlog",
            help="Record both directions, and a journal beside it; a restart goes on in run.2.tlog, run.3.tlog …",
        ),
    ] = None,
    config: ConfigOption = None,
    system: SystemOption = None,
    any_vehicle: AnyVehicleOption = False,
    source_system: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, max=255, help="Our system id. Default: the vehicle's own."),
    ] = None,
    source_component: Annotated[
        int, typer.Option(metavar="N", min=1, max=255, help="Our component id.")
    ] = 195,
    signing_key: SigningKeyOption = None,
    timeout: TimeoutOption = 30.0,
    json_output: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Run beside the autopilot: read fences, state and targets from the stream, keep a plan, upload it verified, watch the drive.

    Type targets as `LAT,LON`; `yes` confirms a plan. Without `--upload` it only reports.

    For example:

    `pbpp bridge --connect udpin:0.0.0.0:14550`

    `pbpp bridge --connect /dev/ttyAMA0,921600 --upload --drive --log run.tlog --json`
    """
    del config  # its callback has taken it
    check_permissions(upload=upload, drive=drive, arm=arm)
    from mavlink_bridge.cli.run_log import RunLog, SafeTeller  # noqa: PLC0415
    from mavlink_bridge.cli.session import signing_of  # noqa: PLC0415
    from mavlink_bridge.director import AT_WORK, Director, Orders  # noqa: PLC0415 - quick help
    from mavlink_bridge.director.orders import DEFAULT_SOURCES, TargetSource  # noqa: PLC0415
    from missions.formats import read_parameters  # noqa: PLC0415
    from missions.situation import Situation  # noqa: PLC0415

    try:
        sources = frozenset(TargetSource(name) for name in target_from) if target_from else DEFAULT_SOURCES
    except ValueError as error:
        raise UsageError(f"--target-from: {error}; known are {', '.join(TargetSource)}") from None
    orders = Orders(
        identity=(source_system, source_component) if source_system else None,
        own_component=source_component,
        system=system,
        any_vehicle=any_vehicle,
        request=request_from_options(None, target or [], clearance, corner_allowance, snap, "optimal"),
        upload=upload,
        drive=drive,
        arm=arm,
        confirm=confirm,
        once=once,
        announce=True,
        target_sources=sources,
        patience_s=timeout,
    )
    parameters = read_parameters(vehicle) if vehicle else {}
    with contextlib.ExitStack() as stack:
        recorder, journal = _recorders(stack, log, orders, parameters)
        director = Director(orders, Situation(parameters=parameters))
        view = _view(stack, director, is_wanted=not (json_output or quiet))
        tell = view.tell if view else _teller(wants_json=json_output, quiet=quiet)
        log_of_run = RunLog(recorder, journal) if recorder is not None and journal is not None else None
        tell = SafeTeller(tell, lambda: director.state not in AT_WORK)
        shell = _Shell(director, connect, tell, view, log_of_run, quiet=quiet)
        with terminable():
            shell.run(signing_of(signing_key), timeout)
    trouble = shell.director.trouble
    if trouble is not None and shell.director.is_done:
        if json_output:
            raise typer.Exit(exit_code_of(trouble))
        raise trouble


@dataclass(eq=False)
class _Journaled:
    """The director as a machine, with every call that is no frame written down."""

    director: Director
    writer: RunLog | None
    frames: int = 0

    def call(self, name: str, now_s: float, target: object = None, text: str = "") -> None:
        from mavlink_bridge.replay.journal import Call  # noqa: PLC0415 - quick help
        from missions.geo import LatLon  # noqa: PLC0415

        if self.writer is not None:
            place = target if isinstance(target, LatLon) else None
            self.writer.call(Call(self.frames, now_s, name, place, text))

    @property
    def is_done(self) -> bool:
        return self.director.is_done

    @property
    def deadline_s(self) -> float | None:
        return self.director.deadline_s

    @property
    def progress(self) -> tuple[int, int]:
        return self.director.progress

    def start(self, now_s: float) -> None:
        """Do nothing: the director has begun before any link was open, and lives on over several."""

    def receive(self, frame: Frame, now_s: float) -> None:
        self.director.receive(frame, now_s)
        self.frames += 1

    def handle_timer(self, now_s: float) -> None:
        deadline_s = self.director.deadline_s
        if deadline_s is not None and deadline_s <= now_s:
            self.call("timer", now_s)
            self.director.handle_timer(now_s)

    def messages_to_send(self) -> list[Message]:
        return self.director.messages_to_send()


class _Shell:
    """Sockets, clock, keyboard and files around one director."""

    def __init__(
        self,
        director: Director,
        connection: str,
        tell: Callable[[Event], None],
        view: LiveView | None,
        log: RunLog | None,
        *,
        quiet: bool = False,
    ) -> None:
        from mavlink_bridge.cli.link_notes import LinkNotes  # noqa: PLC0415 - quick help
        from mavlink_bridge.cli.live import BackupKeeper, PlanMaker  # noqa: PLC0415
        from mavlink_bridge.link import parse_connection  # noqa: PLC0415

        self._connection = connection
        self.director = director
        self._view = view
        self._written = _Journaled(self.director, log)
        self._tell = tell
        self._log = log
        self._notes = LinkNotes()
        self._backups = BackupKeeper(
            self.director,
            str(parse_connection(connection)),
            journal=lambda name, now, text: self._written.call(name, now, text=text),
        )
        self._plans = PlanMaker(self.director)
        self._keyboard = Keyboard()
        self._quiet = quiet
        self._asked_for: Plan | None = None  # the plan that waits for a yes, as was printed

    def run(self, signing: Signing | None, timeout_s: float) -> None:
        """Run until the single job is done, or for ever; a link that breaks is opened again."""
        from mavlink_bridge.link import now_s  # noqa: PLC0415 - quick help
        from mavlink_bridge.protocol.outcomes import ends_in_words  # noqa: PLC0415

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
        from mavlink_bridge.cli.live import director_at_hand  # noqa: PLC0415 - quick help

        at_hand = director_at_hand(self.director, link)
        return replace(
            at_hand,
            aside=self._view.aside if self._view is not None else contextlib.nullcontext,
            keyboard=self._keyboard,
        )

    def _keep_linked(self, signing: Signing | None, timeout_s: float) -> None:
        from mavlink_bridge.cli.opening import Opening  # noqa: PLC0415 - quick help
        from mavlink_bridge.link import ONE_SHOT_IDENTITY, open_link  # noqa: PLC0415
        from mavlink_bridge.mavlink.echoes import SentFrames  # noqa: PLC0415
        from mavlink_bridge.protocol.outcomes import ends_in_words  # noqa: PLC0415

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
            self._notes.tell(link)
            if not self.director.is_done:
                self._listen_to_keyboard(now)
                self._hand_over_plan(now)
            self._keep_backup(now)
            if self.director.identity is not None and link.identity != self.director.identity:
                link.speak_as(self.director.identity)

        def sent() -> None:  # nothing that is printed holds up what is sent
            self._tell_all()
            if self._view is not None:
                self._view.show(link.now_s())

        link.run(self._written, on_step=step, on_sent=sent, longest_wait_s=self._plans.longest_wait_s)

    def _link_closed(self, why: str) -> None:
        self._note(f"link: {why}", is_warning=True)
        if self._view is not None:
            self._view.link_trouble = why

    def _idle(self, wait_s: float) -> None:
        """Let time pass without a link, so that the director notices."""
        from mavlink_bridge.link import now_s  # noqa: PLC0415 - quick help

        until_s = now_s() + wait_s
        while now_s() < until_s and not self.director.is_done:
            self._listen_to_keyboard(now_s())
            self._written.handle_timer(now_s())
            self._tell_all()
            if self._view is not None:
                self._view.show(now_s())
            time.sleep(min(_LINK_LOOK_S, max(0.0, until_s - now_s())))

    def _keep_backup(self, now: float) -> None:
        warn(self._backups.step(now))

    def _hand_over_plan(self, now: float) -> None:
        if (made := self._plans.take()) is not None:
            self._written.call("plan_made", now)
            self.director.plan_made(*made, now)

    def _listen_to_keyboard(self, now: float) -> None:
        from mavlink_bridge.cli.typed import understood  # noqa: PLC0415 - quick help

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

    def _note(self, text: str, *, is_warning: bool) -> None:
        """Print a note that is not an event, where it does not disturb: above the view, else on stderr."""
        if self._view is not None:
            self._view.note(text, is_warning=is_warning)
        elif is_warning or not self._quiet:
            say(text, typer.colors.YELLOW if is_warning else None)

    def _ask_for_yes(self) -> None:
        """Print once for each plan that it waits for a yes."""
        from mavlink_bridge.cli.typed import CONFIRM  # noqa: PLC0415 - quick help

        plan = self.director.plan if self.director.awaits_confirmation else None
        if plan is not None and plan is not self._asked_for:
            self._note(CONFIRM, is_warning=False)
        self._asked_for = plan

    def _tell_all(self) -> None:
        for event in self.director.take_events():
            if self._log is not None:
                self._log.event(event)
            self._tell(event)
        self._ask_for_yes()


def _view(stack: contextlib.ExitStack, director: Director, *, is_wanted: bool) -> LiveView | None:
    """Open the live view where somebody watches a terminal."""
    if not is_wanted or not sys.stdout.isatty():
        return None
    from mavlink_bridge.cli.bridge_view import LiveView  # noqa: PLC0415 - only in a terminal

    return stack.enter_context(LiveView(director))


def _teller(*, wants_json: bool, quiet: bool) -> Callable[[Event], None]:
    """Return what prints events: JSON lines, or lines for people."""
    if wants_json:
        return lambda event: _flushed_json(event.as_json())
    if quiet:
        return lambda _event: None
    return _tell_people


def _flushed_json(document: Mapping[str, object]) -> None:
    print_json(document)
    sys.stdout.flush()


def _tell_people(event: Event) -> None:
    from mavlink_bridge.director import Severity  # noqa: PLC0415 - quick help

    colour = {
        Severity.CRITICAL: typer.colors.RED,
        Severity.ERROR: typer.colors.RED,
        Severity.WARNING: typer.colors.YELLOW,
    }
    clock = time.strftime("%H:%M:%S", time.localtime(event.time_s))
    echo(f"{clock} {event.text}", colour.get(event.severity))


def _recorders(
    stack: contextlib.ExitStack, log: Path | None, orders: Orders, parameters: Mapping[str, float]
) -> tuple[TlogWriter | None, JournalWriter | None]:
    if log is None:
        return None, None
    from mavlink_bridge.cli.recording import open_recording  # noqa: PLC0415 - quick help

    part, recorder, journal = open_recording(stack, log, orders, parameters)
    if part != log:
        warn((f"{log} exists already; this run is recorded to {part}",))
    return recorder, journal
