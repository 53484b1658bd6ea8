"""Every code block of the documentation is run: shell commands, sessions and Python, in a folder with a field, a log and parameters.

Blocks of a page run one after the other in one folder, Python in one namespace. Where a command connects, it is a simulated rover it connects
to. ``# exit N`` behind a command is the exit code it must have. Blocks that cannot be run here have their reason above them:
``<!-- not run: REASON -->``.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.simulator import Simulator, SimulatorConfig
from missions.fence import fence_to_items
from missions.formats import read_fence, read_parameters, read_situation
from missions.geo import LatLon

ROOT = Path(__file__).parents[1]
_SPEC = importlib.util.spec_from_file_location("drawing", ROOT / "docs" / "pictures" / "draw.py")
drawing = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(drawing)
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
RUN = ("sh", "console", "python")
_BLOCK = re.compile(
    r"(?:<!-- not run: (?P<reason>[^\n]+) -->\n)?^```(?P<language>[\w-]*)[^\n]*\n(?P<text>.*?)^```",
    re.DOTALL | re.MULTILINE,
)
_CONNECTION = re.compile(r"(?:udpin|udpout|tcpin|tcp):[\w.]+:\d+|/dev/tty\w+(?:,\d+)?")
_EXIT = re.compile(r"#(?:.*:)?\s*exit (\d+)\s*$")
_SHELL = re.compile(r"[|;&<>*$`~]")
PADDOCK = '{"type": "Polygon", "coordinates": [[[-105.23, 40.071], [-105.228, 40.071], [-105.228, 40.072], [-105.23, 40.071]]]}'
HOME = LatLon(40.071374, -105.229930)


def test_the_files_to_practise_with_are_of_one_yard():
    yard, fields = ROOT / "examples" / "yard", ROOT / "tests" / "fields"
    fence = read_fence(fields / "yard-fence.waypoints")
    assert read_fence(yard / "fence.waypoints") == fence
    planned = read_situation(yard / "field.plan")
    assert planned.home.value == HOME
    assert [zone.kind for zone in planned.fence.value.zones] == [zone.kind for zone in fence.zones]
    drawn, wanted = yard / "drawn.waypoints", fields / "yard-mission.waypoints"
    assert drawn.read_text(encoding="utf-8") == wanted.read_text(encoding="utf-8")
    assert read_parameters(yard / "rover.parm")["FENCE_MARGIN"] == 2.0


def blocks(page: Path) -> list[re.Match]:
    return list(_BLOCK.finditer(page.read_text(encoding="utf-8")))


RUNNABLE = [
    page for page in PAGES if any(block["language"] in RUN and not block["reason"] for block in blocks(page))
]
NOT_RUN = [
    pytest.param(block["reason"], id=f"{page.relative_to(ROOT)}:{number}")
    for page in PAGES
    for number, block in enumerate(blocks(page))
    if block["reason"]
]


@pytest.fixture
def place(tmp_path, monkeypatch) -> Path:
    """A folder as the pages take it for granted."""
    drawing.practice_folder(tmp_path)
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    shutil.copy(ROOT / "tests" / "fields" / "maze-fence.waypoints", tmp_path / "maze.waypoints")
    (tmp_path / "paddock.geojson").write_text(PADDOCK)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setattr("shellingham.detect_shell", lambda *_: ("bash", "/bin/bash"))  # which the reader uses
    monkeypatch.setattr("serial.tools.list_ports.comports", list)  # whoever may use this computer's
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    assert CliRunner().invoke(app, ["convert", "fence.waypoints", "field.kml"]).exit_code == 0
    return tmp_path


class Reader:
    """Somebody who does what the page says."""

    def __init__(self) -> None:
        self.connection: str | None = None
        self._processes: list[subprocess.Popen] = []
        self._simulator: Simulator | None = None
        self._names: dict[str, object] = {"__name__": "page"}

    def close(self) -> None:
        for process in self._processes:
            _interrupted(process)
        if self._simulator is not None:
            self._simulator.__exit__(None, None, None)

    def read(self, language: str, text: str) -> None:
        if language == "python":
            exec(compile(text, "page", "exec"), self._names)
        elif language == "sh":
            for line in _commands(text):
                self.run(line)
        else:
            for session in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                line, _, shown = session.partition("\n")
                _compare(shown, self.run(line))

    def run(self, line: str) -> str:
        """Run a command; return what it told on stdout and stderr."""
        expected = int(found[1]) if (found := _EXIT.search(line)) else 0
        words = shlex.split(line, comments=True)
        if words[:2] == ["pbpp", "sim"]:
            return self._start_simulator(words)
        line = _CONNECTION.sub(lambda _: self._connect(), line)
        words = shlex.split(line, comments=True)
        if words[:2] == ["pbpp", "bridge"] and "--once" not in words:
            return self._listen_for_a_while(words)
        if words[:2] == ["pbpp", "replay"] and "--send" in words:
            words[words.index("--send") + 1] = "udpout:127.0.0.1:9"
            words[words.index("--speed") + 1] = "1e6"
        elif words[0] != "pbpp" or _SHELL.search(shlex.join(words).replace("'", "")):
            done = subprocess.run(
                ["bash", "-euc", line], capture_output=True, text=True, timeout=120, check=False
            )
            assert done.returncode == expected, f"{line}\n{done.stdout}{done.stderr}"
            return done.stdout + done.stderr
        result = CliRunner().invoke(app, words[1:])
        assert result.exit_code == expected, f"{line}\n{result.output}"
        return result.output

    def _connect(self) -> str:
        if self.connection is None:
            fence = fence_to_items(read_fence(Path("fence.waypoints")))
            config = SimulatorConfig(
                home=HOME, fence=fence, parameters=dict(read_parameters(Path("rover.parm")))
            )
            self._simulator = Simulator(config, "tcpin:127.0.0.1:0", speedup=5.0).__enter__()
            self.connection = self._simulator.connection
        return self.connection

    def _start_simulator(self, words: list[str]) -> str:
        command = [sys.executable, "-m", "mavlink_bridge.cli", *words[1:], "--listen", "tcpin:127.0.0.1:0"]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self._processes.append(process)
        self.connection = process.stdout.readline().strip()
        assert self.connection.startswith("tcp:"), process.stderr.read()
        return self.connection

    @staticmethod
    def _listen_for_a_while(words: list[str]) -> str:
        """Run the bridge until it has learnt the vehicle, then press Ctrl-C."""
        command = [sys.executable, "-m", "mavlink_bridge.cli", *words[1:], "--json"]
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.PIPE, text=True
        )
        events = []
        try:
            for line in process.stdout:
                events.append(json.loads(line).get("event"))
                if events[-1] == "learnt":
                    break
        finally:
            errors = _interrupted(process)
        assert (process.returncode, events[-1]) == (130, "learnt"), errors
        return ""


def _interrupted(process: subprocess.Popen) -> str:
    """Press Ctrl-C; return what it told last. Whatever happens, nothing goes on running beside the next page."""
    process.send_signal(signal.SIGINT)
    try:
        return process.communicate(timeout=60)[1]
    finally:
        process.kill()
        process.communicate()


def _commands(text: str) -> list[str]:
    joined = text.replace("\\\n", " ")
    return [
        line.strip() for line in joined.splitlines() if line.strip() and not line.lstrip().startswith("#")
    ]


def _compare(shown: str, told: str) -> None:
    """Each line that a session shows was told; numbers may be others."""
    lines = {_bare(line) for line in told.splitlines()}
    for line in filter(None, map(str.strip, shown.splitlines())):
        assert _bare(line) in lines, f"not told: {line}\n{told}"


def _bare(line: str) -> str:
    return re.sub(r"\d+(?:\.\d+)?", "#", line.strip())


@pytest.mark.timeout(900)  # a page is many commands, each with a limit of its own
@pytest.mark.parametrize("page", RUNNABLE, ids=lambda page: str(page.relative_to(ROOT)))
def test_what_a_page_says_can_be_done(page, place):
    reader = Reader()
    try:
        for block in blocks(page):
            if block["language"] in RUN and not block["reason"]:
                reader.read(block["language"], block["text"])
    finally:
        reader.close()
    for picture in drawing.pictures_made_by(page) if page.is_relative_to(ROOT / "docs") else ():
        assert difference(place / picture, ROOT / "docs" / "pictures" / picture) < 3, f"make docs: {picture}"


def difference(made: Path, shown: Path) -> float:
    """Return by how much pictures differ in the mean, of 255: other versions of the library draw letters a little differently."""
    images = [Image.open(path).convert("L") for path in (made, shown)]
    assert images[0].size == images[1].size, f"make docs: {shown.name}"
    return float(np.abs(np.subtract(*(np.asarray(image, dtype=float) for image in images))).mean())


def test_every_picture_is_made_by_a_command_and_shown():
    made = [name for page in PAGES[1:] for name in drawing.pictures_made_by(page)]
    shown = {name for page in PAGES[1:] for name in drawing.pictures_of(page)}
    there = {path.name for path in (ROOT / "docs" / "pictures").glob("*.png")}
    assert len(made) == len(set(made)) > 5
    assert set(made) == shown == there


@pytest.mark.parametrize("reason", NOT_RUN)
def test_what_is_not_run_says_why(reason):
    """So that the reasons show in the report."""
    assert len(reason.split()) >= 2
    pytest.skip(f"not run: {reason}")


def test_most_blocks_are_run():
    every = [block for page in PAGES for block in blocks(page) if block["language"] in RUN]
    left_out = [block for block in every if block["reason"]]
    assert len(every) > 40
    assert len(left_out) <= len(every) // 4
