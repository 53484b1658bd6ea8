"""A foreign ground station and our bridge on one rover at the same time: MAVProxy works while the bridge drives to its target."""

from __future__ import annotations

import json
import subprocess
import sys

from console import Console, soon
from lists import BLOCKING_FENCE, FENCE, TARGET, same, same_in

from mavlink_bridge.mavlink.messages import Heartbeat, MissionAck, MissionResult
from mavlink_bridge.tlog import TlogReader
from missions.formats.waypoints import format_items

ROVER, BRIDGE, MAVPROXY = (1, 1), (1, 195), (255, 230)


def beside_bridge(python, rover, folder):
    """Let MAVProxy list the mission and put a fence across the route while the bridge drives; the bridge must still arrive."""
    vehicle = rover.vehicle
    (folder / "fence.txt").write_text(format_items(FENCE))
    (folder / "blocking.txt").write_text(format_items(BLOCKING_FENCE))
    with Console(python, rover.connection, folder) as mavproxy:
        yield mavproxy.do(
            f"fence load {folder}/fence.txt", lambda: same(vehicle.fence, FENCE), "the rover holds the fence"
        )
        with Bridge(rover.connection, folder) as bridge:
            assert soon(lambda: bridge.has("driving")), f"the bridge does not drive: {bridge.told()}"
            yield "pbpp bridge: verified and driving"
            direct = vehicle.mission
            path, told = mavproxy.save("wp save", "direct.txt", len(direct))
            assert same_in(path, direct), "another mission was read while driving"
            yield f"while it drives, {told}"
            told = mavproxy.do(
                f"fence load {folder}/blocking.txt",
                lambda: same(vehicle.fence, BLOCKING_FENCE),
                "a square across the route",
            )
            yield f"while it drives, {told}"
            path, told = mavproxy.save("fence save", "back.txt", len(BLOCKING_FENCE))
            assert same_in(path, BLOCKING_FENCE), "another fence was read back while driving"
            assert bridge.wait() == 0, f"the bridge ended with {bridge.wait()}: {bridge.told()}"
        yield judged_bridge(bridge, vehicle)
        path, told = mavproxy.save("wp save", "detour.txt", len(vehicle.mission))
        assert same_in(path, vehicle.mission), "another mission was read back"
        yield f"afterwards, {told}"
    yield judged_traffic(folder)


def judged_bridge(bridge, vehicle):
    """The route went round the new fence, and nothing was driven through."""
    events = bridge.events()
    names = [event["event"] for event in events]
    assert names.count("verified") == 2, f"not two verified missions: {names}"
    assert "arrived" in names, names
    assert not {"refused", "failed", "mission_changed"} & set(names), names
    assert vehicle.breaches == 0, f"{vehicle.breaches} breaches"
    assert vehicle.least_clearance_m > 0, f"clearance {vehicle.least_clearance_m:.2f} m"
    assert same(vehicle.fence, BLOCKING_FENCE), "the fence is not the ground station's"
    arrived = next(event for event in events if event["event"] == "arrived")
    return f"pbpp bridge: {arrived['text']} by a new route, least clearance {vehicle.least_clearance_m:.1f} m, no breach"


def judged_traffic(folder):
    """Both logs show both identities, and no transfer was denied or failed to anybody."""
    results = []
    for name in ("bridge.tlog", "mav.tlog"):
        entries = list(TlogReader(folder / name, [Heartbeat, MissionAck]))
        frames = [entry.frame for entry in entries]
        speakers = {(frame.system, frame.component) for frame in frames}
        assert {ROVER, BRIDGE, MAVPROXY} <= speakers, f"{name} has only {sorted(speakers)}"
        acks = [frame.message for frame in frames if isinstance(frame.message, MissionAck)]
        bad = [ack for ack in acks if ack.type != MissionResult.ACCEPTED]
        assert not bad, f"{name}: {bad}"
        results.append(len(acks))
    return f"both identities in both logs; {results[0]} and {results[1]} transfers acknowledged in them, none denied"


class Bridge:
    """``pbpp bridge`` with a target, in a process of its own."""

    def __init__(self, connection, folder):
        self._events = folder / "events.jsonl"
        self._errors = folder / "bridge-errors.txt"
        options = ["--upload", "--drive", "--arm", "--once", "--json", "--log", str(folder / "bridge.tlog")]
        target = f"{TARGET.lat_deg:.7f},{TARGET.lon_deg:.7f}"
        self._command = [
            *(sys.executable, "-m", "mavlink_bridge.cli", "bridge"),
            *("--connect", connection, "--target", target, *options),
        ]

    def __enter__(self):
        with self._events.open("w") as events, self._errors.open("w") as errors:
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.DEVNULL, stdout=events, stderr=errors
            )
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()

    def events(self):
        return [json.loads(line) for line in self._events.read_text().splitlines()]

    def has(self, name):
        return any(event["event"] == name for event in self.events())

    def wait(self):
        return self._process.wait(timeout=120)

    def told(self):
        return self._events.read_text()[-2000:] + self._errors.read_text()[-1000:]
