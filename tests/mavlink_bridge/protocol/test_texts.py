"""Which of the vehicle's texts are the reason of a refusal: those of this vehicle, in time, grave enough, and about the matter."""

from __future__ import annotations

import pytest
from protocol.scripted import PEER

from mavlink_bridge.mavlink.messages import Frame, Statustext
from mavlink_bridge.protocol.texts import MOST_TEXTS, Reasons


def heard(*texts: tuple[int, str], is_about_list: bool = True) -> tuple[str, ...]:
    reasons = Reasons(PEER, is_about_list=is_about_list)
    reasons.ask()
    for severity, words in texts:
        reasons.take(Frame(PEER.system, PEER.component, Statustext(severity, words)), 1.0)
    return reasons.texts


REASONS = [
    (4, "Only 655 items are supported"),
    (4, "Bad lat or lon"),
    (4, "Fence validation failed"),
    (4, "Fence upload timeout"),
    (4, "Invalid vertex count (2)"),
    (5, "Jump to tag out of range"),
]
OTHERS = [
    (6, "Flight plan received"),
    (4, "Flight plan received"),
    (6, "Fence Indexed OK"),
    (4, "got MISSION_REQUEST; use MISSION_REQUEST_INT!"),
    (6, "EKF3 IMU0 is using GPS"),
    (2, "EKF failsafe"),
    (2, "PreArm: Radio failsafe on"),
    (2, "Arm: Battery low"),
    (4, "Battery 1 is low 10.80V used 900 mAh"),
    (4, "GCS Failsafe"),
    (5, "Polygon fence in 1.5m"),
    (5, "Mission: 3 WP"),
    (6, "Reached waypoint #3"),
    (5, "Mission Complete"),
    (6, "Throttle armed"),
    (4, "pbpp: route 147 m"),
    (4, "  "),
    (7, "something for developers"),
]


@pytest.mark.parametrize("text", REASONS, ids=lambda text: text[1])
def test_reasons_are_kept(text):
    assert heard(*OTHERS, text, *OTHERS, text) == (text[1],)


@pytest.mark.parametrize("text", OTHERS, ids=lambda text: text[1])
def test_what_has_nothing_to_do_with_it_is_left_out(text):
    assert heard(text) == ()


def test_a_command_may_be_refused_for_the_vehicles_state():
    found = heard((2, "Arm: Radio failsafe on"), (6, "Throttle armed"), is_about_list=False)
    assert found == ("Arm: Radio failsafe on",)


def test_only_from_the_request_until_shortly_after_its_answer():
    reasons = Reasons(PEER)

    def say(words: str, now_s: float, component: int = PEER.component) -> None:
        reasons.take(Frame(PEER.system, component, Statustext(4, words)), now_s)

    say("before", 0.0)
    reasons.ask()
    say("meanwhile", 1.0)
    say("by a camera", 1.0, component=100)
    reasons.answered(2.0)
    say("queued", 2.9)
    say("of something else", 3.1)
    reasons.answered(9.0)
    say("long after", 9.0)
    assert reasons.texts == ("meanwhile", "queued")
    reasons.ask()
    assert reasons.texts == ()


def test_they_are_few():
    assert len(heard(*[(4, f"Bad item {number}") for number in range(50)])) == MOST_TEXTS
