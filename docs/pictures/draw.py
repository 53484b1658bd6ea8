"""Draw the pictures of this folder, each by the command on the page that shows it: ``python docs/pictures/draw.py``."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
_BLOCK = re.compile(r"^```sh\n(.*?)^```", re.DOTALL | re.MULTILINE)
_PICTURE = re.compile(r"\]\((?:\.\./)?pictures/([\w-]+\.png)\)")


def practice_folder(folder: Path) -> None:
    """Fill a folder with what the pages take for granted: a yard, its mission, logs, the fields of the tests."""
    fields, logs = ROOT / "tests" / "fields", ROOT / "sitl_logs"
    shutil.copytree(ROOT / "examples" / "yard", folder, dirs_exist_ok=True)
    shutil.copytree(fields, folder / "tests" / "fields")
    shutil.copytree(logs, folder / "sitl_logs")
    shutil.copy(fields / "yard-mission.waypoints", folder / "mission.waypoints")
    for name in ("field.tlog", "flight.tlog"):
        shutil.copy(logs / "guided-maze.tlog", folder / name)


def pictures_of(page: Path) -> list[str]:
    """Return the names of the pictures of this folder that a page shows."""
    return list(dict.fromkeys(_PICTURE.findall(page.read_text(encoding="utf-8"))))


def commands_of(page: Path) -> list[list[str]]:
    """Return a page's commands that need no vehicle."""
    lines = "".join(_BLOCK.findall(page.read_text(encoding="utf-8"))).splitlines()
    found = (shlex.split(line, comments=True) for line in lines if line.startswith("pbpp "))
    return [words for words in found if "--connect" not in words]


def pictures_made_by(page: Path) -> list[str]:
    """Return those of a page's pictures that a command on it draws."""
    words = {word for command in commands_of(page) for word in command}
    return [picture for picture in pictures_of(page) if picture in words]


def draw(page: Path) -> None:
    """Do what a page says, and take over the pictures that it shows."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        practice_folder(folder)
        for words in commands_of(page):
            if words[1] in (
                "plan",
                "rally",
                "check",
                "log",
            ):  # some of them end with an error, as the page says
                subprocess.run(
                    [sys.executable, "-m", "mavlink_bridge.cli", *words[1:], "-q"],
                    cwd=folder,
                    env={**os.environ, "XDG_STATE_HOME": name},
                    check=False,
                    stderr=subprocess.DEVNULL,
                )
        for picture in pictures_made_by(page):
            # By coverage: the median cut turned the yellow of targets brown where there was much else.
            few_colours = (
                Image.open(folder / picture)
                .convert("RGB")
                .quantize(128, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
            )
            few_colours.save(HERE / picture, optimize=True)  # a third of the bytes


if __name__ == "__main__":
    for page in sorted((ROOT / "docs").rglob("*.md")):
        if pictures_made_by(page):
            draw(page)
