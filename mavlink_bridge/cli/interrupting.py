"""What an interrupt leads to: what the vehicle does is reported, and while it drives because of us a person is asked whether to stop it.

On a terminal the first Ctrl-C asks "HOLD? [Y/n]"; at a second one nothing more is sent. Without a terminal, and on SIGTERM, nothing is sent at
all: whoever ends a service does not ask for a vehicle to be stopped. The command ends with 130 whatever the answer.
"""

from __future__ import annotations

import contextlib
import signal
import sys
from dataclasses import dataclass
from enum import StrEnum, auto
from functools import partial
from typing import TYPE_CHECKING, Any

from mavlink_bridge.cli.keyboard import Keyboard
from mavlink_bridge.cli.terminal import say
from mavlink_bridge.cli.terminating import Terminated
from mavlink_bridge.errors import LinkError
from mavlink_bridge.link import now_s
from mavlink_bridge.protocol.mode_switch import ModeSwitch

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from contextlib import AbstractContextManager

    from mavlink_bridge.link import Link
    from mavlink_bridge.protocol.peer import Peer
    from mavlink_bridge.protocol.vehicle_watch import Doing, VehicleWatch

_LOOK_S = 0.1  # listened to at a time; chosen, not measured
_LISTEN_S = 1.5
"""Without a question: for so long the vehicle is listened to, so that what is reported of it is true now. A heartbeat comes every second."""

_OLD_S = 2.0  # two heartbeats: older telemetry is shown with its age


class Interrupted(KeyboardInterrupt):
    """An interrupt with its message; ``details`` is for scripts."""

    def __init__(self, message: str, details: Mapping[str, object]) -> None:
        super().__init__(message)
        self.details = details


class Reaction(StrEnum):
    """What is done next after an interrupt."""

    ASK = auto()
    HOLD = auto()
    REPORT = auto()


def first_reaction(*, drives: bool, can_ask: bool, is_terminated: bool) -> Reaction:
    """Return what an interrupt leads to.

    Parameters
    ----------
    drives : bool
        Whether the vehicle drives because of us.
    can_ask : bool
        Whether a person sits at a terminal.
    is_terminated : bool
        Whether it was a SIGTERM.
    """
    return Reaction.ASK if drives and can_ask and not is_terminated else Reaction.REPORT


def reaction_to(answer: str | None) -> Reaction:
    """Return what an answer to "HOLD? [Y/n]" leads to; None is no answer: a second interrupt, or the end of the input."""
    if answer is None:
        return Reaction.REPORT
    word = answer.strip().lower()
    if word in ("", "y", "yes", "hold"):
        return Reaction.HOLD
    return Reaction.REPORT if word in ("n", "no") else Reaction.ASK


@dataclass(frozen=True, slots=True)
class InterruptReport:
    """What is known at the end of an interrupted command.

    Parameters
    ----------
    said : str
        The message of the part that was interrupted; empty without one.
    doing : Doing
        What the vehicle does.
    on_it : str
        What is on it; empty if ``said`` says it, or nothing was written.
    drives : bool
        Whether it drove because of us.
    is_held : bool, optional
        Whether a HOLD of ours was confirmed; None if none was sent.
    is_link_lost : bool
        Whether the link is gone, so that nothing could be sent or heard.
    changed : bool
        Whether the command had changed anything on the vehicle.
    """

    said: str
    doing: Doing
    on_it: str
    drives: bool = False
    is_held: bool | None = None
    is_link_lost: bool = False
    changed: bool = False

    def message(self) -> str:
        """Return the message for people."""
        on_it = self.on_it or ("" if self.said else "nothing was written to it")
        return "; ".join(filter(None, (self.said or "interrupted", self._deed(), on_it)))

    def details(self) -> dict[str, object]:
        """Return the details for scripts."""
        doing = self.doing
        return {
            "mode": None if doing.mode is None else doing.modes.named(doing.mode),
            "armed": doing.is_armed,
            "speed_mps": None if doing.speed_mps is None else round(doing.speed_mps, 2),
            "age_s": round(doing.age_s, 1),
            "drives": self.drives and not self.is_held,
            "hold": {None: "not sent", True: "confirmed", False: "not confirmed"}[self.is_held],
        }

    def _deed(self) -> str:
        now = doing_text(self.doing)
        if self.is_link_lost:
            now += ", when it was last heard (the link is lost)"
        if self.is_held:
            return f"the vehicle was switched to HOLD, confirmed by its heartbeat: {now}"
        if self.is_held is False:
            return f"HOLD was sent, but no heartbeat confirms it: {now}"
        if self.drives:
            return f"nothing was sent; the vehicle continues the mission that pbpp started: {now}"
        if self.said or self.changed:
            return f"the vehicle now: {now}"
        return f"the vehicle was left as it was: {now}"


def doing_text(doing: Doing) -> str:
    """Return what a vehicle does, for people: mode, armed or not, speed, and how old that is where it is old."""
    if doing.mode is None:
        return "its mode is unknown, no heartbeat was received"
    armed = "armed" if doing.is_armed else "not armed"
    speed = "speed unknown" if doing.speed_mps is None else f"{doing.speed_mps:.1f} m/s"
    age_s = max(doing.age_s, 0.0 if doing.speed_mps is None else doing.speed_age_s)
    old = f" ({age_s:.0f} s ago)" if age_s > _OLD_S else ""
    complete = ", mission complete" if doing.has_completed and doing.mode == doing.modes.mission else ""
    return f"{doing.modes.named(doing.mode)}, {armed}, {speed}{complete}{old}"


