"""The console's shell: the source behind the page, the socket, the printed link, and the end."""

from __future__ import annotations

import contextlib
import sys
import time
import webbrowser
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from secrets import token_hex
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from mavlink_bridge.backup.drive_note import DriveNotes
from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.cli.bridge import BridgeShell, target_sources, teller
from mavlink_bridge.cli.common import inform, warn
from mavlink_bridge.cli.demo import demo_rover
from mavlink_bridge.cli.field_files import read_fence_file
from mavlink_bridge.cli.plan_request import request_from_options
from mavlink_bridge.cli.recording import open_recording
from mavlink_bridge.cli.run_log import RunLog, SafeTeller
from mavlink_bridge.cli.session import signing_of
from mavlink_bridge.cli.terminal import echo, echo_lines, print_json, say
from mavlink_bridge.cli.values import position_from
from mavlink_bridge.cli.vehicle_options import (
    described_vehicle,
    with_description,
    with_home_option,
    with_vehicle,
)
from mavlink_bridge.console.access import Access, is_loopback
from mavlink_bridge.console.app import ConsoleRoutes
from mavlink_bridge.console.backend import FilesBackend
from mavlink_bridge.console.hub import Hub
from mavlink_bridge.console.list_writer import ListWriter
from mavlink_bridge.console.live import LiveBackend, LiveConsole
from mavlink_bridge.console.live_desk import LiveDesk
from mavlink_bridge.console.recorded import RecordedBackend
from mavlink_bridge.console.recording import Recording
from mavlink_bridge.console.server import (
    Certificate,
    Served,
    open_socket,
    own_names,
    page_link,
    qr_code,
)
from mavlink_bridge.console.view.fields import field_sections
from mavlink_bridge.console.view.sections import MapSource, Permissions, Sections, ServerView
from mavlink_bridge.director import Director, Orders, TargetSource
from mavlink_bridge.director.orders import Homing, ObstacleSource
from mavlink_bridge.errors import UsageError
from mavlink_bridge.link import now_s
from missions.formats import FORMATS
from missions.situation import Known, Pose

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from mavlink_bridge.cli.options.serve import ServeOptions
    from mavlink_bridge.console.backend import PageBackend
    from missions.request import Request
    from missions.situation import Situation

_LOOK_S = 0.25  # how soon an interrupt is seen; chosen, not measured
_PLAIN = "on plain HTTP the page is only as safe as the network: use a network of your own, or --tls CERT,KEY"


def serve(options: ServeOptions) -> None:
    """Serve what the options name, until it is interrupted."""
    request = asked(options)
    if options.fence is not None:
        situation = _files(options)
        sections = {**field_sections(situation, request, "file")}
        with served(options, "files", options.fence.name, FilesBackend(situation, request), sections):
            _wait()
        return
    if options.log is not None:
        _served_log(options, options.log, request)
        return
    _served_live(options, request)


def _served_log(options: ServeOptions, log: Path, request: Request) -> None:
    """Serve a replay."""
    orders = Orders(
        system=options.system,
        any_vehicle=options.any_vehicle,
        request=request,
        target_sources=frozenset(TargetSource) - {TargetSource.ECHO, TargetSource.RALLY},
    )
    recording = Recording(log, orders)
    backend = RecordedBackend(recording)
    with served(options, "log", log.name, backend, backend.at(recording.begin_s)) as hub:
        hub.post({}, recording.events, (), recording.track.rows)
        _wait()


def asked(options: ServeOptions) -> Request:
    """Return what is asked of plans where the page says nothing else."""
    plain = request_from_options(None, [], options.clearance, "auto", 0.0, "optimal")
    return replace(
        with_vehicle(plain, options),
        escape=options.escape,
        trusts_model=options.trust_model,
        accepts_less=options.accept_less,
    )


def _files(options: ServeOptions) -> Situation:
    assert options.fence is not None
    situation = with_description(read_fence_file(options.fence, options), described_vehicle(options))
    situation = with_home_option(situation, options.home)
    if options.start is None:
        return situation
    start = position_from("--start", options.start)
    return replace(situation, pose=Known(Pose(start), None, "--start"))


@contextlib.contextmanager
def served(
    options: ServeOptions, source: str, name: str, backend: PageBackend, sections: dict[str, object]
) -> Iterator[Hub]:
    """Serve a backend's page as long as the context lasts, and print where it is."""
    host, port = _listen(options.listen)
    certificate = _certificate(options.tls)
    tiles, map_source, origin = _map(options.map)
    listening = open_socket(host, port)
    access = Access.of(host, listening.getsockname()[1], own_names(), is_secure=certificate is not None)
    server = ServerView(
        version=version("pbpp-rover"),
        run_id=token_hex(8),
        source=source,  # type: ignore[arg-type] # one of its words
        source_name=name,
        can=permissions(options),
        map=map_source,
        reads=tuple(FORMATS),
        writes=tuple(suffix for suffix, one in FORMATS.items() if one.write is not None),
    )
    hub = Hub(Sections(server=server, **sections), backend, access, now_s)  # type: ignore[arg-type]
    with Served(ConsoleRoutes(hub, tiles, origin).app(), listening, certificate):
        _announce(options, access)
        yield hub


