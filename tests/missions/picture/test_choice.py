"""Which suffix draws what, and what is said where none does."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from missions import picture
from missions.errors import MissionFormatError
from missions.picture import PICTURE_SUFFIXES, check_picture_format, draw_plan

if TYPE_CHECKING:
    from missions.planned import Plan


def test_known_suffixes() -> None:
    assert PICTURE_SUFFIXES == (".png", ".svg", ".pdf")
    for suffix in (*PICTURE_SUFFIXES, ".SVG"):
        check_picture_format(Path(f"x{suffix}"))
    check_picture_format(Path("-"))


def test_what_the_caller_writes_itself_is_no_matter_of_ours() -> None:
    with pytest.raises(
        MissionFormatError, match=r"x\.HTML: '\.HTML' is not .*: \.png, \.svg, \.pdf, and - for"
    ) as found:
        check_picture_format("x.HTML")
    assert "plan_page" in str(found.value.details["advice"])
    check_picture_format("x.HTML", beside=(".html",))
    with pytest.raises(MissionFormatError, match=r"\.pdf, \.html, and - for"):
        check_picture_format("x.bmp", beside=(".html",))


def test_unknown_suffixes() -> None:
    with pytest.raises(
        MissionFormatError,
        match=r"x\.bmp: '\.bmp' is not a supported picture format; supported: \.png, .*, and - for",
    ):
        check_picture_format(Path("x.bmp"))


@pytest.mark.parametrize("suffix", [".png", ".pdf"])
def test_a_library_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch, suffix: str) -> None:
    monkeypatch.setattr(picture, "find_spec", lambda _name: None)
    with pytest.raises(MissionFormatError, match=rf"{suffix} pictures need matplotlib: pip install"):
        check_picture_format(Path(f"x{suffix}"))
    check_picture_format(Path("x.svg"))


@pytest.mark.parametrize("suffix", [".png", ".svg"])
def test_files_that_cannot_be_written(plans: dict[str, Plan], tmp_path: Path, suffix: str) -> None:
    with pytest.raises(MissionFormatError, match=rf"x{suffix} cannot be written: No such file"):
        draw_plan(plans["union"], tmp_path / "none" / f"x{suffix}")


def test_checking_a_format_loads_no_drawing_library() -> None:
    code = (
        "import sys; from pathlib import Path; from missions.picture import check_picture_format;"
        "check_picture_format(Path('x.png'));"
        "print([name for name in ('matplotlib',) if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
