"""Drawings as SVG, written with the standard library: for who sees them, and by title and description for who does not."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from missions.picture.drawing import Outlines, Spot
from missions.picture.font import FAMILY, is_known, width_pt

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from missions.picture.drawing import DrawnPage, Look, Part, Words

_FONTS = f"{FAMILY}, Verdana, sans-serif"  # Verdana is about as wide


def svg_bytes(drawing: DrawnPage) -> bytes:
    """Return a drawing as an SVG file: the same bytes for the same drawing."""
    return ("\n".join(_lines(drawing)) + "\n").encode()


def _lines(drawing: DrawnPage) -> Iterator[str]:
    left, top, right, bottom = drawing.frame
    width, height = _number(drawing.width_pt), _number(drawing.height_pt)
    yield '<?xml version="1.0" encoding="utf-8"?>'
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}pt" height="{height}pt" viewBox="0 0 {width} {height}" '
        f'role="img" aria-labelledby="pbpp-title pbpp-description" font-family="{_FONTS}" stroke-linejoin="round" xml:space="preserve">'
    )
    yield f'<title id="pbpp-title">{escape(drawing.title)}</title>'
    yield f'<desc id="pbpp-description">{escape(drawing.description)}</desc>'
    yield f'<clipPath id="pbpp-frame"><path d="M{_number(left)},{_number(top)}H{_number(right)}V{_number(bottom)}H{_number(left)}z"/></clipPath>'
    yield '<rect width="100%" height="100%" fill="#ffffff"/>'
    yield '<g clip-path="url(#pbpp-frame)">'
    yield from map(_element, drawing.inside)
    yield "</g>"
    yield from map(_element, drawing.around)
    yield "</svg>"


def _element(part: Part) -> str:
    if isinstance(part, Outlines):
        path = "".join(_path(line) + ("z" if part.is_closed else "") for line in part.lines)
        return f'<path class="{part.name}" d="{path}"{_attributes(part.look)}/>'
    if isinstance(part, Spot):
        x, y = map(_number, part.middle)
        look = _attributes(part.look)
        return f'<circle class="{part.name}" cx="{x}" cy="{y}" r="{_number(part.radius_pt)}"{look}/>'
    return _text(part)


def _text(words: Words) -> str:
    x, y = map(_number, words.at)
    place = f'transform="translate({x},{y})rotate(-90)"' if words.is_upward else f'x="{x}" y="{y}"'
    anchor = ' text-anchor="middle"' if words.is_centred else ""
    weight = ' font-weight="bold"' if words.is_bold else ""
    color = "" if words.color == "#000000" else f' fill="{words.color}"'
    width = ""
    if is_known(words.text) and not words.is_bold:  # so that it takes up its own room in any font
        length = _number(width_pt(words.text, words.size_pt))
        width = f' textLength="{length}" lengthAdjust="spacingAndGlyphs"'
    size = _number(words.size_pt)
    return f'<text class="{words.name}" {place} font-size="{size}"{anchor}{weight}{color}{width}>{escape(words.text)}</text>'


def _attributes(look: Look) -> str:
    opacity = _number(look.opacity)
    found = f' fill="{look.fill or "none"}"'
    if look.fill is not None and look.opacity < 1:
        found += f' fill-opacity="{opacity}"'
    if look.line is None:
        return found
    found += f' stroke="{look.line}" stroke-width="{_number(look.width_pt)}"'
    if look.dashes_pt:
        found += f' stroke-dasharray="{" ".join(map(_number, look.dashes_pt))}"'
    return found if look.opacity == 1 else f'{found} stroke-opacity="{opacity}"'


def _path(line: NDArray[np.float64]) -> str:
    """Return a line's points, to a hundredth of a point, the first absolute and the others from one to the next."""
    places = (line * 100).round().astype(int)
    steps = places.copy()
    steps[1:] -= places[:-1]
    (x, y), *others = (steps / 100).tolist()
    return f"M{_number(x)},{_number(y)}" + "".join(f"l{_number(dx)},{_number(dy)}" for dx, dy in others)


def _number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")
