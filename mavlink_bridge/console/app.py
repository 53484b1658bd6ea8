"""The ASGI application: routes and the WebSocket, around a `Hub`. What is decided stands in `access`, `control`, `deeds` and `board`."""

from __future__ import annotations

import asyncio
import hashlib
import mimetypes
import re
from collections.abc import Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import msgspec
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.responses import FileResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocketDisconnect, WebSocketState

from mavlink_bridge.console import answers, deeds, reading, wire
from mavlink_bridge.console.access import content_policy
from mavlink_bridge.console.board import Board, Seen
from mavlink_bridge.console.deeds import Refusal
from mavlink_bridge.console.jobs import SupersededError
from mavlink_bridge.console.view.sections import Sections
from mavlink_bridge.console.wire import Failure, Problem, TakenUp, encode
from mavlink_bridge.errors import BridgeError
from missions.errors import MissionError, PlanStoppedError, RequestError
from missions.formats.parts import Part
from missions.situation import Known, Mission, Situation

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Mapping

    from starlette.requests import Request
    from starlette.types import ASGIApp, Message, Receive, Scope, Send
    from starlette.websockets import WebSocket

    from mavlink_bridge.console.answers import Looked
    from mavlink_bridge.console.hub import Hub
    from missions.request import Request as PlanningRequest

BodyT = TypeVar("BodyT")
FoundT = TypeVar("FoundT")

PERIOD_S = 0.1
"""Between two messages to one page: at most 10 a second."""

_ALIVE_S = 1.0  # something comes so often, so that a page knows that it is connected
_SEND_S = 15.0  # a page that takes nothing for so long is gone; chosen, not measured
_FRESH_S = 5.0  # so late a request may come and still change something; chosen: longer than any hitch of a network that can be driven by
_PAGE_ID = re.compile(r"[A-Za-z0-9_-]{8,64}")
_BODY_S = 30.0  # for a request of 4 MB to come: 1.1 Mbit/s; chosen
_JSON = "application/json"
_TYPES = {
    ".mjs": "text/javascript",
    ".js": "text/javascript",
    ".css": "text/css",
    ".html": "text/html",
    ".json": "application/json",
    ".svg": "image/svg+xml",
    ".woff2": "font/woff2",
    ".webmanifest": "application/manifest+json",
    ".wasm": "application/wasm",
    ".pbf": "application/x-protobuf",
    ".md": "text/plain",
    ".txt": "text/plain",
}

_PAGE = "mavlink_bridge.console"


def answer(value: object, status: int = 200) -> Response:
    """Return a JSON answer."""
    return Response(encode(value), status, media_type=_JSON)


def failure(problem: Problem, status: int) -> Response:
    """Return the answer to a request that was not done."""
    return answer(Failure(problem), status)


def problem_of(error: MissionError | BridgeError) -> Problem:
    """Return an error of planning, files or the link as the page gets it."""
    details = dict(error.details)
    advice = str(details.pop("advice", ""))
    plain = {key: value for key, value in details.items() if isinstance(value, str | int | float | bool)}
    return Problem(kind=type(error).__name__, message=str(error), advice=advice, details=plain)


async def _body(request: Request) -> bytes:
    """Return a request's body, if it is not too large.

    Raises
    ------
    Refusal
        It is, or it comes too slowly.
    """
    data = bytearray()
    try:
        async with asyncio.timeout(_BODY_S):
            async for piece in request.stream():
                data += piece
                if len(data) > wire.MOST_BYTES:
                    most = wire.MOST_BYTES // (1024 * 1024)
                    raise Refusal(
                        Problem(kind="too_large", message=f"the request is larger than {most} MB"), 413
                    )
    except TimeoutError:
        raise Refusal(
            Problem(kind="late", message=f"the request took more than {_BODY_S:.0f} s"), 408
        ) from None
    return bytes(data)


