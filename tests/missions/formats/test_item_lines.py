"""On which line each item of a mission's file stands."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from missions.formats import read_situation, write_situation
from missions.formats.item_lines import item_lines
from missions.geo import LatLon
from missions.items import waypoint
from missions.situation import Known, Mission, Situation


@given(count=st.integers(1, 8), indent=st.sampled_from([None, 0, 1, 4]), comment=st.booleans())
def test_a_plans_items_are_where_a_reader_finds_them(tmp_path_factory, count, indent, comment):
    path = tmp_path_factory.mktemp("plans") / "field.plan"
    places = [LatLon(48.1 + number / 1e4, 11.5) for number in range(count)]
    write_situation(
        Situation(mission=Known(Mission(tuple(map(waypoint, places)), places[0]), None, "")), path
    )
    document = json.loads(path.read_text())
    items = document["mission"].pop("items")
    if comment:  # what may stand before and between, brackets in texts too
        document = {
            "groundStation": 'QGC ]}{[ "quoted\\" \\\\',
            "rallyPoints": document["rallyPoints"],
            **document,
        }
        for item in items:
            item["AMSLAltAboveTerrain"] = None
            item["note"] = {"items": [{"items": []}]}
    survey = {"type": "ComplexItem", "complexItemType": "survey"}
    document["mission"]["items"] = [*items[:1], {**survey, "TransectStyleComplexItem": {"Items": items[1:]}}]
    path.write_text(json.dumps(document, indent=indent))
    lines = item_lines(path)
    assert len(lines) == count + 1
    mission = read_situation(path).mission
    assert mission is not None
    assert len(mission.value.items) == count
    if indent:
        texts = path.read_text().splitlines()
        for item, line in zip(items, lines[1:], strict=True):
            assert texts[line - 1].strip() == "{"
            rest = "\n".join(texts[line - 1 :])
            assert json.JSONDecoder().raw_decode(rest.strip())[0] == item
    else:
        assert len(set(lines)) == 1 or indent == 0


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("QGC WPL 110\n0 1 0 16 0 0 0 0 48.1 11.5 0 1\n1 0 3 16 0 0 0 0 48.1 11.5 0 1\n", (2, 3)),
        ("QGC WPL 110\n# a word\n\n0 1 0 16 0 0 0 0 1 1 0 1\n\n1 0 3 16 0 0 0 0 1 1 0 1\n", (4, 6)),
        ("QGC WPL 110\n1 0 3 16 0 0 0 0 1 1 0 1\n2 0 3 16 0 0 0 0 1 1 0 1\n", (1, 2, 3)),
        ("QGC WPL 110\n", (1,)),
        ("QGC WPL 110\nx y\n", ()),
        ("nothing\n", ()),
    ],
)
def test_a_lists_items_are_its_lines(tmp_path, text, lines):
    path = tmp_path / "a.waypoints"
    path.write_text(text)
    assert item_lines(path) == lines


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"mission": 3}', '{"mission": {"items": [', "3", '{"mission" "a"}']
)
def test_what_is_no_plan_has_no_lines(tmp_path, text):
    path = tmp_path / "a.plan"
    path.write_text(text)
    assert item_lines(path) == ()
    assert item_lines(tmp_path / "none.plan") == ()
    assert item_lines(tmp_path / "none.kml") == ()
