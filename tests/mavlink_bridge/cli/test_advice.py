"""What people are told to do: what helps in their case, and nothing that does not."""

from __future__ import annotations

import json
import socket
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app

if TYPE_CHECKING:
    from pathlib import Path


def advice_of(*arguments: str) -> str:
    """Run a command that fails; return its advice, as JSON and as a line the same."""
    told = CliRunner().invoke(app, [arguments[0], "--json", *arguments[1:]])
    assert told.exit_code not in (0, 1), told.output
    document = json.loads(told.stdout)
    assert document["status"] == "error"
    lines = [line for line in told.stderr.splitlines() if line.startswith("advice: ")]
    assert lines == [f"advice: {document['advice']}"]
    return str(document["advice"])


def test_who_is_walled_in_is_not_told_to_ask_for_less(logs: Path) -> None:
    advice = advice_of("plan", "--log", str(logs / "island-unreachable.tlog"))
    assert (
        advice == "less clearance does not help: open a gap in exclusion polygon 1, or choose another target"
    )


def test_who_is_not_walled_in_is(logs: Path) -> None:
    advice = advice_of("plan", "--log", str(logs / "guided-maze.tlog"), "--clearance", "9")
    assert "--clearance max" in advice


def test_a_blocked_target_is_a_matter_of_the_target_even_for_the_widest_way(logs: Path) -> None:
    away = ("--clearance", "max", "--target", "40.07,-105.2")
    assert "another target" in advice_of("plan", "--log", str(logs / "guided-maze.tlog"), *away)


def test_a_dead_line_is_a_matter_of_wires_not_of_system_ids() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    advice = advice_of("plan", "--connect", f"udpin:127.0.0.1:{port}", "--timeout", "0.3")
    assert "baud" in advice
    assert "--system" not in advice


def test_a_server_that_is_not_there_is_no_matter_of_serial_ports() -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    advice = advice_of("plan", "--connect", f"tcp:127.0.0.1:{port}", "--timeout", "0.3")
    assert "does the other side run" in advice
    assert "serial" not in advice


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (
            ("convert", "{fields}/yard-fence.waypoints", "{out}/fence.xyz"),
            "the file extension sets the format",
        ),
        (
            (
                "check",
                "--mission",
                "{fields}/yard-fence.waypoints",
                "--fence",
                "{fields}/yard-fence.waypoints",
            ),
            "use a file that contains a mission",
        ),
        (("plan", "--fence", "{fields}/nothing.plan", "--target", "40,-105"), "check the path"),
    ],
)
def test_files(fields: Path, tmp_path: Path, arguments: tuple[str, ...], expected: str) -> None:
    words = [word.format(fields=fields, out=tmp_path) for word in arguments]
    assert expected in advice_of(*words)
