"""Foreign clients against the simulated rover: MAVProxy and MAVSDK upload, list and clear missions and fences.

Run ``python tests/foreign/run.py`` with this project's interpreter. Each client gets a virtual environment of its own in ``--folder``
(``.foreign`` in the repository if not given, made once). After each step the rover itself is asked what it holds. Exits with 1 if a
client fails; a client that cannot be installed here is reported and left out.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from mavlink_bridge.simulator import Simulator, SimulatorConfig
from missions.formats.waypoints import format_items
from missions.items import Command, CoordinateFrame, MissionItem

HERE = Path(__file__).parent
PINS = {"mavproxy": "MAVProxy==1.8.75", "mavsdk": "mavsdk==4.1.0"}
HOME = MissionItem(Command.NAV_WAYPOINT, CoordinateFrame.GLOBAL, lat_e7=400713740, lon_e7=-1052299300)
MISSION = [
    HOME,
    *(
        MissionItem(
            Command.NAV_WAYPOINT,
            CoordinateFrame.GLOBAL_RELATIVE_ALT,
            lat_e7=400713740 + 900 * seq,
            lon_e7=-1052299300 + 1100 * seq,
        )
        for seq in range(1, 12)
    ),
]
FENCE = [
    MissionItem(command, CoordinateFrame.GLOBAL, (4.0, 0.0, 0.0, 0.0), 400713000 + north, -1052303000 + east)
    for command, size, offset in (
        (Command.FENCE_POLYGON_VERTEX_INCLUSION, 20000, 0),
        (Command.FENCE_POLYGON_VERTEX_EXCLUSION, 2000, 6000),
    )
    for north, east in (
        (offset, offset),
        (offset + size, offset),
        (offset + size, offset + size),
        (offset, offset + size),
    )
]


def main() -> int:
    """Run both clients."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=HERE.parent.parent / ".foreign")
    options = parser.parse_args()
    failures = 0
    for name, steps in (("mavproxy", mavproxy), ("mavsdk", mavsdk)):
        python = environment(options.folder / name, PINS[name])
        if python is None:
            continue
        with (
            tempfile.TemporaryDirectory() as folder,
            Simulator(SimulatorConfig(), "tcpin:127.0.0.1:0") as rover,
        ):
            try:
                for said in steps(python, rover, Path(folder)):
                    print(f"{PINS[name]}: {said}")
            except AssertionError as error:
                failures += 1
                print(f"{PINS[name]}: FAILED: {error}")
    return 1 if failures else 0


def environment(folder: Path, pin: str) -> Path | None:
    """Give the interpreter of an environment with one package, made if it is not there."""
    python = folder / "bin" / "python"
    if (folder / pin).exists():
        return python
    subprocess.run([sys.executable, "-m", "venv", "--clear", str(folder)], check=True)
    installed = subprocess.run(
        [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", pin], check=False
    )
    if installed.returncode:
        print(f"{pin}: cannot be installed here; left out")
        return None
    (folder / pin).touch()
    return python


def mavproxy(python: Path, rover: Simulator, folder: Path):
    """Drive MAVProxy by its console; the rover tells what came of it."""
    (folder / "mission.txt").write_text(format_items(MISSION))
    (folder / "fence.txt").write_text(format_items(FENCE))
    command = [
        str(python),
        str(python.parent / "mavproxy.py"),
        f"--master={rover.connection}",
        f"--state-basedir={folder}",
    ]
    with (folder / "console.txt").open("w") as console:
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=console, stderr=console, text=True, cwd=folder
        )
    vehicle = rover.vehicle

    def do(text, holds, what):
        process.stdin.write(text + "\n")
        process.stdin.flush()
        assert soon(holds), f"{what}; its console said:\n{(folder / 'console.txt').read_text()[-2000:]}"
        return f"{text.split(str(folder))[0].strip()}: {what}"

    def saved(name, items):
        path = folder / name
        return lambda: path.exists() and len(path.read_text().splitlines()) == len(items) + 1

    try:
        assert soon(lambda: "online system 1" in (folder / "console.txt").read_text()), "it never came online"
        yield do(
            f"wp load {folder}/mission.txt",
            lambda: same(vehicle.mission[1:], MISSION[1:]),
            "the rover holds the mission",
        )
        yield do(f"wp save {folder}/back.txt", saved("back.txt", MISSION), "it read the mission back")
        assert near(places_in(folder / "back.txt")[1:], places(MISSION[1:])), "another mission was read back"
        yield do(
            f"fence load {folder}/fence.txt", lambda: same(vehicle.fence, FENCE), "the rover holds the fence"
        )
        yield do(
            f"fence save {folder}/back-fence.txt", saved("back-fence.txt", FENCE), "it read the fence back"
        )
        assert near(places_in(folder / "back-fence.txt"), places(FENCE)), "another fence was read back"
        yield do("fence clear", lambda: vehicle.fence == (), "the fence is gone")
        yield do("wp clear", lambda: vehicle.mission == (), "the mission is gone")
    finally:
        process.kill()  # asked to end, it waits for its console
        process.wait()
        process.stdin.close()


