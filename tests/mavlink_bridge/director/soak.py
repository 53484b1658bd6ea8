"""Hours of the bridge in stepped time, with everything that can happen to it: `python tests/mavlink_bridge/director/soak.py --hours 4 --setting obstacles`.

Random targets typed and clicked, fences and missions changed by another ground station, modes changed by an operator, links cut and
lossy, reboots. After each step the promises are checked; at the end the counts are printed. Also run, for a little while, by the tests.
"""

from __future__ import annotations

import argparse
import cmath
import gc
import random
import sys
import time
import tracemalloc
from collections import Counter
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from director.conducting import Conductor
from director.promises import Promises

from mavlink_bridge.director import Director, Orders, State
from mavlink_bridge.director.orders import Homing, ObstacleSource
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.autopilots import autopilot_table
from mavlink_bridge.mavlink.modes import PX4_MODES
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.upload import Upload
from mavlink_bridge.simulator import Battery, SimulatorConfig
from mavlink_bridge.simulator.any_vehicle import AUTOPILOTS, vehicle_of
from mavlink_bridge.simulator.faults import Faults
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.firmware import Firmware, read_firmware
from missions.formats import read_fence
from missions.geo import LatLon, LocalPoint, to_e7
from missions.items import Command, waypoint
from missions.request import Request

YARD = read_fence(Path(__file__).parents[2] / "fields" / "yard-fence.waypoints")
FENCES = (
    YARD,
    Fence((*YARD.zones, CircleZone(ZoneKind.EXCLUSION, LatLon(40.0720000, -105.2289500), 6.0))),
    Fence((*YARD.zones, CircleZone(ZoneKind.EXCLUSION, LatLon(40.0721500, -105.2301000), 4.0))),
)
HOME = LatLon(40.071374, -105.229930)
PLACES = (
    HOME,
    LatLon(40.0720926, -105.2286152),
    LatLon(40.0712500, -105.2292000),
    LatLon(40.0719500, -105.2300500),
    LatLon(40.0714600, -105.2295800),  # in the barn
    LatLon(40.0740000, -105.2286152),  # outside
)
OPERATOR_MODES = {
    m.Autopilot.ARDUPILOTMEGA: (0, Mode.HOLD, 11),
    m.Autopilot.PX4: (PX4_MODES.hold, PX4_MODES.rtl, PX4_MODES.mission),
}
PARAMETERS = {
    m.Autopilot.ARDUPILOTMEGA: {"FENCE_ENABLE": 1.0, "WP_SPEED": 4.0, "AVOID_BACKUP_SPD": 0.0},
    m.Autopilot.PX4: {},
}
CLEARANCES_M = {m.Autopilot.ARDUPILOTMEGA: 2.5, m.Autopilot.PX4: 1.5}
MOST_GROWTH_KB = 250
"""How far apart the sizes of memory may be, once it has settled: they went up and down by up to 150 kB with what was planned last."""

SAMPLE_S = 900.0
_HOMING = Homing(is_kept=True, by_route=True, gcs_timeout_s=20.0)
SETTINGS: dict[str, dict[str, object]] = {
    "calm": {},
    "dense": {"pace_s": (0.05, 2.5)},
    "home": {"pace_s": (0.3, 6.0), "homing": _HOMING},
    "obstacles": {
        "pace_s": (0.3, 6.0),
        "homing": replace(_HOMING, battery_percent=20),
        "obstacle_sources": frozenset(ObstacleSource),
    },
}
"""How much happens, and what the bridge is to do about it, by name."""