async def _typed(request: Request, kind: type[BodyT]) -> BodyT:
    """Return a request's JSON body as its type.

    Raises
    ------
    Refusal
        It is no JSON, or not of that type.
    """
    if request.headers.get("content-type", "").partition(";")[0].strip() != _JSON:
        raise Refusal(Problem(kind="invalid", message="expected a body of application/json"), 415)
    try:
        return msgspec.json.decode(await _body(request), type=kind)
    except (msgspec.ValidationError, msgspec.DecodeError) as error:
        raise Refusal(Problem(kind="invalid", message=f"the request cannot be read: {error}"), 422) from None


def _page_id(given: str | None) -> str:
    """Return the secret id of the page that asks.

    Raises
    ------
    Refusal
        It has none.
    """
    if given is None or not _PAGE_ID.fullmatch(given):
        raise Refusal(
            Problem(kind="invalid", message="expected X-Page-Id, 8 to 64 letters, digits, - or _"), 400
        )
    return given


Handler = Callable[["Request"], Awaitable[Response]]


def _guarded(handler: Handler) -> Handler:
    """Return a handler whose refusals and errors become answers."""

    async def run(request: Request) -> Response:
        try:
            return await handler(request)
        except Refusal as refusal:
            return failure(refusal.problem, refusal.status)
        except (SupersededError, PlanStoppedError):
            return failure(Problem(kind="superseded", message="replaced by a newer request"), 409)
        except (MissionError, BridgeError) as error:
            return failure(problem_of(error), 422)
        except msgspec.ValidationError as error:
            return failure(Problem(kind="invalid", message=f"the request cannot be read: {error}"), 422)
        except Exception as error:  # noqa: BLE001 - the last place where it can be answered
            text = f"{type(error).__name__}: {error}. This is a bug in pbpp"
            return failure(Problem(kind="internal", message=text), 500)

    return run


