"""The documentation is as the code says."""

from __future__ import annotations

import importlib.util
import re
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
import yaml

from mavlink_bridge.director import TRANSITIONS

DOCS = Path(__file__).parents[1] / "docs"
SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def generated():
    spec = importlib.util.spec_from_file_location("generated", DOCS / "generated.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda page: page.stem)
def test_made_parts_are_up_to_date(generated, page):
    text = page.read_text(encoding="utf-8")
    assert generated.renewed(text) == text


def test_every_part_stands_somewhere(generated):
    text = "".join(page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md"))
    assert all(f"<!-- made: {name} -->" in text for name in generated.PARTS)


def test_made_pictures_are_up_to_date(generated):
    assert generated.PICTURES
    for name, picture in generated.PICTURES.items():
        assert (DOCS / name).read_text(encoding="utf-8") == picture()


def test_the_directors_picture_shows_every_transition(generated):
    svg = ET.parse(DOCS / "figures" / "states-director.svg").getroot()
    texts = [node.text for node in svg.iter(f"{SVG}text")]
    transitions = [(state, cue, after) for state, row in TRANSITIONS.items() for cue, after in row.items()]
    assert len(list(svg.iter(f"{SVG}circle"))) == len(transitions)
    assert texts[: len(TRANSITIONS)] == [state.replace("_", " ") for state in TRANSITIONS]
    cues = Counter(cue.replace("_", " ") for cue, _ in {(cue, after) for _, cue, after in transitions})
    assert Counter(texts[len(TRANSITIONS) :]) == cues


PAGES = sorted([*DOCS.rglob("*.md"), *DOCS.parent.glob("*.md"), *DOCS.parent.glob("sitl_logs/*.md")])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: f"{page.parent.name}-{page.stem}")
def test_every_relative_link_leads_somewhere(page):
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if "://" not in target and not target.startswith("#"):
            assert (page.parent / target.partition("#")[0]).exists(), target


def test_ci_runs_what_the_readme_tells_to_make():
    readme = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    wanted = re.findall(r"^(make \w+)", readme, re.MULTILINE)
    assert len(wanted) == 2
    lines = (DOCS.parent / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    assert set(wanted) <= set(lines)


def test_the_workflow_runs_the_same_and_trusts_no_moving_tag():
    text = (DOCS.parent / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    assert "- run: .ci/run\n" in text
    actions = re.findall(r"uses: (\S+)", text)
    assert actions
    assert all(re.fullmatch(r"[\w/-]+@[0-9a-f]{40}", action) for action in actions)


TEMPLATES = DOCS.parent / ".github" / "ISSUE_TEMPLATE"


@pytest.mark.parametrize("name", ["bug", "feature"])
def test_issue_forms_are_forms(name):
    form = yaml.safe_load((TEMPLATES / f"{name}.yml").read_text(encoding="utf-8"))
    fields = [part for part in form["body"] if part["type"] != "markdown"]
    assert {"name", "description", "labels", "body"} == set(form)
    assert (
        len({field["id"] for field in fields})
        == len({field["attributes"]["label"] for field in fields})
        == len(fields)
    )
    assert {field["type"] for field in fields} <= {"textarea", "input", "dropdown"}
    assert any(field.get("validations", {}).get("required") for field in fields)


def test_a_bug_may_be_in_any_command():
    form = yaml.safe_load((TEMPLATES / "bug.yml").read_text(encoding="utf-8"))
    (command,) = (part for part in form["body"] if part.get("id") == "command")
    told = re.findall(r"^## (pbpp \w+)$", (DOCS / "commands.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(told) > 5
    assert sorted(command["attributes"]["options"][:-1]) == told


@pytest.mark.parametrize("page", PAGES, ids=lambda page: f"{page.parent.name}-{page.stem}")
def test_every_test_that_a_page_names_is_there(page):
    if page.name == "CHANGELOG.md":
        return
    for name in re.findall(r"\btests/[\w./*-]+\w|\btest_\w+\.py", page.read_text(encoding="utf-8")):
        pattern = name.removeprefix("tests/") if name.startswith("tests/") else f"**/{name}"
        assert any((DOCS.parent / "tests").glob(pattern)), name


def test_architecture_names_rooms_and_modules_that_are_there():
    text = (
        (DOCS.parent / "ARCHITECTURE.md")
        .read_text(encoding="utf-8")
        .split("## Rooms by stage")[1]
        .split("\n## ")[0]
    )
    package, looked_at = "", 0
    for row in re.findall(r"^\| (.*?) \|(.*)\|$", text, re.MULTILINE):
        if (found := re.fullmatch(r"\*\*`(\w+)`\*\*", row[0])) is not None:
            package = found[1]
        rooms = re.findall(r"(\w+)/?", "".join(re.findall(r"`([\w/ ]+)`", row[0]))) if package else []
        folders = [DOCS.parent / package / room for room in rooms if (DOCS.parent / package / room).is_dir()]
        for room in rooms:
            path = DOCS.parent / package / room
            assert path.is_dir() or path.with_suffix(".py").is_file() or room == package, f"{package}: {room}"
        for name in re.findall(r"`([a-z_]+)`", row[1]) if package else []:
            looked_at += 1
            assert any((folder / f"{name}.py").is_file() for folder in [*folders, DOCS.parent / package]), (
                name
            )
    assert looked_at > 40


@pytest.mark.parametrize("package", ["missions", "mavlink_bridge"])
def test_tests_stand_in_the_rooms_that_they_test(package):
    rooms, tests = (
        {path.name for path in (DOCS.parent / folder).iterdir() if path.is_dir()}
        for folder in (package, f"tests/{package}")
    )
    assert len(tests) > 5
    assert tests - {"__pycache__"} <= rooms
