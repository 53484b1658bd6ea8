"""Missions of mowers and sprayers, as ground stations save them, through `pbpp upload` to the simulated rover."""

from __future__ import annotations

import json

import pytest
from cli.test_cli_transfers import rover, run, state_folder

__all__ = ["rover", "state_folder"]

HEAD = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t48.1005\t11.5005\t0\t1\n"


def line(seq: int, command: int, *params: float, place: str = "0\t0") -> str:
    first, second, third, fourth = (*params, 0, 0, 0, 0)[:4]
    frame = 3 if command in (16, 82) else 0
    return f"{seq}\t0\t{frame}\t{command}\t{first}\t{second}\t{third}\t{fourth}\t{place}\t0\t1\n"


def mission(*commands: tuple[int, ...]) -> str:
    place = "48.1006\t11.5006"
    lines = [line(1, 16, place=place)]
    for seq, (command, *params) in enumerate(commands, 2):
        lines.append(line(seq, command, *params, place=place if command == 82 else "0\t0"))
    lines.append(line(len(commands) + 2, 16, place="48.1007\t11.5006"))
    return HEAD + "".join(lines)


def test_all_that_a_mower_does_goes_up_and_is_verified(rover, tmp_path):
    file = tmp_path / "mower.waypoints"
    file.write_text(
        mission(
            (181, 1, 1),
            (183, 9, 1900),
            (203, 0, 0, 0, 0),
            (206, 12.5, -1, 1),
            (211, 1, 0),
            (216, 1),
            (218, 300, 2),
            (222, 10, 0, 0, 5),
            (600, 3),
            (82, 1),
        )
    )
    code, document, errors = run(rover, "upload", file, "--json")
    assert code == 0, errors
    assert document["status"] == "ok"
    assert [item.command for item in rover.vehicle.mission[2:12]] == [
        181, 183, 203, 206, 211, 216, 218, 222, 600, 82,
    ]  # fmt: skip


@pytest.mark.parametrize("command", [1, 176, 300, 31_999])
def test_a_command_it_does_not_store_is_refused_without_texts_that_say_nothing(rover, tmp_path, command):
    file = tmp_path / "odd.waypoints"
    file.write_text(mission((command, 1)))
    code, document, errors = run(rover, "upload", file, "--json")
    assert code == 6, errors
    assert "item 2" in document["message"]
    assert "Flight plan received" not in json.dumps(document) + errors
