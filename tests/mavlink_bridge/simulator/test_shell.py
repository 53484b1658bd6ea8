"""The shell over real sockets on loopback: pymavlink on the other end, so that our codec is not its own judge."""

from __future__ import annotations

import socket
import time
from contextlib import closing, contextmanager

import pytest
from pymavlink import mavutil
from simulator.station import HOME, line, square

from mavlink_bridge.errors import LinkError
from mavlink_bridge.simulator import Simulator, SimulatorConfig
from mavlink_bridge.simulator.faults import Faults

LOOPBACK = "tcpin:127.0.0.1:0"
QUIET = SimulatorConfig(streams=False)


@contextmanager
def client(simulator, system=255, component=190):
    link = mavutil.mavlink_connection(
        simulator.connection, source_system=system, source_component=component, autoreconnect=False
    )
    with closing(link):
        yield link


def heard(link, kind, timeout_s=60.0, **fields):
    """Wait for a message of a kind with these fields."""
    end_s = time.monotonic() + timeout_s
    while time.monotonic() < end_s:
        message = link.recv_match(type=kind, blocking=True, timeout=0.2)
        if message and all(getattr(message, name) == value for name, value in fields.items()):
            return message
    pytest.fail(f"no {kind} with {fields} within {timeout_s} s")


@pytest.mark.parametrize("listen", [LOOPBACK, "udpin:127.0.0.1:0", "udp:127.0.0.1:0"])
def test_a_client_uploads_and_downloads(listen):
    with Simulator(QUIET, listen) as simulator, client(simulator) as link:
        assert simulator.is_running
        link.mav.heartbeat_send(6, 8, 0, 0, 0)
        assert heard(link, "HEARTBEAT").type == 10
        items = line(3)
        link.mav.mission_count_send(1, 1, 4, 0)
        for seq in range(4):
            heard(link, "MISSION_REQUEST", seq=seq)
            item = items[max(0, seq - 1)]
            link.mav.mission_item_int_send(1, 1, seq, 3, 16, 0, 1, 0, 0, 0, 0, item.lat_e7, item.lon_e7, 0, 0)
        assert heard(link, "MISSION_ACK").type == 0
        link.mav.mission_request_list_send(1, 1, 0)
        assert heard(link, "MISSION_COUNT").count == 4
        link.mav.mission_request_int_send(1, 1, 2, 0)
        assert heard(link, "MISSION_ITEM_INT", seq=2).x == items[1].lat_e7
    assert simulator.vehicle.mission[1:] == items
    assert not simulator.is_running


def test_udpout_speaks_first():
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    listener = mavutil.mavlink_connection(f"udpin:127.0.0.1:{port}", source_system=255)
    with closing(listener), Simulator(QUIET, f"udpout:127.0.0.1:{port}") as simulator:
        assert simulator.connection == f"udpin:127.0.0.1:{port}"
        assert heard(listener, "HEARTBEAT").autopilot == 3


def test_a_datagram_peer_that_is_gone_does_no_harm():
    with Simulator(SimulatorConfig(), "udpin:127.0.0.1:0", speedup=20.0) as simulator:
        with client(simulator) as link:
            link.mav.heartbeat_send(6, 8, 0, 0, 0)
            heard(link, "HEARTBEAT")
        time.sleep(0.2)
        with client(simulator) as link:
            link.mav.heartbeat_send(6, 8, 0, 0, 0)
            heard(link, "HEARTBEAT")


def test_clients_hear_each_other_unless_it_is_for_the_vehicle():
    with (
        Simulator(QUIET, LOOPBACK) as simulator,
        client(simulator, 255, 190) as first,
        client(simulator, 245, 191) as second,
    ):
        heard(first, "HEARTBEAT", type=10)
        heard(second, "HEARTBEAT", type=10)
        second.mav.mission_request_list_send(1, 1, 0)
        second.mav.heartbeat_send(18, 8, 0, 0, 0)
        beat = heard(first, "HEARTBEAT", type=18)
        assert (beat.get_srcSystem(), beat.get_srcComponent()) == (245, 191)
        assert heard(first, "MISSION_COUNT").target_system == 245
        assert first.recv_match(type="MISSION_REQUEST_LIST") is None


def test_what_clients_hear_of_each_other_is_byte_for_byte_as_it_was_sent():
    """With numbers of the link's own, another program with our ids would pass for an echo of ours."""
    with Simulator(QUIET, LOOPBACK) as simulator, client(simulator) as one, client(simulator, 245) as other:
        for link in (one, other):
            heard(link, "HEARTBEAT")
        other.mav.seq = 77
        other.mav.heartbeat_send(6, 8, 0, 0, 5)
        message = heard(one, "HEARTBEAT", system_status=5)
        assert (message.get_srcSystem(), message.get_seq()) == (245, 77)


def test_a_client_that_leaves_is_forgotten_and_another_may_come():
    with Simulator(SimulatorConfig(), LOOPBACK) as simulator:
        for _ in range(2):
            with client(simulator) as link:
                heard(link, "HEARTBEAT")
        end_s = time.monotonic() + 60.0
        while simulator._clients and time.monotonic() < end_s:
            time.sleep(0.05)
        assert not simulator._clients


