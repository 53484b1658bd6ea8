"""Reports of checks in SARIF 2.1.0 (OASIS), which code hosts show on the lines of a change."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from missions.checking.findings import RULES, Rule
from missions.words import harmless

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import PurePath

    from missions.checking.findings import Finding, Report

_SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def sarif_lines(reports: Iterable[Report], version: str) -> Iterator[str]:
    """Return a SARIF log of many reports, bit by bit: only one report is in memory.

    Parameters
    ----------
    reports : iterable of Report
        Files are named as code hosts want them: below the folder where the command runs, with slashes.
    version : str
        Of this program.
    """
    driver = {
        "name": "pbpp check",
        "version": version,
        "rules": [{"id": rule, "shortDescription": {"text": text}} for rule, text in RULES.items()],
    }
    head = {"$schema": _SCHEMA, "version": "2.1.0"}
    yield f'{json.dumps(head)[:-1]}, "runs": [{{"tool": {json.dumps({"driver": driver})}, "columnKind": "unicodeCodePoints", "results": ['
    before = ""
    for report in reports:
        for finding in report.findings:
            yield before + json.dumps(_result(report.file, finding))
            before = ","
    yield "]}]}"


def _result(file: str, finding: Finding) -> dict[str, Any]:
    return {
        "ruleId": finding.rule,
        "ruleIndex": list(Rule).index(finding.rule),
        "level": "error" if finding.fails else "warning",
        "message": {"text": harmless(finding.message)},
        "locations": [
            {
                "physicalLocation": {
                    "artifactLocation": {"uri": uri_of(Path(file))},
                    "region": {"startLine": finding.line},
                },
                **({"logicalLocations": [{"name": finding.case, "kind": "leg"}]} if finding.case else {}),
            }
        ],
    }


def uri_of(path: PurePath) -> str:
    """Return a file's name as a URI: relative as it is, absolute as ``file:``; bytes of a name that are no UTF-8 as they are on the disk."""
    if path.is_absolute():
        return path.as_uri()
    return quote(os.fsencode(path.as_posix()))  # a colon too: what stands before one would pass for a scheme
