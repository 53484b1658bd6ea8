"""The parts of the documentation that are made from the code: `python docs/generated.py` brings them up to date.

A part stands between ``<!-- made: NAME -->`` and ``<!-- end -->``; a test checks that each is as the code says.
"""

from __future__ import annotations

import inspect
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

from mavlink_bridge.cli.app import COMMANDS, load
from mavlink_bridge.director import SCHEMA, TRANSITIONS

DOCS = Path(__file__).parent
_PART = re.compile(r"(<!-- made: ([a-z-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def event_table() -> str:
    """Give the table of the bridge's events."""
    rows = [
        f"| `{name}` | {severity.name.lower()} | {', '.join(f'`{key}`' for key in keys) or '—'} |"
        for name, (severity, keys) in SCHEMA.items()
    ]
    return "\n".join(["| event | severity | data |", "|---|---|---|", *rows])


def director_diagram() -> str:
    """Give the director's state diagram, in Mermaid's language."""
    lines = ["```mermaid", "stateDiagram-v2", "    [*] --> listening"]
    for state, row in TRANSITIONS.items():
        cues = defaultdict(list)
        for cue, after in row.items():
            cues[after].append(str(cue))
        lines += [f"    {state} --> {after}: {', '.join(names)}" for after, names in cues.items()]
        if not row:
            lines.append(f"    {state} --> [*]")
    return "\n".join([*lines, "```"])


def commands() -> str:
    """Give every command's options, from the command line itself."""
    parts = []
    for name, command in sorted((name, load(name)) for name in COMMANDS):
        rows = [
            _option_row(parameter) for parameter in command.params if not getattr(parameter, "hidden", False)
        ]
        text = inspect.cleandoc(command.help or "")
        table = "\n".join(["| option | meaning | default |", "|---|---|---|", *rows])
        parts.append(f"## pbpp {name}\n\n{text}\n\n{table}")
    return "\n\n".join(parts)


def _option_row(parameter: Any) -> str:  # noqa: ANN401 - the command line's own type
    is_option = parameter.param_type_name == "option"
    word = parameter.metavar or parameter.name.upper()
    names = parameter.opts if is_option else [word]
    metavar = f" {word}" if is_option and not getattr(parameter, "is_flag", False) else ""
    shown = ", ".join(f"`{name}{metavar}`" for name in names)
    meaning = getattr(parameter, "help", None) or ""
    default = parameter.default
    is_shown = default != "" and isinstance(default, (str, int, float)) and not isinstance(default, bool)
    cells = (shown, meaning, f"`{default}`" if is_shown else "")
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


PARTS = {"bridge-events": event_table, "commands": commands, "director-states": director_diagram}


def renewed(text: str) -> str:
    """Give a page's text with its made parts as the code says."""
    return _PART.sub(lambda found: f"{found[1]}{PARTS[found[2]]()}\n{found[3]}", text)


if __name__ == "__main__":
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        page.write_text(renewed(text), encoding="utf-8")
