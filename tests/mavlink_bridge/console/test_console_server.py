"""The server on loopback, as browsers and strangers meet it: routes, refusals, headers, streams."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
import time
from contextlib import suppress
from dataclasses import replace

import httpx
import jsonschema
import pytest
import shapely
from console.serving import FIELDS, OTHER, PAGE, TARGET, files_hub, served
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from mavlink_bridge.console import app as app_module
from mavlink_bridge.console import server, wire
from mavlink_bridge.console.access import Access
from mavlink_bridge.console.deeds import Refusal, not_now
from mavlink_bridge.console.server import open_socket, page_link, qr_code
from mavlink_bridge.console.view.sections import EventView, Permissions, VehicleView
from mavlink_bridge.errors import LinkError
from missions.formats import read_fence
from missions.routing.promised_route import PromisedRoute

MARKUP = "<img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def console():
    with served() as (hub, address), httpx.Client(base_url=f"http://{address}", timeout=60) as client:
        yield hub, address, client


@pytest.fixture
def client(console):
    return console[2]


def schema_of(name: str) -> dict:
    whole = wire.schema()
    return {"$defs": whole["$defs"], "$ref": f"#/$defs/{name}"}


def asked(**more) -> dict:
    return {"targets": [TARGET], "clearance_m": 2.5, **more}


# The page


def test_the_page_comes_with_a_policy_that_lets_nothing_foreign_in(client):
    found = client.get("/")
    assert found.status_code == 200
    assert found.headers["content-type"].startswith("text/html")
    policy = found.headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert found.headers["x-content-type-options"] == "nosniff"
    assert found.headers["cache-control"] == "no-cache"
    again = client.get("/page/index.html", headers={"if-none-match": found.headers["etag"]})
    assert again.status_code == 304


@pytest.mark.parametrize(
    "path", ["/page/../app.py", "/page/..%2fapp.py", "/page/%2e%2e/wire.py", "/page/", "/page/none.js"]
)
def test_nothing_but_the_page_is_read_from_the_disk(client, path):
    found = client.get(path)
    assert found.status_code == 404
    assert "import" not in found.text


def test_unknown_addresses_and_methods_answer_as_json(client):
    assert client.get("/api/none").json()["error"]["kind"] == "not_found"
    assert client.get("/api/plan").status_code == 405


# Looking


def test_a_plan_is_answered_as_the_schema_says_and_keeps_its_clearance(client):
    found = client.post("/api/plan", json=asked()).json()
    jsonschema.validate(found, schema_of("PlanView"))
    assert found["state"] == "planned"
    assert found["promised_m"] >= 2.5
    assert {leg["verdict"] for leg in found["legs"]} == {"keeps"}
    # Independently of the code under test: the drawn line against the fence, in degrees made metres.
    fence = read_fence(FIELDS / "maze-fence.waypoints")
    scale = (85_300.0, 111_030.0)  # metres a degree at 40.07° north, east and north

    def flat(places):
        return [(lon * scale[0], lat * scale[1]) for lon, lat in places]

    zones = [one for one in fence.zones if hasattr(one, "vertices")]
    edges = [shapely.LinearRing(flat((at.lon_deg, at.lat_deg) for at in one.vertices)) for one in zones]
    line = shapely.LineString(flat(point["at"] for point in found["points"]))
    assert min(edge.distance(line) for edge in edges) >= 2.5
    lengths = [math_length(flat(point["at"] for point in found["points"]))]
    assert lengths[0] == pytest.approx(found["length_m"], rel=2e-3)
    assert found["profile"][-1]["s_m"] == pytest.approx(found["length_m"], abs=0.05)
    least = min(sample["clearance_m"] for sample in found["profile"])
    assert found["driven_m"] - 0.02 <= least <= found["drawn_m"] + 0.5


def math_length(points) -> float:
    return shapely.LineString(points).length


def test_no_route_is_an_answer_with_the_widest_one_and_what_blocks_it(client):
    found = client.post("/api/plan", json=asked(clearance_m=9.0)).json()
    jsonschema.validate(found, schema_of("PlanView"))
    why = found["no_route"]
    assert (found["state"], why["kind"]) == ("no_route", "NoRouteError")
    assert 7.0 < why["widest"]["clearance_m"] < 9.0
    assert [one["name"] for one in why["blockers"]] == list(why["widest"]["between"])
    assert why["widest"]["path"]["coordinates"][-1] == pytest.approx(TARGET, abs=1e-6)
    assert why["at"] == why["widest"]["at"]


def test_too_much_clearance_is_refused_without_looking_for_the_widest_that_can_be_driven(client, monkeypatch):
    driven = client.post("/api/plan", json=asked(clearance_m=None, widest=True)).json()["promised_m"]
    monkeypatch.setattr(PromisedRoute, "widest", None)
    for clearance_m in (driven + 0.3, 9.0, 40.0):
        why = client.post("/api/plan", json=asked(clearance_m=clearance_m)).json()["no_route"]
        assert why["widest"]["clearance_m"] > driven
        assert not why["widest"]["is_driven"]
        assert "along straight legs" in why["message"]


def test_planning_that_takes_a_while_is_cancelled_in_the_midst_of_it(console):
    hub, address, client = console
    answers: list[httpx.Response] = []

    def plan() -> None:
        with httpx.Client(base_url=f"http://{address}", timeout=60) as page:
            answers.append(page.post("/api/plan", json=asked(clearance_m=None, widest=True), headers=PAGE))

    thread = threading.Thread(target=plan)
    thread.start()
    until_s = time.monotonic() + 100
    while not hub.jobs._newest and time.monotonic() < until_s:
        time.sleep(0.002)
    assert client.post("/api/plan/cancel", json={}, headers=PAGE).status_code == 200
    thread.join(100)
    assert (answers[0].status_code, answers[0].json()["error"]["kind"]) == (409, "superseded")


def test_a_dragged_way_point_breaks_the_promise_at_once(client):
    route = client.post("/api/plan", json=asked()).json()
    points = [point["at"] for point in route["points"][1:]]
    start = route["points"][0]["at"]
    good = client.post("/api/check", json={"points": points, "start": start, "clearance_m": 2.5}).json()
    assert good["is_promised"]
    points[1] = [points[1][0] - 3e-4, points[1][1] + 3e-4]
    bad = client.post("/api/check", json={"points": points, "start": start, "clearance_m": 2.5}).json()
    jsonschema.validate(bad, schema_of("PlanView"))
    assert not bad["is_promised"]
    assert "breaks" in {leg["verdict"] for leg in bad["legs"]}
    mended = client.post("/api/repair", json={"points": points, "start": start, "clearance_m": 2.5}).json()
    assert mended["state"] == "repaired"
    assert "breaks" not in {leg["verdict"] for leg in mended["legs"]}


def test_a_drawn_fence_is_looked_at_and_planned_round(client):
    held = client.get("/api/state").json()["state"]["fence"]["held"]
    circle = {
        "type": "Feature",
        "properties": {
            "kind": "exclusion",
            "shape": "circle",
            "radius_m": 4.0,
            "centre": [-105.2297, 40.0718],
        },
    }
    drawn = {"type": "FeatureCollection", "features": [*held["features"], circle]}
    looked = client.post("/api/fence/look", json={"fence": drawn}).json()
    jsonschema.validate(looked, schema_of("FenceView"))
    assert len(looked["held"]["features"]) == len(held["features"]) + 1
    assert looked["where"] == "drawn"
    assert client.post("/api/plan", json=asked(fence=drawn)).json()["state"] == "planned"
    drawn["features"][-1] = {
        "properties": {"kind": "exclusion"},
        "geometry": {"coordinates": [[[0, 0], [1, 1]]]},
    }
    half = client.post("/api/fence/look", json={"fence": drawn})
    assert half.status_code == 200
    assert "at least 3 corners" in half.json()["trouble"]
    assert len(half.json()["held"]["features"]) == len(held["features"])


def test_the_sliders_end_is_where_routes_end(client):
    widest = client.post("/api/widest", json=asked()).json()
    assert len(widest["between"]) == 2
    assert client.post("/api/plan", json=asked(clearance_m=widest["clearance_m"] + 0.1)).json()["no_route"]
    blocked = client.post("/api/widest", json={"targets": [[0.0, 0.0]]})
    assert (blocked.status_code, blocked.json()["clearance_m"]) == (200, None)
    assert blocked.json()["trouble"]


def test_files_go_in_and_out(client):
    data = (FIELDS / "maze-fence.waypoints").read_bytes()
    held = client.post("/api/import", params={"name": "maze.waypoints"}, content=data).json()
    jsonschema.validate(held, schema_of("Imported"))
    assert held["parts"] == ["fence"]
    assert held["fence"]["where"] == "file"
    kml = client.post("/api/convert", params={"name": "a.waypoints", "format": ".kml"}, content=data)
    assert kml.content.startswith(b"<?xml")
    plan = client.post("/api/plan", json=asked()).json()
    out = client.post("/api/export", json={"format": ".plan", "plan_id": plan["id"]})
    assert out.headers["content-disposition"] == 'attachment; filename="field.plan"'
    assert len(json.loads(out.content)["mission"]["items"]) == plan["items"] - 1
    assert client.get("/api/export", params={"what": "fence", "format": ".geojson"}).status_code == 200
    bad = client.post("/api/import", params={"name": f"{MARKUP}.plan"}, content=b"{")
    assert bad.status_code == 422
    assert "pbpp-" not in bad.json()["error"]["message"]  # no path of this computer
    assert bad.headers["content-type"] == "application/json"
    lost = client.post("/api/import", params={"name": "../../etc/passwd"}, content=b"x")
    assert lost.json()["error"]["kind"] == "MissionFormatError"


def test_a_picture_for_who_cannot_draw(client):
    client.post("/api/plan", json=asked())
    found = client.get("/api/picture.svg")
    assert found.headers["content-type"].startswith("image/svg")
    assert b"<svg" in found.content


@pytest.mark.parametrize(
    ("path", "given", "status"),
    [
        ("/api/plan", {"content": b"{"}, 415),
        ("/api/plan", {"json": {}}, 422),
        ("/api/plan", {"json": {"targets": "x"}}, 422),
        ("/api/plan", {"json": {"targets": [[200.0, 0.0]]}}, 422),
        ("/api/plan", {"json": {"targets": [[0.0, 0.0]] * 2000}}, 422),
        ("/api/plan", {"json": {"targets": [TARGET], "clearance_m": -1}}, 422),
        ("/api/check", {"json": {}}, 422),
        ("/api/upload", {"json": {"plan_id": "x"}}, 400),
        ("/api/plan", {"content": b" " * (wire.MOST_BYTES + 1), "headers": {"content-type": "application/json"}}, 413),
        ("/api/replay?time_s=x", {}, 405),
    ],
)  # fmt: skip
def test_senseless_requests_are_refused_with_a_reason(client, path, given, status):
    found = client.post(path, **given)
    assert found.status_code == status
    jsonschema.validate(found.json(), schema_of("Failure"))


def test_a_newer_request_stops_an_older_one(console, monkeypatch):
    hub, address, _ = console
    begun, stopped = threading.Event(), threading.Event()

    def endless(_body, _situation, _own, stop, _clock):
        begun.set()
        while not stop():
            time.sleep(0.005)
        stopped.set()
        raise app_module.PlanStoppedError("nobody waits")

    results = []

    def older():
        with httpx.Client(base_url=f"http://{address}", timeout=60) as one:
            results.append(one.post("/api/plan", json=asked(), headers=PAGE))

    with monkeypatch.context() as patched:
        patched.setattr(app_module.answers, "look_at_plan", endless)
        thread = threading.Thread(target=older)
        thread.start()
        assert begun.wait(100)
    with httpx.Client(base_url=f"http://{address}", timeout=60) as two:
        other = two.post("/api/plan", json=asked(), headers=OTHER)  # another page stops nothing
        assert other.json()["state"] == "planned"
        assert not stopped.is_set()
        assert two.post("/api/plan", json=asked(), headers=PAGE).json()["state"] == "planned"
    thread.join(100)
    assert results[0].status_code == 409
    assert results[0].json()["error"]["kind"] == "superseded"
    assert hub.looked


# Strangers


@pytest.mark.parametrize(
    "headers",
    [
        {"host": "evil.example"},
        {"host": "localhost.evil.example:80"},
        {"origin": "http://evil.example"},
        {"origin": "null"},
        {"sec-fetch-site": "cross-site"},
    ],
)
def test_a_foreign_page_reads_nothing_and_sends_nothing(console, headers):
    _, address, client = console
    assert client.get("/api/state", headers=headers).status_code == 403
    assert client.post("/api/hold", headers={**PAGE, **headers}).status_code == 403
    assert client.get("/", headers=headers).status_code == 403
    with pytest.raises(InvalidStatus), connect(
        f"ws://{address}/api/live?page=aaaaaaaa", additional_headers=headers if "host" not in headers else None,
        origin=headers.get("origin") if "host" not in headers else "http://evil.example",
    ):  # fmt: skip
        pass


def test_beyond_loopback_nothing_without_the_token():
    access = replace(Access.of("192.168.1.5", 1), host="192.168.1.5")
    with (
        served(access=access) as (hub, address),
        httpx.Client(base_url=f"http://{address}", timeout=30) as client,
    ):
        assert client.get("/").status_code == 200  # the page's own code, which is public
        for path in ("/api/state", "/api/events", "/map.pmtiles", "/api/backups", "/api/schema"):
            assert client.get(path).status_code == 401
        assert client.post("/api/hold", headers=PAGE).status_code == 401
        with pytest.raises(InvalidStatus), connect(f"ws://{address}/api/live?page=aaaaaaaa"):
            pass
        assert client.post("/api/session", json={"token": "guess"}).status_code == 401
        assert client.get("/api/state").status_code == 401
        token = hub.access.token
        shown = client.post("/api/session", json={"token": token})
        assert shown.status_code == 200
        assert token not in shown.headers["set-cookie"]
        assert client.get("/api/state").status_code == 200
        link = page_link(hub.access)
        assert link.endswith(f"/#token={token}")  # a fragment: no server and no log sees it
        assert len(qr_code(link).splitlines()) > 10


def test_what_vehicles_and_files_say_is_data(console):
    hub, _, client = console
    hub.post({}, [EventView(id=0, time_s=0.0, name="statustext", severity="info", text=MARKUP)])
    time.sleep(0.2)
    found = client.get("/api/events")
    assert found.headers["content-type"] == "application/json"
    assert found.headers["x-content-type-options"] == "nosniff"
    assert MARKUP in [one["text"] for one in found.json()]


# Permissions and control


class Recorder:
    """A backend that notes deeds."""

    def __init__(self) -> None:
        self.deeds: list = []
        self._files = files_hub(Access.of("127.0.0.1", 1)).backend

    def __getattr__(self, name):
        return getattr(self._files, name)

    async def do(self, deed, page):
        self.deeds.append((type(deed).__name__, page))
        if type(deed).__name__ == "Resume":
            raise not_now("not now")
        return "done"


DEEDS = {
    "/api/upload": {"plan_id": "x"},
    "/api/start": {"plan_id": "x"},
    "/api/hold": None,
    "/api/resume": None,
    "/api/backups/restore": {"name": "x"},
}


@pytest.mark.parametrize(
    ("can", "allowed"),
    [
        (Permissions(), set()),
        (Permissions(upload=True), {"/api/upload", "/api/backups/restore"}),
        (Permissions(upload=True, drive=True), set(DEEDS)),
    ],
)
def test_what_is_not_permitted_is_refused_by_the_server(can, allowed):
    backend = Recorder()
    with (
        served(can, backend) as (_, address),
        httpx.Client(base_url=f"http://{address}", timeout=30) as client,
    ):
        for path, given in DEEDS.items():
            found = client.post(path, json=given, headers=PAGE)
            if path in allowed:
                assert found.status_code in (202, 409), found.text
            else:
                assert found.status_code == 403
                assert found.json()["error"]["kind"] == "not_permitted"
                assert "--" in found.json()["error"]["advice"]
    assert len(backend.deeds) == len(allowed)


def test_one_page_holds_control_and_every_page_may_hold_the_vehicle():
    backend = Recorder()
    can = Permissions(upload=True, drive=True)
    with (
        served(can, backend) as (_, address),
        httpx.Client(base_url=f"http://{address}", timeout=30) as client,
    ):
        with connect(f"ws://{address}/api/live?page={OTHER['x-page-id']}") as socket_:
            first = json.loads(socket_.recv())
            assert first["you"] == "page 1"
            assert client.post("/api/start", json={"plan_id": "x"}, headers=PAGE).status_code == 202
            refused = client.post("/api/start", json={"plan_id": "x"}, headers=OTHER)
            assert refused.json()["error"]["kind"] == "no_control"
            assert client.post("/api/hold", headers=OTHER).status_code == 202
            assert client.post("/api/control/take", headers=OTHER).status_code == 200
            assert client.post("/api/start", json={"plan_id": "x"}, headers=PAGE).status_code == 409
            texts, holder = [], None
            while holder != "page 1" or not texts:
                message = json.loads(socket_.recv(60))
                texts += [one["text"] for one in message.get("events", ())]
                holder = message.get("state", {}).get("control", {}).get("holder", holder)
            assert texts == ["page 1 took control from page 2"]
        assert client.post("/api/control/give", headers=OTHER).status_code == 200
        assert client.post("/api/resume", headers=PAGE).status_code == 409
    # Who takes control or gives it up ends what was waited for: the vehicle's side is told.
    assert backend.deeds == [
        ("Start", "page 2"),
        ("Hold", "page 1"),
        ("TakeControl", "page 1"),
        ("GiveControl", "page 1"),
        ("Resume", "page 2"),
    ]


@pytest.mark.parametrize(
    "more", [{"x-run-id": "of-yesterday"}, {"x-asked-s": "1000.0"}, {"x-asked-s": "nan"}, {"x-asked-s": "?"}]
)
def test_a_request_that_comes_late_or_was_meant_for_an_earlier_server_moves_nothing(more):
    backend = Recorder()
    can = Permissions(upload=True, drive=True)
    with (
        served(can, backend) as (_, address),
        httpx.Client(base_url=f"http://{address}", timeout=30) as client,
    ):
        for path in ("/api/start", "/api/upload"):
            found = client.post(path, json={"plan_id": "x"}, headers={**PAGE, **more})
            assert found.json()["error"]["kind"] in ("late", "invalid"), found.text
        assert client.post("/api/resume", headers={**PAGE, **more}).json()["error"]["kind"] != "not_now"
        assert backend.deeds == []
        assert client.post("/api/hold", headers={**PAGE, **more}).status_code == 202  # never too late
        now = {"x-run-id": "r", "x-asked-s": str(time.time() - 1.0)}
        assert client.post("/api/start", json={"plan_id": "x"}, headers={**PAGE, **now}).status_code == 202


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/page/a%00b", 404),
        (f"/page/{'x' * 300}", 404),
        ("/page/%2e%2e/app.py", 404),
        ("/api/export?what=x", 422),
    ],
)
def test_odd_addresses_are_answered_and_no_defects(path, status):
    with served() as (_, address):
        found = httpx.get(f"http://{address}{path}", timeout=30)
        assert (found.status_code, "bug" in found.text) == (status, False), found.text


def test_files_have_no_vehicle_to_be_asked():
    with served(Permissions(upload=True, drive=True)) as (_, address):
        found = httpx.post(f"http://{address}/api/hold", headers=PAGE, timeout=30)
        assert found.json()["error"]["kind"] == "not_here"
        assert httpx.get(f"http://{address}/api/after", timeout=30).json() is None
        assert httpx.get(f"http://{address}/api/backups", timeout=30).json() == []


# The stream


def test_a_stream_begins_with_everything_and_goes_on_with_changes(console):
    hub, address, _ = console
    with connect(f"ws://{address}/api/live?page=stream-page", ping_interval=None) as socket_:
        first = json.loads(socket_.recv())
        jsonschema.validate(first, schema_of("Snapshot"))
        begun_s = time.monotonic()
        for mode in range(200):  # at 200 a second
            hub.post({"vehicle": VehicleView(mode=mode)}, (), [(float(mode), 0.0, float(mode), 0.0, mode)])
            time.sleep(0.005)
        took_s = time.monotonic() - begun_s
        seen, rows, seq = [], 0, first["seq"]
        while not seen or seen[-1] != 199:
            message = json.loads(socket_.recv(60))
            assert message["seq"] == seq + 1
            seq = message["seq"]
            last = message
            rows += len(message.get("track", ()))
            if "vehicle" in message.get("state", {}):
                seen.append(message["state"]["vehicle"]["mode"])
        jsonschema.validate(last, schema_of("ChangeMessage"))
        assert len(seen) <= took_s * 10 + 3  # ten a second at most, the newest of each
        assert rows == 200
        assert json.loads(socket_.recv(60))["type"] in ("alive", "change")


@pytest.mark.parametrize("query", ["", "?page=short", "?page=" + "x" * 65, "?page=has%20blank"])
def test_a_stream_needs_a_page(console, query):
    with (
        pytest.raises((InvalidStatus, ConnectionClosed)),
        connect(f"ws://{console[1]}/api/live{query}") as one,
    ):
        one.recv(60)


def test_twenty_clients_that_take_nothing_hold_nobody_up(console):
    hub, address, client = console
    host, port = address.split(":")
    stuck = []
    for number in range(20):
        one = socket.create_connection((host, int(port)))
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1024)
        one.sendall(
            f"GET /api/live?page=stuck-page-{number} HTTP/1.1\r\nHost: {address}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        stuck.append(one)
    try:
        posting_s = []
        for number in range(100):
            begun_s = time.perf_counter()
            hub.post(
                {"vehicle": VehicleView(mode=number)}, (), [(float(n), 0.0, 0.0, 0.0, n) for n in range(50)]
            )
            posting_s.append(time.perf_counter() - begun_s)
            time.sleep(0.01)
        assert sorted(posting_s)[len(posting_s) // 2] < 0.05  # the bridge's loop is never held up
        assert client.get("/api/schema").status_code == 200
        with connect(f"ws://{address}/api/live?page=a-quick-page") as quick:
            assert json.loads(quick.recv(60))["type"] == "snapshot"
    finally:
        for one in stuck:
            one.close()


def test_a_server_that_starts_anew_says_so_and_pages_come_back():
    ids = []
    for _ in range(2):
        with served() as (_, address), connect(f"ws://{address}/api/live?page=the-same-tab") as one:
            ids.append(json.loads(one.recv(60))["you"])
    assert ids == ["page 1", "page 1"]


# The map and the socket


def test_a_map_is_served_in_pieces(tmp_path):
    tiles = tmp_path / "field.pmtiles"
    tiles.write_bytes(bytes(range(256)) * 100)
    with (
        served(tiles=tiles) as (_, address),
        httpx.Client(base_url=f"http://{address}", timeout=30) as client,
    ):
        part = client.get("/map.pmtiles", headers={"range": "bytes=256-511"})
        assert (part.status_code, part.content) == (206, bytes(range(256)))
        assert client.get("/map.pmtiles").content == tiles.read_bytes()
    with served(tiles_origin="https://tiles.example") as (_, address):
        found = httpx.get(f"http://{address}/", timeout=30)
        assert "https://tiles.example" in found.headers["content-security-policy"]
        assert httpx.get(f"http://{address}/map.pmtiles", timeout=30).status_code == 404


def test_a_port_that_is_taken_is_said_and_a_free_one_is_found():
    with open_socket("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(LinkError, match="cannot be used"):
            open_socket("127.0.0.1", port)
    with open_socket("127.0.0.1", None) as found:
        assert 8080 <= found.getsockname()[1] < 8100


def test_a_hub_whose_server_has_ended_takes_posts_all_the_same():
    with served() as (hub, _):
        pass
    hub.post({"vehicle": VehicleView(mode=1)})
    hub.post({"vehicle": VehicleView(mode=2)})


def test_a_refusal_is_no_failure():
    async def ask():
        with pytest.raises(Refusal, match="no vehicle"):
            await files_hub(Access.of("127.0.0.1", 1), Permissions(drive=True)).do(
                app_module.deeds.Hold(), "page-of-the-test"
            )

    asyncio.run(ask())


def test_one_stranger_cannot_take_all_connections_and_hold_with_them(monkeypatch):
    monkeypatch.setattr(server, "_REQUEST_S", 1.0)
    with served(Permissions(upload=True, drive=True), Recorder()) as (_, address):
        host, port = address.split(":")
        page = connect(f"ws://{address}/api/live?page=stream-page", ping_interval=None)
        idle = [
            socket.create_connection((host, int(port)), source_address=("127.0.0.2", 0)) for _ in range(300)
        ]
        for one in idle:
            with suppress(OSError):  # most are closed at once
                one.send(b"GET / HTTP/1.1\r\nHost: ")
        assert httpx.post(f"http://{address}/api/hold", headers=PAGE, timeout=30).status_code == 202
        for one in idle:  # and the others soon
            one.settimeout(30)
            with suppress(ConnectionError):
                assert one.recv(1) == b""
            one.close()
        with page:
            assert json.loads(page.recv(30))["type"] == "snapshot"
            assert json.loads(page.recv(30))  # it is closed by nobody
            time.sleep(2.5)
            assert json.loads(page.recv(30))
