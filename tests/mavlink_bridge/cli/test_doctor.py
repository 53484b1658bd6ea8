"""``pbpp doctor`` and ``pbpp config``: what they look at and how they end."""

from __future__ import annotations

import importlib.util
import json
import os
import shutil
import subprocess
import sysconfig
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest
import shapely
from pyproj import Proj
from typer.testing import CliRunner

from mavlink_bridge.cli import doctor as doctor_command
from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.options_file import user_file
from missions.fence import ZoneKind
from missions.formats import read_fence

_GRAPH = Path(__file__).parents[2] / "pbpp" / "visibility_graph.py"


@pytest.fixture(autouse=True)
def own_folders(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv("NO_COLOR", raising=False)


def run(*arguments: object):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def findings(*arguments: object) -> dict[str, dict]:
    result = run("doctor", *arguments, "--json")
    document = json.loads(result.stdout)
    wrong = any(finding["verdict"] == "error" for finding in document["findings"])
    assert result.exit_code == (8 if wrong else 0)
    assert document["status"] == ("error" if wrong else "ok")
    return {finding["what"]: finding for finding in document["findings"]}


def write_options(text: str) -> Path:
    path = user_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


class TestVehicle:
    def test_what_of_a_vehicle_was_not_measured(self, tmp_path):
        vehicle = tmp_path / "rover.parm"
        vehicle.write_text("WP_SPEED 8\n", encoding="utf-8")
        result = run("doctor", "--vehicle", vehicle, "--firmware", "4.6.3")
        assert "vehicle: ArduPilot 4.6.3, ackermann steering" in result.stdout
        assert "WP_SPEED 8 m/s was not measured (only 1 to 5, ackermann steering)" in result.stdout
        assert "parameters missing, ArduPilot defaults used" in result.stdout
        assert "of an unknown version (--firmware)" in run("doctor", "--vehicle", vehicle).stdout

    def test_a_vehicle_that_is_none_is_wrong(self, tmp_path):
        vehicle = tmp_path / "rover.parm"
        vehicle.write_text("WP_SPEED -8\n", encoding="utf-8")
        assert findings("--vehicle", vehicle)["vehicle"]["found"].startswith("WP_SPEED is -8")
        assert findings("--vehicle", tmp_path / "none.parm")["vehicle"]["verdict"] == "error"


class TestDoctor:
    def test_a_sound_installation(self, monkeypatch):
        monkeypatch.setattr("serial.tools.list_ports.comports", list)
        found = findings()
        assert found["numpy"]["found"] == metadata.version("numpy")
        assert {finding["verdict"] for finding in found.values()} <= {"ok", "info", "warning"}

    def test_the_known_answer_is_right(self, fields):
        """The expected length by a visibility graph in a map of the test's own."""
        spec = importlib.util.spec_from_file_location("visibility_graph", _GRAPH)
        graph = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(graph)
        chart = Proj(proj="tmerc", lat_0=40.072, lon_0=-105.2295, k=1, ellps="WGS84")
        fence = read_fence(fields / "maze-fence.waypoints")

        def shape(zone):
            if hasattr(zone, "radius_m"):
                return shapely.Point(chart(*zone.centre[::-1])).buffer(zone.radius_m, quad_segs=34)
            return shapely.Polygon([chart(*vertex[::-1]) for vertex in zone.vertices])

        inside = shapely.union_all([shape(zone) for zone in fence.zones if zone.kind is ZoneKind.INCLUSION])
        outside = shapely.union_all([shape(zone) for zone in fence.zones if zone.kind is ZoneKind.EXCLUSION])
        clearance_m = 2.5
        free = inside.buffer(-clearance_m, quad_segs=3).difference(outside.buffer(clearance_m, quad_segs=3))
        ends = [chart(*place[::-1]) for place in (doctor_command._START, doctor_command._TARGET)]
        shortest_m = graph.shortest_length(free, *ends)
        assert doctor_command.SHORTEST_M <= shortest_m <= 1.001 * doctor_command.SHORTEST_M

    def test_a_planner_that_is_off_is_seen(self, monkeypatch):
        monkeypatch.setattr(doctor_command, "SHORTEST_M", 170.0)
        assert findings()["test plan"]["verdict"] == "error"

    def test_a_planner_that_breaks_is_seen(self, monkeypatch):
        def broken(*_):
            raise OSError("no such library")

        monkeypatch.setattr("missions.planning.plan.plan", broken)
        found = findings()["test plan"]
        assert (found["verdict"], found["found"]) == ("error", "OSError: no such library")

    @pytest.mark.skipif(os.name != "posix", reason="Windows does not say who may use a port")
    def test_ports_and_who_may_use_them(self, monkeypatch):
        ports = [
            SimpleNamespace(device="/dev/ttyACM0", description="Pixhawk", vid=0x2DAE),
            SimpleNamespace(device="/dev/ttyUSB9", description="n/a", vid=0x10C4),
        ]
        monkeypatch.setattr("serial.tools.list_ports.comports", lambda: ports)
        monkeypatch.setattr(os, "access", lambda path, _mode: path == "/dev/ttyACM0")
        found = findings()
        assert found["serial port /dev/ttyACM0"]["verdict"] == "ok"
        refused = found["serial port /dev/ttyUSB9"]
        assert refused["verdict"] == "error"
        assert "/dev/ttyUSB9" in refused["advice"]

    @pytest.mark.skipif(os.name != "posix", reason="Windows does not say who may use a port")
    def test_a_computers_own_port_that_may_not_be_used_is_only_noted(self, monkeypatch):
        port = SimpleNamespace(device="/dev/ttyS0", description="n/a", vid=None)
        monkeypatch.setattr("serial.tools.list_ports.comports", lambda: [port])
        monkeypatch.setattr(os, "access", lambda *_: False)
        found = findings()["serial port /dev/ttyS0"]
        assert (found["verdict"], found["found"]) == ("info", "present, but you have no permission to use it")
        assert found["advice"]

    @pytest.mark.parametrize(
        ("group", "advice"),
        [
            ("dialout", "sudo usermod -aG dialout $USER, then log in again"),
            ("root", "ask the administrator for access to /dev/ttyS0"),
        ],
    )
    def test_nobody_is_told_to_join_the_group_root(self, monkeypatch, group, advice):
        monkeypatch.setattr("sys.platform", "linux")
        monkeypatch.setattr(Path, "group", lambda _: group)
        assert doctor_command._permission_advice(Path("/dev/ttyS0")) == advice

    @pytest.mark.skipif(os.name != "posix", reason="Windows has other permissions")
    def test_a_signing_key_that_others_may_read(self, tmp_path):
        key = tmp_path / "rover.key"
        key.write_bytes(bytes(range(1, 33)))
        key.chmod(0o644)
        found = findings("--signing-key", key)["signing key"]
        assert found["verdict"] == "error"
        assert "chmod 600" in found["found"]
        key.chmod(0o600)
        assert findings("--signing-key", key)["signing key"]["verdict"] == "ok"

    def test_backups_that_cannot_be_kept(self, tmp_path, monkeypatch):
        (tmp_path / "file").write_text("")
        monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
        assert findings()["backups"]["verdict"] == "error"

    def test_missing_packages(self, monkeypatch):
        def version(name):
            if name in ("matplotlib", "pyserial"):
                raise metadata.PackageNotFoundError(name)
            return "1"

        monkeypatch.setattr(metadata, "version", version)
        found = findings()
        assert (found["matplotlib"]["verdict"], found["pyserial"]["verdict"]) == ("info", "error")

    def test_options_that_cannot_be_read(self):
        write_options("[plan]\nclearence = 2\n")
        found = findings()["options file"]
        assert found["verdict"] == "error"
        assert "unknown option 'clearence' in [plan]" in found["found"]
        write_options("[plan\n")  # which no command can go on with
        assert run("doctor").exit_code == 2

    def test_quiet_tells_what_is_wrong_only(self, monkeypatch):
        monkeypatch.setattr(doctor_command, "SHORTEST_M", 170.0)
        monkeypatch.setattr("serial.tools.list_ports.comports", list)
        lines = run("doctor", "-q").stdout.splitlines()
        assert len(lines) == 2
        assert lines[0].startswith("error")


class TestConfig:
    def test_where_and_what(self):
        path = write_options('[all]\nsystem = 7\n[plan]\nclearance = 2.5\nplot = ["a.png", "b.svg"]\n')
        document = json.loads(run("config", "--json").stdout)
        assert (document["file"], document["exists"]) == (str(path), True)
        told = {(one["command"], one["option"]): one for one in document["settings"]}
        assert told["plan", "--clearance"]["value"] == "2.5"
        assert told["plan", "--plot"]["value"] == ["a.png", "b.svg"]
        assert told["download", "--system"]["source"] == str(path)
        assert ("sim", "--clearance") not in told

    def test_without_a_file(self):
        result = run("config")
        assert result.exit_code == 0
        assert "does not exist" in result.stdout

    def test_the_template_is_a_file_of_options(self, tmp_path):
        text = run("config", "--template").stdout
        bare = "\n".join(line.removeprefix("# ") if " = " in line else line for line in text.splitlines())
        path = tmp_path / "template.toml"
        path.write_text(bare)
        document = json.loads(run("config", "--config", path, "--json").stdout)
        assert len(document["settings"]) > 5

    def test_a_given_file_counts_more_and_the_command_line_most(self, fields, tmp_path):
        write_options("[plan]\nclearance = 1.0\ncorner-allowance = 0\n")
        given = tmp_path / "given.toml"
        given.write_text("[plan]\nclearance = 1.5\n")
        arguments = ("plan", "--fence", fields / "yard-fence.waypoints", "--start", "40.071374,-105.229930")
        arguments = (*arguments, "--target", "40.0720926,-105.2286152", "--json")

        def clearance_m(*more):
            return json.loads(run(*arguments, *more).stdout)["drawn_clearance_m"]

        own = clearance_m()
        assert 1.0 <= own < 1.5 <= clearance_m("--config", given) < 2.0
        assert clearance_m("--config", given, "--clearance", "2") >= 2.0
        document = json.loads(run("config", "--config", given, "--json").stdout)
        told = {one["option"]: one["value"] for one in document["settings"]}
        assert told == {"--clearance": "1.5", "--corner-allowance": "0"}

    @pytest.mark.parametrize("target", ['"40.0720926,-105.2286152"', '["40.0720926,-105.2286152"]'])
    def test_an_option_that_may_be_repeated_may_stand_alone(self, fields, tmp_path, target):
        given = tmp_path / "given.toml"
        given.write_text(f"[plan]\ntarget = {target}\n")
        told = run(
            "plan", "--config", given, "--fence", fields / "yard-fence.waypoints",
            "--start", "40.071374,-105.229930", "--json",
        )  # fmt: skip
        assert told.exit_code == 0
        assert json.loads(told.stdout)["targets"]

    @pytest.mark.parametrize("daring", ["upload", "drive", "arm", "replace-active"])
    def test_no_file_read_unasked_changes_a_vehicle(self, daring):
        write_options(f"[all]\n{daring} = true\n")
        result = run("config")
        assert result.exit_code == 2
        assert daring in result.stderr

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("[paln]\n", "is not a command"),
            ("[all]\nnonsense = 1\n", "nonsense"),
            ("clearance = 2\n", "outside a table"),
            ("[plan\n", "not TOML"),
            ("[plan]\nclearence = 2\n", "clearence"),
        ],
    )
    def test_files_that_are_wrong(self, text, said):
        write_options(text)
        result = run("config")
        assert result.exit_code == 2
        assert said in result.stderr