class ConsoleRoutes:
    """The routes.

    Parameters
    ----------
    hub : Hub
        What they share.
    tiles : Path, optional
        A PMTiles file to serve.
    tiles_origin : str
        Where tiles come from, if not from here.
    """

    def __init__(self, hub: Hub, tiles: Path | None = None, tiles_origin: str = "") -> None:
        self._hub = hub
        self._tiles = tiles
        self._tiles_origin = tiles_origin

    def app(self) -> ASGIApp:
        """Return the ASGI application."""
        hub = self._hub

        @asynccontextmanager
        async def lifespan(_app: Starlette) -> AsyncIterator[None]:
            hub.begin()
            yield

        posts: dict[str, Handler] = {
            "/api/session": self.session,
            "/api/plan": self.plan,
            "/api/plan/cancel": self.cancel,
            "/api/check": self.check,
            "/api/repair": self.repair,
            "/api/widest": self.widest,
            "/api/fence/look": self.look_at_fence,
            "/api/import": self.import_file,
            "/api/export": self.export,
            "/api/convert": self.convert,
            "/api/targets": self.targets,
            "/api/upload": self.upload,
            "/api/start": self.start,
            "/api/resume": self.resume,
            "/api/hold": self.hold,
            "/api/blocked": self.blocked,
            "/api/blocked/clear": self.clear_blocked,
            "/api/backups/restore": self.restore,
            "/api/control/take": self.take_control,
            "/api/control/give": self.give_control,
        }
        gets: dict[str, Handler] = {
            "/api/state": self.state,
            "/api/schema": self.schema,
            "/api/events": self.events,
            "/api/backups": self.backups,
            "/api/after": self.after,
            "/api/replay": self.replay,
            "/api/export": self.export_known,
            "/api/picture.svg": self.picture,
        }
        routes = [
            *(Route(path, _guarded(handler), methods=["POST"]) for path, handler in posts.items()),
            *(Route(path, _guarded(handler), methods=["GET"]) for path, handler in gets.items()),
            WebSocketRoute("/api/live", self.live),
            Route("/map.pmtiles", _guarded(self.map), methods=["GET"]),
            Route("/", self.index, methods=["GET"]),
            Route("/page/{path:path}", self.page, methods=["GET"]),
        ]
        plain = Starlette(routes=routes, lifespan=lifespan, exception_handlers={HTTPException: _not_found})
        return _Gate(plain, hub, self._tiles_origin)

    # The page's own files

    async def index(self, _request: Request) -> Response:
        """Return the page."""
        return self._file("index.html", "")

    async def page(self, request: Request) -> Response:
        """Return one of the page's files."""
        return self._file(request.path_params["path"], request.headers.get("if-none-match", ""))

    def _file(self, name: str, known: str) -> Response:
        root = Path(str(files(_PAGE).joinpath("page"))).resolve()
        try:
            path = (root / name).resolve()
            is_there = path.is_relative_to(root) and path.is_file()
        except (ValueError, OSError):  # no name of a file at all: too long, or with a NUL
            is_there = False
        if not is_there:
            return failure(Problem(kind="not_found", message="there is no such file"), 404)
        data = path.read_bytes()
        tag = f'"{hashlib.blake2s(data, digest_size=12).hexdigest()}"'
        headers = {"etag": tag, "cache-control": "no-cache"}
        if known == tag:
            return Response(status_code=304, headers=headers)
        media = _TYPES.get(path.suffix.lower()) or mimetypes.guess_type(path.name)[0]
        return Response(data, headers=headers, media_type=media or "application/octet-stream")

    async def map(self, _request: Request) -> Response:
        """Return the map's file, or the part of it that is asked for."""
        if self._tiles is None:
            return failure(Problem(kind="not_found", message="no map is served: --map FILE.pmtiles"), 404)
        return FileResponse(self._tiles, media_type="application/vnd.pmtiles")

    async def session(self, request: Request) -> Response:
        """Give a browser that shows the token its cookie."""
        body = await _typed(request, wire.SessionRequest)
        access = self._hub.access
        if access.needs_token and not access.takes_token(body.token):
            await asyncio.sleep(0.5)  # guessing is no use at 128 bits, and slow besides
            return failure(
                Problem(kind="unauthorized", message="the token is not valid for this server"), 401
            )
        done = answer(TakenUp())
        if access.needs_token:
            done.headers["set-cookie"] = access.set_cookie()
        return done

    # What is known

    async def state(self, _request: Request) -> Response:
        """Return all sections, events and the track."""
        board = self._hub.board
        return answer(
            {
                "time_s": self._hub.clock(),
                "state": board.sections,
                "events": board.events,
                "track": board.rows,
            }
        )

    async def schema(self, _request: Request) -> Response:
        """Return the JSON schema of everything."""
        return answer(wire.schema())

    async def events(self, _request: Request) -> Response:
        """Return the newest events."""
        return answer(self._hub.board.events)

    async def backups(self, _request: Request) -> Response:
        """Return the backups that may be put back."""
        return answer(self._hub.backend.backups())

    async def after(self, request: Request) -> Response:
        """Return the newest drive, against what was promised."""
        backend = self._hub.backend
        return answer(
            await self._hub.jobs.run(self._purpose(request, "after"), lambda _stop: backend.after())
        )

    async def replay(self, request: Request) -> Response:
        """Return the sections of a log at a time."""
        try:
            time_s = float(request.query_params.get("time_s", ""))
        except ValueError:
            raise Refusal(
                Problem(kind="invalid", message="expected ?time_s= in seconds since 1970"), 422
            ) from None
        found = self._hub.backend.at(time_s)
        if found is None:
            raise Refusal(Problem(kind="not_here", message="this is not a replay"), 404)
        return answer({**self._hub.board.sections, **found})

    # Looking: nothing changes

    async def plan(self, request: Request) -> Response:
        """Plan what the page asks for."""
        return await self._looked(request, wire.PlanRequest, "plan", answers.look_at_plan)

    async def cancel(self, request: Request) -> Response:
        """Stop planning for this page."""
        for name in ("plan", "check", "widest"):
            self._hub.jobs.cancel(self._purpose(request, name))
        return answer(TakenUp())

    async def check(self, request: Request) -> Response:
        """Check a mission."""
        return await self._looked(request, wire.CheckRequest, "check", answers.look_at_mission)

    async def repair(self, request: Request) -> Response:
        """Repair a mission."""
        return await self._looked(request, wire.CheckRequest, "check", answers.repaired)

    async def widest(self, request: Request) -> Response:
        """Find the most clearance that a route over the targets keeps."""
        return answer(await self._ask(request, wire.PlanRequest, "widest", answers.widest))

    async def look_at_fence(self, request: Request) -> Response:
        """Return what a drawn fence comes to."""
        return answer(await self._ask(request, wire.FenceRequest, "fence", answers.look_at_fence))

    async def _ask(
        self,
        request: Request,
        kind: type[BodyT],
        name: str,
        look: Callable[[BodyT, Situation, PlanningRequest, Callable[[], bool]], FoundT],
    ) -> FoundT:
        """Return the answer to a page's question by what is known now, found beside the loop."""
        body = await _typed(request, kind)
        situation, own = self._hub.backend.situation(), self._hub.backend.request()
        return await self._hub.jobs.run(
            self._purpose(request, name), lambda stop: look(body, situation, own, stop)
        )

    async def _looked(
        self,
        request: Request,
        kind: type[BodyT],
        name: str,
        look: Callable[[BodyT, Situation, PlanningRequest, Callable[[], bool], Callable[[], float]], Looked],
    ) -> Response:
        """Answer with a plan or a check as it is shown, and keep it for what is asked of it later."""
        clock = self._hub.clock
        looked = await self._ask(
            request, kind, name, lambda body, situation, own, stop: look(body, situation, own, stop, clock)
        )
        self._hub.keep(looked)
        return answer(looked.view)

    async def import_file(self, request: Request) -> Response:
        """Return what a file holds that was dropped onto the page."""
        name = request.query_params.get("name", "")
        data = await _body(request)
        situation, own = self._hub.backend.situation(), self._hub.backend.request()

        def read(_stop: Callable[[], bool]) -> wire.Imported:
            return reading.imported(name, reading.read_upload(name, data), situation, own)

        return answer(await self._hub.jobs.run(self._purpose(request, "import"), read))

    async def convert(self, request: Request) -> Response:
        """Return a dropped file in another format."""
        name, to = request.query_params.get("name", ""), request.query_params.get("format", "")
        data = await _body(request)

        def change(_stop: Callable[[], bool]) -> bytes:
            return reading.written(reading.read_upload(name, data), to)[0]

        return _download(await self._hub.jobs.run(self._purpose(request, "convert"), change), "converted", to)

    async def export_known(self, request: Request) -> Response:
        """Return what is known as a file."""
        what, format_ = request.query_params.get("what", "all"), request.query_params.get("format", ".plan")
        body = msgspec.convert({"what": what, "format": format_}, wire.ExportRequest)
        return await self._exported(request, body)

    async def export(self, request: Request) -> Response:
        """Return what the page has as a file."""
        return await self._exported(request, await _typed(request, wire.ExportRequest))

    async def _exported(self, request: Request, body: wire.ExportRequest) -> Response:
        situation = reading.with_fence(self._hub.backend.situation(), body.fence)
        if body.items:
            mission = Mission(tuple(map(reading.item_of, body.items)), _home(situation))
            situation = replace(situation, mission=Known(mission, None, "page"))
        elif body.plan_id:
            situation = self._with_plan(situation, body.plan_id)
        part = None if body.what in ("all", "plan") else Part(body.what)
        data = await self._hub.jobs.run(
            self._purpose(request, "export"), lambda _stop: reading.written(situation, body.format, part)[0]
        )
        return _download(data, body.what if body.what != "all" else "field", body.format)

    def _with_plan(self, situation: Situation, plan_id: str) -> Situation:
        looked = self._hub.looked.get(plan_id)
        if looked is None or not looked.items:
            raise Refusal(Problem(kind="not_found", message="that plan no longer exists: plan again"), 404)
        home = looked.plan.home if looked.plan is not None else None
        start = looked.plan.start if looked.plan is not None else None
        return replace(situation, mission=Known(Mission(looked.items, home or start), None, "page"))

    async def picture(self, request: Request) -> Response:
        """Return a picture of the plan that stands or was looked at last, for browsers that cannot draw it."""
        looked = next(reversed(self._hub.looked.values()), None)
        if looked is None or looked.plan is None:
            raise Refusal(Problem(kind="not_found", message="there is no plan to draw"), 404)
        plan = looked.plan
        data = await self._hub.jobs.run(
            self._purpose(request, "picture"), lambda _stop: reading.picture(plan)
        )
        return Response(data, media_type="image/svg+xml")

    def _purpose(self, request: Request, name: str) -> str:
        return f"{request.headers.get('x-page-id', '')} {name}"

    # Deeds

    async def targets(self, request: Request) -> Response:
        """Give the bridge targets."""
        body = await _typed(request, wire.PlanRequest)
        asked = reading.plan_request(body, self._hub.backend.request())
        if body.fence is not None:
            raise Refusal(Problem(kind="not_now", message="upload the drawn fence first"), 409)
        return await self._do(request, deeds.TakeTargets(asked))

    async def upload(self, request: Request) -> Response:
        """Write a plan or a fence to the vehicle."""
        body = await _typed(request, wire.UploadRequest)
        if (body.fence is None) == (not body.plan_id):
            raise Refusal(Problem(kind="invalid", message="expected plan_id or fence"), 422)
        if body.fence is not None:
            return await self._do(request, deeds.UploadFence(reading.fence_of(body.fence)))
        return await self._do(request, deeds.UploadPlan(body.plan_id, self._hub.looked.get(body.plan_id)))

    async def start(self, request: Request) -> Response:
        """Start the drive."""
        body = await _typed(request, wire.StartRequest)
        return await self._do(request, deeds.Start(body.plan_id))

    async def resume(self, request: Request) -> Response:
        """Go on to the last target."""
        return await self._do(request, deeds.Resume())

    async def hold(self, request: Request) -> Response:
        """Stop the vehicle."""
        return await self._do(request, deeds.Hold())

    async def blocked(self, request: Request) -> Response:
        """Report an obstacle."""
        body = await _typed(request, wire.BlockedRequest)
        if not 0.1 <= body.radius_m <= 100.0:
            raise RequestError("radius_m: expected 0.1 to 100 m", field="radius_m", value=body.radius_m)
        where = reading.position(body.position) if body.position is not None else None
        return await self._do(request, deeds.Blocked(where, body.radius_m))

    async def clear_blocked(self, request: Request) -> Response:
        """Forget the obstacles."""
        return await self._do(request, deeds.ClearBlocked())

    async def restore(self, request: Request) -> Response:
        """Put a backup back."""
        body = await _typed(request, wire.RestoreRequest)
        return await self._do(request, deeds.Restore(body.name))

    async def _do(self, request: Request, deed: deeds.Deed) -> Response:
        page_id = _page_id(request.headers.get("x-page-id"))
        if deed.needs_control:
            self._check_fresh(request)
        return answer(TakenUp(text=await self._hub.do(deed, page_id)), 202)

    def _check_fresh(self, request: Request) -> None:
        """Refuse what a page asked for long ago, or of a server before this one: the network or the browser may keep a request, and send it again.

        Raises
        ------
        Refusal
            It comes late.
        """
        run_id, asked_s = request.headers.get("x-run-id"), request.headers.get("x-asked-s")
        if run_id is not None and run_id != self._hub.board.sections["server"].run_id:
            raise Refusal(Problem(kind="late", message="pbpp was restarted meanwhile: nothing was sent"), 409)
        if asked_s is None:
            return
        try:
            age_s = self._hub.clock() - float(asked_s)
        except ValueError:
            raise Refusal(Problem(kind="invalid", message="expected X-Asked-S in seconds"), 400) from None
        if not age_s <= _FRESH_S:
            message = f"this was asked for {age_s:.0f} s ago: nothing was sent"
            raise Refusal(Problem(kind="late", message=message, advice="ask for it again"), 409)

    async def take_control(self, request: Request) -> Response:
        """Let the page have control."""
        return answer(TakenUp(text=await self._hub.take_control(_page_id(request.headers.get("x-page-id")))))

    async def give_control(self, request: Request) -> Response:
        """Take control back from the page."""
        return answer(TakenUp(text=await self._hub.give_control(_page_id(request.headers.get("x-page-id")))))

    # The WebSocket

    async def live(self, socket: WebSocket) -> None:
        """Show a page everything, and then what changes."""
        try:
            page_id = _page_id(socket.query_params.get("page"))
        except Refusal:
            await socket.close(1008)
            return
        await socket.accept()
        hub = self._hub
        you = hub.control.connect(page_id)
        hub.show_control()
        stream = _PageStream(socket, hub, you)
        listening = asyncio.create_task(stream.listen())
        try:
            await stream.show()
        except (WebSocketDisconnect, TimeoutError, RuntimeError, OSError):
            pass  # the page is gone, or takes nothing: it connects again
        finally:
            listening.cancel()
            with suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
                await listening
            hub.control.disconnect(page_id, hub.clock())
            hub.show_control()
            if socket.client_state is WebSocketState.CONNECTED:
                with suppress(RuntimeError, OSError):
                    await socket.close(1013)


