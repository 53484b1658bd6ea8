"""One vehicle on one open link, for the commands that transfer something."""

from __future__ import annotations

import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from mavlink_bridge.backup.vehicle_mark import VehicleMark, uid_of
from mavlink_bridge.cli.common import warn
from mavlink_bridge.cli.interrupting import AtHand
from mavlink_bridge.cli.link_notes import tell_echoes
from mavlink_bridge.errors import LinkError, OutcomeError, RefusedError
from mavlink_bridge.link import open_link, parse_connection
from mavlink_bridge.mavlink.autopilots import autopilot_table
from mavlink_bridge.mavlink.messages import Autopilot
from mavlink_bridge.mavlink.signing import Signing, SigningKey
from mavlink_bridge.mavlink.vehicles import not_known
from mavlink_bridge.protocol.ask_version import AskVersion
from mavlink_bridge.protocol.find import FindVehicle, identity_shared, identity_taken
from mavlink_bridge.protocol.mode_switch import ModeSwitch
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.telemetry import stream_requests
from mavlink_bridge.protocol.vehicle_watch import VehicleWatch
from missions.firmware import firmware_from_number
from missions.situation import Situation

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager
    from pathlib import Path

    from mavlink_bridge.link import Link
    from mavlink_bridge.mavlink.autopilots import AutopilotTable
    from mavlink_bridge.mavlink.messages import Frame
    from mavlink_bridge.protocol.machine import Machine
    from mavlink_bridge.protocol.vehicle_watch import Doing

_MODE_PATIENCE_S = 5.0
_HEARTBEAT_PATIENCE_S = 5.0
"""A heartbeat comes every second; over a bad link some are lost."""


@dataclass(frozen=True, slots=True)
class Contact:
    """Where the vehicle is and as whom we speak.

    Parameters
    ----------
    connection : str
        The connection string.
    identity : tuple of int
        Our system and component id.
    system : int, optional
        The vehicle's system id.
    any_vehicle : bool
        Take vehicles that are neither rover nor boat.
    timeout_s : float
        How long to wait for the vehicle.
    key_file : Path, optional
        The signing key.
    """

    connection: str
    identity: tuple[int, int]
    system: int | None = None
    any_vehicle: bool = False
    timeout_s: float = 30.0
    key_file: Path | None = None


