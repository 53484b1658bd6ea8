"""Print every text that people may read, one a line: for a reader who judges each.

It walks the syntax trees of the three packages; a text is a string or f-string of at least three words that is no docstring.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

HOME = Path(__file__).parents[1]
LEAST_WORDS = 3


def texts_of(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Return line and text of each, in the order of the file; what is put in stands in braces."""
    docs = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef))
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    pieces = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            docs.add(id(node.value))  # a docstring of a constant
        if id(node) in docs or id(node) in pieces:
            continue
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
        elif isinstance(node, ast.JoinedStr):
            text = "".join(
                part.value if isinstance(part, ast.Constant) else "{" + ast.unparse(part.value) + "}"
                for part in node.values
            )
        else:
            continue
        if len(text.split()) >= LEAST_WORDS:
            yield node.lineno, " ".join(text.split())


def main() -> None:
    """Print the table of the packages, or of the files that are given."""
    given = [Path(name) for name in sys.argv[1:]]
    for path in given or sorted(
        path for package in ("pbpp", "missions", "mavlink_bridge") for path in (HOME / package).rglob("*.py")
    ):
        for line, text in sorted(set(texts_of(ast.parse(path.read_text(encoding="utf-8"))))):
            print(f"{path.relative_to(HOME) if path.is_relative_to(HOME) else path}:{line}\t{text}")


if __name__ == "__main__":
    main()