class Soak:
    """One long run and its promises.

    Parameters
    ----------
    seed : int
        Of everything that happens.
    pace_s : tuple of float
        Shortest and longest time between what others do.
    autopilot, firmware : Autopilot, Firmware or None
        Whose rover it is.
    """

    def __init__(
        self,
        seed: int,
        pace_s: tuple[float, float] = (3.0, 45.0),
        autopilot: m.Autopilot = m.Autopilot.ARDUPILOTMEGA,
        firmware: Firmware | None = None,
        **orders: object,
    ) -> None:
        self.random = random.Random(seed)
        self.pace_s = pace_s
        # With AVOID_BACKUP_SPD 0 it may start inside a fence's margin, where an operator has left it: else nothing is driven any more.
        self.table = autopilot_table(autopilot, firmware)
        self.modes = self.table.modes
        config = SimulatorConfig(
            home=HOME,
            fence=self._sent(m.MissionType.FENCE, fence_to_items(YARD)),
            parameters=PARAMETERS[autopilot],
            autopilot=autopilot,
            firmware=firmware,
        )
        given = {"upload": True, "drive": True, "arm": True, "announce": True, **orders}
        self.vehicle = vehicle_of(config)
        self.run = Conductor(
            Director(Orders(request=Request(clearance_m=CLEARANCES_M[autopilot]), **given)),
            [self.vehicle],
            Faults(),
        )
        self.run.meddle = self._step
        self.promises = Promises(self.run)
        self.counts: Counter[str] = Counter()
        self.sizes_kb: list[float] = []
        self._rival: Upload | None = None
        self._next_s = 10.0
        self._restore_link_s = 0.0
        receive = self.run.director.receive

        def listen(frame: m.Frame, now_s: float) -> None:
            if self._rival is not None:  # the rival's answers come by the same link as the director's
                self._rival.receive(frame, now_s)
            receive(frame, now_s)

        self.run.director.receive = listen

    @property
    def violations(self) -> list[str]:
        """Promises that were broken."""
        return self.promises.broken

    def go(self, until_s: float, wall_s: float = 1e9) -> None:
        """Run until a time of the stepped clock, or for so many real seconds."""
        begun_s = time.monotonic()
        run = self.run
        run.run_until(lambda: run.director.state is not State.LISTENING, 30)
        while run.now_s < until_s and time.monotonic() - begun_s < wall_s and not self.violations:
            run.step()
            if run.now_s >= SAMPLE_S * (len(self.sizes_kb) + 1):
                gc.collect()
                self.sizes_kb.append(tracemalloc.get_traced_memory()[0] / 1024)

    def _step(self, run: Conductor) -> None:
        self._serve_rival()
        run.sent.clear()
        for event in run.events:
            self.counts[event.name] += 1
        run.events.clear()
        run.backups.clear()
        if self._restore_link_s and run.now_s >= self._restore_link_s:
            run.is_cut = False
            self._restore_link_s = 0.0
        if run.now_s >= self._next_s:
            self._next_s = run.now_s + self.random.uniform(*self.pace_s)
            self._act()

    def _act(self) -> None:
        self.run.planning_s = self.random.choice((0.0, 0.0, 0.5, 4.0))
        acts = (
            (self._type, 5), (self._click, 5), (self._change_fence, 3), (self._block_way, 2), (self._change_mission, 1),
            (self._take_over, 3), (self._disarm, 1), (self._cut, 2), (self._spoil, 2), (self._reboot, 1), (self._spoof, 1),
        )  # fmt: skip
        if self.run.director.orders.obstacle_sources:
            acts += ((self._report, 4), (self._report_nonsense, 1), (self._clear, 1))
        if self.run.director.orders.homing.battery_percent is not None:
            acts += ((self._lower_battery, 1),)
        act = self.random.choices([act for act, _ in acts], [weight for _, weight in acts])[0]
        self.counts[act.__name__.strip("_")] += 1
        act()

    def _type(self) -> None:
        self.promises.asked()
        self.promises.typed()
        self.run.director.take_target(self.random.choice(PLACES), self.run.now_s)

    def _click(self) -> None:
        lat_e7, lon_e7 = to_e7(self.random.choice(PLACES))
        self.promises.asked()
        self.run.ground_station(
            m.CommandInt(1, 1, 0, Command.DO_REPOSITION, param1=-1.0, param2=1.0, x=lat_e7, y=lon_e7)
        )

    def _report(self) -> None:
        """Type an obstacle: ahead, or somewhere on the route."""
        plan, place = self.run.director.plan, None
        if plan is not None and self.random.random() < 0.7:
            place = plan.ground.frame.to_lat_lon(LocalPoint(*self.random.choice(list(plan.points))))
        self.run.director.take_obstacle(place, self.random.choice((0.5, 2.0, 8.0)), self.run.now_s)

    def _report_nonsense(self) -> None:
        """Let a sensor see something everywhere, or send what no sensor sends."""
        cm = tuple(self.random.choice((0, 1, 300, 1500, 65535)) for _ in range(72))
        increment = self.random.choice((0, 5, 45, 255))
        scan = m.ObstacleDistance(0, 0, cm, increment=increment, min_distance=20, max_distance=1500, frame=12)
        self.run.director.receive(m.Frame(1, 196, scan), self.run.now_s)

    def _clear(self) -> None:
        self.run.director.clear_obstacles(self.run.now_s)

    def _lower_battery(self) -> None:
        self.vehicle.rover.battery = Battery(self.random.choice((-1, 0, 10, 90)), 11.0)

    def _change_fence(self) -> None:
        if self._rival is None:
            self._begin(m.MissionType.FENCE, fence_to_items(self.random.choice(FENCES)))

    def _sent(self, mission_type: m.MissionType, items: tuple) -> tuple:
        """Return a list as the vehicle's autopilot takes it."""
        return self.table.lists.form.prepared(items, mission_type)

    @property
    def _ahead(self) -> tuple[complex, complex, float]:
        """Where the vehicle is and looks, in its plane, and how fast it is."""
        rover = self.vehicle.rover
        if self.table.autopilot == m.Autopilot.PX4:
            motion = rover.motion
            return motion.position_m, cmath.rect(1.0, motion.heading_rad), motion.speed_mps
        return rover.body.position_m, rover.body.direction, rover.body.speed_mps

    def _block_way(self) -> None:
        """Put a fence in the vehicle's way, nearer than it can stop or farther."""
        position_m, direction, speed_mps = self._ahead
        if self._rival is None and speed_mps > 0.5:
            radius_m = 3.0
            place = self.vehicle.rover.frame.to_lat_lon(
                position_m + direction * (radius_m + self.random.uniform(0.5, 12.0))
            )
            circle = CircleZone(ZoneKind.EXCLUSION, place, radius_m)
            self._begin(m.MissionType.FENCE, fence_to_items(Fence((*YARD.zones, circle))))

    def _change_mission(self) -> None:
        if self._rival is None:
            mission = [waypoint(place) for place in PLACES[1:4]]
            self._begin(m.MissionType.MISSION, self.table.lists.form.mission_of(mission, HOME))

    def _begin(self, mission_type: m.MissionType, items: tuple) -> None:
        peer = Peer(1, 1, 255, 190, self.table)
        self._rival = Upload(peer, mission_type, self._sent(mission_type, items))
        self._rival.start(self.run.now_s)

    def _serve_rival(self) -> None:
        if self._rival is None:
            return
        for message in self._rival.messages_to_send():
            self.vehicle.receive(m.Frame(255, 190, message), self.run.now_s)
        self._rival.handle_timer(self.run.now_s)
        if self._rival.is_done:
            self._rival = None

    def _take_over(self) -> None:
        mode = self.random.choice(OPERATOR_MODES[self.table.autopilot])
        if mode == self.modes.rtl and self.run.director.orders.homing.by_route:
            self.promises.asked()  # the first one is answered; which one is the second stands in test_coming_home
        else:
            self.promises.taken_over(mode)
        self._operate(m.SetMode(1, 1, mode))

    def _disarm(self) -> None:
        self.promises.taken_over(None)
        self._operate(m.CommandLong(1, 1, Command.COMPONENT_ARM_DISARM, param1=0.0))

    def _operate(self, message: m.Message) -> None:
        """Let the operator act, heard by the bridge or by remote control."""
        if self.random.random() < 0.5:
            self.run.ground_station(message)
        else:
            self.vehicle.receive(m.Frame(255, 190, message), self.run.now_s)

    def _cut(self) -> None:
        self.run.is_cut = True
        self._restore_link_s = self.run.now_s + self.random.uniform(1, 15)

    def _spoil(self) -> None:
        loss = self.random.choice((0.0, 0.0, 0.05, 0.1))
        faults = Faults(loss=loss, duplicate=loss / 2, latency_s=loss, jitter_s=loss / 2)
        for side, name in enumerate(("up", "down")):
            setattr(self.run, name, type(self.run.up)(faults, self.random.randrange(1000) + side))

    def _spoof(self) -> None:
        """Let somebody speak with the bridge's own ids: once, or in a flood."""
        for _ in range(self.random.choice((1, 100))):
            self.run.director.receive(m.Frame(1, 195, m.Heartbeat(6, 8)), self.run.now_s)
        self.promises.clashed()

    def _reboot(self) -> None:
        self.promises.taken_over(None)
        self.vehicle.reboot(self.run.now_s)