def test_completion_is_offered_for_three_shells(tmp_path, monkeypatch):
    """As the shells ask for it: `--show-completion` gives a script, and the script's question is answered."""
    environment = {
        **os.environ,
        "HOME": str(tmp_path),
        "USERPROFILE": str(tmp_path),
        "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1",
    }
    pbpp = shutil.which("pbpp", path=sysconfig.get_path("scripts"))
    for shell in ("bash", "zsh", "fish"):
        shown = subprocess.run(
            [pbpp, "--show-completion", shell], env=environment, capture_output=True, text=True, check=True
        )
        assert "_PBPP_COMPLETE" in shown.stdout
    question = {**environment, "_PBPP_COMPLETE": "complete_bash", "COMP_WORDS": "pbpp do", "COMP_CWORD": "1"}
    answer = subprocess.run([pbpp], env=question, capture_output=True, text=True, check=False)
    assert answer.stdout.split() == ["download", "doctor"]
    question["COMP_WORDS"] = "pbpp plan --cle"
    question["COMP_CWORD"] = "2"
    assert subprocess.run(
        [pbpp], env=question, capture_output=True, text=True, check=False
    ).stdout.split() == ["--clearance"]
    subprocess.run([pbpp, "--install-completion", "bash"], env=environment, capture_output=True, check=True)
    assert "pbpp" in (tmp_path / ".bashrc").read_text()
