"""The parts of the documentation that are made from the code: `python docs/generated.py` brings them up to date.

A part stands between ``<!-- made: NAME -->`` and ``<!-- end -->``; a test checks that each is as the code says.
"""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

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


PARTS = {"bridge-events": event_table, "director-states": director_diagram}


def renewed(text: str) -> str:
    """Give a page's text with its made parts as the code says."""
    return _PART.sub(lambda found: f"{found[1]}{PARTS[found[2]]()}\n{found[3]}", text)


if __name__ == "__main__":
    for page in sorted(DOCS.glob("*.md")):
        text = page.read_text(encoding="utf-8")
        page.write_text(renewed(text), encoding="utf-8")
