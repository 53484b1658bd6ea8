"""Tell GitHub each finding of a SARIF report at its line (workflow commands), so that a pull request shows it there without code scanning."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from urllib.parse import unquote


def main() -> None:
    """Print a command for each finding."""
    report = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    for run in report["runs"]:
        for result in run["results"]:
            place = result["locations"][0]["physicalLocation"]
            properties = {
                "file": unquote(place["artifactLocation"]["uri"]),
                "line": place["region"]["startLine"],
                "title": f"pbpp check: {result['ruleId']}",
            }
            told = ",".join(f"{name}={escaped(str(value), ',:')}" for name, value in properties.items())
            print(f"::{result['level']} {told}::{escaped(result['message']['text'])}")


def escaped(text: str, more: str = "") -> str:
    """Return a text as a workflow command may hold it: nothing in a file's name or message begins another one."""
    for sign in "%\r\n" + more:
        text = text.replace(sign, f"%{ord(sign):02X}")
    return text


if __name__ == "__main__":
    main()
