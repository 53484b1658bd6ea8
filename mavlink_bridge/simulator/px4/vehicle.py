"""A simulated PX4 rover behind a MAVLink 2 link: sans-IO, without a clock. What comes in is answered at once."""

from __future__ import annotations

import cmath
import math
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.mavlink.modes import px4_mode
from mavlink_bridge.simulator import streams
from mavlink_bridge.simulator.px4.commands import Px4Commands
from mavlink_bridge.simulator.px4.lists import Px4List
from mavlink_bridge.simulator.px4.parameters import NO_INDEX, Px4Parameters
from mavlink_bridge.simulator.px4.rover import AUTO, HOLD, TICK_S, Px4Rover
from mavlink_bridge.simulator.px4.transfers import Px4Transfers
from missions.errors import MissionError
from missions.firmware import Firmware
from missions.geo import to_e7

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mavlink_bridge.simulator.config import SimulatorConfig
    from missions.geo import LatLon
    from missions.items import MissionItem

BOOT_S = 3.0
"""How long a rebooted vehicle is silent; chosen, as of the other rover."""

IDS_LATE_S = 1.0
"""How long after a change MISSION_CURRENT tells the new id of a list."""

_REACHED_AGAIN = 10
_CAPABILITIES = 0xE8FF
_NO_ITEMS = 65_535
_EXACT = 0x1D  # base_mode in AUTO: custom, auto, guided, stabilised
_STANDBY, _ACTIVE, _CRITICAL_STATE = 3, 4, 5  # MAV_STATE
_RATES_HZ = {
    streams.SYS_STATUS: 1.0,
    streams.GPS_RAW_INT: 5.0,
    streams.GLOBAL_POSITION_INT: 5.0,
    streams.MISSION_CURRENT: 1.0,
    streams.VFR_HUD: 4.0,
    streams.HOME_POSITION: 0.5,
}
"""A ground station's link, as on boards."""

_SENSORS = 0x121_8000F  # gyro, accelerometer, magnetometer, barometer, motors, battery and the like; chosen
_PREARM_OK = 1 << 28