@dataclass(frozen=True, eq=False)
class AtHand:
    """A vehicle at hand while a command runs, for the moment of an interrupt.

    Parameters
    ----------
    link : Link, optional
        The open link; None while there is none.
    peer : callable
        Returns the vehicle, None before it was found.
    watch : callable
        Returns what it reported about itself.
    drives : callable
        Returns whether it drives because of us.
    on_it : callable
        Returns what is on it, for people; empty where nothing was written, or the part that was interrupted says so itself.
    changed : callable
        Returns whether anything on it was changed by the command.
    aside : callable
        Clears the terminal of what moves on it, for as long as the context lasts.
    keyboard : Keyboard, optional
        What is typed; the standard input if not given.
    """

    link: Link | None
    peer: Callable[[], Peer | None]
    watch: Callable[[], VehicleWatch]
    drives: Callable[[], bool]
    on_it: Callable[[], str]
    changed: Callable[[], bool] = lambda: False
    aside: Callable[[], AbstractContextManager[Any]] = contextlib.nullcontext
    keyboard: Keyboard | None = None


@contextlib.contextmanager
def interruptible(at_hand: AtHand) -> Iterator[None]:
    """End an interrupt with what the vehicle does and what is on it, after asking about HOLD where that is to be asked.

    Raises
    ------
    Interrupted
        In the place of a KeyboardInterrupt.
    """
    try:
        yield
    except Interrupted:
        raise
    except KeyboardInterrupt as interrupt:
        with at_hand.aside():
            raise _settled(at_hand, interrupt) from None


def _settled(at_hand: AtHand, interrupt: KeyboardInterrupt) -> Interrupted:
    """Do what an interrupt leads to; a second one ends it at once."""
    drives = at_hand.drives()
    can_ask = at_hand.link is not None and sys.stdin.isatty() and sys.stderr.isatty()
    reaction = first_reaction(drives=drives, can_ask=can_ask, is_terminated=isinstance(interrupt, Terminated))
    was_asked, is_held = reaction is Reaction.ASK, None
    is_link_lost = at_hand.link is None
    try:
        _end_transfer(at_hand)
        if was_asked:
            reaction = _ask(at_hand)
        if reaction is Reaction.HOLD:
            is_held = False
            is_held = _hold(at_hand)
        elif at_hand.link is not None and at_hand.peer() is not None:
            _listen(at_hand)
    except KeyboardInterrupt:
        pass  # the second: nothing more is sent
    except LinkError:
        is_link_lost = True
    _heed_no_more()
    at_s = at_hand.link.now_s() if at_hand.link is not None else now_s()
    ending = InterruptReport(
        said=str(interrupt),
        doing=at_hand.watch().doing(at_s),
        on_it=at_hand.on_it(),
        drives=drives,
        is_held=is_held,
        is_link_lost=is_link_lost,
        changed=at_hand.changed(),
    )
    return Interrupted(ending.message(), ending.details())


def _end_transfer(at_hand: AtHand) -> None:
    """End a transfer that was interrupted, on a vehicle that heeds that: its old list stays, and it is free for others at once."""
    link, peer = at_hand.link, at_hand.peer()
    if link is not None and peer is not None:
        link.send_all(link.transfer.ending(peer))


def _ask(at_hand: AtHand) -> Reaction:
    """Ask whether to stop the vehicle, and listen to it meanwhile."""
    keyboard = at_hand.keyboard or Keyboard()
    keyboard.forget()
    reaction = Reaction.ASK
    say("")  # behind the terminal's ^C
    say(f"the vehicle is driving: {_doing_text_now(at_hand)}")
    while reaction is Reaction.ASK:
        say("HOLD? [Y/n] ", nl=False)
        while (answer := keyboard.line()) is None and not keyboard.is_closed:
            _hear(at_hand, _LOOK_S)
        reaction = reaction_to(answer)
    return reaction


def _doing_text_now(at_hand: AtHand) -> str:
    assert at_hand.link is not None
    return doing_text(at_hand.watch().doing(at_hand.link.now_s()))


def _hold(at_hand: AtHand) -> bool:
    """Switch the vehicle to HOLD, and return whether its heartbeat has confirmed it."""
    link, peer = at_hand.link, at_hand.peer()
    assert link is not None
    assert peer is not None
    switch = ModeSwitch(peer, peer.autopilot.modes.hold, is_urgent=True, until_seen=True)
    link.run(switch, on_frames=partial(_take, at_hand))
    return switch.is_granted


def _listen(at_hand: AtHand) -> None:
    """Listen for a heartbeat, so that what is reported of the vehicle is true now."""
    assert at_hand.link is not None
    begun_s = at_hand.link.now_s()
    _hear(at_hand, _LISTEN_S, until=lambda: at_hand.watch().heartbeat_s >= begun_s)


def _hear(at_hand: AtHand, for_s: float, until: Callable[[], bool] = lambda: False) -> None:
    assert at_hand.link is not None
    at_hand.link.listen(for_s, on_frames=partial(_take, at_hand), until=until)


def _take(at_hand: AtHand, frames: list[Any]) -> None:
    peer, link = at_hand.peer(), at_hand.link
    assert link is not None
    for frame in frames:
        if peer is not None and (frame.system, frame.component) == (peer.system, peer.component):
            at_hand.watch().receive(frame.message, link.now_s())


def _heed_no_more() -> None:
    """Let no further Ctrl-C spoil the last message."""
    with contextlib.suppress(ValueError):  # not the main thread: no signals come here
        signal.signal(signal.SIGINT, signal.SIG_IGN)
