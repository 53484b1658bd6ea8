"""The page's files: what is copied from packages is as it was locked, nothing names a place outside, and its types are the server's."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path

import pytest

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
