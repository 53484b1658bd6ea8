"""The console's page after a long drive: 10,000 s of track at 10 rows a second, then a full stream ten times a second. Memory and main thread.

``python benchmarks/console_page.py`` prints the figures, and exits with 1 where a bound is not kept. A server of its own feeds the real page; Chromium
draws with software WebGL, whose raster runs in another process and is not counted. The time of a frame is all that the page's main thread did between
two frames (bound 30 ms at the 95th percentile). The page's memory is what its own process holds by the kernel's count (PSS: pages shared with other
processes count in parts; bound 200 MB), after the browser was asked to collect what nobody uses; beside it what an empty page takes in the same browser. Linux only.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import os
import shutil
import socket
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import uvicorn
from playwright.sync_api import sync_playwright
from starlette.applications import Starlette
from starlette.requests import Request  # noqa: TC002 - starlette looks at the names
from starlette.responses import FileResponse, JSONResponse
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

import mavlink_bridge

if TYPE_CHECKING:
    from playwright.sync_api import Browser

PAGE = Path(mavlink_bridge.__file__).parent / "console" / "page"
RATE_HZ = 10
HOME = (-105.23, 40.07)
SWITCHES = (
    "--no-sandbox",
    "--enable-unsafe-swiftshader",
    "--use-angle=swiftshader",
    "--ignore-gpu-blocklist",
)
NAMES = ("chromium", "chromium-browser", "google-chrome")


def row(i: int) -> list[float]:
    """Return a row of a drive in ever new loops over 300 m of field: nothing that thins out by itself."""
    angle = i / 90
    radius_m = 60 + 90 * abs(math.sin(i / 5000))
    east_m, north_m = radius_m * math.sin(angle), radius_m * math.cos(1.01 * angle)
    return [i / RATE_HZ, HOME[0] + east_m / 85_000, HOME[1] + north_m / 111_000, 2.0, 10]


def sections(i: int) -> dict[str, Any]:
    """Return what changes with each message of a full stream."""
    _, lon, lat, speed, mode = row(i)
    return {
        "link": {"state": "ok", "heard_s": i / RATE_HZ, "heartbeats_missed_percent": 0.0, "rate_hz": 40.0, "trouble": ""},
        "vehicle": {
            "system": 1, "autopilot": "ArduPilot", "firmware": "4.6.3", "mode": mode, "mode_text": "AUTO", "armed": True,
            "position": [lon, lat], "position_s": i / RATE_HZ, "heading_deg": i % 360, "speed_mps": speed, "fix_kind": 6,
            "fix_text": "RTK fixed", "fix_error_m": 0.02, "satellites": 20, "battery_percent": 80, "battery_v": 24.8,
            "footprint": {"length_m": 1.2, "width_m": 0.8, "gps_forward_m": 0.0, "gps_right_m": 0.0}, "most_items": 700,
        },
        "drive": {
            "state": "driving", "state_text": "driving", "since_s": 0.0, "awaits_start": False, "plan_id": "", "can_resume": False,
            "trouble": "", "way_home": "", "is_driving": True, "begun_s": 0.0, "next_seq": 2, "progress_m": i % 1000, "length_m": 1000.0,
            "left_m": 1000 - i % 1000, "eta_s": 100.0, "driven_m": 100.0, "deviation_m": 0.1, "corridor_ok": True,
            "least_clearance_m": 2.5, "least_at": [lon, lat], "asked_m": 2.0, "breaches": 0,
        },
    }  # fmt: skip


def snapshot() -> dict[str, Any]:
    """Return the first message: a field with a fence of 200 corners."""
    ring = [
        [HOME[0] + 200 * math.sin(a) / 85_000, HOME[1] + 200 * math.cos(a) / 111_000]
        for a in np.linspace(0, 2 * math.pi, 201)
    ]
    zone = {
        "type": "Feature", "geometry": {"type": "Polygon", "coordinates": [ring]},
        "properties": {"index": 0, "name": "inclusion polygon 1", "kind": "inclusion", "shape": "polygon", "radius_m": None, "centre": None},
    }  # fmt: skip
    area = {"type": "MultiPolygon", "coordinates": [[ring]]}
    meant = {
        "free": area,
        "margin": area,
        "margin_m": 2.0,
        "union": False,
        "home_circle": None,
        "is_bounded": True,
    }
    return {
        "server": {"version": "0", "run_id": "1", "source": "live", "source_name": "benchmark", "map": None, "reads": [], "writes": [],
                   "can": {"upload": True, "drive": True, "arm": True}},
        "control": {"holder": None, "since_s": None, "is_away": False, "pages": ["page 1"]},
        "fence": {"id": "1", "held": {"type": "FeatureCollection", "features": [zone]}, "return_point": None, "meant": meant, "obstacles": [],
                  "where": "vehicle", "source": "vehicle", "enabled": True, "time_s": 0, "trouble": "", "warnings": []},
        "rally": [], "home": list(HOME), "request": {"targets": [], "clearance_m": None, "widest": False, "order": "given", "end": "hold",
                                                     "comes_back": False, "speed_mps": None, "reserve_m": 0},
        "plan": None, "mission": None, "hold": {"state": "none", "text": "", "by": "", "asked_s": None, "answered_s": None},
        "upload": None, "replay": None, **sections(0),
    }  # fmt: skip


class Feed:
    """The server's side of the live messages."""

    def __init__(self, seconds: int, live_s: int) -> None:
        self.rows = seconds * RATE_HZ
        self.live = live_s * RATE_HZ
        self.is_fed = threading.Event()

    async def run(self, socket_: WebSocket) -> None:
        """Feed all but the newest part quickly, the rest as it would come."""
        await socket_.accept()
        message = {
            "type": "snapshot",
            "seq": 0,
            "you": "page 1",
            "time_s": 0,
            "state": snapshot(),
            "events": [],
            "track": [],
        }
        await socket_.send_text(json.dumps(message))
        begin, seq = 0, 0
        while begin < self.rows + self.live:
            is_live = begin >= self.rows
            count = 1 if is_live else 500
            end = begin + count
            seq += 1
            change = {"type": "change", "seq": seq, "time_s": end / RATE_HZ, "state": sections(end), "events": [],
                      "track": [row(i) for i in range(begin, end)], "track_anew": False, "events_anew": False}  # fmt: skip
            try:
                await socket_.send_text(json.dumps(change))
            except WebSocketDisconnect:
                return
            begin = end
            if is_live:
                self.is_fed.set()
            await asyncio.sleep(1 / RATE_HZ if is_live else 0.03)
        await asyncio.sleep(60)


