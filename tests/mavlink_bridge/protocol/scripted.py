"""A machine driven by hand: frames in at given times, messages out as a list."""

from __future__ import annotations

from protocol.twin import PEER

from mavlink_bridge.mavlink.messages import Frame


class Script:
    """Drives one machine.

    Parameters
    ----------
    machine : Machine
        It is started at time 0.
    """

    def __init__(self, machine):
        self.machine = machine
        self.now_s = 0.0
        self.sent = []
        machine.start(0.0)
        self._collect()

    def hear(self, *messages, after_s=0.0, system=PEER.system, component=PEER.component):
        """Let frames of the vehicle arrive; return what is sent in return."""
        before = len(self.sent)
        self.pass_time(after_s)
        for message in messages:
            self.machine.receive(Frame(system, component, message), self.now_s)
            self._collect()
        return self.sent[before:]

    def pass_time(self, for_s):
        """Let time pass, with every deadline kept; return what is sent meanwhile."""
        before = len(self.sent)
        until_s = self.now_s + for_s
        while (deadline_s := self.machine.deadline_s) is not None and deadline_s <= until_s:
            self.now_s = max(self.now_s, deadline_s)
            self.machine.handle_timer(self.now_s)
            self._collect()
        self.now_s = until_s
        return self.sent[before:]

    def _collect(self):
        self.sent += self.machine.messages_to_send()


def seqs(messages):
    """Return the seq of each message that has one."""
    return [message.seq for message in messages if hasattr(message, "seq")]
