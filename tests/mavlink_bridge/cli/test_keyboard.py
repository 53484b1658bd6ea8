"""What is typed where the view shows it: edited as the terminal would, and the terminal as before afterwards."""

from __future__ import annotations

import os
import sys

import pytest

from mavlink_bridge.cli import keyboard as keyboard_module
from mavlink_bridge.cli.keyboard import Keyboard

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a terminal of another kind")


class Terminal:
    """A pseudo-terminal in the place of the standard input."""

    def __init__(self, monkeypatch) -> None:
        import pty

        self.person, self.program = pty.openpty()
        monkeypatch.setattr(keyboard_module, "STDIN", self.program)
        monkeypatch.setattr(sys, "stdin", os.fdopen(self.program, closefd=False))

    def modes(self) -> int:
        import termios

        return termios.tcgetattr(self.program)[3]

    def type(self, text: str) -> None:
        os.write(self.person, text.encode())


@pytest.fixture
def terminal(monkeypatch):
    return Terminal(monkeypatch)


def line_of(keyboard: Keyboard) -> str | None:
    for _ in range(100):
        if (line := keyboard.line()) is not None:
            return line
    return None


@pytest.mark.parametrize(
    ("typed", "line"),
    [
        ("40.07,-105.22\n", "40.07,-105.22"),
        ("40.08\x7f7\r", "40.07"),
        ("wrong\x15right\n", "right"),
        ("one two\x17three\n", "onethree"),
        ("é\x7fe\n", "e"),
        ("\x1b[D\x1b[3~\x1bOAyes\n", "yes"),
        ("\x7f\x7f\x04\tgo\n", "go"),
        ("yes\nno", "yes"),
    ],
)
def test_lines_are_edited_as_the_terminal_would(terminal, typed, line):
    keyboard = Keyboard()
    keyboard.take()
    assert keyboard.is_shown_by_us
    terminal.type(typed)
    assert line_of(keyboard) == line
    assert keyboard.typing == ("no" if typed.endswith("no") else "")
    keyboard.give_back()


def test_what_is_typed_is_known_before_its_line_ends(terminal):
    keyboard = Keyboard()
    keyboard.take()
    terminal.type("40.0")
    assert line_of(keyboard) is None
    assert keyboard.typing == "40.0"
    keyboard.forget()
    assert keyboard.typing == ""
    keyboard.give_back()


def test_the_terminal_is_given_back_as_it_was(terminal):
    before = terminal.modes()
    keyboard = Keyboard()
    for _ in range(2):
        keyboard.take()
        keyboard.take()
        assert terminal.modes() != before
        keyboard.give_back()
        keyboard.give_back()
        assert terminal.modes() == before
    assert not keyboard.is_shown_by_us


def test_what_is_no_terminal_is_left_alone(monkeypatch):
    ours, theirs = os.pipe()
    with os.fdopen(ours) as pipe:
        monkeypatch.setattr(sys, "stdin", pipe)
        keyboard = Keyboard()
        keyboard.take()
        assert not keyboard.is_shown_by_us
    os.close(theirs)