def serve(feed: Feed) -> int:
    """Serve page and feed in a thread; return the port."""

    async def live(socket_: WebSocket) -> None:
        await feed.run(socket_)

    async def index(_request: Request) -> FileResponse:
        return FileResponse(PAGE / "index.html")

    async def nothing(_request: Request) -> JSONResponse:
        return JSONResponse([])

    routes = [
        Route("/", index), WebSocketRoute("/api/live", live), Route("/api/backups", nothing), Mount("/page", StaticFiles(directory=PAGE)),
    ]  # fmt: skip
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    config = uvicorn.Config(Starlette(routes=routes), host="127.0.0.1", port=port, log_level="error")
    threading.Thread(target=uvicorn.Server(config).run, daemon=True).start()
    time.sleep(1)
    return port


def frames_ms(trace: Path) -> list[float]:
    """Return what the page's main thread did between two frames of the page, milliseconds each, from a trace."""
    events = json.loads(trace.read_text(encoding="utf-8"))["traceEvents"]
    names = {
        (one["pid"], one["tid"]): one["args"]["name"] for one in events if one.get("name") == "thread_name"
    }
    frames = [
        one
        for one in events
        if one.get("name") == "FireAnimationFrame" and names.get((one["pid"], one["tid"])) == "CrRendererMain"
    ]
    thread = (frames[0]["pid"], frames[0]["tid"])
    tasks = sorted(
        (one["ts"], one.get("tdur", 0), one.get("dur", 0))
        for one in events
        if one.get("name") == "RunTask" and (one["pid"], one["tid"]) == thread
    )
    # A frame calls back whoever asked for it, one after the other in one task: that task's begin is where the frame begins.
    called = np.array(sorted(one["ts"] for one in frames))
    marks = np.array(
        [ts for ts, _, dur in tasks if np.searchsorted(called, ts) < np.searchsorted(called, ts + dur)]
    )
    sums = np.zeros(len(marks) + 1)
    for ts, tdur, _ in tasks:
        sums[np.searchsorted(marks, ts, side="right")] += tdur / 1000
    return sums[1:-1].tolist()


