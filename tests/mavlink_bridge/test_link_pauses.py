"""Our own computer pauses, for a second or a minute: what came meanwhile is heard before anybody's patience is judged."""

from __future__ import annotations

from mavlink_bridge.link import Link
from mavlink_bridge.mavlink.codec import Codec
from mavlink_bridge.mavlink.messages import Heartbeat

PATIENCE_S = 5.0


class Clock:
    now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


class Transport:
    """A vehicle that tells a heartbeat each second; what was not read yet waits."""

    is_stream = True

    def __init__(self, clock, pause_after_waiting_s=0.0) -> None:
        self.clock = clock
        self.pause_after_waiting_s = pause_after_waiting_s
        self.codec = Codec(1, 1)
        self.told_s = clock()

    def send(self, data) -> None:
        """Take it."""

    def receive(self, timeout_s: float) -> list:
        due_s = self.told_s + 1.0
        self.clock.now_s = max(self.clock.now_s, min(due_s, self.clock.now_s + timeout_s))
        if self.clock.now_s < due_s:
            self.clock.now_s += self.pause_after_waiting_s
            self.pause_after_waiting_s = 0.0
            return []
        self.told_s = self.clock.now_s
        return [(None, self.codec.encode(Heartbeat(10, 3)))]

    def heard(self, source) -> None:
        """There is one other end."""

    def close(self) -> None:
        """Nothing to close."""


class Watch:
    """Ends after so many heartbeats, or when none came for too long."""

    is_done = False
    is_silent = False

    def __init__(self, clock, pause_in_receive_s=0.0) -> None:
        self.clock = clock
        self.pause_s = pause_in_receive_s
        self.count = 0

    @property
    def deadline_s(self):
        return self.heard_s + PATIENCE_S

    def start(self, now_s):
        self.heard_s = now_s

    def receive(self, frame, now_s):
        self.heard_s = now_s
        self.count += 1
        self.is_done = self.count == 4
        if self.count == 2:
            self.clock.now_s += self.pause_s

    def handle_timer(self, now_s):
        if now_s >= self.deadline_s:
            self.is_silent = self.is_done = True

    def messages_to_send(self):
        return []


def run(clock, transport, watch):
    with Link(transport, clock=clock) as link:
        link.run(watch)


def test_a_pause_while_a_message_is_looked_at_is_no_silence():
    clock = Clock()
    watch = Watch(clock, pause_in_receive_s=60.0)
    run(clock, Transport(clock), watch)
    assert not watch.is_silent
    assert watch.count == 4
    assert clock.now_s >= 1060.0


def test_a_pause_after_waiting_in_vain_is_no_silence():
    clock = Clock()
    watch = Watch(clock)
    run(clock, Transport(clock, pause_after_waiting_s=60.0), watch)
    assert not watch.is_silent
    assert watch.count == 4


def test_silence_is_still_noticed():
    clock = Clock()
    transport = Transport(clock)
    transport.told_s = 1e6
    watch = Watch(clock)
    run(clock, transport, watch)
    assert watch.is_silent
    assert PATIENCE_S <= clock.now_s - 1000.0 < PATIENCE_S + 1.0
