"""What `pbpp bridge` costs, and how quickly it acts: against the simulated rover over TCP, in real time.

Run ``python benchmarks/bridge.py`` (about ten minutes); ``--seconds`` sets how long each stream is watched, ``--repeats`` how often the bad link
is tried, which loses other messages each time. It exits with 1 where a bound is
not kept.

- At rest: CPU time of the process with every message at 4 Hz, over wall time.
- Full stream: fifteen message types at 50 Hz each. Once a second the bridge is sent a command that it has to deny; the time to its
  COMMAND_ACK is how far it has fallen behind.
- Target to verified mission in the maze, an item each 20 ms.
- A fence across the route while driving: from when the fence is known to HOLD, to the new verified mission, to arrival; the same over 5 % loss and a
  round trip of 200 ms.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import platform
import select
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

from pymavlink.dialects.v20 import ardupilotmega as dialect

from mavlink_bridge.link import Link, open_link
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.upload import Upload
from mavlink_bridge.simulator import Simulator, SimulatorConfig
from mavlink_bridge.simulator.faults import Faults
from missions.fence import CircleZone, Fence, ZoneKind, fence_to_items
from missions.formats import read_fence
from missions.geo import LatLon, to_e7
from missions.items import Command

FIELDS = Path(__file__).parent.parent / "tests" / "fields"
HOME = LatLon(40.071374, -105.229930)
FAR = LatLon(40.0720926, -105.2286152)
WALL = CircleZone(ZoneKind.EXCLUSION, LatLon(40.0720000, -105.2289500), 6.0)
STREAM_HZ = 50.0
_GROUND_STATION = (255, 190)


class Bridge:
    """A `pbpp bridge` process and its events; a context manager.

    Parameters
    ----------
    connection : str
        Where the vehicle is.
    options : str
        Further ones.
    name : str
        Another command that runs a bridge: ``serve``.
    """

    def __init__(self, connection: str, *options: str, name: str = "bridge") -> None:
        command = [
            sys.executable,
            "-m",
            "mavlink_bridge.cli",
            name,
            "--connect",
            connection,
            "--json",
            *options,
        ]
        self._folder = tempfile.TemporaryDirectory()
        environment = {**os.environ, "XDG_STATE_HOME": self._folder.name}
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=environment,
        )
        self.events: list[dict[str, Any]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.wait()
        self._folder.cleanup()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.events.append(json.loads(line))

    def type(self, text: str) -> None:
        """Type a line."""
        assert self._process.stdin is not None
        self._process.stdin.write(text + "\n")
        self._process.stdin.flush()

    def await_event(self, name: str, within_s: float = 60.0, after: int = 0) -> dict[str, Any]:
        """Return the first event of a name after so many."""
        wait_for(lambda: any(event.get("event") == name for event in self.events[after:]), within_s, name)
        return next(event for event in self.events[after:] if event.get("event") == name)

    def cpu_s(self) -> float:
        """Return the CPU time of the process so far."""
        fields = Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def wait_for(condition: Callable[[], bool], within_s: float, what: str) -> float:
    """Wait until something is so, and tell when; fails if it never is."""
    until_s = time.time() + within_s
    while not condition():
        if time.time() > until_s:
            raise TimeoutError(what)
        time.sleep(0.002)
    return time.time()


def cpu_at_rest(seconds: float) -> float:
    """Return the share of one core that the bridge takes with every message at 4 Hz."""
    with Simulator(config("maze")) as simulator, Bridge(simulator.connection) as bridge:
        bridge.await_event("learnt")
        with open_link(simulator.connection, _GROUND_STATION) as station:
            station.send(m.RequestDataStream(1, 1, 0, 4, 1))
            serve(station, 2.0)
        begun_s, cpu_s = time.monotonic(), bridge.cpu_s()
        time.sleep(seconds)
        return (bridge.cpu_s() - cpu_s) / (time.monotonic() - begun_s)


class Flood:
    """Stands between bridge and vehicle, passes everything on, and adds a full stream; a context manager.

    Once a second it sends the bridge a command that it has to deny, and takes the time to its answer.

    Parameters
    ----------
    simulator : Simulator
        The vehicle.
    stream_hz : float
        How often each message comes.
    """

    def __init__(self, simulator: Simulator, stream_hz: float = STREAM_HZ) -> None:
        self._stream_hz = stream_hz
        host, port = simulator.connection.split(":")[1:]
        self._vehicle = socket.create_connection((host, int(port)))
        self._server = socket.create_server(("127.0.0.1", 0))
        self.connection = f"tcp:127.0.0.1:{self._server.getsockname()[1]}"
        self._from_vehicle, self._from_bridge = Codec(254, 1), Codec(254, 2)
        self._station = Codec(*_GROUND_STATION)
        self._packets = full_packets(simulator)
        self._position = b""
        self._asked_s: float | None = None
        self.is_on = False
        self.sent = 0
        self.lags: list[float] = []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        for one in (self._vehicle, self._server):
            one.close()

    def _run(self) -> None:
        bridge = self._server.accept()[0]
        due_s = ask_s = time.monotonic()
        with bridge, contextlib.suppress(OSError):
            while not self._stop.is_set():
                ready = select.select([self._vehicle, bridge], [], [], max(0.0, due_s - time.monotonic()))[0]
                if self._vehicle in ready:
                    bridge.sendall(self._pass_down(self._vehicle.recv(65536)))
                if bridge in ready:
                    self._vehicle.sendall(self._pass_up(bridge.recv(65536)))
                now_s = time.monotonic()
                if now_s >= due_s:
                    due_s += 1 / self._stream_hz
                    if self.is_on:
                        packets = [*self._packets, self._position]
                        bridge.sendall(b"".join(packets))
                        self.sent += len(packets)
                if self.is_on and now_s >= ask_s and self._asked_s is None:
                    ask_s = now_s + 1.0
                    self._asked_s = now_s
                    bridge.sendall(self._station.encode(m.CommandInt(1, 195, 0, Command.DO_REPOSITION)))

    def _pass_down(self, data: bytes) -> bytes:
        for raw, frame in self._from_vehicle.decode_with_bytes(data):
            if frame is not None and isinstance(frame.message, m.GlobalPositionInt):
                self._position = raw
        return data

    def _pass_up(self, data: bytes) -> bytes:
        for frame in self._from_bridge.decode(data):
            if isinstance(frame.message, m.CommandAck) and self._asked_s is not None:
                self.lags.append(time.monotonic() - self._asked_s)
                self._asked_s = None
        return data


def full_stream(seconds: float) -> tuple[float, float, list[float]]:
    """Return messages a second, the share of one core and the lags in s under fifteen types at 50 Hz."""
    with (
        Simulator(config("maze")) as simulator,
        Flood(simulator) as flood,
        Bridge(flood.connection) as bridge,
    ):
        bridge.await_event("learnt")
        time.sleep(1.0)
        begun_s, cpu_s, flood.is_on = time.monotonic(), bridge.cpu_s(), True
        time.sleep(seconds)
        took_s = time.monotonic() - begun_s
        return flood.sent / took_s, (bridge.cpu_s() - cpu_s) / took_s, flood.lags


def full_packets(simulator: Simulator) -> list[bytes]:
    """Make a frame of each type of a full stream but the position, the vehicle standing where it stands."""
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    position = simulator.vehicle.position
    lat_e7, lon_e7 = to_e7(position)
    messages = [
        mav.attitude_encode(1, 0, 0, 0, 0, 0, 0),
        mav.vfr_hud_encode(0, 0, 0, 0, 0, 0),
        mav.sys_status_encode(1, 1, 1, 100, 12000, 100, 90, 0, 0, 0, 0, 0, 0),
        mav.servo_output_raw_encode(1, 1, *[1500] * 8),
        mav.rc_channels_encode(1, 8, *[1500] * 18, 200),
        mav.raw_imu_encode(*[1] * 10),
        mav.scaled_imu2_encode(*[1] * 10),
        mav.scaled_pressure_encode(1, 1000, 1, 2000),
        mav.gps_raw_int_encode(1, 6, lat_e7, lon_e7, 0, 100, 100, 0, 0, 10),
        mav.nav_controller_output_encode(0, 0, 0, 0, 0, 0, 0, 0),
        mav.ahrs2_encode(0, 0, 0, 0, lat_e7, lon_e7),
        mav.vibration_encode(1, 0, 0, 0, 0, 0, 0),
        mav.ekf_status_report_encode(831, 0, 0, 0, 0, 0),
        mav.system_time_encode(1, 1),
    ]
    return [bytes(message.pack(mav)) for message in messages]


def serve(station: Link, seconds: float) -> None:
    """Listen, so that heartbeats go out and the socket stays empty."""
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        station.receive(0.05)


def target_to_verified() -> tuple[float, int]:
    """Return the time from a typed target to its verified mission in the maze, and the mission's items."""
    with Simulator(config("maze")) as simulator, Bridge(simulator.connection, "--upload") as bridge:
        bridge.await_event("learnt")
        time.sleep(1.0)
        bridge.type(f"{FAR.lat_deg},{FAR.lon_deg}")
        verified = bridge.await_event("verified")
        return verified["time_s"] - bridge.await_event("target")["time_s"], verified["mission_items"]


