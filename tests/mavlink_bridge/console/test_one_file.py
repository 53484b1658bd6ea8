"""Pages in one file, without a browser: what is in them, that nothing in their data is markup, and that they stay small."""

from __future__ import annotations

import base64
import hashlib
import importlib.util
import json
import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import pytest
from console.serving import FIELDS, START, TARGET
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.console import one_file, wire
from mavlink_bridge.console.log_page import log_page
from mavlink_bridge.console.one_file import NamedLine, NamedMark, StillPage, page_bytes, plain
from mavlink_bridge.console.stills import log_still, plan_page
from mavlink_bridge.console.view.events import text_view
from mavlink_bridge.console.view.fields import field_sections
from mavlink_bridge.console.view.plans import plan_view
from mavlink_bridge.console.view.sections import DriveView, FenceView, LinkView, PlanView, VehicleView
from mavlink_bridge.mavlink import messages as m
from missions import plan, read_situation
from missions.errors import MissionFormatError
from missions.geo import LatLon
from missions.request import GoTo

ROOT = Path(__file__).parents[3]
LOGS = ROOT / "sitl_logs"
HOSTILE = (
    "</script><script>alert(1)</script><!--<script> <b>b</b> &amp; \x1b]0;PWNED\x07 \u202e \u2028 ' \" ${x}"
)


