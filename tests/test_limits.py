"""How large the house may grow: functions, classes, rooms, late imports; and no name for two things without a reason."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("pbpp", "missions", "mavlink_bridge")
SOURCES = {
    path: path.read_text(encoding="utf-8") for name in PACKAGES for path in (ROOT / name).rglob("*.py")
}
MOST_LINES, MOST_ATTRIBUTES, MOST_LATE_IMPORTS = 60, 20, 30


@cache
def nodes() -> list[tuple[Path, ast.ClassDef | ast.FunctionDef | ast.Module]]:
    """Return what is looked at; once, and not while tests are collected, which every process of a run does."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef)
    return [
        (path, node)
        for path, text in SOURCES.items()
        for node in ast.walk(ast.parse(text))
        if isinstance(node, kinds)
    ]


def attributes(kind: ast.ClassDef) -> set[str]:
    """Return a class's own fields, and what its methods set on it."""
    declared = {
        part.target.id
        for part in kind.body
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name)
    }
    found = {part for part in ast.walk(kind) if isinstance(part, ast.Attribute)}
    return declared | {
        part.attr
        for part in found
        if isinstance(part.ctx, ast.Store) and isinstance(part.value, ast.Name) and part.value.id == "self"
    }


def has_reason(path: Path, node: ast.FunctionDef | ast.ClassDef, word: str) -> bool:
    """Return whether a comment in it says why it is as large as it is."""
    lines = SOURCES[path].splitlines()[node.lineno - 1 : node.end_lineno]
    return any(re.match(rf"\s*# {word}", line) for line in lines)


def test_functions_are_short_or_say_why_not():
    long = [
        f"{path.relative_to(ROOT)}:{node.lineno} {node.name}"
        for path, node in nodes()
        if isinstance(node, ast.FunctionDef)
        and node.end_lineno - node.lineno >= MOST_LINES
        and not has_reason(path, node, "Long")
    ]
    assert long == []


def test_classes_hold_little_or_say_why_not():
    large = [
        f"{path.relative_to(ROOT)}:{node.lineno} {node.name} {len(attributes(node))}"
        for path, node in nodes()
        if isinstance(node, ast.ClassDef)
        and len(attributes(node)) > MOST_ATTRIBUTES
        and not has_reason(path, node, "Many attributes")
    ]
    assert large == []


@pytest.mark.parametrize(("package", "most"), [("missions", 24), ("mavlink_bridge", 16)])
def test_a_package_has_few_rooms(package, most):
    rooms = {
        path.relative_to(ROOT / package).parts[0] for path in SOURCES if path.is_relative_to(ROOT / package)
    }
    assert len(rooms - {"__init__.py"}) <= most


def test_few_imports_are_late():
    assert sum(text.count("noqa: PLC0415") for text in SOURCES.values()) <= MOST_LATE_IMPORTS


def test_docstrings_begin_with_what_is_returned_or_done():
    texts = [ast.get_docstring(node) or "" for _, node in nodes()]
    assert len([text for text in texts if re.match(r"(Give|Tell|Say)s?\b", text)]) <= 5


def test_a_class_name_for_two_things_stands_in_the_glossary():
    places = defaultdict(list)
    for path, node in nodes():
        if isinstance(node, ast.ClassDef):
            places[node.name].append(path)
    glossary = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    twice = {name for name, paths in places.items() if len(paths) > 1}
    assert {name for name in twice if f"| `{name}` |" not in glossary} == set()


def test_parts_of_the_director_leave_nothing_to_be_overridden():
    director = ROOT / "mavlink_bridge" / "director"
    assert not [
        path
        for path, text in SOURCES.items()
        if path.is_relative_to(director) and "NotImplementedError" in text
    ]