def renderers_mb(browser: Browser) -> dict[int, float]:
    """Return the memory of each of the browser's page processes, by its number."""
    session = browser.new_browser_cdp_session()
    found = session.send("SystemInfo.getProcessInfo")["processInfo"]
    session.detach()
    return {one["id"]: pss_mb(one["id"]) for one in found if one["type"] == "renderer"}


def pss_mb(pid: int) -> float:
    """Return what a process holds, its share of what it shares with others counted."""
    text = Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii")
    return next(int(line.split()[1]) for line in text.splitlines() if line.startswith("Pss:")) * 1024 / 1e6


def main() -> int:
    """Feed, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=10_000, help="of track")
    parser.add_argument("--live", type=int, default=20, help="seconds that are measured")
    arguments = parser.parse_args()
    feed = Feed(arguments.seconds, arguments.live + 15)
    port = serve(feed)
    chromium = os.environ.get("PBPP_CHROMIUM") or next(filter(None, map(shutil.which, NAMES)))
    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(SWITCHES))
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(f"http://127.0.0.1:{port}/page/icon.svg")
        page.wait_for_timeout(1000)
        empty_mb = max(renderers_mb(browser).values())
        page.goto(f"http://127.0.0.1:{port}/")
        assert feed.is_fed.wait(120), "the page took the feed too slowly"
        page.wait_for_timeout(3000)
        fed_mb = max(renderers_mb(browser).values())
        trace = Path(folder) / "trace.json"
        browser.start_tracing(
            page=page, path=trace, categories=["devtools.timeline", "disabled-by-default-devtools.timeline"]
        )
        page.wait_for_timeout(arguments.live * 1000)
        browser.stop_tracing()
        client = page.context.new_cdp_session(page)
        client.send("HeapProfiler.collectGarbage")
        client.send("Performance.enable")
        page.wait_for_timeout(1000)
        whole_mb = max(renderers_mb(browser).values())
        metrics = {one["name"]: one["value"] for one in client.send("Performance.getMetrics")["metrics"]}
        sizes_ms = np.array(frames_ms(trace))
        version = browser.version
        browser.close()
    print(
        f"{arguments.seconds} s of track, Chromium {version}: main thread {np.percentile(sizes_ms, 50):.1f} ms median, "
        f"{np.percentile(sizes_ms, 95):.1f} ms p95, {sizes_ms.max():.1f} ms at the most a frame ({len(sizes_ms)} frames in "
        f"{arguments.live} s, bound 30 at p95); JS heap {metrics['JSHeapUsedSize'] / 1e6:.0f} MB\n"
        f"the page's process: {fed_mb:.0f} MB while it is fed, {whole_mb:.0f} MB at the end (bound 200); with an empty page {empty_mb:.0f} MB"
    )
    return 0 if np.percentile(sizes_ms, 95) <= 30.0 and max(fed_mb, whole_mb) <= 200.0 else 1


if __name__ == "__main__":
    sys.exit(main())
