"""A number at the head of a module has its source or its reason beside it, or it says that it was chosen."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = sorted(
    path for package in ("pbpp", "missions", "mavlink_bridge") for path in (ROOT / package).rglob("*.py")
)
_NUMERIC = (ast.Constant, ast.Tuple, ast.UnaryOp, ast.BinOp, ast.operator, ast.unaryop, ast.expr_context)


def numbers(tree: ast.Module) -> list[ast.Assign | ast.AnnAssign]:
    """Return the assignments of numbers, or of tuples of them, to names in capitals."""
    found = []
    for node in tree.body:
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = [part.id for target in targets for part in ast.walk(target) if isinstance(part, ast.Name)]
        parts = list(ast.walk(node.value))
        is_number = all(isinstance(part, _NUMERIC) for part in parts) and all(
            type(part.value) in {int, float} for part in parts if isinstance(part, ast.Constant)
        )
        if is_number and names and all(re.fullmatch(r"_?[A-Z][A-Z0-9_]*", name) for name in names):
            found.append(node)
    return found


def block(lines: list[str], node: ast.stmt) -> str:
    """Return the lines about a statement up to the next empty ones."""
    begin, end = node.lineno - 1, node.end_lineno
    while begin > 0 and lines[begin - 1].strip():
        begin -= 1
    while end < len(lines) and lines[end].strip():
        end += 1
    return "\n".join(lines[begin:end])


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_numbers_have_a_reason(path):
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    for node in numbers(ast.parse(text)):
        about = block(lines, node)
        assert "#" in about or '"""' in about, f"line {node.lineno}: {lines[node.lineno - 1]}"


def test_most_numbers_are_looked_at():
    assert sum(len(numbers(ast.parse(path.read_text(encoding="utf-8")))) for path in MODULES) > 400
