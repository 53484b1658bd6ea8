"""Make ``missions/formats/mission_commands.py`` from MAVLink's definitions, as pymavlink carries them: ``python tools/mission_commands.py``."""

from __future__ import annotations

import re
from importlib.metadata import version
from pathlib import Path
from textwrap import wrap

from pymavlink.dialects.v20 import all as dialect

OUTPUT = Path(__file__).parents[1] / "missions" / "formats" / "mission_commands.py"
UNUSED = re.compile(r"\s*(empty|reserved|unused|not used)?\b\.?\s*(\(.*\))?$", re.IGNORECASE)
TEXT = '''"""MAVLink's commands (MAV_CMD), from its definitions. Made by ``tools/mission_commands.py``: change that, not this."""

MADE_FROM = "pymavlink {version}"

# fmt: off
COMMANDS_WITH_PLACE = frozenset({{
{places}
}})
"""Commands whose params 5 and 6 are a latitude and a longitude (``hasLocation``)."""

USED_PARAMS = {{
{used}
}}
"""Which of params 1 to 6 each command uses; the others are empty or reserved."""
'''


def made() -> str:
    """Return the module's text."""
    commands = {
        number: entry
        for number, entry in sorted(dialect.enums["MAV_CMD"].items())
        if not entry.name.endswith("_ENUM_END")
    }
    places = ", ".join(str(number) for number, entry in commands.items() if _has_location(entry))
    used = ", ".join(f'{number}:\N{NO-BREAK SPACE}"{_used(entry)}"' for number, entry in commands.items())
    return TEXT.format(version=version("pymavlink"), places=_lines(places), used=_lines(used))


def _has_location(entry: object) -> bool:
    return bool(getattr(entry, "has_location", False))


def _used(entry: dialect.EnumEntry) -> str:
    return "".join(str(i) for i in range(1, 7) if not UNUSED.match(entry.param.get(i, "")))


def _lines(text: str) -> str:
    lines = wrap(f"{text},", 104, break_long_words=False)
    return "\n".join(f"    {line}" for line in lines).replace("\N{NO-BREAK SPACE}", " ")


if __name__ == "__main__":
    OUTPUT.write_text(made(), encoding="utf-8")
