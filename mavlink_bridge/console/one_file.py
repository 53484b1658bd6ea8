"""The console's page as one file with its data inside: opened from a disk, without a server and without one request.

The modules are those that the server serves, put together beforehand (`bundle.js`, made by ``make bundle``); the map's library and its worker
are the vendored files. Which scripts and styles may run stands in the file's Content-Security-Policy by their hashes, and nothing may be loaded.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from html import escape
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from mavlink_bridge.console.view.sections import ServerView
from missions.words import harmless

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from mavlink_bridge.console.view.sections import EventView, Place, TrackRow

_HERE: Final = Path(__file__).parent
_MAP: Final = _HERE / "page" / "vendor" / "maplibre-gl"
_EXPORTS: Final = "export{"
_NO_SCRIPT: Final = "This page needs JavaScript to show what is in it."
_LOADS: Final = (
    "default-src 'none'",
    # The map's worker stands in the file: it is handed on as a blob, or where a browser takes none from a disk as data.
    "worker-src blob: data:",
    "connect-src blob:",
    "img-src data: blob:",
    "base-uri 'none'",
    "form-action 'none'",
)


@dataclass(frozen=True, slots=True)
class NamedLine:
    """A line that is drawn besides, with its name."""

    name: str
    places: tuple[Place, ...]


@dataclass(frozen=True, slots=True)
class NamedMark:
    """A place that must not be missed, with its name; ``icon`` is ``blocked`` or ``target``."""

    name: str
    at: Place
    icon: str = "blocked"


@dataclass(frozen=True, slots=True)
class StillMoment:
    """A moment of a log: the sections, and fields of sections, that differ from those of the moment before."""

    time_s: float
    whole: Mapping[str, Any]
    parts: Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class StillPage:
    """What a page in one file shows.

    Parameters
    ----------
    title : tuple of str
        The lines above it; the first is the page's title.
    sections : mapping
        As the server sends them, all but ``server``.
    events, track : sequence
        Of a log.
    moments : sequence of StillMoment
        Of a log; the first holds its sections whole.
    notes : sequence of str
        What was found.
    lines, marks : sequence
        What is drawn besides.
    """

    title: tuple[str, ...]
    sections: Mapping[str, Any]
    events: Sequence[EventView] = ()
    track: Sequence[TrackRow] = ()
    moments: Sequence[StillMoment] = ()
    notes: Sequence[str] = ()
    lines: Sequence[NamedLine] = ()
    marks: Sequence[NamedMark] = field(default=())


def page_bytes(page: StillPage) -> bytes:
    """Return a page as one file (UTF-8). The same page gives the same bytes."""
    styles, licences, worker, scripts = _parts()
    policy = [*_LOADS, f"script-src {_hashes(scripts)}", f"style-src {_hashes(styles)}"]
    title = escape(harmless(page.title[0] if page.title else ""), quote=False)
    return "\n".join(
        (
            "<!doctype html>",
            '<html lang="en">',
            "<head>",
            '<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{escape("; ".join(policy))}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<meta name="color-scheme" content="light dark">',
            '<link rel="icon" href="data:,">',
            f"<title>{title} – PBPP Rover</title>",
            *(f"<style>{style}</style>" for style in styles),
            f'<script type="text/plain" id="licences">{licences}</script>',
            f'<script type="application/json" id="inside">{_data(page)}</script>',
            f'<script type="text/plain" id="map-worker">{worker}</script>',
            *(f'<script type="module">{script}</script>' for script in scripts),
            "</head>",
            f"<body><noscript>{_NO_SCRIPT}</noscript></body>",
            "</html>\n",
        )
    ).encode()


def _data(page: StillPage) -> str:
    """Return the page's data as JSON that cannot end the element it stands in, nor begin a comment there."""
    source = "log" if page.moments else "files"
    name = page.title[0] if page.title else ""
    server = ServerView(version=version("pbpp-rover"), run_id="", source=source, source_name=name)  # type: ignore[arg-type] # one of its words
    message = {
        "type": "snapshot",
        "seq": 0,
        "you": "",
        "time_s": 0.0,
        "state": {"server": server, **page.sections},
        "events": page.events,
        "track": page.track,
    }
    held = {
        "title": page.title,
        "message": message,
        "moments": page.moments,
        "notes": page.notes,
        "lines": page.lines,
        "marks": page.marks,
    }
    text = json.dumps(plain(held), separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def plain(value: Any) -> Any:  # noqa: ANN401 - whatever sections hold
    """Return what is shown as JSON has it: numbers that are not finite are null, and every character of a text can be seen."""
    if isinstance(value, str):
        return harmless(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if is_dataclass(value):
        return {one.name: plain(getattr(value, one.name)) for one in fields(value)}
    if isinstance(value, dict):
        return {harmless(str(key)): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    return value


@cache
def _parts() -> tuple[tuple[str, ...], str, str, tuple[str, ...]]:
    """Return styles, licences, the map's worker, and the scripts in the order in which they run."""
    styles = (_text(_MAP / "maplibre-gl.css"), _text(_HERE / "page" / "page.css"))
    licences = "\n".join(_text(_MAP / name) for name in ("LICENSE.txt", "LICENSES-INSIDE.txt"))
    worker = _without_map(_text(_MAP / "maplibre-gl-worker.mjs"))
    return styles, licences, worker, (_library(), _text(_HERE / "bundle.js"))


def _text(path: Path) -> str:
    """Return a file that is put into the page as it is: nothing in it ends the element that it stands in."""
    text = path.read_text(encoding="utf-8")
    low = text.lower()
    assert not any(sign in low for sign in ("</script", "<!--", "</style")), path
    return text


def _library() -> str:
    """Return the map's library as a script that leaves its names to the one after it, in place of exporting them to other files."""
    begin, sign, end = _without_map(_text(_MAP / "maplibre-gl.mjs")).rpartition(_EXPORTS)
    assert sign, "the map's library exports nothing"
    names = (name.split(" as ") for name in end.rstrip().rstrip(";").removesuffix("}").split(","))
    return f"{begin}globalThis.maplibre={{{','.join(f'{name[-1]}:{name[0]}' for name in names)}}};\n"


def _without_map(script: str) -> str:
    """Return a script without the address of its source map, for which a browser's tools would ask."""
    return "\n".join(line for line in script.split("\n") if not line.startswith("//# sourceMappingURL"))


def _hashes(texts: Sequence[str]) -> str:
    digests = (hashlib.sha256(text.encode()).digest() for text in texts)
    return " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
