"""A simulated ArduRover behind a MAVLink 2 link: sans-IO, without a clock.

Its main loop runs 50 times a second, as the real one's: what comes in is looked at in the next tick and answered in it. That is where
the measured pace of transfers comes from (20 ms an item when each answer is waited for).
"""

from __future__ import annotations

import math
import zlib
from typing import TYPE_CHECKING

from mavlink_bridge.errors import RefusedError
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.simulator.commands import CommandServer
from mavlink_bridge.simulator.config import SimulatorConfig
from mavlink_bridge.simulator.item_lists import FenceList, MissionList, RallyList, StoredList
from mavlink_bridge.simulator.mission_server import MissionServer
from mavlink_bridge.simulator.parameters import ParameterStore, kind
from mavlink_bridge.simulator.personality import turns_early
from mavlink_bridge.simulator.rover import TICK_S, Rover
from mavlink_bridge.simulator.sensor import place_at
from mavlink_bridge.simulator.streams import (
    DEFAULT_RATES_HZ,
    FENCE_STATUS,
    HEARTBEAT,
    OBSTACLE_DISTANCE,
    SENSOR_RATES_HZ,
    Streams,
)
from mavlink_bridge.simulator.telemetry import TelemetrySource, telemetry
from missions.geo import from_e7
from missions.items import with_home

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mavlink_bridge.simulator.config import MovingDisc
    from missions.geo import LatLon
    from missions.items import MissionItem

REQUESTS_A_TICK = 334
"""Download requests that one tick's input holds; of 500 sent at once the measured autopilot lost 166."""

PARAMETERS_A_TICK = 10
"""PARAM_VALUEs of a list that go out in one tick."""

BOOT_S = 3.0
"""How long a rebooted vehicle is silent."""

_POSITION_IGNORED = 3  # POSITION_TARGET_TYPEMASK_X_IGNORE and _Y_IGNORE
_GUIDED_ITEM = 2  # MISSION_ITEM.current: go there now
_HIGHER_ITEM = 3  # MISSION_ITEM.current: change the altitude, which Rover does not
_NO_INDEX = 65_535  # UINT16_MAX: PARAM_VALUE.param_index outside a list
_BOOT_TEXTS = ("ArduRover V4.7.0-dev (simulated)", "ArduPilot Ready")


