"""The reusable action and the hook: their own steps, run here, fail a repository of missions with the finding on the item's line."""

from __future__ import annotations

import importlib.util
import json
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
YARD = ROOT / "examples" / "yard"
GOOD = "QGC WPL 110\n0 1 0 16 0 0 0 0 40.071374 -105.229930 0 1\n1 0 3 16 0 0 0 0 40.071464 -105.22996 0 1\n"

pytestmark = pytest.mark.skipif(os.name == "nt" or shutil.which("git") is None, reason="needs git and bash")


@pytest.fixture
def repository(tmp_path, monkeypatch) -> Path:
    """A repository of missions, one of which drives through a barn."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    (tmp_path / "missions").mkdir()
    for name in ("fence.waypoints", "rover.parm"):
        shutil.copy(YARD / name, tmp_path)
    Path("missions/good one.waypoints").write_text(GOOD)
    shutil.copy(YARD / "drawn.waypoints", "missions/bad.waypoints")
    subprocess.run(["git", "init", "-q"], check=True)
    subprocess.run(["git", "add", "."], check=True)
    return tmp_path


def step(**inputs: str) -> subprocess.CompletedProcess[str]:
    """Run the action's last step, as GitHub does; the one before it installs."""
    action = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
    steps = action["runs"]["steps"]
    assert [one["shell"] for one in steps] == ["bash", "bash"]
    assert "pip install" in steps[0]["run"]
    given = {name: one["default"] for name, one in action["inputs"].items()} | inputs
    known = {f"${{{{ inputs.{name} }}}}": value for name, value in given.items()}
    known["${{ github.action_path }}"] = str(ROOT)
    environment = {name: known[value] for name, value in steps[1]["env"].items()}
    command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", steps[1]["run"]]
    return subprocess.run(
        command, env={**os.environ, **environment}, capture_output=True, text=True, check=False
    )


def test_the_action_fails_with_the_finding_on_the_items_line(repository):
    options = "--fence fence.waypoints --vehicle rover.parm"
    failed = step(missions="missions/*.waypoints", options=options)
    assert failed.returncode == 8, failed.stderr
    errors = [line for line in failed.stdout.splitlines() if line.startswith("::error ")]
    assert len(errors) == 1
    assert errors[0].startswith(
        "::error file=missions/bad.waypoints,line=4,title=pbpp check%3A leg-crosses-fence::leg 1 → 2 crosses"
    )
    log = json.loads(Path("pbpp-check.sarif").read_text())
    assert {one["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for one in log["runs"][0]["results"]} == {
        "missions/bad.waypoints", "missions/good%20one.waypoints",
    }  # fmt: skip
    passed = step(missions="missions/good*", options=options, sarif="a.sarif")
    assert passed.returncode == 0, passed.stderr
    assert "::error" not in passed.stdout
    none = step(missions="*.plan")
    assert (none.returncode, none.stdout) == (3, "::error::no mission matches: *.plan\n")


def test_nothing_in_an_input_is_evaluated(repository):
    step(missions="$(touch evil) *.waypoints;touch evil", options="--clearance $(touch evil)")
    assert not Path("evil").exists()


def test_the_hook_fails_a_commit(repository):
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    files = ["missions/bad.waypoints", "missions/good one.waypoints"]
    arguments = [
        "--fence",
        "fence.waypoints",
        "--vehicle",
        "rover.parm",
        "--jobs",
        "1",
    ]  # `args` of a user's own file
    command = [*shlex.split(hook["entry"]), *arguments, *files]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 8
    assert "missions/bad.waypoints:4: FAIL: leg 1 → 2 crosses" in done.stdout
    assert "missions/good one.waypoints: PASS" in done.stdout


def test_names_and_messages_begin_no_command_of_their_own():
    spec = importlib.util.spec_from_file_location("annotations", ROOT / "tools" / "annotations.py")
    annotations = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(annotations)
    assert annotations.escaped("50 %\n::error::a") == "50 %25%0A::error::a"
    assert annotations.escaped("a,b:c", ",:") == "a%2Cb%3Ac"