class _PageStream:
    """One page's connection."""

    def __init__(self, socket: WebSocket, hub: Hub, you: str) -> None:
        self._socket = socket
        self._hub = hub
        self._you = you
        self._mark = Seen()
        self._seq = 0
        self._own: Board | None = None  # of a replay: each page sees its own moment
        self._is_gone = asyncio.Event()
        self._sought = asyncio.Event()

    async def listen(self) -> None:
        """Take what the page says: which moment of a replay it wants to see, or nothing."""
        try:
            while True:
                text = await self._socket.receive_text()
                if len(text) > wire.MOST_MESSAGE_BYTES:
                    continue
                with suppress(msgspec.ValidationError, msgspec.DecodeError):
                    self._seek(msgspec.json.decode(text, type=wire.Seek).time_s)
        finally:
            self._is_gone.set()

    def _seek(self, time_s: float) -> None:
        found = self._hub.backend.at(time_s)
        if found is None:
            return
        if self._own is None:
            self._own = Board(Sections(**self._hub.board.sections))
            self._mark = Seen.of_new_board()
        self._own.publish(found)
        self._sought.set()

    async def show(self) -> None:
        """Send everything, then what changes, until the page is gone."""
        first = self._hub.board.news(self._mark)
        await self._send({"type": "snapshot", "you": self._you, **_whole(first)})
        loop = asyncio.get_running_loop()
        sent_s = loop.time()
        while not self._is_gone.is_set():
            news = self._hub.news
            found = self._news()
            if found:
                await self._send({"type": "change", **found})
            elif loop.time() - sent_s >= _ALIVE_S:
                await self._send({"type": "alive"})
            else:
                await self._wait(news, _ALIVE_S - (loop.time() - sent_s))
                continue
            sent_s = loop.time()
            await self._pause(PERIOD_S)

    def _news(self) -> dict[str, Any]:
        """Return what the page has not got yet."""
        if self._own is None:
            return self._hub.board.news(self._mark)
        self._own.publish({"control": self._hub.board.sections["control"]})
        return self._own.news(self._mark)

    async def _wait(self, news: asyncio.Event, for_s: float) -> None:
        """Wait for news, or a time."""
        self._sought.clear()
        waits = [asyncio.ensure_future(event.wait()) for event in (news, self._is_gone, self._sought)]
        try:
            await asyncio.wait(waits, timeout=max(0.0, for_s), return_when=asyncio.FIRST_COMPLETED)
        finally:
            for one in waits:
                one.cancel()

    async def _pause(self, for_s: float) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self._is_gone.wait(), for_s)

    async def _send(self, message: dict[str, Any]) -> None:
        """Send one message; a page that does not take it in time is gone.

        Raises
        ------
        TimeoutError
            It did not.
        """
        whole = {"seq": self._seq, "time_s": self._hub.clock(), **message}
        self._seq += 1
        await asyncio.wait_for(self._socket.send_text(encode(whole).decode()), _SEND_S)


