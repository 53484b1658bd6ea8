"""Parameters that are no numbers, or none that can be, in a recording: every command says so or goes on, and none breaks down."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.tlog import TlogWriter

if TYPE_CHECKING:
    from pathlib import Path

FENCE = [(40.071, -105.2305), (40.073, -105.2305), (40.073, -105.228), (40.071, -105.228)]
ENDS = ("--start", "40.0715,-105.2300", "--target", "40.0725,-105.229")
READ = ["FENCE_TYPE", "FENCE_OPTIONS", "FENCE_ENABLE", "SERVO1_FUNCTION", "AVOID_ENABLE", "WP_SPEED", "FENCE_RADIUS", "FENCE_MARGIN", "FRAME_CLASS"]  # fmt: skip
OTHERS = ["FENCE_TOTAL", "MIS_TOTAL", "BRD_SD_MISSION", "MIS_DONE_BEHAVE"]


def recording(path: Path, name: str, value: float) -> Path:
    station = Codec(255, 190)
    rover = Codec(1, 1)
    heartbeat = m.Heartbeat(10, 3, 81, 4, 4)
    told = [
        rover.encode(heartbeat),
        station.encode(m.MissionRequestList(1, 1, 1)),
        rover.encode(m.MissionCount(255, 190, 4, 1)),
    ]
    for number, (lat, lon) in enumerate(FENCE):
        x, y = round(lat * 1e7), round(lon * 1e7)
        told.append(
            rover.encode(m.MissionItemInt(255, 190, number, 0, 5001, 0, 1, 4.0, 0, 0, 0, x, y, 0.0, 1))
        )
    told.append(rover.encode(m.ParamValue(name, value, 9, 10, 1)))
    told += [rover.encode(heartbeat) for _ in range(5)]
    with TlogWriter(path) as log:
        for number, data in enumerate(told):
            log.write(1.7e9 + number / 10, data)
    return path


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, [str(one) for one in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result.exit_code, result.output


@pytest.mark.parametrize("value", [math.inf, math.nan, 1e38])
@pytest.mark.parametrize("name", READ + OTHERS)
def test_no_command_breaks_down(tmp_path: Path, name: str, value: float) -> None:
    log = recording(tmp_path / "bad.tlog", name, value)
    assert run("log", log)[0] == 0
    assert run("replay", log, "--jobs", "1")[0] == 0
    assert run("check", "--log", log)[0] in (2, 3)
    code, output = run("plan", "--log", log, *ENDS, "--json")
    found = json.loads(output[output.index("{") :])
    if name in READ:
        assert (code, found["error"]) == (3, "VehicleError")
        assert found["message"].startswith(f"{name} is ")
    elif name == "BRD_SD_MISSION" or not math.isfinite(value):
        assert code == 0
        assert any(text.startswith(f"{name} ") for text in found["warnings"])
    else:
        assert code == 0


def test_what_came_is_said_in_a_plan_and_in_the_log(tmp_path: Path) -> None:
    log = recording(tmp_path / "bad.tlog", "MIS_TOTAL", math.nan)
    said = "MIS_TOTAL came as nan, which is not a number: not known"
    assert f"warning: {said}" in run("plan", "--log", log, *ENDS)[1]
    assert said in run("log", log)[1]