class Elements(HTMLParser):
    """The elements of a page as a browser takes it apart: tag, attributes, text."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.found: list[tuple[str, dict[str, str | None], str]] = []
        self.comments: list[str] = []

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs), ""))

    def handle_endtag(self, tag):
        self.found.append((f"/{tag}", {}, ""))

    def handle_data(self, data):
        if not self.found:
            return
        tag, attributes, text = self.found[-1]
        self.found[-1] = (tag, attributes, text + data)

    def handle_comment(self, data):
        self.comments.append(data)


def elements(page: bytes) -> list[tuple[str, dict[str, str | None], str]]:
    parser = Elements()
    parser.feed(page.decode())
    parser.close()
    assert parser.comments == []
    return parser.found


def inside(page: bytes) -> dict:
    """The data of a page."""
    (text,) = (text for tag, attributes, text in elements(page) if attributes.get("id") == "inside")
    return json.loads(text)


@pytest.fixture(scope="module")
def planned():
    situation = read_situation(FIELDS / "maze-fence.waypoints")
    request = GoTo(start=START, target=LatLon(TARGET[1], TARGET[0]), clearance_m=2.5)
    return plan(situation, request), situation, request


@pytest.fixture(scope="module")
def page(planned) -> bytes:
    return plan_page(*planned)


def test_only_what_its_policy_names_may_run_and_nothing_is_loaded(page):
    found = elements(page)
    assert [tag for tag, *_ in found[:3]] == ["html", "head", "meta"]
    (policy,) = (
        one["content"] for tag, one, _ in found if one.get("http-equiv") == "Content-Security-Policy"
    )
    rules = dict(rule.split(" ", 1) for rule in policy.split("; "))
    assert rules["default-src"] == rules["base-uri"] == rules["form-action"] == "'none'"
    assert rules["connect-src"] == "blob:"
    assert "unsafe" not in policy
    assert "http" not in policy
    for tag, name in (("script", "script-src"), ("style", "style-src")):
        texts = [
            text
            for one, attributes, text in found
            if one == tag and attributes.get("type") in (None, "module")
        ]
        hashes = [
            f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'" for text in texts
        ]
        assert rules[name].split() == hashes
        assert len(hashes) == 2
    assert [value for _, one, _ in found for name, value in one.items() if name in ("src", "href")] == [
        "data:,"
    ]
    assert not [name for _, one, _ in found for name in one if name.startswith("on") or name == "style"]
    assert b"sourceMappingURL" not in page


def test_viewport_title_and_licences(page):
    found = elements(page)
    assert ("meta", {"name": "viewport", "content": "width=device-width, initial-scale=1"}) in [
        (tag, one) for tag, one, _ in found
    ]
    (title,) = (text for tag, _, text in found if tag == "title")
    assert re.match(r"\d+\.\d m, about \d+ s – PBPP Rover", title)
    (licences,) = (text for _, one, text in found if one.get("id") == "licences")
    assert "Redistribution and use in source and binary forms" in licences


def test_its_data_is_what_the_server_sends(planned, page):
    made, situation, request = planned
    sent = {**field_sections(situation, request, "file"), "plan": plan_view(made, situation, request)}
    state = inside(page)["message"]["state"]
    assert state.pop("server")["can"] == {"upload": False, "drive": False, "arm": False}
    assert state == json.loads(wire.encode(sent))
    assert [len(inside(page)[name]) for name in ("moments", "lines", "marks")] == [0, 0, 0]


def test_the_same_plan_gives_the_same_page_and_a_small_one(planned, page):
    assert plan_page(*planned) == page
    assert len(page) < 2_500_000  # plotly's page had 4.8 MB


def test_texts_from_outside_are_data():
    marks = (NamedMark(HOSTILE, (1.0, 2.0)),)
    page = page_bytes(
        StillPage(
            title=(HOSTILE, HOSTILE),
            sections={"fence": FenceView(source=HOSTILE, trouble=HOSTILE, warnings=(HOSTILE,))},
            events=(text_view(m.Statustext(2, HOSTILE), 1.0),),
            lines=(NamedLine(HOSTILE, ((1.0, 2.0), (1.0, 3.0))),),
            marks=marks,
            notes=(HOSTILE,),
        )
    )
    usual = page_bytes(StillPage(title=("a",), sections={}))
    assert [tag for tag, *_ in elements(page)] == [tag for tag, *_ in elements(usual)]
    assert (page.count(b"<script"), page.count(b"<!--")) == (usual.count(b"<script"), 0)
    held = inside(page)
    shown = plain(HOSTILE)
    assert shown.startswith("</script><script>alert(1)")
    assert r"\x1b]0;PWNED\x07" in shown
    assert {held["title"][1], held["notes"][0], held["marks"][0]["name"], held["lines"][0]["name"]} == {shown}
    assert held["message"]["state"]["fence"]["source"] == held["message"]["events"][0]["text"] == shown
    (title,) = (text for tag, _, text in elements(page) if tag == "title")
    assert title == f"{shown} – PBPP Rover"
    assert not any(ord(sign) < 32 and sign != "\n" for sign in page.decode().partition("<style>")[0])


def test_numbers_that_are_none_are_null():
    assert plain({"a": (float("inf"), float("nan"), 1.5, True, None, 3)}) == {
        "a": [None, None, 1.5, True, None, 3]
    }


def test_no_web_library_is_needed():
    code = (
        "import sys\n"
        "for name in ('msgspec', 'starlette', 'uvicorn', 'websockets', 'segno', 'matplotlib'): sys.modules[name] = None\n"
        "from mavlink_bridge.cli import main\n"
        "main()\n"
    )
    words = ["log", str(LOGS / "mission-yard.tlog"), "--plot", "/dev/null/x.html"]
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
    assert "x.html cannot be written" in done.stderr, done.stderr


def test_the_committed_bundle_is_made_of_todays_modules():
    spec = importlib.util.spec_from_file_location("page_tools", ROOT / "tools" / "page" / "page_tools.py")
    tools = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tools)
    made_of = re.search(r"page/: ([0-9a-f]{64})", tools.BUNDLE.read_text(encoding="utf-8")).group(1)
    assert made_of == tools.sources(), "make bundle"


def test_the_library_leaves_every_name_that_it_exports():
    library = one_file._library()
    assert "export{" not in library
    names = set(re.findall(r"([A-Za-z]+):", library.rpartition("globalThis.maplibre=")[2]))
    assert {
        "Map",
        "Marker",
        "NavigationControl",
        "ScaleControl",
        "AttributionControl",
        "setWorkerUrl",
    } <= names


# Logs


def test_a_logs_moments_are_those_of_the_replay():
    log = LOGS / "mission-yard.tlog"
    held = inside(page_bytes(log_page(log, None, ("a log",), notes=("found",))))
    assert (held["notes"], held["message"]["state"]["server"]["source"]) == (["found"], "log")
    moments = held["moments"]
    assert set(moments[0]["whole"]) == {
        "link", "vehicle", "drive", "fence", "plan", "mission", "rally", "home", "request",
    }  # fmt: skip
    states = [
        {**one["whole"].get("drive", {}), **one["parts"].get("drive", {})}.get("state") for one in moments
    ]
    assert {"listening", "planned" if "planned" in states else "ready"} & set(states)
    times = [one["time_s"] for one in moments]
    assert times == sorted(times)
    assert held["message"]["events"]
    assert held["message"]["track"]
    # Put together again the last moment is what the replay shows at the end.
    state: dict = {}
    for one in moments:
        state |= one["whole"]
        for name, parts in one["parts"].items():
            state[name] = {**state[name], **parts}
    from mavlink_bridge.console.recording import RecordedSections, Recording
    from mavlink_bridge.director import Orders, TargetSource
    from missions.request import Tour

    sources = frozenset(TargetSource) - {TargetSource.ECHO, TargetSource.RALLY}
    recording = Recording(log, Orders(any_vehicle=True, request=Tour(), target_sources=sources))
    sections = RecordedSections(recording)
    end = [sections.at(one.time_s) for one in recording.moments][
        -1
    ]  # a plan's legs are judged when it is first seen
    del end["replay"]
    assert state == plain(end)


class LongSections:
    """The sections of a log in which plan and fence change all the time."""

    def at(self, time_s):
        number = int(time_s)
        corridor = tuple((float(i), 1.0, 1.0, 1.0, 1.0) for i in range(400))
        return {
            "link": LinkView(heard_s=time_s),
            "vehicle": VehicleView(speed_mps=time_s, position=(time_s, 1.0)),
            "drive": DriveView(progress_m=time_s),
            "plan": PlanView(id=f"plan {number}", state="planned", profile=corridor),
            "fence": FenceView(id=f"fence {number % 3}"),
            "replay": None,
        }


def test_a_long_log_stays_small():
    moments = [
        SimpleNamespace(
            time_s=float(number),
            plan=number,
            drive=DriveView(),
            situation=SimpleNamespace(fence=number % 3, mission=None),
        )
        for number in range(20_000)
    ]
    events = [text_view(m.Statustext(6, f"text {number}"), float(number)) for number in range(5_000)]
    decisions = [replace(one, name="planned") for one in events[:20]]
    rows = [(float(number), 1.0, 2.0, 0.5, number // 15_000) for number in range(50_000)]
    recording = SimpleNamespace(
        moments=moments,
        events=[*events, *decisions],
        track=SimpleNamespace(rows=rows),
        begin_s=0.0,
        end_s=2e4,
    )
    page = log_still(("long",), recording, LongSections())
    assert len(page.moments) <= 1000
    assert page.moments[-1].time_s > 19_900
    assert len(page.events) == 500
    assert sum(one.name == "planned" for one in page.events) == 20
    assert len(page.track) <= 5_010
    assert {row[4] for row in page.track} == {0, 1, 2, 3}
    drawn = [one for one in page.moments if one.whole.get("plan") and one.whole["plan"].profile]
    assert 0 < len(drawn) <= 40
    assert re.fullmatch(r"of \d+ more plans and fences only the lines are drawn", page.title[-1])
    assert len(page_bytes(page)) < 5_000_000


# Who asks for one


@pytest.mark.parametrize("name", ["a.html", "b.HTML"])
def test_rally_points_ways_home_and_blocks_are_drawn_besides(tmp_path, name):
    path = tmp_path / name
    words = [
        "plan",
        "--fence",
        FIELDS / "yard-fence.waypoints",
        "--start",
        "40.071374,-105.22993",
        "--target",
        "40.0720926,-105.2286152",
    ]
    result = CliRunner().invoke(
        app, [*map(str, words), "--place", "shed=40.0714,-105.2288", "--blocks", "--plot", str(path)]
    )
    assert f"Wrote {path}" in result.stdout, result.output
    names = {one["name"] for one in inside(path.read_bytes())["lines"]}
    assert names == {"way home", ""}


def test_programs_are_told_where_pages_are_made(planned, tmp_path):
    with pytest.raises(MissionFormatError, match=r"'\.html' is not a supported picture format") as caught:
        planned[0].plot(tmp_path / "x.html")
    assert "plan_page" in str(caught.value.details["advice"])


def test_two_files_that_differ(tmp_path):
    path = tmp_path / "x.html"
    files = [str(FIELDS / name) for name in ("yard-fence.waypoints", "maze-fence.waypoints")]
    result = CliRunner().invoke(app, ["diff", *files, "--plot", str(path)])
    assert f"Wrote {path}" in result.stdout, result.output
    held = inside(path.read_bytes())
    assert held["notes"]
    assert {one["name"] for one in held["lines"]} == {"fence in A"}
    assert held["marks"]
    assert held["message"]["state"]["fence"]["held"]["features"]