def _whole(first: dict[str, Any]) -> dict[str, Any]:
    """Return the first news as the fields of a snapshot."""
    return {"state": first["state"], "events": first.get("events", ()), "track": first.get("track", ())}


class _Gate:
    """Refuses strangers before anything else is done, and gives every answer its headers.

    Parameters
    ----------
    app : ASGI application
        What stands behind it.
    hub : Hub
    tiles : str
        The origin of the map's tiles, where they are somewhere else.
    """

    def __init__(self, app: ASGIApp, hub: Hub, tiles: str) -> None:
        self._app = app
        self._hub = hub
        self._access = hub.access
        self._tiles = tiles

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = {key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]}
        problem, status = self._access.stranger(headers, is_index=scope["path"] == "/"), 403
        if problem is None and not _is_open(scope["path"]):
            problem, status = self._access.unknown(headers), 401
        if scope["type"] == "websocket":
            if problem is not None:
                await receive()
                await send({"type": "websocket.close", "code": 1008})
                return
            await self._app(scope, receive, send)
            return
        with_headers = self._with_headers(send, headers)
        if problem is not None:
            await failure(problem, status)(scope, receive, with_headers)
            return
        self._hub.control.note_seen(headers.get("x-page-id", ""), self._hub.clock())
        await self._app(scope, receive, with_headers)

    def _with_headers(self, send: Send, headers: Mapping[str, str]) -> Send:
        policy = content_policy(headers.get("host", ""), is_secure=self._access.is_secure, tiles=self._tiles)
        more = [
            (b"content-security-policy", policy.encode("latin-1", "replace")),
            (b"x-content-type-options", b"nosniff"),
            (b"referrer-policy", b"no-referrer"),
            (b"cross-origin-opener-policy", b"same-origin"),
            (b"cross-origin-resource-policy", b"same-origin"),
            (b"permissions-policy", b"geolocation=(self)"),
        ]

        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start":
                known = {key.lower() for key, _ in message["headers"]}
                extra = [] if b"cache-control" in known else [(b"cache-control", b"no-store")]
                message = {**message, "headers": [*message["headers"], *more, *extra]}
            await send(message)

        return sent


def _is_open(path: str) -> bool:
    """Return whether a path is for anybody who may reach the server: the page's own code, which is public, and where the token is shown."""
    return path == "/" or path.startswith("/page/") or path == "/api/session"


async def _not_found(_request: Request, error: Exception) -> Response:
    status = error.status_code if isinstance(error, HTTPException) else 404
    kind, message = ("not_found", "there is no such address") if status == 404 else ("invalid", "not so")
    return failure(Problem(kind=kind, message=message), status)


def _download(data: bytes, name: str, format_: str) -> Response:
    suffix = format_ if format_.startswith(".") else f".{format_}"
    headers = {"content-disposition": f'attachment; filename="{name}{suffix}"'}
    return Response(data, headers=headers, media_type="application/octet-stream")


def _home(situation: Situation) -> Any:  # noqa: ANN401 - a position or None
    return situation.home.value if situation.home else None
