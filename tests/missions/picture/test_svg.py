"""SVG files: written without matplotlib, whole, harmless, and read by who does not see them."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from matplotlib import get_data_path
from matplotlib.ft2font import FT2Font

from missions.picture import font
from missions.picture.drawing import DrawnPage, Look, Outlines, Spot, Words
from missions.picture.page import scene_drawing
from missions.picture.plans import plan_scene
from missions.picture.svg import _path, svg_bytes

if TYPE_CHECKING:
    from missions.picture.scene import PictureScene
    from missions.planned import Plan

SVG = "{http://www.w3.org/2000/svg}"


def test_drawing_an_svg_loads_no_matplotlib(fields: Path, tmp_path: Path) -> None:
    code = (
        "import sys; sys.modules['matplotlib'] = None; from mavlink_bridge.cli import main\n"
        f"sys.argv = ['pbpp', 'plan', '--fence', {str(fields / 'yard-fence.waypoints')!r}, '--start', '40.071374,-105.229930',"
        " '--target', '40.0720926,-105.2286152', '--plot', 'a.svg']\n"
        "main()"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=tmp_path, capture_output=True)
    assert ET.parse(tmp_path / "a.svg").getroot().tag == f"{SVG}svg"


def test_every_part_is_written_where_it_is(scene: PictureScene) -> None:
    drawing = scene_drawing(scene)
    root = ET.fromstring(svg_bytes(drawing))
    parts = (*drawing.inside, *drawing.around)
    assert root.get("viewBox") == f"0 0 576 {drawing.height_pt:.2f}".rstrip("0").rstrip(".")
    kinds = {Outlines: "path", Spot: "circle", Words: "text"}
    written = [node for node in root.iter() if node.get("class")]
    assert [node.get("class") for node in written] == [part.name for part in parts]
    assert [node.tag for node in written] == [SVG + kinds[type(part)] for part in parts]
    for node, part in zip(written, parts, strict=True):
        if isinstance(part, Outlines):
            for text, line in zip(str(node.get("d")).split("M")[1:], part.lines, strict=True):
                steps = [pair.split(",") for pair in text.rstrip("z").split("l")]
                places = np.cumsum(np.array(steps, dtype=float), axis=0)
                assert np.abs(places - line).max() < 0.0051
                assert text.endswith("z") == part.is_closed
        elif isinstance(part, Words):
            assert node.text == part.text
    (group,) = root.findall(f"{SVG}g")
    assert len(group) == len(drawing.inside)
    assert group.get("clip-path") == "url(#pbpp-frame)"


def test_it_says_what_it_shows(plans: dict[str, Plan]) -> None:
    root = ET.fromstring(svg_bytes(scene_drawing(plan_scene(plans["yard"], title="Yard <1> & 'co'"))))
    title, description = (root.find(f"{SVG}{name}") for name in ("title", "desc"))
    assert title is not None
    assert description is not None
    assert root.get("role") == "img"
    assert root.get("aria-labelledby") == f"{title.get('id')} {description.get('id')}"
    assert title.text == "Yard <1> & 'co'"
    words = str(description.text)
    assert "north up, with a scale bar of 20 m" in words
    assert "inclusion; predicted corridor; route" in words
    assert "exclusion polygon 1" in words


def test_names_from_files_are_text(plans: dict[str, Plan]) -> None:
    name = "</text><b>\x07\"'"
    plan = plans["yard"]
    barriers = tuple(replace(barrier, name=name) for barrier in plan.ground.barriers)
    data = svg_bytes(scene_drawing(plan_scene(replace(plan, ground=replace(plan.ground, barriers=barriers)))))
    root = ET.fromstring(data)
    assert {node.tag for node in root.iter()} == {
        SVG + tag for tag in ("svg", "title", "desc", "clipPath", "path", "rect", "g", "circle", "text")
    }
    assert any("</text><b>\\x07" in (node.text or "") for node in root.iter(f"{SVG}text"))


def test_looks() -> None:
    line = np.array(((0.0, 0.0), (3.0, 4.004)))
    look = Look("#112233", "#445566", 1.5, (3.0, 1.25), opacity=0.5)
    drawing = page_of(Outlines("a", (line,), look), Words("b", "up", (1, 2), 8, is_upward=True))
    path, text = (node for node in ET.fromstring(svg_bytes(drawing)).iter() if node.get("class"))
    assert path.attrib == {
        "class": "a", "d": "M0,0l3,4", "fill": "#112233", "fill-opacity": "0.5", "stroke": "#445566",
        "stroke-width": "1.5", "stroke-dasharray": "3 1.25", "stroke-opacity": "0.5",
    }  # fmt: skip
    assert text.get("transform") == "translate(1,2)rotate(-90)"
    assert text.get("textLength") == f"{font.width_pt('up', 8):.2f}"


def page_of(*parts: Outlines | Words) -> DrawnPage:
    return DrawnPage(10, 10, "t", "d", (0, 0, 10, 10), parts, ())


def test_widths_are_those_of_the_font() -> None:
    real = FT2Font(str(Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"))
    real.set_size(1000, 72)
    for character in (*map(chr, range(0x20, 0x7F)), "×", "−", "À", "é", "ß", "Ω"):
        advance = real.load_char(ord(character)).linearHoriAdvance / 65536
        if font.is_known(character) or character in "Àé":
            assert font.width_pt(character, 1000) == pytest.approx(advance, abs=0.5)
        else:
            assert font.width_pt(character, 1000) >= advance
    assert font.width_pt("道", 10) == 10
    assert font.width_pt("e\u0301", 10) == pytest.approx(font.width_pt("e", 10))


def test_lines_from_far_outside_the_frame_come_in_at_their_place():
    """A path's points are told from one to the next: what the first one lacks, all that follow would be off by."""
    path = _path(np.array([[-1234564.25, 12345.67], [10.5, 20.25], [30.0, 40.0]]))
    told = [tuple(map(float, step.split(","))) for step in path[1:].split("l")]
    assert np.cumsum(told, axis=0)[1:] == pytest.approx(np.array([[10.5, 20.25], [30.0, 40.0]]), abs=0.006)