def _listen(text: str) -> tuple[str, int | None]:
    """Read HOST:PORT; a port alone is on this computer, a host alone gets a free port."""
    host, colon, port = text.rpartition(":")
    if not colon or text.endswith("]"):
        return ("127.0.0.1", int(text)) if text.isdigit() else (text.strip("[]"), None)
    if ":" in host and not host.startswith("["):
        raise UsageError(f"--listen {text!r}: an IPv6 address stands in brackets: [::1]:8080")
    if not port.isdigit() or int(port) > 65535:
        raise UsageError(f"--listen {text!r}: expected HOST:PORT, with a port of 0 to 65535")
    return host.strip("[]") or "0.0.0.0", int(port)  # noqa: S104 - as the user says


def _certificate(text: str | None) -> Certificate | None:
    if text is None:
        return None
    certificate, comma, key = text.partition(",")
    found = Certificate(Path(certificate), Path(key))
    if not comma or not found.certificate.is_file() or not found.key.is_file():
        raise UsageError(f"--tls {text!r}: expected the files CERT,KEY (PEM)")
    return found


def _map(text: str | None) -> tuple[Path | None, MapSource | None, str]:
    """Return the tiles' file, what the page is told of them, and the origin that its CSP names."""
    if text is None:
        return None, None, ""
    parts = urlsplit(text)
    if parts.scheme in ("http", "https") and parts.hostname:
        port = f":{parts.port}" if parts.port else ""
        return None, MapSource(text), f"{parts.scheme}://{parts.hostname}{port}"
    path = Path(text)
    if not path.is_file():
        raise UsageError(f"--map {text!r}: expected a PMTiles file, or the URL of one")
    return path, MapSource("/map.pmtiles"), ""


def _announce(options: ServeOptions, access: Access) -> None:
    link = page_link(access)
    if options.json_output:
        print_json({"status": "ok", "command": "serve", "url": link})
        sys.stdout.flush()
    else:
        echo(f"Console: {link}")
        if access.needs_token and sys.stdout.isatty():
            echo_lines(qr_code(link).splitlines())
        echo("Stop with Ctrl-C")
        sys.stdout.flush()
    if not is_loopback(access.host) and not access.is_secure:
        warn((_PLAIN,))
    if options.open_browser and not webbrowser.open(link):
        inform(("no browser could be opened",))


def _wait(is_over: Callable[[], bool] = lambda: False) -> None:
    """Wait until Ctrl-C, which is the way to end it."""
    try:
        while not is_over():
            time.sleep(_LOOK_S)
    except KeyboardInterrupt:
        say("stopped")


def _served_live(options: ServeOptions, request: Request) -> None:
    """Serve a live bridge: its loop runs here, the page's in a thread beside it."""
    with contextlib.ExitStack() as stack:
        connection, source, name = options.connect or "", "live", options.connect or ""
        if options.demo:
            rover = demo_rover(options.autopilot or "ardupilot", options.firmware, options.speedup)
            simulator = stack.enter_context(rover)
            connection, source, name = simulator.connection, "demo", "simulated rover"
        orders = _orders(options, request)
        described = described_vehicle(options)
        store = BackupStore()
        notes, troubles = DriveNotes(store.folder).read()
        warn(map(str, troubles))
        director = Director(orders, described, notes)
        log = None
        if options.record is not None:
            part, recorder, journal = open_recording(stack, options.record, orders, described, notes)
            log = RunLog(recorder, journal)
            inform((f"recording to {part}",))
        backend = LiveBackend(director)
        writer = ListWriter(director, store)
        console = LiveConsole(director, writer, backend, request)
        stack.callback(console.close)
        shell = BridgeShell(
            director, connection, SafeTeller(teller(options), lambda: False), None, log, store
        )
        desk = LiveDesk(director, writer, store, shell.vehicle, shell.call, console.note)
        shell.show_on(console, writer)
        hub = stack.enter_context(served(options, source, name, backend, {}))
        console.serve(hub, desk)
        shell.run(signing_of(options.signing_key), options.timeout)


def _orders(options: ServeOptions, request: Request) -> Orders:
    """Return what the director may do: nothing is uploaded, nothing driven without a person's word at the page."""
    can = permissions(options)
    return Orders(
        system=options.system,
        any_vehicle=options.any_vehicle,
        request=request,
        upload=can.upload,
        drive=can.drive,
        arm=can.arm,
        confirm=True,
        starts_on_word=True,
        announce=True,
        target_sources=target_sources(options.target_from),
        obstacle_sources=frozenset({ObstacleSource.KEYBOARD}),
        patience_s=options.timeout,
        homing=Homing(is_kept=True),
    )


def permissions(options: ServeOptions) -> Permissions:
    """Return what the page may do; of a simulated rover everything."""
    if options.demo:
        return Permissions(True, True, True)
    return Permissions(options.upload, options.drive, options.arm)
