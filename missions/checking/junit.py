"""Reports of checks as JUnit's XML, which build servers show: a suite for each mission, a case for each leg."""

from __future__ import annotations

from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from missions.checking.findings import Rule
from missions.words import harmless

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from missions.checking.findings import Finding, Report

_WHOLE = "mission"
"""The case of what is of no leg."""


def junit_lines(reports: Iterable[Report]) -> Iterator[str]:
    """Return JUnit's XML of many reports, bit by bit: only one report is in memory."""
    yield '<?xml version="1.0" encoding="us-ascii"?>'
    yield '<testsuites name="pbpp check">'
    for report in reports:
        yield ET.tostring(
            _suite(report), encoding="us-ascii"
        ).decode()  # other letters as numbers: whatever the terminal can show
    yield "</testsuites>"


def _suite(report: Report) -> ET.Element:
    failures = report.failures
    unusable = [finding for finding in failures if finding.rule is Rule.UNUSABLE]
    by_case: dict[str, list[Finding]] = {case: [] for case in (_WHOLE, *report.cases)}
    for finding in failures:
        by_case.setdefault(finding.case or _WHOLE, []).append(finding)
    suite = ET.Element(
        "testsuite",
        name=harmless(report.file),
        tests=str(len(by_case)),
        failures=str(sum(bool(found) for found in by_case.values()) - bool(unusable)),
        errors=str(int(bool(unusable))),
    )
    for case, found in by_case.items():
        line = min((finding.line for finding in found), default=1)
        element = ET.SubElement(
            suite,
            "testcase",
            name=case,
            classname=harmless(report.file),
            file=harmless(report.file),
            line=str(line),
        )
        if found:
            text = "\n".join(harmless(f"{report.file}:{one.line}: {one.message}") for one in found)
            kind = "error" if unusable else "failure"
            ET.SubElement(element, kind, type=found[0].rule, message=harmless(found[0].message)).text = text
    remarks = [finding for finding in report.findings if not finding.fails]
    if remarks:
        ET.SubElement(suite, "system-err").text = "\n".join(harmless(one.message) for one in remarks)
    return suite
