"""What `pbpp serve` costs over `pbpp bridge`, and whether pages hold the bridge up: against the simulated rover over TCP, in real time.

Run ``python benchmarks/console.py`` (about two minutes); ``--seconds`` sets how long each stream is watched. It exits with 1 where a bound is not kept.

- Fifteen message types at 10 Hz each: CPU time of `pbpp serve` with one page, as a multiple of `pbpp bridge` in the same minute (bound 3).
- The same stream with 20 WebSocket clients, of which 10 take nothing: once a second the bridge is sent a command that it has to deny; the time to its
  COMMAND_ACK, less the median of `pbpp bridge`, is how much later it decides (bound 50 ms in the middle).
"""

from __future__ import annotations

import argparse
import os
import platform
import socket
import statistics
import subprocess
import sys
import time
from contextlib import ExitStack
from datetime import UTC, datetime

from bridge import Bridge, Flood, config, wait_for

from mavlink_bridge.simulator import Simulator

PAGE_HZ = 10.0
_READER = """
import sys
from websockets.sync.client import connect
with connect(f"ws://{sys.argv[1]}/api/live?page={sys.argv[2]}", ping_interval=None) as socket:
    for message in socket:
        pass
"""


def watched(name: str, seconds: float, reading: int = 0, stuck: int = 0) -> tuple[float, list[float]]:
    """Return the share of one core and the lags in s of a command under the stream, with so many pages that read and that take nothing."""
    with ExitStack() as stack:
        simulator = stack.enter_context(Simulator(config("maze")))
        flood = stack.enter_context(Flood(simulator, PAGE_HZ))
        bridge = stack.enter_context(Bridge(flood.connection, name=name))
        bridge.await_event("learnt", 120.0)
        if reading or stuck:
            wait_for(lambda: any("url" in one for one in bridge.events), 60, "the page's address")
            address = next(one["url"] for one in bridge.events if "url" in one).split("/")[2]
            for number in range(reading):
                command = [sys.executable, "-c", _READER, address, f"reading-page-{number}"]
                client = stack.enter_context(subprocess.Popen(command))
                stack.callback(client.kill)
            for number in range(stuck):
                stack.enter_context(take_nothing(address, number))
        time.sleep(3.0)
        begun_s, cpu_s, flood.is_on = time.monotonic(), bridge.cpu_s(), True
        time.sleep(seconds)
        took_s = time.monotonic() - begun_s
        return (bridge.cpu_s() - cpu_s) / took_s, sorted(flood.lags)


def take_nothing(address: str, number: int) -> socket.socket:
    """Return a WebSocket that was asked for and is never read."""
    host, port = address.split(":")
    one = socket.create_connection((host, int(port)))
    one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
    one.sendall(
        f"GET /api/live?page=stuck-page-{number} HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    return one


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=30.0, help="how long each stream is watched")
    seconds = parser.parse_args().seconds
    print(
        f"{datetime.now(UTC):%Y-%m-%d}, Python {platform.python_version()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
    )
    alone, lags = watched("bridge", seconds)
    page, _ = watched("serve", seconds, reading=1)
    crowd, late = watched("serve", seconds, reading=10, stuck=10)
    ratio = page / alone
    later_s = statistics.median(late) - statistics.median(lags)
    kept = [ratio <= 3.0, later_s <= 0.05]
    print(f"pbpp bridge: {alone:.1%} of one core; lag {statistics.median(lags) * 1000:.0f} ms in the middle")
    print(f"pbpp serve, one page: {page:.1%}, {ratio:.2f} times as much (bound 3)")
    print(
        f"pbpp serve, 20 pages, 10 of them stuck: {crowd:.1%}; lag {statistics.median(late) * 1000:.0f} ms in the middle, {late[-1] * 1000:.0f} ms at most of "
        f"{len(late)}: {later_s * 1000:.0f} ms later (bound 50)"
    )
    return 0 if all(kept) else 1


if __name__ == "__main__":
    sys.exit(main())
