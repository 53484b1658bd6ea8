"""The parts and pictures of the documentation that are made from the code: `python docs/generated.py` brings them up to date.

A part stands between ``<!-- made: NAME -->`` and ``<!-- end -->``; a test checks that each, and each picture, is as the code says.
"""

from __future__ import annotations

import inspect
import json
import re
import sys
from collections import defaultdict
from functools import partial
from pathlib import Path
from typing import Any

from mavlink_bridge import errors as bridge_errors
from mavlink_bridge.cli.app import COMMANDS, load
from mavlink_bridge.cli.failing import ExitCode, exit_code_of
from mavlink_bridge.console import wire
from mavlink_bridge.dataset.questions import QUESTIONS
from mavlink_bridge.dataset.schema import PARTITION, VIEWS
from mavlink_bridge.dataset.schema import TABLES as DATASET_TABLES
from mavlink_bridge.director import SCHEMA, TRANSITIONS
from mavlink_bridge.protocol.transitions import TABLES
from missions import errors as mission_errors
from missions.vehicle import Autopilot
from missions.vehicle.parameters import PARAMETERS, Parameter

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS))
from state_picture import draw, lanes  # noqa: E402 - beside this file

_PART = re.compile(r"(<!-- made: ([a-z0-9-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def event_table() -> str:
    """Return the table of the bridge's events."""
    rows = [
        f"| `{name}` | {severity.name.lower()} | {', '.join(f'`{key}`' for key in keys) or '—'} |"
        for name, (severity, keys) in SCHEMA.items()
    ]
    return "\n".join(["| event | severity | data |", "|---|---|---|", *rows])


def director_table() -> str:
    """Return the director's transitions as a table, in the order of the picture."""
    few, many = lanes(TRANSITIONS)
    rows = [
        f"| `{lane.cue}` | {', '.join(f'`{state}`' for state in lane.begins)} | `{lane.end}` |"
        for lane in (*few, *many)
    ]
    return "\n".join(["| cue | in | leads to |", "|---|---|---|", *rows])


def commands() -> str:
    """Return every command's options, from the command line itself."""
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
    is_switch = getattr(parameter, "is_flag", False) or getattr(parameter, "count", False)
    metavar = f" {word}" if is_option and not is_switch else ""
    shown = ", ".join(f"`{name}{metavar}`" for name in names)
    meaning = getattr(parameter, "help", None) or ""
    default = parameter.default
    is_shown = not is_switch and default != "" and isinstance(default, (str, int, float))
    cells = (shown, meaning, f"`{default}`" if is_shown else "")
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def exit_codes() -> str:
    """Return the table of exit codes and the errors that end with each."""
    kinds = defaultdict(list)
    for module in (mission_errors, bridge_errors):
        for name, kind in vars(module).items():
            if isinstance(kind, type) and issubclass(kind, Exception) and kind.__module__ == module.__name__:
                kinds[exit_code_of(kind(""))].append(f"`{name}`")
    kinds[ExitCode.USAGE].append("wrong options")
    kinds[ExitCode.INPUT].append("`FileError`")
    kinds[ExitCode.INTERNAL].append("`InternalError`")
    rows = [f"| {int(code)} | {_CODES[code]} | {', '.join(kinds[code]) or '—'} |" for code in ExitCode]
    return "\n".join(["| exit | meaning | errors |", "|---|---|---|", *rows])


_CODES = {
    ExitCode.DONE: "done, verified",
    ExitCode.INTERNAL: "internal error: a bug; says how to report it",
    ExitCode.USAGE: "wrong usage",
    ExitCode.INPUT: "input unusable: file, log or fence; says where",
    ExitCode.NO_ROUTE: "no route: start or target blocked, or unreachable; says what blocks it",
    ExitCode.LINK: "link: no connection, no heartbeat, silence",
    ExitCode.REFUSED: "the vehicle refused; says its result by name, and the item",
    ExitCode.OUTCOME: "what is on the vehicle is not what was wanted, or unknown; says what is known and where the backup is",
    ExitCode.CHECK: "a check or comparison failed (`check`, `replay --expect`, `doctor`), or two files differ (`diff`)",
    ExitCode.INTERRUPTED: "interrupted by the user; says what the vehicle does now (mode, armed, speed) and what is on it",
}


def parameters() -> str:
    """Return the table of parameters that count (`missions.vehicle.parameters`)."""
    rows = [
        _parameter_row(
            row, f"`{row.name}` … `SERVO32_FUNCTION`" if row.name == "SERVO1_FUNCTION" else f"`{row.name}`"
        )
        for row in PARAMETERS.values()
        if not re.fullmatch(r"SERVO[2-9]_FUNCTION", row.name)
    ]
    head = "| parameter | default if it is not known | the autopilot's own range | measured | changes |"
    return "\n".join([head, "|---|---|---|---|---|", *rows])


def _parameter_row(row: Parameter, name: str) -> str:
    taken = "—" if row.default is None else f"{row.default:g}"
    if row.before is not None:
        taken += f" ({row.before[1]:g} before {row.before[0].major}.{row.before[0].minor})"
    since = f" (since {row.since.major}.{row.since.minor})" if row.since is not None else ""
    if row.until is not None:
        since = f" (to {row.until.major}.{row.until.minor})"
    measured = str(row.measured or "—")
    if row.measured_skid != row.measured:
        measured = (
            f"{measured}; on skid steer {row.measured_skid}"
            if row.measured_skid
            else f"{measured} on steered wheels"
        )
    if row.measured_before_4_6:
        measured += f"; before 4.6 {row.measured_before_4_6}"
    autopilot = "PX4: " if row.autopilot is Autopilot.PX4 else ""
    whole = " (INT32)" if row.is_whole else ""
    return f"| {name}{since} | {taken} | {row.documented or '—'}{whole} | {measured} | {autopilot}{row.changes} |"


def dataset_tables() -> str:
    """Return the tables of a dataset with their columns."""
    parts = []
    for table in DATASET_TABLES.values():
        rows = [f"| `{one.name}` | {one.sql} | {one.meaning} |" for one in table.columns]
        kept = "by month and vehicle" if table.is_partitioned else "not parted"
        parts.append(
            "\n".join(
                [
                    f"### {table.name}",
                    "",
                    f"A row is {table.about}. Kept {kept}.",
                    "",
                    "| column | type | means |",
                    "|---|---|---|",
                    *rows,
                ]
            )
        )
    return "\n\n".join(parts)


def dataset_partition() -> str:
    """Return the columns that come from folders' names."""
    rows = [f"| `{one.name}` | {one.sql} | {one.meaning} |" for one in PARTITION]
    return "\n".join(["| column | type | means |", "|---|---|---|", *rows])


def dataset_views() -> str:
    """Return the views of a dataset, with the SQL that makes them."""
    return "\n\n".join(f"`{view.name}`: a row is {view.about}.\n\n```sql\n{view.sql}\n```" for view in VIEWS)


def dataset_questions() -> str:
    """Return the ready questions."""
    rows = [f"| `{one.name}` | {one.about} |" for one in QUESTIONS.values()]
    return "\n".join(["| question | asks |", "|---|---|", *rows])


def _planners(case: str) -> str:
    """Return a map's table out of the benchmark's results."""
    text = (DOCS.parent / "benchmarks" / "results" / "planner.md").read_text(encoding="utf-8")
    found = re.search(rf"^## {case}\n\n(.*?)\n\n", text, re.DOTALL | re.MULTILINE)
    assert found is not None
    return found[1]


def console_types() -> str:
    """Return the types that go between the console's page and server, from their JSON schema, those of the snapshot first."""
    types = wire.schema()["$defs"]
    parts = []
    for name, kind in types.items():
        if (properties := kind.get("properties")) is None:
            continue
        rows = [
            f"| `{field}` | {_schema_type(value)} | {'' if field in kind.get('required', ()) else _default(value)} |"
            for field, value in properties.items()
        ]
        head = kind.get("description", "").split("\n")[0]
        table = "\n".join(["| field | type | default |", "|---|---|---|", *rows])
        parts.append(f"### {name}\n\n{head}\n\n{table}")
    return "\n\n".join(parts)


def _schema_type(value: dict[str, Any]) -> str:
    if "$ref" in value:
        name = value["$ref"].rsplit("/", 1)[-1]
        return f"[{name}](#{name.lower()})"
    if "anyOf" in value:
        return " or ".join(map(_schema_type, value["anyOf"]))
    if "const" in value or "enum" in value:
        return ", ".join(f"`{one}`" for one in value.get("enum", [value.get("const")]))
    if "prefixItems" in value:
        return f"[{', '.join(map(_schema_type, value['prefixItems']))}]"
    if value.get("type") == "array":
        return f"list of {_schema_type(value.get('items', {}))}"
    return {"object": "mapping", "null": "null", None: "any"}.get(value.get("type"), str(value.get("type")))


def _default(value: dict[str, Any]) -> str:
    return f"`{json.dumps(value['default'])}`" if "default" in value else ""


def console_schema() -> str:
    """Return the JSON schema of what goes between the console's page and server."""
    return json.dumps(wire.schema(), indent=1) + "\n"


PARTS = {
    "bridge-events": event_table,
    "commands": commands,
    "console-types": console_types,
    "dataset-partition": dataset_partition,
    "dataset-questions": dataset_questions,
    "dataset-tables": dataset_tables,
    "dataset-views": dataset_views,
    "director-states": director_table,
    "exit-codes": exit_codes,
    "parameters": parameters,
    "planners-100": partial(_planners, "rand100"),
    "planners-1000": partial(_planners, "rand1000"),
}


PICTURES = {
    "console-schema.json": console_schema,
    "figures/states-director.svg": partial(
        draw, TRANSITIONS, "The states of the live bridge, and what leads from one to another"
    ),
    **{
        f"figures/states-{name.replace('_', '-')}.svg": partial(
            draw, table, f"The states of {name.replace('_', ' ')}, and what leads from one to another"
        )
        for name, table in TABLES.items()
    },
}


def renewed(text: str) -> str:
    """Return a page's text with its made parts as the code says."""
    return _PART.sub(lambda found: f"{found[1]}{PARTS[found[2]]()}\n{found[3]}", text)


if __name__ == "__main__":
    for page in sorted(DOCS.rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        page.write_text(renewed(text), encoding="utf-8")
    for name, picture in PICTURES.items():
        (DOCS / name).write_text(picture(), encoding="utf-8", newline="\n")