def mavsdk(python: Path, rover: Simulator, folder: Path):
    """Run MAVSDK step by step; the rover tells what came of it."""
    vehicle = rover.vehicle
    connection = rover.connection.replace("tcp:", "tcpout://")

    def do(step, path):
        done = subprocess.run(
            [str(python), str(HERE / "mavsdk_client.py"), connection, step, str(path)],
            capture_output=True,
            text=True,
            timeout=90,
            check=False,
        )
        assert done.returncode == 0, f"{step}: {done.stdout[-1500:]}{done.stderr[-1500:]}"

    for kind, items in (("mission", MISSION), ("fence", FENCE)):
        path = folder / f"{kind}.json"
        path.write_text(json.dumps(raw(items, mission_type=int(kind == "fence"))))
        do(f"upload-{kind}", path)
        held = vehicle.mission[1:] if kind == "mission" else vehicle.fence
        assert same(held, items[1:] if kind == "mission" else items), f"the rover holds another {kind}"
        yield f"upload: the rover holds the {kind}"
        do(f"download-{kind}", path)
        back = [(item["x"], item["y"]) for item in json.loads(path.read_text())]
        assert back[1:] == places(items)[1:], f"another {kind} was read back"
        yield f"download: it read the {kind} back"
    do("clear-mission", folder / "none")
    assert soon(lambda: len(vehicle.mission) <= 1), "the mission is still there"
    yield "clear: the mission is gone"


def raw(items, mission_type):
    """Give items as MISSION_ITEM_INT has them; MAVSDK wants exactly one to be the current one."""
    return [
        {
            "seq": seq,
            "frame": int(item.frame),
            "command": int(item.command),
            "current": int(seq == 0),
            "autocontinue": 1,
            "param1": item.params[0],
            "param2": item.params[1],
            "param3": item.params[2],
            "param4": item.params[3],
            "x": item.lat_e7,
            "y": item.lon_e7,
            "z": item.alt_m,
            "mission_type": mission_type,
        }
        for seq, item in enumerate(items)
    ]


def places(items):
    return [(item.lat_e7, item.lon_e7) for item in items]


def places_in(path):
    rows = [line.split("\t") for line in path.read_text().splitlines()[1:]]
    return [(round(float(row[8]) * 1e7), round(float(row[9]) * 1e7)) for row in rows]


def same(held, items):
    """Tell whether the rover holds the items; MAVProxy cuts degrees to degE7 instead of rounding them."""
    return near(places(held), places(items))


def near(a, b):
    return len(a) == len(b) and all(
        abs(x - y) <= 1 for one, other in zip(a, b, strict=True) for x, y in zip(one, other, strict=True)
    )


def soon(condition, within_s=60.0):
    until_s = time.monotonic() + within_s
    while time.monotonic() < until_s:
        if condition():
            return True
        time.sleep(0.1)
    return False


if __name__ == "__main__":
    sys.exit(main())