class Px4Vehicle:
    """A rover that answers MAVLink messages as PX4 does.

    Parameters
    ----------
    config : SimulatorConfig
        What it starts with. It boots at time 0.

    Raises
    ------
    BridgeError
        A parameter that it does not have.
    MissionError
        A list in the configuration that it would refuse.
    """

    def __init__(self, config: SimulatorConfig) -> None:
        self.config = config
        self.firmware = config.firmware or Firmware(1, 18, 0, 0)
        self.is_1_18 = self.firmware >= Firmware(1, 18, 0, 0)
        self.parameters = Px4Parameters(config.parameters, is_1_18=self.is_1_18)
        self.lists = {
            kind: Px4List(kind, checks_unused=self.is_1_18)
            for kind in (MissionType.MISSION, MissionType.FENCE, MissionType.RALLY)
        }
        for kind, items in zip(self.lists, (config.mission, config.fence, config.rally), strict=True):
            _store(self.lists[kind], items)
        self._server = Px4Transfers(
            self.lists,
            config.system,
            repeats_count=self.is_1_18,
            current=lambda: self.rover.progress.seq,
        )
        self.rover = Px4Rover(
            self.parameters, self.lists, config.home, config.heading_deg, tells_modes=self.is_1_18
        )
        self._commands = Px4Commands(self.rover, self._report, is_1_18=self.is_1_18)
        self._outbox: list[m.Message] = []
        self._ids = (0, 0, 0)
        self._boot_s = self._stepped_s = self._changed_s = 0.0
        self._reached = (-1, 0)
        self._streams = streams.Streams({}, 0.0)
        self._begin(0.0)
        self.rover.look(math.inf)
        self.rover.look(0.0)

    @property
    def deadline_s(self) -> float:
        """When `handle_timer` wants to be called."""
        deadlines = [self._streams.deadline_s, self._server.deadline_s, self.rover.deadline_s]
        if not self.rover.is_idle:
            deadlines.append(self._stepped_s + TICK_S)
        return max(self._boot_s, min(deadline_s for deadline_s in deadlines if deadline_s is not None))

    @property
    def is_armed(self) -> bool:
        """Whether its motors may run."""
        return self.rover.is_armed

    @property
    def mode(self) -> int:
        """HEARTBEAT.custom_mode."""
        return px4_mode(*self.rover.mode)

    @property
    def position(self) -> LatLon:
        """Where it is."""
        return self.rover.position

    @property
    def mission(self) -> tuple[MissionItem, ...]:
        """The stored mission as it reads back."""
        return self.lists[MissionType.MISSION].items

    @property
    def fence(self) -> tuple[MissionItem, ...]:
        """The stored fence as it reads back."""
        return self.lists[MissionType.FENCE].items

    @property
    def rally(self) -> tuple[MissionItem, ...]:
        """The stored rally points as they read back."""
        return self.lists[MissionType.RALLY].items

    def receive(self, frame: m.Frame, now_s: float) -> None:
        """Take a frame, and answer it."""
        self.handle_timer(now_s)
        if now_s < self._boot_s or (frame.system, frame.component) == (
            self.config.system,
            self.config.component,
        ):
            return
        message = frame.message
        match message:
            case m.CommandLong() | m.CommandInt():
                if message.target_system in (0, self.config.system):
                    self._take_command(frame, message, now_s)
            case m.SetMode():
                if message.target_system == self.config.system:
                    self.rover.set_mode(message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF)
            case m.MissionSetCurrent():
                if not self.rover.set_current(message.seq):
                    self._outbox.append(m.Statustext(2, "WPM: WP CURR CMD: Not in list\t"))
            case m.ParamRequestList():
                self._outbox += [
                    self.parameters.message(name, index) for index, name in enumerate(self.parameters)
                ]
                self._outbox.append(self.parameters.checksum())
            case m.ParamRequestRead():
                answer = self.parameters.asked(message)
                self._outbox += [answer] if answer is not None else []
            case m.ParamSet():
                if self.parameters.set(message):
                    self._outbox.append(self.parameters.message(message.param_id, NO_INDEX))
                    self.rover.renew_fence()
            case _:
                self._server.receive(frame, now_s)
                self._outbox += self._server.messages_to_send()
        self._look(now_s)

    def handle_timer(self, now_s: float) -> None:
        """Do what is due by now."""
        if now_s < self._boot_s:
            return
        self._server.handle_timer(now_s)
        self._outbox += self._server.messages_to_send()
        while not self.rover.is_idle and self._stepped_s + TICK_S <= now_s + 1e-9:
            self._stepped_s += TICK_S
            self.rover.step(self._stepped_s)
        if self.rover.is_idle:
            self._stepped_s = now_s
        self._look(now_s)
        for message_id in self._streams.due(now_s):
            self._tell(message_id, now_s)

    def messages_to_send(self) -> list[m.Message]:
        """Return what is to be sent, and forget it."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def reboot(self, now_s: float) -> None:
        """Start anew, as after a loss of power: lists and parameters stay."""
        self._server.reboot()
        self.rover.reboot()
        self._begin(now_s + BOOT_S)

    def _begin(self, boot_s: float) -> None:
        self._boot_s = self._stepped_s = boot_s
        self._outbox.clear()
        self._reached = (-1, 0)
        self._changed_s = boot_s
        self._streams = streams.Streams(_RATES_HZ if self.config.streams else {}, boot_s)

    def _look(self, now_s: float) -> None:
        rover = self.rover
        rover.look(now_s)
        self._outbox += [m.Statustext(severity, text) for severity, text in rover.texts]
        rover.texts.clear()
        if rover.progress.reached >= 0 and rover.progress.reached != self._reached[0]:
            self._reached = (rover.progress.reached, _REACHED_AGAIN)
            self._outbox.append(m.MissionItemReached(rover.progress.reached))

    def _tell(self, message_id: int, now_s: float) -> None:
        message = self._report(message_id, now_s)
        if message is not None:
            self._outbox.append(message)
        seq, left = self._reached
        if message_id == streams.MISSION_CURRENT and left:
            self._reached = (seq, left - 1)
            self._outbox.append(m.MissionItemReached(seq))

    def _take_command(self, frame: m.Frame, message: m.CommandLong | m.CommandInt, now_s: float) -> None:
        result, answers = self._commands.execute(message, now_s)
        ack = m.CommandAck(
            message.command, result, target_system=frame.system, target_component=frame.component
        )
        self._outbox += [ack, *answers]

    def _report(self, message_id: int, now_s: float) -> m.Message | None:
        builders: dict[int, Callable[[float], m.Message]] = {
            streams.HEARTBEAT: self._heartbeat,
            streams.SYS_STATUS: self._sys_status,
            streams.GPS_RAW_INT: self._gps_raw,
            streams.GLOBAL_POSITION_INT: self._global_position,
            streams.VFR_HUD: self._vfr_hud,
            streams.MISSION_CURRENT: self._mission_current,
            streams.HOME_POSITION: self._home_position,
            streams.AUTOPILOT_VERSION: self._version,
        }
        build = builders.get(message_id)
        return build(now_s) if build is not None else None

    def _sys_status(self, _: float) -> m.Message:
        return m.SysStatus(_SENSORS | _PREARM_OK, _SENSORS | _PREARM_OK, _SENSORS | _PREARM_OK)

    def _gps_raw(self, now_s: float) -> m.Message:
        time_usec = round((now_s - self._boot_s) * 1e6)
        place = to_e7(self.rover.position)
        return m.GpsRawInt(time_usec, 3, *place, 0, eph=90, satellites_visible=10, h_acc=900)

    def _global_position(self, now_s: float) -> m.Message:
        rover, motion = self.rover, self.rover.motion
        velocity_mps = cmath.rect(motion.speed_mps, motion.heading_rad)
        return m.GlobalPositionInt(
            round((now_s - self._boot_s) * 1000) % 2**32,
            *to_e7(rover.position),
            vx=round(velocity_mps.real * 100),
            vy=round(velocity_mps.imag * 100),
            hdg=round(rover.heading_deg * 100) % 36_000,
        )

    def _vfr_hud(self, _: float) -> m.Message:
        speed_mps = self.rover.motion.speed_mps
        return m.VfrHud(speed_mps, speed_mps, int(self.rover.heading_deg), 0)

    def _home_position(self, _: float) -> m.Message:
        return m.HomePosition(*to_e7(self.rover.home))

    def _heartbeat(self, _: float) -> m.Message:
        rover = self.rover
        base_mode = _EXACT | (m.ModeFlag.SAFETY_ARMED if rover.is_armed else 0)
        status = _CRITICAL_STATE if rover.is_in_failsafe else _ACTIVE if rover.is_armed else _STANDBY
        return m.Heartbeat(m.MavType.GROUND_ROVER, m.Autopilot.PX4, int(base_mode), self.mode, status)

    def _mission_current(self, now_s: float) -> m.Message:
        ids = tuple(stored.id for stored in self.lists.values())
        if ids == self._ids:
            self._changed_s = now_s
        elif now_s >= self._changed_s + IDS_LATE_S:
            self._ids = (ids[0], ids[1], ids[2])
        rover = self.rover
        total = len(rover.mission) or _NO_ITEMS
        in_mission = rover.mode[0] == AUTO and rover.mode[1] != HOLD
        return m.MissionCurrent(rover.progress.seq, total, rover.mission_state, int(in_mission), *self._ids)

    def _version(self, _: float) -> m.Message:
        own = self.firmware
        number = own.major << 24 | own.minor << 16 | own.patch << 8 | own.stage
        return m.AutopilotVersion(_CAPABILITIES, number, uid2=tuple(self.config.uid.ljust(18, b"\0")[:18]))


def _store(stored: Px4List, items: Sequence[MissionItem]) -> None:
    """Write a list the way an upload would."""
    if not items:
        return
    if len(items) > stored.limit:
        raise MissionError(f"{len(items)} items; the simulated PX4 rover holds {stored.limit}")
    stored.begin()
    for seq, item in enumerate(items):
        result = stored.take(item, current=int(seq == 0))
        if result:
            raise MissionError(f"item {seq} is refused: {result.name}", item=seq, result=result.name)
    stored.finish()