def fence_across_the_route(faults: Faults) -> dict[str, float]:
    """Return how a drive goes on whose route is cut by a new fence: times in s, and breaches."""
    options = ("--upload", "--drive", "--arm", "--clearance", "2.5")
    with (
        Simulator(config("yard"), faults=faults) as simulator,
        Bridge(simulator.connection, *options) as bridge,
    ):
        vehicle = simulator.vehicle
        bridge.await_event("learnt")
        bridge.type(f"{FAR.lat_deg},{FAR.lon_deg}")
        bridge.await_event("driving")
        time.sleep(6.0)
        before = len(bridge.events)
        with open_link(simulator.connection, _GROUND_STATION) as station:
            yard = read_fence(FIELDS / "yard-fence.waypoints")
            items = fence_to_items(Fence((*yard.zones, WALL)))
            station.run(Upload(Peer(1, 1, *_GROUND_STATION), m.MissionType.FENCE, items), timeout_s=60)
            changed_s = time.time()
            stood_s = wait_for(lambda: vehicle.mode == Mode.HOLD, 20, "HOLD")
            known_s = bridge.await_event("fence_changed", after=before)["time_s"]
            verified_s = bridge.await_event("verified", after=before)["time_s"]
            driving_s = bridge.await_event("driving", after=before)["time_s"]
            arrived = bridge.await_event("arrived", 200, before)
        return {
            "known": known_s - changed_s,
            "hold_after_known": stood_s - known_s,
            "hold": stood_s - changed_s,
            "verified": verified_s - changed_s,
            "driving": driving_s - changed_s,
            "arrived": arrived["time_s"] - changed_s,
            "breaches": vehicle.breaches,
        }


