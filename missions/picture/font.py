"""How wide words are in DejaVu Sans, which matplotlib brings along: known without it, so that names find their places in every picture alike."""

from __future__ import annotations

import unicodedata
from typing import Final

FAMILY: Final = "DejaVu Sans"

_UNITS: Final = 2048  # an em
_ASCII: Final = (
    651, 821, 942, 1716, 1303, 1946, 1597, 563, 799, 799, 1024, 1716, 651, 739, 651, 690,
    1303, 1303, 1303, 1303, 1303, 1303, 1303, 1303, 1303, 1303, 690, 690, 1716, 1716, 1716, 1087,
    2048, 1401, 1405, 1430, 1577, 1294, 1178, 1587, 1540, 604, 604, 1343, 1141, 1767, 1532, 1612,
    1235, 1612, 1423, 1300, 1251, 1499, 1401, 2025, 1403, 1251, 1403, 799, 690, 799, 1716, 1024,
    1024, 1255, 1300, 1126, 1300, 1260, 721, 1300, 1298, 569, 569, 1186, 569, 1995, 1298, 1253,
    1300, 1300, 842, 1067, 803, 1298, 1212, 1675, 1212, 1212, 1075, 1303, 690, 1303, 1716,
)  # fmt: skip
"""Advances of the characters from the blank to ``~``: table ``hmtx`` of DejaVuSans.ttf 2.37; a test reads it."""

_WIDTHS: Final = {chr(code): advance / _UNITS for code, advance in enumerate(_ASCII, start=0x20)} | {
    "×": 1716 / _UNITS,
    "−": 1716 / _UNITS,
}
_OTHER: Final = 0.8  # of an em, for letters that are not in the table; chosen: most are narrower

ASCENT: Final = 0.76  # of an em, of ``l`` and ``d``
CAPITALS: Final = 0.73
DESCENT: Final = 0.24  # of ``p`` is 0.21, of ``|`` 0.24
LINE: Final = 1.2  # from one baseline to the next


def width_pt(text: str, size_pt: float) -> float:
    """Return how wide a line of text is, or a little more where it has letters that are not known here."""
    return size_pt * sum(_em(character) for character in text)


def is_known(text: str) -> bool:
    """Return whether all characters are known, so that `width_pt` is right but for kerning."""
    return all(character in _WIDTHS for character in text)


def _em(character: str) -> float:
    plain = unicodedata.normalize("NFD", character)[0]  # À is as wide as A
    if plain in _WIDTHS:
        return _WIDTHS[plain]
    if unicodedata.combining(plain):
        return 0.0
    return 1.0 if unicodedata.east_asian_width(plain) in "WF" else _OTHER
