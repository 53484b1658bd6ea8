"""`pbpp serve` as a process: the bridge behind a real page's requests, killed and started anew; what needs no web library loads none."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, contextmanager

import httpx
import pytest
from processes import APART, end
from typer.testing import CliRunner
from websockets.sync.client import connect

from mavlink_bridge.cli.app import app
from mavlink_bridge.simulator import Simulator, SimulatorConfig
from missions.fence import fence_to_items
from missions.formats import read_fence

from console.serving import FIELDS, PAGE, START, TARGET  # isort: skip


@contextmanager
def serving(folder, *options: str, full: bool = False):
    """A `pbpp serve` process, and its address, or its full link."""
    environment = {**os.environ, "XDG_STATE_HOME": str(folder), "PYTHONUNBUFFERED": "1"}
    command = [sys.executable, "-m", "mavlink_bridge.cli", "serve", "--json", *options]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment, **APART
    )
    try:
        first = json.loads(process.stdout.readline())
        reader = threading.Thread(target=process.stdout.read, daemon=True)
        reader.start()
        yield process, first["url"] if full else first["url"].split("/")[2]
    finally:
        end(process)
        process.wait(60)
        reader.join(60)
        process.stdout.close()


class Page:
    """What a page has been shown."""

    def __init__(self, address: str) -> None:
        self.state: dict = {}
        self.events: list = []
        self._stack = ExitStack()
        self._socket = self._stack.enter_context(
            connect(f"ws://{address}/api/live?page={PAGE['x-page-id']}", ping_interval=None)
        )
        self.client = httpx.Client(base_url=f"http://{address}", headers=PAGE, timeout=60)

    def until(self, condition, within_s: float = 120.0):
        """Read until something is so."""
        until_s = time.monotonic() + within_s
        while not self.state or not condition(self.state):
            assert time.monotonic() < until_s, (self.state.get("drive"), [one["text"] for one in self.events])
            message = json.loads(self._socket.recv(60))
            self.state.update(message.get("state", {}))
            self.events += message.get("events", ())
        return self.state

    def post(self, path: str, **body):
        found = self.client.post(f"/api/{path}", json=body)
        assert found.status_code in (200, 202), found.text
        return found.json()

    def die(self) -> None:
        """End without a word, as a browser that is killed."""
        self._socket.socket.shutdown(socket.SHUT_RDWR)
        self._stack.close()
        self.client.close()


@pytest.fixture
def rover():
    fence = fence_to_items(read_fence(FIELDS / "maze-fence.waypoints"))
    parameters = {
        "FENCE_ENABLE": 1.0,
        "WP_RADIUS": 2.0,
        "WP_SPEED": 1.5,
    }  # it drives long enough for a busy computer to start a server
    config = SimulatorConfig(home=START, fence=fence, parameters=parameters, uid=bytes(range(12)))
    with Simulator(config, "tcpin:127.0.0.1:0") as simulator:
        yield simulator


def drive_of(state) -> str:
    return state["drive"]["state"]


def test_a_page_that_dies_and_a_server_that_is_killed_change_nothing_for_the_vehicle(tmp_path, rover):
    options = ("--connect", rover.connection, "--upload", "--drive", "--arm", "--listen", "127.0.0.1:0")
    with serving(tmp_path, *options) as (process, address):
        page = Page(address)
        page.until(lambda state: drive_of(state) == "ready" and state["fence"]["meant"])
        plan = page.post("plan", targets=[TARGET], clearance_m=2.5)
        page.post("upload", plan_id=plan["id"])
        page.die()  # in the middle of the upload, or just before
        page = Page(address)  # loaded again
        state = page.until(lambda state: drive_of(state) == "verified")
        assert state["control"]["holder"] == "page 1"
        page.post("start", plan_id=state["drive"]["plan_id"])
        page.until(lambda state: drive_of(state) == "driving" and state["drive"]["progress_m"] > 2.0)
        page.die()
        process.kill()  # nobody is told
    with serving(tmp_path, *options) as (_, address):
        page = Page(address)
        page.until(lambda state: drive_of(state) == "driving")  # adopted
        assert page.post("hold")["text"]
        state = page.until(lambda state: state["hold"]["state"] == "stopped")
        assert (state["vehicle"]["mode_text"], drive_of(state)) == ("HOLD", "let_go")
        assert rover.vehicle.breaches == 0
        assert page.client.get("/api/after").json() is None
        page.die()


WEB = ("starlette", "uvicorn", "websockets", "msgspec", "segno", "httpx")


@pytest.mark.parametrize(
    "statement",
    [
        "import mavlink_bridge.console.view.plans, mavlink_bridge.console.view.drives, mavlink_bridge.console.view.instruments",
        "import mavlink_bridge.cli.plan, mavlink_bridge.cli.serve, mavlink_bridge.cli.bridge",
    ],
)
def test_what_is_shown_and_other_commands_load_no_web_library(statement):
    code = f"import sys; {statement}; print([one for one in {WEB} if one in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_a_field_is_served_beyond_loopback_with_a_token_and_a_map(tmp_path):
    tiles = tmp_path / "field.pmtiles"
    tiles.write_bytes(b"PMTiles")
    options = ("--fence", str(FIELDS / "maze-fence.waypoints"), "--map", str(tiles), "--listen", "0.0.0.0:0")
    with serving(tmp_path, *options, full=True) as (_, link):
        address, token = link.split("/")[2], link.rpartition("=")[2]
        with httpx.Client(base_url=f"http://{address}", timeout=60) as client:
            assert client.get("/api/state").status_code == 401
            assert client.post("/api/session", json={"token": token}).status_code == 200
            state = client.get("/api/state").json()["state"]
            assert state["server"]["map"]["url"] == "/map.pmtiles"
            assert state["server"]["can"] == {"upload": False, "drive": False, "arm": False}
            assert client.get("/map.pmtiles").content == b"PMTiles"


def test_one_command_shows_everything(tmp_path):
    with serving(tmp_path, "--demo", "--listen", "127.0.0.1:0", "--record", str(tmp_path / "run.tlog")) as (
        _,
        address,
    ):
        page = Page(address)
        state = page.until(lambda state: drive_of(state) == "ready" and state["fence"]["meant"])
        assert state["server"]["source"] == "demo"
        assert state["server"]["can"] == {"upload": True, "drive": True, "arm": True}
        assert len(state["fence"]["held"]["features"]) == 9
        page.post("targets", targets=[TARGET], clearance_m=2.5)
        page.until(lambda state: state["drive"]["awaits_upload"])
        page.die()
    journal = (tmp_path / "run.journal.jsonl").read_text(encoding="utf-8")
    assert '"call": "request"' in journal


@pytest.mark.parametrize("firmware", ["1.17", "1.18"])
def test_the_demonstration_of_a_px4_rover(tmp_path, firmware):
    options = ("--demo", "--autopilot", "px4", "--firmware", firmware, "--listen", "127.0.0.1:0")
    with serving(tmp_path, *options) as (_, address):
        page = Page(address)
        state = page.until(lambda state: drive_of(state) == "ready" and state["fence"]["meant"])
        assert state["server"]["can"] == {"upload": True, "drive": True, "arm": True}
        assert state["vehicle"]["autopilot"] == "PX4"
        assert state["vehicle"]["firmware"].startswith(firmware)
        page.post("targets", targets=[TARGET], clearance_m=2.5)
        page.until(lambda state: state["drive"]["awaits_upload"])
        page.die()


def test_the_autopilot_of_a_demonstration_alone_is_chosen(tmp_path):
    result = CliRunner().invoke(
        app, ["serve", "--autopilot", "px4", "--fence", str(FIELDS / "maze-fence.waypoints")]
    )
    assert result.exit_code == 2
    assert "--autopilot goes with --demo" in result.output
