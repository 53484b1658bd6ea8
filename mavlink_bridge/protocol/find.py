"""Finding the vehicle that is meant among those heard on a link."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_bridge.errors import IdentityTakenError, LinkError, OutcomeError, VehicleNotFoundError
from mavlink_bridge.mavlink.messages import Heartbeat
from mavlink_bridge.mavlink.vehicles import HeardVehicle, choose_vehicle, is_vehicle
from mavlink_bridge.protocol.table_machine import TableMachine
from mavlink_bridge.protocol.transitions import FIND, FindEvent, FindState

if TYPE_CHECKING:
    from mavlink_bridge.mavlink.messages import Frame

LISTEN_S = 1.2
"""How long further vehicles are listened for: a heartbeat comes every second."""

_STILL_THERE_S = 5.0
"""Whoever was silent so long is gone: five missed heartbeats."""

_SILENT_ADVICE = "is the vehicle on, and does its telemetry reach this link?"
_FORWARD_ADVICE = "MAVLink is received, but from no autopilot: let the ground station or router forward the vehicle's messages to this port too"


class FindVehicle(TableMachine[FindState, FindEvent]):
    """Listens for heartbeats; when `is_done`, `trouble` is set, or `vehicle`, its newest `heartbeat` and when it came, `heard_s`.

    Parameters
    ----------
    system : int, optional
        The system id meant; without it there must be only one vehicle.
    any_vehicle : bool
        Take vehicles that are neither rover nor boat.
    patience_s : float
        How long to wait for the first heartbeat.
    identity : tuple of int, optional
        The ids that we speak as: whoever else has them is trouble.
    own_component : int, optional
        Where the ids follow from the vehicle's: our component id, beside its system id.
    """

    def __init__(
        self,
        system: int | None = None,
        *,
        any_vehicle: bool = False,
        patience_s: float = 30.0,
        identity: tuple[int, int] | None = None,
        own_component: int | None = None,
    ) -> None:
        super().__init__(FIND, FindState.IDLE)
        self._system = system
        self._any_vehicle = any_vehicle
        self._patience_s = patience_s
        self._identity = identity
        self._own_component = own_component
        self._until_s = 0.0
        self._heard: dict[tuple[int, int], tuple[HeardVehicle, Heartbeat, float]] = {}
        self._senders: dict[tuple[int, int], float] = {}  # and when each was heard last
        self.vehicle: HeardVehicle | None = None
        self.heartbeat: Heartbeat | None = None
        self.heard_s = 0.0
        self.trouble: LinkError | None = None

    @property
    def outcome(self) -> HeardVehicle | LinkError | None:
        """The vehicle, or why there is none; None while it runs."""
        return self.vehicle or self.trouble

    @property
    def bound_s(self) -> float:
        """Longest time from the start to the end."""
        return self._patience_s + LISTEN_S

    @property
    def deadline_s(self) -> float | None:
        """When `handle_timer` wants to be called."""
        return None if self.is_done or self.state is FindState.IDLE else self._until_s

    def start(self, now_s: float) -> None:
        """Begin to listen."""
        if self._move(FindEvent.START):
            self._until_s = now_s + self._patience_s

    def receive(self, frame: Frame, now_s: float) -> None:
        """Take a frame; only autopilots' heartbeats count, and any with our own ids."""
        heartbeat = frame.message
        self._senders[frame.system, frame.component] = now_s
        if (frame.system, frame.component) == self._identity:
            self._refuse_identity(self._identity)
        if not isinstance(heartbeat, Heartbeat) or not is_vehicle(heartbeat) or self.is_done:
            return
        was_listening = self.state is FindState.LISTENING
        self._heard[frame.system, frame.component] = (
            HeardVehicle(frame.system, frame.component, heartbeat.type),
            heartbeat,
            now_s,
        )
        if frame.system == self._system:
            self._choose(FindEvent.NAMED_ONE_HEARD, now_s)
        elif self._move(FindEvent.HEARD) and was_listening and self._system is None:
            self._until_s = now_s + LISTEN_S

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        if not self.is_done and self.state is not FindState.IDLE and now_s >= self._until_s:
            self._choose(FindEvent.TIME_IS_UP, now_s)

    def _choose(self, event: FindEvent, now_s: float) -> None:
        heard = sorted(vehicle for vehicle, _, _ in self._heard.values())
        try:
            chosen = choose_vehicle(heard, self._system, any_vehicle=self._any_vehicle)
        except VehicleNotFoundError as error:
            self.trouble = error if heard else self._unheard()
            self._move(FindEvent.CHOICE_FAILED)
            return
        if self._own_component is not None:
            identity = self._identity or (chosen.system, self._own_component)
            if now_s - self._senders.get(identity, -math.inf) <= _STILL_THERE_S:
                self._refuse_identity(identity)
                return
        self.vehicle, self.heartbeat, self.heard_s = self._heard[chosen.system, chosen.component]
        self._move(event)

    def _refuse_identity(self, identity: tuple[int, int]) -> None:
        if self._move(FindEvent.IDENTITY_TAKEN):
            self.trouble = identity_taken(identity)

    def _unheard(self) -> VehicleNotFoundError:
        """Return the error for a vehicle not heard; it notes whether anybody else was heard, which is another trouble than a dead line."""
        within = f"no vehicle's HEARTBEAT was heard within {self._patience_s:g} s"
        if not self._senders:
            return VehicleNotFoundError(f"{within}, nor any other message", heard=[], advice=_SILENT_ADVICE)
        names = ", ".join(
            f"system {system} component {component}" for system, component in sorted(self._senders)
        )
        return VehicleNotFoundError(f"{within}, heard only {names}", advice=_FORWARD_ADVICE)


def identity_taken(identity: tuple[int, int]) -> IdentityTakenError:
    """Return the error that somebody else on the link speaks with our ids."""
    return IdentityTakenError(
        f"another program on the link already uses system {identity[0]} component {identity[1]}, perhaps another pbpp command; "
        "choose other ids with --source-component (or --source-system)"
    )


def identity_shared(identity: tuple[int, int], then: str) -> OutcomeError:
    """Return the error that what was begun is not gone on with, because somebody else speaks with our ids by now."""
    return OutcomeError(
        f"another program on the link uses our ids (system {identity[0]} component {identity[1]}): {then}",
        system=identity[0],
        component=identity[1],
        advice="if it is another pbpp command, give one of them another --source-component; else find the program, or sign the link",
    )
