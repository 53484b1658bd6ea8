"""What an interrupt leads to: the decision alone, the words, one link without a clock, and a real process at a real terminal."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from threading import Thread

import pytest
from typer.testing import CliRunner

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.cli import interrupting
from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.interrupting import (
    AtHand,
    Interrupted,
    InterruptReport,
    Reaction,
    doing_text,
    first_reaction,
    interruptible,
    reaction_to,
)
from mavlink_bridge.cli.terminating import Terminated, terminable
from mavlink_bridge.errors import LinkError
from mavlink_bridge.link import Link
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.mavlink.rover import Mode
from mavlink_bridge.protocol.peer import Peer
from mavlink_bridge.protocol.vehicle_watch import Doing, VehicleWatch
from mavlink_bridge.protocol.verified_upload import VerifiedUpload
from mavlink_bridge.simulator import SimulatedVehicle, Simulator, SimulatorConfig, SteppedRover
from missions.fence import fence_to_items
from missions.formats import read_fence
from missions.geo import LatLon
from missions.items import waypoint

HOME = LatLon(40.071374, -105.229930)
TARGET = "40.0720926,-105.2286152"
DRIVING = Doing(Mode.AUTO, True, 5.0, age_s=0.3, speed_age_s=0.1)


@pytest.mark.parametrize("drives", [True, False])
@pytest.mark.parametrize("can_ask", [True, False])
@pytest.mark.parametrize("is_terminated", [True, False])
def test_only_a_person_at_a_terminal_is_asked_and_only_while_it_drives_by_us(drives, can_ask, is_terminated):
    wanted = Reaction.ASK if drives and can_ask and not is_terminated else Reaction.REPORT
    assert first_reaction(drives=drives, can_ask=can_ask, is_terminated=is_terminated) is wanted


@pytest.mark.parametrize(
    ("answer", "step"),
    [
        *[(answer, Reaction.HOLD) for answer in ("", "y", "Y", "yes", " Yes ", "hold", "HOLD")],
        *[(answer, Reaction.REPORT) for answer in ("n", "N", "no", None)],
        *[(answer, Reaction.ASK) for answer in ("perhaps", "40.07,-105.2", "nn")],
    ],
)
def test_answers(answer, step):
    assert reaction_to(answer) is step


@pytest.mark.parametrize(
    ("doing", "text"),
    [
        (DRIVING, "AUTO, armed, 5.0 m/s"),
        (Doing(Mode.HOLD, False, None, age_s=0.2), "HOLD, not armed, speed unknown"),
        (Doing(), "its mode is unknown, no heartbeat was received"),
        (Doing(Mode.AUTO, True, 0.0, has_completed=True, age_s=0, speed_age_s=0), "AUTO, armed, 0.0 m/s, mission complete"),
        (Doing(99, True, 1.0, age_s=12.4, speed_age_s=0.1), "mode 99, armed, 1.0 m/s (12 s ago)"),
        (Doing(Mode.AUTO, True, 1.0, age_s=0.1, speed_age_s=30.0), "AUTO, armed, 1.0 m/s (30 s ago)"),
    ],
)  # fmt: skip
def test_what_a_vehicle_does_in_words(doing, text):
    assert doing_text(doing) == text


@pytest.mark.parametrize(
    ("ending", "message"),
    [
        (InterruptReport("", Doing(Mode.HOLD, False, 0.0, age_s=0, speed_age_s=0), ""),
         "interrupted; the vehicle was left as it was: HOLD, not armed, 0.0 m/s; nothing was written to it"),
        (InterruptReport("", DRIVING, "the mission on it is ours", drives=True),
         "interrupted; nothing was sent; the vehicle continues the mission that pbpp started: AUTO, armed, 5.0 m/s; the mission on it is ours"),
        (InterruptReport("", Doing(Mode.HOLD, True, 0.1, age_s=0, speed_age_s=0), "x", drives=True, is_held=True),
         "interrupted; the vehicle was switched to HOLD, confirmed by its heartbeat: HOLD, armed, 0.1 m/s; x"),
        (InterruptReport("", DRIVING, "x", drives=True, is_held=False),
         "interrupted; HOLD was sent, but no heartbeat confirms it: AUTO, armed, 5.0 m/s; x"),
        (InterruptReport("part old, part new", DRIVING, ""), "part old, part new; the vehicle now: AUTO, armed, 5.0 m/s"),
        (InterruptReport("", DRIVING, "x", drives=True, is_link_lost=True),
         "interrupted; nothing was sent; the vehicle continues the mission that pbpp started: AUTO, armed, 5.0 m/s, when it was last heard (the link is lost); x"),
    ],
)  # fmt: skip
def test_what_is_said_at_the_end(ending, message):
    assert ending.message() == message


def test_what_scripts_are_told():
    assert InterruptReport("", DRIVING, "", drives=True).details() == {
        "mode": "AUTO", "armed": True, "speed_mps": 5.0, "age_s": 0.3, "drives": True, "hold": "not sent",
    }  # fmt: skip
    held = InterruptReport(
        "", Doing(Mode.HOLD, True, None, age_s=0.5), "", drives=True, is_held=True
    ).details()
    assert (held["drives"], held["hold"], held["speed_mps"]) == (False, "confirmed", None)


def test_what_is_heard_of_a_vehicle():
    watch = VehicleWatch()
    assert watch.is_active(0.0) is None
    watch.receive(m.Heartbeat(10, 3, 129, Mode.AUTO, 4), 10.0)
    watch.receive(m.GlobalPositionInt(0, 0, 0, vx=300, vy=400), 10.5)
    assert watch.is_active(11.0) is True
    assert watch.is_active(13.1) is None
    assert watch.doing(11.0) == Doing(Mode.AUTO, True, 5.0, age_s=1.0, speed_age_s=0.5)
    watch.receive(m.MissionCurrent(3, 3, mission_state=5), 10.0)
    assert watch.is_active(11.0) is False
    watch.receive(m.Heartbeat(10, 3, 129, Mode.AUTO, 4), 14.0)
    assert watch.is_active(14.0) is True, "an old word of the mission's end is none"
    watch.receive(m.Heartbeat(10, 3, 1, Mode.AUTO, 4), 15.0)
    assert watch.is_active(15.0) is False


class Typed:
    """A keyboard at which somebody types an answer each time that he is asked; None interrupts once more."""

    def __init__(self, *answers: str | None, closed: bool = False) -> None:
        self._answers = list(answers)
        self.is_closed = closed

    def line(self) -> str | None:
        if self.is_closed or not self._answers:
            return None
        answer = self._answers.pop(0)
        if answer is None:
            raise KeyboardInterrupt
        return answer

    def forget(self) -> None:
        pass


@pytest.fixture
def driven():
    """A rover that drives its mission, on a link without a clock of its own."""
    mission = tuple(waypoint(LatLon(40.0722, -105.2300 + 0.0002 * i)) for i in range(4))
    rover = SteppedRover(SimulatedVehicle(SimulatorConfig(home=HOME, mission=mission)), 1e9)
    link = Link(rover, (245, 190), clock=rover.now_s)
    watch = VehicleWatch()
    peer = Peer(1, 1, 245, 190)
    at_hand = AtHand(link, lambda: peer, lambda: watch, lambda: True, lambda: "on it")
    wait(link, 4)
    link.send(m.CommandLong(1, 1, 400, param1=1.0))
    link.send(m.CommandLong(1, 1, 176, param1=1.0, param2=Mode.AUTO))
    wait(link, 6, watch)
    return rover, at_hand


def wait(link: Link, seconds: float, watch: VehicleWatch | None = None) -> None:
    until_s = link.now_s() + seconds
    while link.now_s() < until_s:
        for frame in link.receive(0.1):
            if watch is not None:
                watch.receive(frame.message, link.now_s())


def interrupt(at_hand, monkeypatch, *, keyboard=None, kind=KeyboardInterrupt, terminal=True) -> Interrupted:
    monkeypatch.setattr(interrupting.sys.stdin, "isatty", lambda: terminal, raising=False)
    monkeypatch.setattr(interrupting.sys.stderr, "isatty", lambda: terminal, raising=False)
    monkeypatch.setattr(interrupting, "_heed_no_more", lambda: None)
    with pytest.raises(Interrupted) as caught, interruptible(replace(at_hand, keyboard=keyboard)):
        raise kind
    return caught.value


@pytest.mark.parametrize("answers", [("",), ("y",), ("what?", "", "n")])
def test_hold_is_sent_and_confirmed(driven, monkeypatch, answers):
    rover, at_hand = driven
    told = interrupt(at_hand, monkeypatch, keyboard=Typed(*answers))
    assert rover.vehicle.mode == Mode.HOLD
    assert "switched to HOLD, confirmed by its heartbeat: HOLD, armed" in str(told)
    assert (told.details["hold"], told.details["mode"], told.details["drives"]) == (
        "confirmed",
        "HOLD",
        False,
    )


@pytest.mark.parametrize("keyboard", [Typed("n"), Typed("what?", "no"), Typed(None), Typed(closed=True)])
def test_nothing_is_sent_for_a_no_a_second_interrupt_or_a_closed_input(driven, monkeypatch, keyboard):
    rover, at_hand = driven
    sent = []
    send = at_hand.link.send
    monkeypatch.setattr(at_hand.link, "send", lambda message: (sent.append(message), send(message)))
    told = interrupt(at_hand, monkeypatch, keyboard=keyboard)
    assert rover.vehicle.mode == Mode.AUTO
    assert {type(message) for message in sent} <= {m.Heartbeat}
    assert "nothing was sent; the vehicle continues the mission that pbpp started: AUTO, armed, " in str(told)
    assert told.details["drives"] is True


@pytest.mark.parametrize(("kind", "terminal"), [(Terminated, True), (Terminated, False), (KeyboardInterrupt, False)])  # fmt: skip
def test_without_a_person_nothing_is_sent_and_the_state_is_told(driven, monkeypatch, kind, terminal):
    rover, at_hand = driven
    told = interrupt(at_hand, monkeypatch, keyboard=Typed("y"), kind=kind, terminal=terminal)
    assert rover.vehicle.mode == Mode.AUTO
    assert told.details["hold"] == "not sent"
    assert told.details["age_s"] < 1.5
    assert math.isclose(told.details["speed_mps"], rover.vehicle.rover.body.speed_mps, abs_tol=0.3)


def test_a_second_interrupt_while_hold_is_under_way(driven, monkeypatch):
    rover, at_hand = driven

    def interrupted_again(*_args) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(interrupting, "_take", interrupted_again)
    told = interrupt(at_hand, monkeypatch, keyboard=Typed(""))
    assert "HOLD was sent, but no heartbeat confirms it" in str(told)
    assert told.details["hold"] == "not confirmed"
    assert rover.vehicle.mode in (Mode.HOLD, Mode.AUTO)


def test_a_link_that_breaks_meanwhile(driven, monkeypatch):
    _, at_hand = driven

    def broken(_timeout_s):
        raise LinkError("the other end closed the link")

    monkeypatch.setattr(at_hand.link, "receive_at", broken)
    told = interrupt(at_hand, monkeypatch, terminal=False)
    assert "(the link is lost)" in str(told)


def config(fields) -> SimulatorConfig:
    fence = fence_to_items(read_fence(fields / "yard-fence.waypoints"))
    return SimulatorConfig(home=HOME, fence=fence, parameters={"FENCE_ENABLE": 1.0, "WP_SPEED": 1.0})


def started(simulator, tmp_path, command: str, **streams) -> subprocess.Popen:
    options = ["--connect", simulator.connection, "--target", TARGET, "--clearance", "2", "--upload", "--drive"]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "XDG_STATE_HOME": str(tmp_path)}
    words = [sys.executable, "-m", "mavlink_bridge.cli", command, *options]
    return subprocess.Popen(words, env=environment, **streams)


def is_driving(simulator) -> bool:
    until_s = time.monotonic() + 60
    while time.monotonic() < until_s:
        if simulator.vehicle.mode == Mode.AUTO and simulator.vehicle.rover.body.speed_mps > 0.5:
            return True
        time.sleep(0.02)
    return False


def take_terminal() -> None:
    """Make the standard input the terminal whose Ctrl-C reaches this process."""
    import fcntl
    import termios

    os.setsid()
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


@pytest.mark.skipif(os.name != "posix", reason="pseudo-terminals")
@pytest.mark.parametrize(
    ("command", "answer", "mode", "said"),
    [
        ("plan", "\n", Mode.HOLD, "switched to HOLD, confirmed by its heartbeat"),
        ("bridge", "n\n", Mode.AUTO, "nothing was sent; the vehicle continues"),
    ],
)
def test_at_a_real_terminal(fields, tmp_path, command, answer, mode, said):
    pty = pytest.importorskip("pty")
    with Simulator(config(fields), "tcpin:127.0.0.1:0") as simulator:
        simulator.vehicle.rover.is_armed = True
        ours, theirs = pty.openpty()
        process = started(
            simulator, tmp_path, command, stdin=theirs, stdout=theirs, stderr=theirs,
            preexec_fn=take_terminal,
        )  # fmt: skip
        os.close(theirs)
        heard = b""

        def read_until(text: bytes) -> None:
            nonlocal heard
            while text not in heard:
                heard += os.read(ours, 4096)

        def interrupt_once_it_drives() -> None:
            if is_driving(simulator):
                os.write(ours, b"\x03")

        waiting = Thread(target=interrupt_once_it_drives)  # beside: somebody has to read what is shown
        waiting.start()
        read_until(b"HOLD? [Y/n]")
        waiting.join()
        os.write(ours, answer.encode())
        with suppress(OSError):  # how Linux tells the end
            while more := os.read(ours, 4096):
                heard += more
        os.close(ours)
        assert process.wait(60) == 130
        text = " ".join(heard.decode(errors="replace").split())
        assert "the vehicle is driving: AUTO, armed, " in text
        assert said in text
        assert "the mission on it is the planned one (" in text
        assert simulator.vehicle.mode == mode


@pytest.mark.parametrize(
    ("owner", "method", "said", "not_said"),
    [
        (BackupStore, "begin", "was left as it was: MANUAL, not armed, 0.0 m/s; nothing was written to it", "part of"),
        (VerifiedUpload, "backup_stored", "part of both: read it back before driving; the old list is kept in ", "nothing was"),
    ],
)  # fmt: skip
def test_an_interrupted_plan_says_what_is_on_the_vehicle(
    fields, tmp_path, monkeypatch, owner, method, said, not_said
):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    original = getattr(owner, method)

    def interrupted(*arguments):
        original(*arguments)
        raise KeyboardInterrupt

    monkeypatch.setattr(owner, method, interrupted)
    with Simulator(config(fields), "tcpin:127.0.0.1:0") as simulator:
        plan = ["plan", "--connect", simulator.connection, "--target", TARGET, "--clearance", "2", "--upload"]
        result = CliRunner().invoke(app, [*plan, "--json"])
    document = json.loads(result.stdout)
    assert (result.exit_code, document["error"]) == (130, "Interrupted")
    assert said in document["message"]
    assert not_said not in document["message"]
    assert document["details"]["armed"] is False


@pytest.mark.skipif(os.name != "posix", reason="SIGTERM")
@pytest.mark.parametrize(
    ("command", "name"), [("plan", "SIGTERM"), ("bridge", "SIGINT"), ("bridge", "SIGHUP")]
)
def test_a_service_that_is_ended_sends_nothing_and_tells_the_state(fields, tmp_path, command, name):
    with Simulator(config(fields), "tcpin:127.0.0.1:0") as simulator:
        simulator.vehicle.rover.is_armed = True
        pipes = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        process = started(simulator, tmp_path, command, text=True, **pipes)
        assert is_driving(simulator)
        process.send_signal(getattr(signal, name))
        _, errors = process.communicate(timeout=60)
        assert process.returncode == 130
        assert simulator.vehicle.mode == Mode.AUTO
    assert "nothing was sent; the vehicle continues the mission that pbpp started: AUTO, armed, " in errors
    assert "left as it was" not in errors
    assert json.dumps(errors).count("error: ") == 1


@pytest.mark.skipif(os.name != "posix", reason="SIGHUP")
def test_what_nohup_ignores_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with terminable():
            signal.raise_signal(signal.SIGHUP)
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
        with pytest.raises(Terminated), terminable():
            signal.raise_signal(signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_DFL
    finally:
        signal.signal(signal.SIGHUP, before)
