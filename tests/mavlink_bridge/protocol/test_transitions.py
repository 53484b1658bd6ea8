"""The tables: every state is in them, reachable, and has a way out; the machines run by them."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from mavlink_bridge import protocol
from mavlink_bridge.protocol import transitions
from mavlink_bridge.protocol.transitions import TABLES

FOLDER = Path(protocol.__file__).parent


@pytest.mark.parametrize("name", TABLES)
def test_every_state_is_reachable_and_can_end(name):
    table = TABLES[name]
    states = set(type(next(iter(table))))
    assert set(table) == states
    begin = next(iter(table))
    assert _closure({begin}, table) == states
    ends = {state for state, following in table.items() if not following}
    assert ends
    for state in states:
        assert _closure({state}, table) & ends


@pytest.mark.parametrize("name", TABLES)
def test_every_event_is_used(name):
    table = TABLES[name]
    used = {event for following in table.values() for event in following}
    events = set(type(next(iter(used))))
    if name == "parameters":  # two machines share it
        events = used
    assert used == events


def test_machines_change_their_state_by_the_table_alone():
    for path in FOLDER.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Assign | ast.AugAssign | ast.AnnAssign):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                for target in targets:
                    if isinstance(target, ast.Attribute) and target.attr == "state":
                        assert path.name == "table_machine.py", f"{path.name}:{node.lineno}"


def test_the_tables_know_nothing_of_messages():
    imported = {
        node.module
        for node in ast.walk(ast.parse((FOLDER / "transitions.py").read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom)
    }
    assert imported == {"__future__", "enum", "typing"}
    assert transitions.TABLES


@pytest.mark.parametrize("name", TABLES)
def test_the_drawn_diagram_shows_the_table(name):
    figure = FOLDER.parents[1] / "docs" / "figures" / f"states-{name.replace('_', '-')}.svg"
    drawn = set(re.split(r", |<[^>]*>", figure.read_text(encoding="utf-8")))
    members = {*TABLES[name], *(event for following in TABLES[name].values() for event in following)}
    assert {member.name.lower().replace("_", " ") for member in members} <= drawn


def _closure(states, table):
    known = set(states)
    todo = list(states)
    while todo:
        for following in table[todo.pop()].values():
            if following not in known:
                known.add(following)
                todo.append(following)
    return known