class Session:
    """A vehicle on a link: runs machines and knows the newest heartbeat.

    Parameters
    ----------
    link : Link
        The open link.
    contact : Contact
        Which vehicle.
    show : callable
        Moves the progress bar: text, steps done, steps in all.

    Attributes
    ----------
    link : Link
        The open link.
    watch : VehicleWatch
        What the vehicle reported about itself.
    drives_by_us : bool
        Whether it drives because of us, or is about to.
    listeners : list of callable
        Told of every batch of frames, but for those of somebody else who has our ids.

    Raises
    ------
    LinkError
        The vehicle is not there, or its autopilot is not known here.
    IdentityTakenError
        Somebody else on the link speaks with our ids.
    """

    def __init__(self, link: Link, contact: Contact, show: Callable[[str, int, int], None]) -> None:
        self.link = link
        self._connection = contact.connection
        self._show = show
        self._machine: Machine | None = None
        self._has_written = self._is_refused = self._has_clashed = False
        finder = FindVehicle(
            contact.system,
            any_vehicle=contact.any_vehicle,
            patience_s=contact.timeout_s,
            identity=link.identity,
        )
        self.watch = VehicleWatch()
        self.drives_by_us = False
        self._has_changed_mode = False
        self.peer: Peer | None = None
        self.listeners: list[Callable[[list[Frame]], None]] = []
        self.run(finder, "listening for the vehicle")
        if finder.vehicle is None:
            assert finder.trouble is not None
            raise self._with_signing_hint(finder.trouble)
        self.peer = Peer(finder.vehicle.system, finder.vehicle.component, *link.identity)
        assert finder.heartbeat is not None
        self.watch.receive(finder.heartbeat, link.now_s())
        table = autopilot_table(finder.heartbeat.autopilot)
        if table is None:
            raise not_known(finder.vehicle.system, finder.heartbeat.autopilot)
        self.peer = replace(self.peer, autopilot=table)
        self.heard = Situation(
            system=finder.vehicle.system,
            component=finder.vehicle.component,
            ardupilot=finder.heartbeat.autopilot == Autopilot.ARDUPILOTMEGA,
            vehicle_type=finder.vehicle.type,
        )

    @property
    def vehicle(self) -> Peer:
        """The vehicle that was found."""
        assert self.peer is not None
        return self.peer

    @property
    def autopilot(self) -> AutopilotTable:
        """How its autopilot speaks."""
        return self.vehicle.autopilot

    @property
    def is_active(self) -> bool | None:
        """Whether it drives its mission in AUTO; None if its last heartbeat is too old."""
        return self.watch.is_active(self.link.now_s())

    @property
    def doing(self) -> Doing:
        """What it does, as last reported."""
        return self.watch.doing(self.link.now_s())

    def at_hand(self, aside: Callable[[], AbstractContextManager[Any]], on_it: Callable[[], str]) -> AtHand:
        """Return the vehicle as an interrupt finds it."""
        return AtHand(
            link=self.link,
            peer=lambda: self.peer,
            watch=lambda: self.watch,
            drives=lambda: self.drives_by_us,
            on_it=on_it,
            changed=lambda: self._has_changed_mode or bool(on_it()),
            aside=aside,
        )

    def hear_anew(self) -> bool:
        """Return whether its next heartbeat came; waits for it."""
        begun_s = self.link.now_s()
        return self.listen_until(lambda: self.watch.heartbeat_s > begun_s, _HEARTBEAT_PATIENCE_S)

    def which_vehicle(self) -> VehicleMark:
        """Ask the vehicle which one it is, and of which version; return by what it is known again."""
        asking = AskVersion(self.vehicle)
        self.run(asking, "identifying the vehicle")
        version = asking.version
        firmware = firmware_from_number(version.flight_sw_version) if version is not None else None
        self.heard = replace(self.heard, firmware=firmware)
        table = autopilot_table(self.autopilot.autopilot, firmware)
        assert table is not None
        self.peer = replace(self.vehicle, autopilot=table)
        if remark := table.remark(firmware):
            warn([remark])
        return VehicleMark(
            self.vehicle.system,
            uid_of(version),
            str(parse_connection(self._connection)),
            int(table.autopilot),
        )

    def run(self, machine: Machine, text: str, on_step: Callable[[], None] | None = None) -> None:
        """Run a machine to its outcome, with progress.

        Raises
        ------
        IdentityTakenError
            Somebody else on the link speaks with our ids, and nothing was written yet of what is going to be.
        """

        def step() -> None:
            self._show(text, *machine.progress)
            tell_echoes(self.link)
            if on_step:
                on_step()

        self._machine = machine
        self.link.run(machine, on_frames=self._listen, on_step=step, until=lambda: self._is_refused)
        if self._is_refused:
            raise identity_taken(self.link.identity)
        self._has_written = self._has_written or getattr(machine, "has_written", False)

    def change_mode(self, mode: int) -> None:
        """Switch the vehicle's mode and wait until its heartbeat reports it.

        Raises
        ------
        RefusedError
            The vehicle refused.
        OutcomeError
            It accepted but does not show the mode, or did not answer; or it is to drive, and somebody else has our ids.
        """
        modes = self.autopilot.modes
        name = modes.named(mode)
        if mode == modes.mission and self._has_clashed:
            raise identity_shared(
                self.link.identity, f"the vehicle was not switched to {name}; the upload is on it"
            )
        switch = ModeSwitch(self.vehicle, mode)
        self._has_changed_mode = True
        self.run(switch, f"switching to {name}")
        if switch.is_refused:
            result, texts = switch.result_name, "".join(f"; {text}" for text in switch.texts)
            raise RefusedError(f"the vehicle refused mode {name}: {result}{texts}", result=result)
        if not self.listen_until(lambda: self._is_in(mode), _MODE_PATIENCE_S):
            raise OutcomeError(f"the vehicle did not confirm mode {name}", mode=name)

    def ask_telemetry(self) -> None:
        """Ask for the position, its quality and the mission's state, which not every link gets unasked."""
        self.link.send_all(stream_requests(self.vehicle))

    def listen_until(self, is_enough: Callable[[], bool], for_s: float) -> bool:
        """Listen until a condition holds, no longer than a time; return whether it does."""
        self.link.listen(for_s, on_frames=self._listen, until=is_enough)
        return is_enough()

    def _is_in(self, mode: int) -> bool:
        return self.doing.mode == mode

    def _listen(self, frames: list[Frame]) -> None:
        others = [frame for frame in frames if not self.link.is_ours(frame)]
        if len(others) < len(frames) and self.peer is not None:
            self._take_clash()
        for listener in self.listeners:
            listener(others)
        for frame in others:
            if self.peer is not None and (frame.system, frame.component) == (
                self.peer.system,
                self.peer.component,
            ):
                self.watch.receive(frame.message, self.link.now_s())

    def _take_clash(self) -> None:
        """End before anything is written; later go on, for what is under way is checked against what the vehicle holds, and report it."""
        self._has_clashed = True
        is_going_to_write = not getattr(self._machine, "has_written", True)
        self._is_refused = is_going_to_write and not self._has_written
        if not self._is_refused:
            system, component = self.link.identity
            text = (
                f"another program on the link uses our ids (system {system} component {component}): the vehicle's answers may be meant "
                "for it; if it is another pbpp command, give one of them another --source-component"
            )
            warn([text])

    def _with_signing_hint(self, trouble: LinkError) -> LinkError:
        if not self.link.untrusted_frames:
            return trouble
        return type(trouble)(
            f"{trouble}; {self.link.untrusted_frames} frames were ignored: not signed with this key",
            **trouble.details,
            untrusted_frames=self.link.untrusted_frames,
        )


def signing_of(key_file: Path | None) -> Signing | None:
    """Return the signing that a key file asks for.

    Raises
    ------
    UsageError
        The key cannot be used.
    """
    if key_file is None:
        return None
    return Signing(SigningKey.read(key_file), time.time)


@contextmanager
def open_session(contact: Contact, show: Callable[[str, int, int], None]) -> Iterator[Session]:
    """Open the link, find the vehicle, and close the link at the end.

    Raises
    ------
    LinkError
        No link, or no vehicle.
    UsageError
        The signing key cannot be used.
    """
    with open_link(
        contact.connection,
        contact.identity,
        signing=signing_of(contact.key_file),
        timeout_s=contact.timeout_s,
    ) as link:
        session = Session(link, contact, show)
        try:
            yield session
        except KeyboardInterrupt:
            with suppress(LinkError):
                link.send_all(link.transfer.ending(session.vehicle))
            raise