def soak(
    seed: int, hours: float, wall_s: float = 1e9, pace_s: tuple[float, float] = (3.0, 45.0), **orders: object
) -> Soak:
    """Run."""
    run = Soak(seed, pace_s, **orders)
    run.go(hours * 3600, wall_s)
    return run


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--hours", type=float, default=4.0)
    parser.add_argument("--minutes", type=float, default=1e9, help="at most so many real minutes")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--autopilot", choices=tuple(AUTOPILOTS), default="ardupilot")
    parser.add_argument("--firmware", type=read_firmware)
    parser.add_argument("--setting", choices=SETTINGS, default="calm", help="how much happens")
    options = parser.parse_args()
    begun_s = time.monotonic()
    tracemalloc.start()
    autopilot = AUTOPILOTS[options.autopilot]
    run = soak(
        options.seed,
        options.hours,
        options.minutes * 60,
        autopilot=autopilot,
        firmware=options.firmware,
        **SETTINGS[options.setting],
    )
    print(f"{run.run.now_s / 3600:.2f} h of stepped time in {time.monotonic() - begun_s:.0f} s")
    print(", ".join(f"{name} {count}" for name, count in run.counts.most_common()))
    print("memory every quarter of an hour (kB):", ", ".join(f"{size_kb:.0f}" for size_kb in run.sizes_kb))
    settled = run.sizes_kb[1:]
    is_flat = not settled or max(settled) - min(settled) <= MOST_GROWTH_KB
    print("violations:", run.violations or "none", "" if is_flat else "; memory is not flat")
    raise SystemExit(bool(run.violations) or not is_flat)


if __name__ == "__main__":
    main()
