"""Nowhere is a parameter turned into a whole number but by the functions that say what it can be."""

from __future__ import annotations

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
SOURCES = sorted(
    path for package in ("missions", "mavlink_bridge") for path in (ROOT / package).rglob("*.py")
)
NAMES = ("parameters", "param_value", "_values")


def conversions(source: str) -> list[int]:
    """The lines on which ``int``, ``round``, ``math.floor`` … take something that names parameters."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Call):
            continue
        name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
        if name not in {"int", "round", "floor", "ceil", "trunc"}:
            continue
        told = {
            part.id if isinstance(part, ast.Name) else part.attr
            for argument in node.args
            for part in ast.walk(argument)
            if isinstance(part, ast.Name | ast.Attribute)
        }
        if told & set(NAMES):
            found.append(node.lineno)
    return found


def test_no_parameter_becomes_a_whole_number_by_itself() -> None:
    found = {
        str(path.relative_to(ROOT)): lines
        for path in SOURCES
        if (lines := conversions(path.read_text(encoding="utf-8")))
    }
    assert {name: len(lines) for name, lines in found.items()} == {"missions/vehicle/reader.py": 1}


def test_the_search_finds_what_it_looks_for() -> None:
    assert conversions('x = int(situation.parameters.get("FENCE_TYPE", 0)) & 2') == [1]
    assert conversions('y = 1\nx = round(parameters["A"])') == [2]
    assert conversions("x = int(text)") == []
