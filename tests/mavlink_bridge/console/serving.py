"""A console on a stepped bridge, and one on files, as the tests of this room use them."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from director.test_bridge_director import conductor

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.backup.vehicle_mark import VehicleMark
from mavlink_bridge.console.access import Access
from mavlink_bridge.console.app import ConsoleRoutes
from mavlink_bridge.console.backend import FilesBackend
from mavlink_bridge.console.hub import Hub
from mavlink_bridge.console.list_writer import ListWriter
from mavlink_bridge.console.live_desk import LiveDesk
from mavlink_bridge.console.server import Served, open_socket
from mavlink_bridge.console.view.fields import field_sections
from mavlink_bridge.console.view.sections import Permissions, Sections, ServerView
from mavlink_bridge.mavlink.messages import Frame
from missions.formats import read_situation
from missions.geo import LatLon
from missions.request import Tour
from missions.situation import Known, Pose

if TYPE_CHECKING:
    from director.conducting import Conductor

    from mavlink_bridge.console.deeds import Deed

FIELDS = Path(__file__).parents[2] / "fields"
START = LatLon(40.071374, -105.229930)
TARGET = [-105.2290497, 40.0726316]
PAGE = {"x-page-id": "page-of-the-tests"}
OTHER = {"x-page-id": "another-page-here"}


def files_hub(access: Access, can: Permissions | None = None, backend=None) -> Hub:
    """A hub on the maze's file, without a vehicle."""
    situation = read_situation(FIELDS / "maze-fence.waypoints")
    situation = replace(situation, pose=Known(Pose(START), None, "test"))
    request = Tour()
    source = "files" if backend is None else "demo"
    server = ServerView(version="1", run_id="r", source=source, source_name="maze", can=can or Permissions())
    sections = Sections(server=server, **field_sections(situation, request, "file"))
    return Hub(sections, backend or FilesBackend(situation, request), access, time.time)


@contextmanager
def served(can: Permissions | None = None, backend=None, access=None, **more) -> Iterator[tuple[Hub, str]]:
    """A real server on loopback; its hub and its address."""
    listening = open_socket("127.0.0.1", 0)
    port = listening.getsockname()[1]
    access = replace(access, port=port) if access is not None else Access.of("127.0.0.1", port)
    hub = files_hub(access, can, backend)
    with Served(ConsoleRoutes(hub, **more).app(), listening):
        yield hub, f"127.0.0.1:{port}"


@dataclass
class SteppedConsole:
    """The desk of a console on the director's stepped bridge, whose time only passes where a test lets it."""

    folder: Path
    orders: dict = field(default_factory=dict)
    conductor: Callable[..., Conductor] = conductor
    told: list = field(default_factory=list)
    calls: list = field(default_factory=list)

    def __post_init__(self) -> None:
        given = {"confirm": True, "starts_on_word": True, "arm": True, **self.orders}
        self.run = self.conductor(**given)
        self.director = self.run.director
        self.store = BackupStore(self.folder)
        self.writer = ListWriter(self.director, self.store)
        self.desk = LiveDesk(
            self.director,
            self.writer,
            self.store,
            self.vehicle,
            self.note,
            lambda *told: self.told.append(told),
        )
        self.run.meddle = self._beside
        receive = self.director.receive

        def heard(frame, now_s):
            receive(frame, now_s)
            self.writer.receive(frame, now_s)

        self.director.receive = heard

    def vehicle(self) -> VehicleMark | None:
        peer = self.director.peer
        return VehicleMark(peer.system, "0123", "tcp:test", 3) if peer is not None else None

    def note(self, name: str, now_s: float, target: object = None, text: str = "") -> None:
        self.calls.append((name, target, text))

    def _beside(self, run) -> None:
        self.desk.handle_timer(run.now_s)
        self.writer.handle_timer(run.now_s)
        for message in self.writer.messages_to_send():
            run.up.push(Frame(*self.director.identity, message), run.now_s)

    def do(self, deed: Deed, page: str = "page 1") -> str:
        return self.desk.do(deed, page, self.run.now_s)

    def until(self, condition, within_s: float = 60.0) -> None:
        self.run.run_until(condition, within_s)

    def wait(self, seconds: float) -> None:
        until_s = self.run.now_s + seconds
        while self.run.now_s < until_s:
            self.run.step()


def body(answer) -> dict:
    return json.loads(answer.content)
