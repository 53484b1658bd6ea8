"""Foreign clients against the simulated rover: MAVProxy and MAVSDK upload, list and clear missions and fences; MAVProxy beside our bridge.

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
from pathlib import Path

from beside_bridge import beside_bridge
from console import Console, soon
from lists import FENCE, MISSION, places, same, same_in

from mavlink_bridge.simulator import Simulator, SimulatorConfig
from missions.formats.waypoints import format_items

HERE = Path(__file__).parent
PINS = {"mavproxy": "MAVProxy==1.8.75", "mavsdk": "mavsdk==4.1.0"}


def main() -> int:
    """Run all clients."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=HERE.parent.parent / ".foreign")
    options = parser.parse_args()
    failures = 0
    for name, steps in (("mavproxy", mavproxy), ("mavproxy", beside_bridge), ("mavsdk", mavsdk)):
        python = environment(options.folder / name, PINS[name])
        if python is None:
            continue
        with (
            tempfile.TemporaryDirectory() as folder,
            Simulator(SimulatorConfig(parameters={"FENCE_ENABLE": 1.0}), "tcpin:127.0.0.1:0") as rover,
        ):
            try:
                for said in steps(python, rover, Path(folder)):
                    print(f"{PINS[name]}: {said}")
            except AssertionError as error:
                failures += 1
                print(f"{PINS[name]}: FAILED: {error}")
    return 1 if failures else 0


def environment(folder: Path, pin: str) -> Path | None:
    """Return the interpreter of an environment with one package, made if it is not there."""
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
    vehicle = rover.vehicle
    with Console(python, rover.connection, folder) as console:
        yield console.do(
            f"wp load {folder}/mission.txt",
            lambda: same(vehicle.mission[1:], MISSION[1:]),
            "the rover holds the mission",
        )
        path, told = console.save("wp save", "back.txt", len(MISSION))
        assert same_in(path, MISSION), "another mission was read back"
        yield told
        yield console.do(
            f"fence load {folder}/fence.txt", lambda: same(vehicle.fence, FENCE), "the rover holds the fence"
        )
        path, told = console.save("fence save", "back-fence.txt", len(FENCE))
        assert same_in(path, FENCE), "another fence was read back"
        yield told
        yield console.do("fence clear", lambda: vehicle.fence == (), "the fence is gone")
        yield console.do("wp clear", lambda: vehicle.mission == (), "the mission is gone")


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
    do("clear-fence", folder / "none")
    assert soon(lambda: vehicle.fence == ()), "the fence is still there"
    assert same(vehicle.mission[1:], MISSION[1:]), "the mission went with the fence"
    yield "clear: the fence is gone, the mission is not"
    do("clear-mission", folder / "none")
    assert soon(lambda: len(vehicle.mission) <= 1), "the mission is still there"  # it may leave home
    yield "clear: the mission is gone"


def raw(items, mission_type):
    """Return items as MISSION_ITEM_INT has them; MAVSDK wants exactly one to be the current one."""
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


if __name__ == "__main__":
    sys.exit(main())