class SimulatedVehicle:
    """A rover that answers MAVLink messages and drives.

    Parameters
    ----------
    config : SimulatorConfig, optional
        What it starts with. It boots at time 0.

    Raises
    ------
    RefusedError
        A list in the configuration that the vehicle would refuse.
    BridgeError
        A parameter it does not have.

    Attributes
    ----------
    rover : Rover
        The rover itself, for reading its state.
    """

    def __init__(self, config: SimulatorConfig | None = None) -> None:
        self.config = config or SimulatorConfig()
        self.parameters = ParameterStore(self.config.parameters, self.config.firmware)
        self._home: LatLon = self.config.home
        self._mission = MissionList(
            lambda: self._home,
            lambda: self.rover.is_running_mission,
            self.parameters.whole("BRD_SD_MISSION"),
        )
        self._fence, self._rally = FenceList(self.parameters.whole("BRD_SD_FENCE")), RallyList()
        self._lists: tuple[StoredList, ...] = (self._mission, self._fence, self._rally)
        if self.config.mission:
            _store(self._mission, with_home(self.config.mission, self._home))
        _store(self._fence, self.config.fence)
        _store(self._rally, self.config.rally)
        self._server = MissionServer(self._lists)
        self.rover = Rover(
            self.parameters,
            self.config.home,
            self.config.heading_deg,
            lambda: self._mission.items,
            lambda: self._fence.items,
            turns_early=turns_early(self.config.firmware),
        )
        self.rover.discs += self.config.discs
        self.rover.battery = self.config.battery
        self._home = self.rover.home
        self._outbox: list[m.Message] = []
        self._update_totals(announce=False)
        self._commands = CommandServer(
            self.rover, lambda: self._streams, self._report, self._parameter_changed, self._is_ready
        )
        self._begin(0.0)

    @property
    def deadline_s(self) -> float:
        """When `handle_timer` wants to be called; never None: a vehicle always has something to send."""
        return self._time_of(self._wake_tick())

    @property
    def mission(self) -> tuple[MissionItem, ...]:
        """The stored mission as it reads back, home first."""
        return _read(self._mission)

    @property
    def fence(self) -> tuple[MissionItem, ...]:
        """The stored fence as it reads back."""
        return _read(self._fence)

    @property
    def rally(self) -> tuple[MissionItem, ...]:
        """The stored rally points as they read back."""
        return _read(self._rally)

    @property
    def discs(self) -> list[MovingDisc]:
        """What is in the field beside fences."""
        return self.rover.discs

    @property
    def mode(self) -> Mode:
        """The mode it is in."""
        return self.rover.mode

    @property
    def is_armed(self) -> bool:
        """Whether its motors may run."""
        return self.rover.is_armed

    @property
    def position(self) -> LatLon:
        """Where it truly is."""
        return self.rover.position

    @property
    def least_clearance_m(self) -> float:
        """The least distance of its true track to any fence, enabled or not; negative on forbidden ground."""
        return self.rover.least_clearance_m

    @property
    def breaches(self) -> int:
        """How often it saw itself leave allowed ground, with the fence enabled."""
        return self.rover.breaches

    def discs_at(self, now_s: float) -> tuple[tuple[complex, float], ...]:
        """Return middle and radius of the discs that are there, in the rover's frame."""
        frame = self.rover.frame
        return tuple((place_at(one, frame, now_s), one.radius_m) for one in self.discs if now_s >= one.from_s)

    def receive(self, frame: m.Frame, now_s: float) -> None:
        """Take a frame; the next tick looks at it. A vehicle that boots receives nothing."""
        self.handle_timer(now_s)
        if now_s < self._boot_s:
            return
        own = self.config.system, self.config.component
        if (frame.system, frame.component) == own:
            return
        if frame.system == self.config.system:
            self._neighbours.add(frame.component)
        if self._is_for_me(frame.message):
            self._input.append(frame)

    def handle_timer(self, now_s: float) -> None:
        """Run all ticks up to now in which something happens."""
        while self._wake_tick() <= self._tick_at(now_s):
            self._tick = self._wake_tick()
            self._run_tick(self._time_of(self._tick))
            self._tick += 1
        self._tick = max(self._tick, self._tick_at(now_s) + 1)

    def messages_to_send(self) -> list[m.Message]:
        """Return what is to be sent, and forget it."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def reboot(self, now_s: float) -> None:
        """Start anew, as after a loss of power: transfers under way, mode, arming and unsent answers are forgotten."""
        self.rover.reboot()
        self._home = self.rover.home
        self._server.reboot()
        self._begin(now_s + BOOT_S)

    def _time_of(self, tick: int) -> float:
        return self._boot_s + tick * TICK_S

    def _tick_at(self, now_s: float) -> int:
        return math.floor((now_s - self._boot_s) / TICK_S + 1e-6)

    def _wake_tick(self) -> int:
        """Return the next tick in which something happens."""
        if self._input or self._parameter_queue or not self.rover.is_idle:
            return self._tick
        deadline_s = self._streams.deadline_s
        if self._server.deadline_s is not None:
            deadline_s = min(deadline_s, self._server.deadline_s)
        return max(self._tick, math.ceil((deadline_s - self._boot_s) / TICK_S - 1e-6))

    def _begin(self, boot_s: float) -> None:
        self._boot_s = boot_s
        self._tick = 0
        self._input: list[m.Frame] = []
        self._outbox.clear()
        self._neighbours: set[int] = set()
        self._parameter_queue: list[str] = []
        sensor_hz = SENSOR_RATES_HZ if self.config.sensor_m else {}
        self._streams = Streams({**DEFAULT_RATES_HZ, **sensor_hz} if self.config.streams else {}, boot_s)
        self._outbox += [m.Statustext(6, text) for text in _BOOT_TEXTS]
        self.rover.mode = Mode.MANUAL if self._is_ready(boot_s) else Mode.INITIALISING
        self._told_mode, self._told_breaches = self.rover.mode, self.rover.breaches

    def _is_ready(self, now_s: float) -> bool:
        return now_s - self._boot_s >= self.config.ready_after_s

    def _is_for_me(self, message: m.Message) -> bool:
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        if system == 0:
            return True
        return system == self.config.system and component not in self._neighbours

    def _run_tick(self, now_s: float) -> None:
        frames, self._input = self._input, []
        requests = 0
        for frame in frames:
            if isinstance(frame.message, m.MissionRequestInt | m.MissionRequest):
                requests += 1
                if requests > REQUESTS_A_TICK:
                    continue
            self._take(frame, now_s)
        self._server.handle_timer(now_s)
        self._outbox += self._server.messages_to_send()
        if frames:
            self._update_totals(announce=True)
        if self.rover.mode == Mode.INITIALISING and self._is_ready(now_s):
            self.rover.mode = Mode.MANUAL
        if not self.rover.is_idle:
            self.rover.step(now_s)
        elif frames:
            self.rover.check_fence(now_s)
        self._tell(now_s)

    def _tell(self, now_s: float) -> None:
        rover = self.rover
        self._outbox += [m.Statustext(severity, text) for severity, text in rover.texts]
        self._outbox += [m.MissionItemReached(seq) for seq in rover.reached]
        rover.texts.clear()
        rover.reached.clear()
        self._tell_changes(now_s)
        queue = self._parameter_queue
        self._outbox += [
            self._parameter(name, self.parameters.index_of(name)) for name in queue[:PARAMETERS_A_TICK]
        ]
        del queue[:PARAMETERS_A_TICK]
        for message_id in self._streams.due(now_s):
            message = self._report(message_id, now_s)
            if message is not None:
                self._outbox.append(message)

    def _tell_changes(self, now_s: float) -> None:
        """Report at once a breach, for which Rover has no text, and a change of mode: in ArduPilot's usual order."""
        rover = self.rover
        if rover.breaches != self._told_breaches:
            self._outbox += filter(None, [self._report(FENCE_STATUS, now_s)])
        if rover.mode != self._told_mode:
            self._outbox += filter(None, [self._report(HEARTBEAT, now_s)])
        self._told_mode, self._told_breaches = rover.mode, rover.breaches

    def _take(self, frame: m.Frame, now_s: float) -> None:
        message = frame.message
        match message:
            case m.MissionItemInt() | m.MissionItem() if message.current in (_GUIDED_ITEM, _HIGHER_ITEM):
                self._take_guided_item(frame, message)
            case m.CommandLong() | m.CommandInt():
                result, answers = self._commands.execute(message, now_s)
                ack = m.CommandAck(
                    message.command,
                    result,
                    target_system=frame.system,
                    target_component=frame.component,
                )
                self._outbox += [ack, *answers]
            case m.SetMode():
                self.rover.set_mode(message.custom_mode, now_s)
            case m.MissionSetCurrent():
                if self.rover.set_current_item(message.seq, restart=False, now_s=now_s):
                    self._outbox += filter(None, [self._report(42, now_s)])
            case m.SetPositionTargetGlobalInt():
                if not message.type_mask & _POSITION_IGNORED:
                    self.rover.go_to(from_e7(message.lat_int, message.lon_int))
            case m.ParamRequestList():
                self._parameter_queue = list(self.parameters)
            case m.ParamRequestRead():
                self._answer_parameter(message)
            case m.ParamSet():
                self._set_parameter(message)
            case m.RequestDataStream():
                rate_hz = message.req_message_rate if message.start_stop else 0
                self._streams.request_stream(message.req_stream_id, rate_hz, now_s)
            case _:
                self._server.receive(frame, now_s)
                self._outbox += self._server.messages_to_send()

    def _take_guided_item(self, frame: m.Frame, message: m.MissionItemInt | m.MissionItem) -> None:
        if isinstance(message, m.MissionItemInt):
            target = from_e7(message.x, message.y)
        else:
            target = from_e7(round(message.x * 1e7), round(message.y * 1e7))
        taken = message.current == _GUIDED_ITEM and self.rover.go_to(target)
        result = m.MissionResult.ACCEPTED if taken else m.MissionResult.ERROR
        self._outbox.append(m.MissionAck(frame.system, frame.component, result, m.MissionType.MISSION))

    def _answer_parameter(self, message: m.ParamRequestRead) -> None:
        if message.param_index >= 0:
            name, index = self.parameters.name_at(message.param_index), message.param_index
        else:
            name, index = message.param_id, _NO_INDEX
        if name is not None and name in self.parameters:
            self._outbox.append(self._parameter(name, index))

    def _set_parameter(self, message: m.ParamSet) -> None:
        name = message.param_id
        if name not in self.parameters or not math.isfinite(message.param_value):
            return
        self.parameters.set(name, message.param_value)
        self._parameter_changed(name)

    def _parameter_changed(self, name: str) -> None:
        self._outbox.append(self._parameter(name, _NO_INDEX))
        self.rover.renew_settings()

    def _parameter(self, name: str, index: int) -> m.ParamValue:
        return m.ParamValue(name, self.parameters[name], kind(name), len(self.parameters), index)

    def _update_totals(self, *, announce: bool) -> None:
        """Keep the parameters that count the lists, and let the rover know of a changed fence."""
        fence_total = len(self._fence) + 2 if len(self._fence) else 0
        totals = {
            "MIS_TOTAL": len(self._mission),
            "FENCE_TOTAL": fence_total,
            "RALLY_TOTAL": len(self._rally),
        }
        for name, total in totals.items():
            if self.parameters[name] != total:
                self.parameters.set(name, total)
                if announce:
                    self._outbox.append(self._parameter(name, _NO_INDEX))
        if self._fence.items is not self._known_fence:
            self._known_fence = self._fence.items
            self.rover.renew_fence()

    _known_fence: Sequence[MissionItem] | None = None

    def _report(self, message_id: int, now_s: float) -> m.Message | None:
        mission_id, fence_id, rally_id = (
            _id_of(stored.items) if self.config.list_ids else 0 for stored in self._lists
        )
        state = TelemetrySource(
            self.rover,
            len(self._mission),
            now_s - self._boot_s,
            self._is_ready(now_s),
            (mission_id, fence_id, rally_id),
            self.config.uid,
            self.config.firmware,
            self.discs_at(now_s) if message_id == OBSTACLE_DISTANCE else (),
            self.config.sensor_m,
        )
        return telemetry(message_id, state)


def _id_of(items: Sequence[MissionItem]) -> int:
    """Return a list's id: another one for other items, 0 for none."""
    return zlib.crc32(repr(tuple(items)).encode()) if items else 0


def _store(stored: StoredList, items: Sequence[MissionItem]) -> None:
    """Write a list the way an upload would."""
    if not items:
        return
    if len(items) > stored.limit:
        raise RefusedError(f"{stored.name}: {len(items)} items; the vehicle holds {stored.limit}")
    stored.begin(len(items))
    for seq, item in enumerate(items):
        result = stored.write(seq, item, len(items))
        if result != m.MissionResult.ACCEPTED:
            raise RefusedError(
                f"{stored.name}: item {seq} is refused: {result.name}", item=seq, result=result.name
            )
    if stored.finish() != m.MissionResult.ACCEPTED:
        raise RefusedError(f"{stored.name} is refused: {'; '.join(stored.texts)}")
    stored.texts.clear()


def _read(stored: StoredList) -> tuple[MissionItem, ...]:
    return tuple(item for item in map(stored.read, range(len(stored))) if item is not None)