def config(field: str) -> SimulatorConfig:
    """Return a simulated rover in a field."""
    fence = fence_to_items(read_fence(FIELDS / f"{field}-fence.waypoints"))
    return SimulatorConfig(home=HOME, fence=fence, parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": 3.0})


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=60.0, help="how long each stream is watched")
    parser.add_argument("--repeats", type=int, default=5, help="how often the bad link is tried")
    options = parser.parse_args()
    print(
        f"{datetime.now(UTC):%Y-%m-%d}, Python {platform.python_version()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
    )
    kept = []

    def tell(what: str, *, is_kept: bool) -> None:
        kept.append(is_kept)
        print(("      " if is_kept else "WRONG ") + what, flush=True)

    share = cpu_at_rest(options.seconds)
    tell(f"at rest, 4 Hz: {share:.1%} of one core (bound 3 %)", is_kept=share <= 0.03)
    rate_hz, share, lags = full_stream(options.seconds)
    lags.sort()
    tell(
        f"full stream, {rate_hz:.0f} messages a second: {share:.1%} of one core; lag {lags[len(lags) // 2] * 1000:.0f} ms in the middle, "
        f"{lags[-1] * 1000:.0f} ms at most of {len(lags)} (bound 500 ms)",
        is_kept=lags[-1] <= 0.5,
    )
    took_s, items = target_to_verified()
    tell(
        f"maze, target to verified mission of {items} items: {took_s:.2f} s (bound 1 s)",
        is_kept=took_s <= 1.0,
    )
    times = fence_across_the_route(Faults())
    tell(
        f"fence across the route, clean link: {_told(times)} (bound of HOLD after known 0.5 s)",
        is_kept=times["hold_after_known"] <= 0.5 and not times["breaches"],
    )
    for _ in range(options.repeats):
        times = fence_across_the_route(Faults(loss=0.05, latency_s=0.1))
        tell(
            f"the same, 5 % loss, 200 ms round trip: {_told(times)} (bound of driving 10 s)",
            is_kept=times["driving"] <= 10.0 and not times["breaches"],
        )
    return 0 if all(kept) else 1


def _told(times: dict[str, float]) -> str:
    seconds = ", ".join(f"{what} {value:.2f} s" for what, value in times.items() if what != "breaches")
    return f"{seconds}; breaches {times['breaches']}"


if __name__ == "__main__":
    raise SystemExit(main())
