"""The page's files: what is copied from packages is as it was locked, nothing names a place outside, and its types are the server's."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path

import pytest

from mavlink_bridge.console import wire

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "mavlink_bridge" / "console" / "page"
VENDORS = (PAGE / "vendor", Path(__file__).parent / "vendor")
OWN = [
    path
    for path in PAGE.rglob("*")
    if path.suffix in (".js", ".css", ".html", ".svg") and "vendor" not in path.parts
]

# What the page calls the server's types, where it has another name for them.
NAMES = {
    "Server": "ServerView", "Control": "ControlView", "Link": "LinkView", "Vehicle": "VehicleView", "Fence": "FenceView", "Footprint": "FootprintView",
    "Obstacle": "ObstacleView", "Asked": "AskedView", "Leg": "LegView", "NoRoute": "NoRouteView", "Plan": "PlanView", "HeldMission": "MissionView",
    "Drive": "DriveView", "Hold": "HoldView", "Transfer": "TransferView", "Event": "EventView", "Replay": "ReplayView",
    **{same: same for same in ("MapSource", "Permissions", "ZoneFacts", "FenceMeant", "RoutePoint", "ProfileSample")},
}  # fmt: skip


def _colours(name: str) -> dict[str, list[float]]:
    """The map's table of colours, as red, green and blue."""
    text = (PAGE / "map" / "style.js").read_text(encoding="utf-8")
    table = re.search(rf"const {name} = \{{(.*?)\}};", text, re.DOTALL)
    assert table is not None
    found = re.findall(r'(\w+): "#(\w{6})"', table.group(1))
    return {key: [int(value[i : i + 2], 16) for i in (0, 2, 4)] for key, value in found}


def _contrast(one: list[float], other: list[float]) -> float:
    """The ratio of WCAG 2."""

    def light(colour: list[float]) -> float:
        parts = [value / 255 for value in colour]
        red, green, blue = (v / 12.92 if v <= 0.03928 else ((v + 0.055) / 1.055) ** 2.4 for v in parts)
        return 0.2126 * red + 0.7152 * green + 0.0722 * blue

    dark, bright = sorted((light(one), light(other)))
    return (bright + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("name", ["LIGHT", "DARK"])
def test_lines_of_the_map_are_told_from_what_lies_under_them_in_the_sun(name: str):
    """At least 3 to 1 (WCAG 2, 1.4.11) on bare ground, on free ground, on ground that keeps the clearance, and lines of a drive also on its corridor."""
    table = _colours(name)
    grounds = [table[one] for one in ("ground", "free", "kept")]
    opacity = re.search(
        r'"fill-color": colour.corridor, "fill-opacity": ([\d.]+)',
        (PAGE / "map" / "style.js").read_text("utf-8"),
    )
    assert opacity is not None
    share = float(opacity.group(1))
    covered = [
        [share * c + (1 - share) * g for c, g in zip(table["corridor"], ground, strict=True)]
        for ground in grounds
    ]
    lines = set(table) - {"ground", "free", "kept", "grid", "gridMain", "halo", "roverEdge"}
    assert {
        "keeps",
        "near",
        "breaks",
        "extrapolated",
        "track",
        "fence",
        "exclusion",
        "corridor",
        "draft",
    } <= lines
    for line in lines:
        under = grounds if line in ("corridor", "hatch") else [*grounds, *covered]
        assert min(_contrast(table[line], one) for one in under) >= 3.0, line
    for word in ("text", "fence", "exclusion"):  # names have a halo
        assert _contrast(table[word], table["halo"]) >= 4.5


def test_files_that_the_server_does_not_take_are_not_sent():
    text = (PAGE / "actions.js").read_text(encoding="utf-8")
    assert re.search(r"MOST_BYTES = (\d+) \* 1024 \* 1024;", text).group(1) == str(wire.MOST_BYTES // 1024**2)


@pytest.mark.parametrize("folder", VENDORS, ids=("page", "tests"))
def test_copied_files_are_those_of_the_locked_packages(folder: Path):
    table = json.loads((folder / "packages.json").read_text(encoding="utf-8"))
    lock = json.loads((ROOT / "tools" / "page" / "package-lock.json").read_text(encoding="utf-8"))["packages"]
    for package, entry in table.items():
        for name, one in {package: entry, **entry["inside"]}.items():
            locked = lock[f"node_modules/{name}"]
            assert (one["version"], one["integrity"], one["licence"]) == (
                locked["version"],
                locked["integrity"],
                locked["license"],
            )
        there = {
            path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in (folder / package).iterdir()
        }
        assert there == entry["files"]
        assert any(name.startswith("LICEN") for name in there)
    assert {path.name for path in folder.iterdir()} == {*table, "packages.json"}


def test_the_lock_names_no_registry():
    lock = json.loads((ROOT / "tools" / "page" / "package-lock.json").read_text(encoding="utf-8"))
    assert not [name for name, entry in lock["packages"].items() if "resolved" in entry]
    assert all("integrity" in entry for name, entry in lock["packages"].items() if name)


@pytest.mark.parametrize("path", OWN, ids=lambda path: str(path.relative_to(PAGE)))
def test_the_page_names_no_place_outside_and_makes_no_markup(path: Path):
    text = path.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
    assert not re.findall(r"https?://|//[a-z]+\.[a-z]", text)
    assert not re.findall(
        r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function| on[a-z]+=\"", text
    )
    if path.suffix == ".html":
        assert "<script>" not in text
        assert "style=" not in text


def test_the_pages_types_are_the_servers():
    schema = json.loads((ROOT / "docs" / "console-schema.json").read_text(encoding="utf-8"))["$defs"]
    text = re.sub(r"\n \*", " ", (PAGE / "types.js").read_text(encoding="utf-8"))
    for name, of_server in NAMES.items():
        found = re.search(rf"@typedef \{{\{{((?:(?!@typedef).)*)\}}\}} {name}\b", text)
        assert found, name
        body = found.group(1)
        while re.search(r"\{[^{}]*\}", body):  # what is nested has fields of its own
            body = re.sub(r"\{[^{}]*\}", "", body)
        assert set(re.findall(r"(\w+):", body)) == set(schema[of_server]["properties"]) - {"type"}, name
