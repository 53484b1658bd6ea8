"""MAVProxy's console, driven by script: what is typed, and what must have come of it."""

from __future__ import annotations

import subprocess
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path


class Console:
    """A MAVProxy process connected to a simulated rover.

    Parameters
    ----------
    python : Path
        The interpreter of its virtual environment.
    connection : str
        The rover's.
    folder : Path
        Where it keeps its state, its log ``mav.tlog`` and its console's text.
    """

    def __init__(self, python: Path, connection: str, folder: Path) -> None:
        self.folder = folder
        self._text = folder / "console.txt"
        self._command = [
            str(python),
            str(python.parent / "mavproxy.py"),
            f"--master={connection}",
            f"--state-basedir={folder}",
        ]

    def __enter__(self):
        with self._text.open("w") as text:
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.PIPE, stdout=text, stderr=text, text=True, cwd=self.folder
            )
        try:
            assert soon(lambda: "online system 1" in self.said), f"it never came online:\n{self.said}"
        except AssertionError:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self._process.kill()  # asked to end, it waits for its console
        self._process.wait()
        self._process.stdin.close()

    @property
    def said(self) -> str:
        """Everything it has printed."""
        return self._text.read_text()

    def do(self, text, holds, what):
        """Type a line and wait until it has worked; return what to tell."""
        self._process.stdin.write(text + "\n")
        self._process.stdin.flush()
        assert soon(holds), f"{text}: not so: {what}; its console said:\n{self.said[-2000:]}"
        return f"{text.split(str(self.folder))[0].strip()}: {what}"

    def save(self, command, name, count):
        """Let it read a list back into a file of its folder; return the file and what to tell."""
        path = self.folder / name
        told = self.do(
            f"{command} {path}",
            lambda: path.exists() and len(path.read_text().splitlines()) == count + 1,
            "it read the list back",
        )
        return path, told


def soon(condition, within_s=60.0):
    """Wait until something is so; tell whether it is."""
    until_s = time.monotonic() + within_s
    while time.monotonic() < until_s:
        if condition():
            return True
        time.sleep(0.1)
    return False
