"""Texts that people read keep to the field's words."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
_SPEC = importlib.util.spec_from_file_location("messages", ROOT / "tools" / "messages.py")
messages = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(messages)

NOT_OURS = re.compile(
    r"forbidden ground|foreseen|\bmend|\bBREAKS\b|\bthe band\b|\bis not told\b|\bpassed over\b|\bfor good\b|\bwhat is there\b"
)
"""Words of the code, or of nobody; what people read instead stands in docs/glossary.md."""


def test_the_table_has_texts_and_no_docstrings(tmp_path):
    source = tmp_path / "one.py"
    source.write_text(
        '"""A docstring of the module."""\nX = 1\n"""And of a constant."""\nsay(f"moved {x:.2f} m to {place}")\nsay("too short")\n'
    )
    found = list(messages.texts_of(messages.ast.parse(source.read_text())))
    assert found == [(4, "moved {x} m to {place}")]


@pytest.mark.parametrize("package", ["pbpp", "missions", "mavlink_bridge"])
def test_no_text_uses_words_of_the_code(package):
    texts = [
        (path.name, line, text)
        for path in (ROOT / package).rglob("*.py")
        for line, text in messages.texts_of(messages.ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert len(texts) > 20
    assert [one for one in texts if NOT_OURS.search(one[2])] == []
