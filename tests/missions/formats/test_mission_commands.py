"""The table of MAVLink's commands is what the script makes of pymavlink's definitions."""

from __future__ import annotations

import importlib.util
from importlib.metadata import version
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega

from missions.formats import mission_commands
from missions.items import PLACED_COMMANDS

ROOT = Path(__file__).parents[3]


def test_the_table_is_as_the_script_makes_it():
    if f"pymavlink {version('pymavlink')}" != mission_commands.MADE_FROM:
        pytest.skip(f"made from {mission_commands.MADE_FROM}")
    spec = importlib.util.spec_from_file_location("made", ROOT / "tools" / "mission_commands.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.OUTPUT.read_text(encoding="utf-8") == module.made()


def test_every_command_of_the_dialect_stands_in_it():
    known = {
        number
        for number, entry in ardupilotmega.enums["MAV_CMD"].items()
        if not entry.name.endswith("_ENUM_END")
    }
    assert known - set(mission_commands.USED_PARAMS) == set()
    assert set(mission_commands.USED_PARAMS) >= mission_commands.COMMANDS_WITH_PLACE


def test_places():
    assert set(PLACED_COMMANDS) <= mission_commands.COMMANDS_WITH_PLACE
    assert mission_commands.COMMANDS_WITH_PLACE.isdisjoint(
        {20, 177, 178, 183, 202, 203, 205, 206, 1000, 42702}
    )
    assert {21, 82, 179, 189, 195, 201, 5001, 5100} <= mission_commands.COMMANDS_WITH_PLACE
