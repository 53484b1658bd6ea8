"""Reports of checks for code hosts and build servers: valid, harmless, each finding at its item."""

from __future__ import annotations

import json
import os
from pathlib import Path, PurePosixPath, PureWindowsPath
from urllib.parse import unquote
from xml.etree import ElementTree as ET

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.checking.findings import RULES, Finding, Report, Rule, report_of_error
from missions.checking.junit import junit_lines
from missions.checking.sarif import sarif_lines, uri_of
from missions.errors import MissionFormatError
from missions.words import harmless

SCHEMA = json.loads((Path(__file__).parent / "data" / "sarif-2.1.0-rtm.5.json").read_text(encoding="utf-8"))
VALID = jsonschema.Draft4Validator(SCHEMA, format_checker=jsonschema.FormatChecker())

texts = st.text(max_size=30)
findings = st.builds(
    Finding,
    rule=st.sampled_from(Rule),
    message=texts,
    case=st.sampled_from(["", "leg 1 → 2", "leg 2 → 3"]),
    line=st.integers(1, 99),
)
reports = st.lists(
    st.builds(
        Report,
        file=texts,
        cases=st.just(("leg 1 → 2", "leg 2 → 3")),
        findings=st.lists(findings, max_size=4).map(tuple),
    ),
    max_size=3,
)


@settings(max_examples=25)
@given(reports)
def test_every_log_is_valid_sarif(many):
    log = json.loads("".join(sarif_lines(iter(many), "1.2.3")))
    VALID.validate(log)
    run = log["runs"][0]
    told = [finding for report in many for finding in report.findings]
    assert [result["message"]["text"] for result in run["results"]] == [harmless(one.message) for one in told]
    rules = run["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == list(Rule) == list(RULES)
    for result, finding in zip(run["results"], told, strict=True):
        assert rules[result["ruleIndex"]]["id"] == result["ruleId"] == finding.rule
        assert (result["level"] == "error") == finding.fails
        assert result["locations"][0]["physicalLocation"]["region"]["startLine"] == finding.line


@given(reports)
def test_every_junit_report_is_xml_that_counts_right(many):
    root = ET.fromstring("\n".join(junit_lines(iter(many))))
    assert len(root) == len(many)
    for suite, report in zip(root, many, strict=True):
        cases = suite.findall("testcase")
        bad = [case for case in cases if case.find("failure") is not None or case.find("error") is not None]
        assert int(suite.get("tests")) == len(cases)
        assert bool(bad) == bool(report.failures)
        if not any(one.rule is Rule.UNUSABLE for one in report.failures):
            assert int(suite.get("failures")) == len(bad)
            assert suite.get("errors") == "0"
        assert "\n".join(junit_lines([report])).isascii()


@pytest.mark.parametrize(
    ("path", "uri"),
    [
        (PurePosixPath("missions/a b.plan"), "missions/a%20b.plan"),
        (PurePosixPath("/home/me/a.plan"), "file:///home/me/a.plan"),
        (PureWindowsPath("C:\\me\\a.plan"), "file:///C:/me/a.plan"),
        (PureWindowsPath("me\\a.plan"), "me/a.plan"),
        (PurePosixPath("me\\a.plan"), "me%5Ca.plan"),  # where a backslash is a letter
        (PurePosixPath("ä:b.plan"), "%C3%A4%3Ab.plan"),
        (PurePosixPath("C:b.plan"), "C%3Ab.plan"),
        (PurePosixPath("50%#1?.plan"), "50%25%231%3F.plan"),
    ],
)
def test_files_are_named_as_uris(path, uri):
    assert uri_of(path) == uri
    assert unquote(uri).endswith(path.as_posix())


@pytest.mark.skipif(os.name == "nt", reason="names on Windows are Unicode")
def test_names_that_are_no_text_are_reported():
    for folder in ("", "/home/"):
        name = folder + os.fsdecode(b"\xff\x1b[31m.plan")
        report = report_of_error(name, f"{name} cannot be read", MissionFormatError("", file=name))
        log = json.loads("".join(sarif_lines([report], "1")))
        VALID.validate(log)
        (result,) = log["runs"][0]["results"]
        assert result["message"][
            "text"
        ].encode()  # no half of a character, which other readers of JSON refuse
        uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
        assert uri.endswith("%FF%1B%5B31m.plan")
        assert ET.fromstring("\n".join(junit_lines([report])))[0].get("errors") == "1"


def test_an_error_stands_on_the_line_that_it_names_in_this_file():
    error = MissionFormatError("a.plan: line 7: not JSON", file="a.plan")
    assert report_of_error("a.plan", str(error), error).findings[0].line == 7
    assert report_of_error("b.plan", str(error), error).findings[0].line == 1
    named = MissionFormatError("a.plan: odd", file="a.plan", line=3)
    assert report_of_error("a.plan", str(named), named).failures[0].line == 3
