"""``--stopping``, and what plan and check tell of a HOLD on the way."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app

START, TARGET = "40.071374,-105.22993", "40.07209265,-105.22861524"
FAR_M = 80.0


def run(*arguments: str):
    return CliRunner().invoke(app, list(map(str, arguments)))


@pytest.fixture
def planned(tmp_path, fields):
    """Plan over the yard; return a plan's JSON document for options, and the file."""
    vehicle = tmp_path / "rover.parm"
    vehicle.write_text("AVOID_ENABLE 0\nWP_SPEED 3\nFENCE_ENABLE 1\nFENCE_TYPE 4\n")
    mission = tmp_path / "out.plan"

    def plan(*options: str) -> dict:
        source = (
            "--fence",
            fields / "yard-fence.waypoints",
            "--start",
            START,
            "--target",
            TARGET,
            "--vehicle",
            vehicle,
        )
        result = run("plan", *source, "--firmware", "4.6", "-o", mission, "--json", *options)
        assert result.exit_code == 0, result.output
        return json.loads(result.stdout)

    return plan, mission, vehicle


def test_a_plan_tells_how_far_the_vehicle_rolls_on(planned):
    plan, _, _ = planned
    stopping = plan()["stopping"]
    assert (stopping["speed_mps"], stopping["leaves_fence"]) == (3.0, None)
    assert stopping["distance_m"] == pytest.approx(6.2, abs=0.05)
    assert stopping["source"] == "from ArduPilot's simulation, not your rover"


def test_the_owners_word_counts_and_a_hold_that_ends_beyond_the_fence_is_a_warning(planned):
    plan, mission, vehicle = planned
    document = plan("--stopping", f"{FAR_M}@3", "--stopping", "10@1.5")
    stopping = document["stopping"]
    assert (stopping["distance_m"], stopping["source"]) == (FAR_M, "from --stopping")
    leaves = stopping["leaves_fence"]
    assert leaves["beyond_m"] == pytest.approx(leaves["distance_m"] - leaves["to_fence_m"], abs=0.011)
    [text] = [text for text in document["warnings"] if text.startswith("HOLD does not brake")]
    assert f"{leaves['beyond_m']:.1f} m beyond {leaves['fence']}" in text
    checked = run(
        "check",
        "--mission",
        mission,
        "--vehicle",
        vehicle,
        "--firmware",
        "4.6",
        "--stopping",
        f"{FAR_M}@3",
        "--json",
    )
    assert checked.exit_code == 0, checked.output  # nobody promised a HOLD
    found = json.loads(checked.stdout)
    assert found["stopping"]["leaves_fence"]["fence"] == leaves["fence"]
    assert [text for text in found["warnings"] if text.startswith("HOLD does not brake")]


def test_a_check_does_not_speak_of_holds_that_end_within_the_fence(planned, fields):
    plan, mission, vehicle = planned
    plan()
    told = run("check", "--mission", mission, "--vehicle", vehicle, "--firmware", "4.6").output
    assert "HOLD" not in told


@pytest.mark.parametrize("command", ["plan", "check", "bridge"])
@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("6", "expected M@MPS, such as 6@3"),
        ("@3", "expected M@MPS, such as 6@3"),
        ("6@0", "expected metres a second (0.05 to 100)"),
        ("6@", "expected metres a second (0.05 to 100)"),
        ("-1@3", "expected metres (0 to 1000000)"),
        ("nan@3", "expected metres (0 to 1000000)"),
        ("6@3@1", "expected metres a second (0.05 to 100)"),
    ],
)
def test_what_is_no_stop_is_refused(command, text, says):
    result = run(command, "--connect", "udpin:127.0.0.1:1", "--stopping", text)
    assert result.exit_code == 2
    assert says in " ".join(result.output.replace("│", " ").split())


def test_an_options_file_may_hold_one_or_several(tmp_path, planned):
    plan, _, _ = planned
    config = tmp_path / "options.toml"
    config.write_text('[plan]\nstopping = "7@3"\n')
    assert plan("--config", config)["stopping"]["distance_m"] == 7.0
    config.write_text('[plan]\nstopping = ["7@3", "9@3"]\n')
    assert plan("--config", config)["stopping"]["distance_m"] == 9.0
