"""Help: quick, whole and as the commands say; benchmarks/startup.py measures it."""

from __future__ import annotations

import subprocess
import sys

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import COMMANDS, app, load

START, TARGET = "40.071374,-105.229930", "40.0720926,-105.2286152"


def loaded_after(*arguments: object) -> set[str]:
    """Run the command line in a fresh interpreter; return the modules it loaded."""
    code = (
        "import sys; sys.argv[0] = 'pbpp'; from mavlink_bridge.cli import main\n"
        "try: main()\n"
        "except SystemExit as end: assert not end.code, end.code\n"
        "print('\\n' + ' '.join(sys.modules), file=sys.stderr)"
    )
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    return set(done.stderr.splitlines()[-1].split())


LIBRARIES = {"numpy", "shapely", "pyproj", "pymavlink", "serial", "missions.formats"}
RUNNERS = {f"mavlink_bridge.cli.{name}" for name in COMMANDS}


def test_help_loads_no_command_and_no_library():
    loaded = loaded_after("--help")
    assert not (LIBRARIES | RUNNERS | {"platformdirs", "tomllib"}) & loaded
    ours = {name for name in loaded if name.split(".")[0] in {"missions", "pbpp", "mavlink_bridge"}}
    shared = {
        f"mavlink_bridge.cli{part}"
        for part in ("", ".app", ".common", ".failing", ".terminal", ".terminating")
    }
    assert ours == shared | {
        "mavlink_bridge",
        "mavlink_bridge.errors",
        "missions",
        "missions.errors",
        "missions.words",
    }


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_loads_its_options_alone(name):
    loaded = loaded_after(name, "--help")
    assert f"mavlink_bridge.cli.options.{name}" in loaded
    assert not (LIBRARIES | RUNNERS) & loaded


def test_a_plan_of_a_file_loads_no_link_and_no_picture(fields):
    loaded = loaded_after(
        "plan", "--fence", fields / "yard-fence.waypoints", "--start", START, "--target", TARGET
    )
    assert not {"pymavlink", "serial", "matplotlib", "mavlink_bridge.director"} & loaded


def test_help_names_every_command():
    result = CliRunner().invoke(app, ["--help"], env={"COLUMNS": "120"})
    assert result.exit_code == 0
    for name, text in COMMANDS.items():
        assert name in result.stdout
        assert text in result.stdout


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_shows_examples(name):
    result = CliRunner().invoke(app, [name, "--help"])
    assert result.exit_code == 0
    if name != "demo":
        assert "For example:" in result.stdout
        assert f"pbpp {name}" in result.stdout
    assert all(parameter.help for parameter in load(name).params)


def test_no_words_at_all_give_help():
    result = CliRunner().invoke(app, [])
    assert result.exit_code == 2
    assert "Usage" in result.stdout


@pytest.mark.parametrize(
    "name", ["plan", "check", "bridge", "log", "replay", "upload", "download", "convert"]
)
def test_a_command_without_words_prints_its_usage(name):
    result = CliRunner().invoke(app, [name])
    assert result.exit_code == 2
    assert f"Usage: pbpp {name}" in result.stdout
    assert result.stderr.startswith("error: ")


@pytest.mark.parametrize("name", ["", *COMMANDS])
def test_flags_show_no_type(name):
    assert "<bool>" not in CliRunner().invoke(app, [*filter(None, [name]), "--help"]).stdout


def test_the_version():
    result = CliRunner().invoke(app, ["--version"])
    assert result.exit_code == 0
    assert result.stdout.startswith("pbpp 0.")
