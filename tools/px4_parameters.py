"""Make the table of PX4's own parameter metadata: `python tools/px4_parameters.py 1.15=FOLDER 1.17=FOLDER 1.18=FOLDER`.

Each FOLDER is a checkout of PX4-Autopilot at a version, oldest first. Without git in it, its file COMMITS says of which commit each file is, a line
``path<TAB>commit`` each. Only the parameters of `missions.vehicle.parameters` are taken: type, range and default, from module.yaml, \\*_params.yaml and
\\*_params.c, of the newest version that has them; where 1.17 has it, also with its file and commit there. What differs between versions is written to the
error output.
"""

from __future__ import annotations

import csv
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import yaml

from missions.vehicle.parameters import PX4_NAMES

RELEASE = "1.17"
"""The version that was measured as a release."""

ROOT = Path(__file__).parents[1]
TABLE = ROOT / "tests" / "missions" / "vehicle" / "data" / "px4_parameters.csv"
_C = re.compile(r"/\*\*((?:[^*]|\*(?!/))*)\*/\s*PARAM_DEFINE_(INT32|FLOAT)\((\w+),\s*([-\w.+]+?)f?\);")
_TYPES = {"float": "FLOAT", "int32": "INT32", "enum": "INT32", "bitmask": "INT32", "boolean": "INT32"}


class Row(NamedTuple):
    """One parameter, as the table has it."""

    name: str
    type: str
    least: str
    most: str
    default: str
    last: str
    file: str
    commit: str
    file_1_17: str = ""
    commit_1_17: str = ""


def found_in(folder: Path, version: str, names: set[str]) -> dict[str, Row]:
    """Return the rows of one version."""
    rows = {}
    patterns = ("module.yaml", "*_params.yaml", "*_params.c")
    for path in sorted(path for pattern in patterns for path in (folder / "src").rglob(pattern)):
        text = path.read_text(encoding="utf-8")
        if not any(name in text for name in names):
            continue
        relative = path.relative_to(folder).as_posix()
        read = _from_c if path.suffix == ".c" else _from_yaml
        for name, kind, least, most, default in read(text):
            if name in names:
                commit = _commit(folder, relative)
                rows[name] = Row(name, kind, *map(_number, (least, most, default)), version, relative, commit)
    return rows


def _from_yaml(text: str) -> list[tuple[str, str, object, object, object]]:
    return [
        (name, _TYPES[one["type"]], one.get("min"), one.get("max"), one["default"])
        for group in yaml.safe_load(text).get("parameters", ())
        for name, one in group["definitions"].items()
        if "type" in one
    ]


def _from_c(text: str) -> list[tuple[str, str, object, object, object]]:
    def tag(comment: str, word: str) -> str | None:
        found = re.search(rf"@{word} (\S+)", comment)
        return found[1] if found else None

    return [
        (name, kind, tag(comment, "min"), tag(comment, "max"), default)
        for comment, kind, name, default in _C.findall(text)
    ]


def _number(value: object) -> str:
    return "" if value is None else f"{float(str(value)):.9g}"


def _commit(folder: Path, relative: str) -> str:
    told = folder / "COMMITS"
    if told.exists():
        return dict(line.split("\t") for line in told.read_text(encoding="utf-8").splitlines())[relative]
    command = ["git", "-C", str(folder), "log", "-1", "--format=%H", "--", relative]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def main(arguments: list[str]) -> None:
    """Write the table."""
    rows: dict[str, Row] = {}
    for argument in arguments:
        version, _, folder = argument.partition("=")
        for name, row in found_in(Path(folder), version, set(PX4_NAMES)).items():
            before = rows.get(name)
            if before is not None and before[1:5] != row[1:5]:
                sys.stderr.write(f"{name}: {before[1:5]} in {before.last}, {row[1:5]} in {version}\n")
            released = row if version == RELEASE else before
            named = released is not None and released.last == RELEASE
            rows[name] = row._replace(file_1_17=released.file, commit_1_17=released.commit) if named else row
    missing = sorted(set(PX4_NAMES) - set(rows))
    if missing:
        raise SystemExit(f"not found: {', '.join(missing)}")
    head = [line for line in TABLE.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
    with TABLE.open("w", encoding="utf-8", newline="") as file:
        file.write("".join(f"{line}\n" for line in head))
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Row._fields)
        writer.writerows(rows[name] for name in PX4_NAMES)


if __name__ == "__main__":
    main(sys.argv[1:])