def test_a_client_that_never_reads_does_not_stop_the_rest():
    with Simulator(SimulatorConfig(), LOOPBACK, speedup=500.0) as simulator:
        host, port = simulator.connection.removeprefix("tcp:").split(":")
        with closing(socket.create_connection((host, int(port)))), client(simulator) as link:
            heard(link, "GLOBAL_POSITION_INT")
            time.sleep(1.0)
            heard(link, "HEARTBEAT")


def test_the_rovers_time_runs_faster():
    with Simulator(QUIET, LOOPBACK, speedup=20.0) as simulator, client(simulator) as link:
        begin_s = time.monotonic()
        for _ in range(20):
            heard(link, "HEARTBEAT")
        assert time.monotonic() - begin_s < 15.0  # of 20 s


def test_time_in_which_the_computer_stood_still_is_not_made_up_for():
    simulator = Simulator(QUIET, LOOPBACK, speedup=4.0)
    turns_s = [simulator._advance(real_s) for real_s in (0.0, 0.1, 0.2, 60.2, 60.3)]
    assert turns_s == pytest.approx([0.0, 0.4, 0.8, 1.8, 2.2])
    fast = Simulator(QUIET, LOOPBACK, speedup=100.0)
    assert [fast._advance(real_s) for real_s in (0.01, 1.0)] == pytest.approx([1.0, 11.0])


def test_a_rover_that_was_held_up_goes_on_telling():
    with Simulator(QUIET, LOOPBACK, speedup=20.0) as simulator, client(simulator) as link:
        heard(link, "HEARTBEAT")
        simulator._start_s -= 3600.0  # as if the computer had slept for an hour
        begin_s = time.monotonic()
        for _ in range(5):
            heard(link, "HEARTBEAT")
        assert time.monotonic() - begin_s < 60.0
        assert simulator._vehicle_s < 3600.0


def test_faults_hold_both_ways():
    with Simulator(QUIET, LOOPBACK, Faults(latency_s=0.2)) as simulator, client(simulator) as link:
        heard(link, "HEARTBEAT")
        begin_s = time.monotonic()
        link.mav.mission_request_list_send(1, 1, 0)
        heard(link, "MISSION_COUNT")
        assert time.monotonic() - begin_s >= 0.4
    with Simulator(QUIET, LOOPBACK, Faults(loss=1.0)) as simulator, client(simulator) as link:
        assert link.recv_match(blocking=True, timeout=1.5) is None


def test_it_drives_in_the_background():
    config = SimulatorConfig(home=HOME, mission=line(2), fence=tuple(square(20, 40)))
    with Simulator(config, LOOPBACK, speedup=50.0) as simulator, client(simulator) as link:
        heard(link, "HEARTBEAT")
        link.mav.command_long_send(1, 1, 176, 0, 1, 10, 0, 0, 0, 0, 0)
        heard(link, "COMMAND_ACK", result=0)
        link.mav.command_long_send(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0)
        heard(link, "MISSION_ITEM_REACHED", seq=2)
    assert simulator.vehicle.rover.mission_run.is_complete
    assert 30.0 < simulator.vehicle.least_clearance_m < 36.0


def test_a_taken_address_is_an_error():
    with Simulator(QUIET, LOOPBACK) as simulator:
        taken = simulator.connection.replace("tcp:", "tcpin:")
        with pytest.raises(LinkError, match="cannot be used"):
            Simulator(QUIET, taken).start()


@pytest.mark.parametrize(
    "listen", ["nonsense", "tcp:127.0.0.1:5760", "tcpin:127.0.0.1:x", "tcpin:127.0.0.1:99999", "/dev/ttyACM0"]
)
def test_what_is_not_an_address_is_an_error(listen):
    with pytest.raises(LinkError, match="expected tcpin"):
        Simulator(QUIET, listen)


def test_an_address_that_is_not_ours_is_an_error():
    with pytest.raises(LinkError, match=r"192\.0\.2\.1"):
        Simulator(QUIET, "tcpin:192.0.2.1:5760").start()


@pytest.mark.parametrize("speedup", [0.0, -1.0, float("inf")])
def test_time_must_run_forward(speedup):
    with pytest.raises(LinkError, match="speedup"):
        Simulator(QUIET, LOOPBACK, speedup=speedup)


def test_a_failure_in_the_background_comes_out_at_the_end(monkeypatch):
    simulator = Simulator(QUIET, LOOPBACK)

    def fail(_now_s):
        raise RuntimeError("broken rover")

    monkeypatch.setattr(simulator.vehicle, "handle_timer", fail)
    simulator.start()
    end_s = time.monotonic() + 60.0
    while simulator.is_running and time.monotonic() < end_s:
        time.sleep(0.01)
    assert not simulator.is_running
    with pytest.raises(RuntimeError, match="broken rover"):
        simulator.stop()
    simulator.stop()


def test_any_address_is_opened_as_loopback():
    assert Simulator(QUIET, "tcpin:0.0.0.0:5760").connection == "tcp:127.0.0.1:5760"
