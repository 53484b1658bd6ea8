"""Lines on a terminal fit it, words whole; elsewhere they stay one line for scripts."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from mavlink_bridge.cli.terminal import echo, say

if TYPE_CHECKING:
    import pytest

LONG = "error: " + "no route keeps the clearance that was asked for " * 4 + "/a/path/" + "x" * 90


def test_a_terminal_gets_whole_words(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    say(LONG)
    first, *others = capsys.readouterr().err.splitlines()
    assert [word for line in (first, *others) for word in line.split()] == LONG.split()
    assert all(len(line) <= 80 for line in (first, *others) if "/a/path" not in line)
    assert all(line.startswith("  ") for line in others)  # so none passes for a line of ours


def test_a_file_gets_one_line(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    say(LONG)
    echo(LONG)
    told = capsys.readouterr()
    assert told.err.rstrip("\n") == told.out.rstrip("\n") == LONG
