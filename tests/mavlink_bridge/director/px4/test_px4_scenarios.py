"""The bridge's scenarios of ArduPilot's rover with PX4's: those that can be, and why the others cannot.

Rooms of scenarios that PX4 has tests of its own for, told by what PX4 does, stand in `OWN_TESTS`.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from director import (
    test_bridge_director,
    test_disarmed,
    test_identity_clash,
    test_lost_answers,
    test_persons_at_pages,
    test_planning,
    test_takeover,
)
from director.px4.as_px4 import put_in_place
from director.px4.px4_runs import V1_17, V1_18

MODULES = [
    test_bridge_director,
    test_disarmed,
    test_identity_clash,
    test_lost_answers,
    test_persons_at_pages,
    test_planning,
    test_takeover,
]
OWN_TESTS = {
    "test_adopting": "test_px4_gaps: TestRestarts",
    "test_coming_home": "test_px4_gaps: TestCallsHome; test_px4_bridge: RTL; test_px4_attacks: TestBreaches",
    "test_director": "test_px4_bridge: TestSingleJobs",
    "test_director_signals": "no vehicle in it",
    "test_hold_watch": "test_px4_gaps: TestHoldNearAFence; ArduPilot rolls out straight, PX4 turns a loop",
    "test_home_and_obstacles": "test_px4_gaps: TestCallsHome, TestObstacles",
    "test_incidents": "test_px4_bridge: TestFailsafes; test_px4_attacks: TestBreaches; FENCE_STATUS and ArduPilot's texts are none of PX4's",
    "test_obstacles": "test_px4_gaps: TestObstacles; test_px4_bridge",
    "test_repaired_drives": "a JUMP and a CONDITION are driven otherwise by PX4: tests/missions/checking/test_px4_plans.py",
    "test_rolling_out": "PX4's loop is not foreseen: test_px4_gaps: test_the_roll_out_of_hold_is_not_foreseen_straight",
    "test_soak": "test_px4_attacks: test_a_few_minutes_of_the_soak_keep_every_promise",
    "test_two_vehicles": "test_px4_bridge: one vehicle a link; a link with two PX4 rovers was not tried",
    "test_way_home_inside": "PX4 has no JUMP_TAG",
}
"""What of the director's scenarios is not run here, and which tests PX4 has for it, or why none."""

_NO_GUIDED = "there is no GUIDED: position targets and guided items do nothing outside OFFBOARD"
_HOLDS_ITSELF = "its mission ends in HOLD by itself, and the bridge sends none"
_ENFORCED = "between verified and driving it has ENFORCED (test_px4_bridge)"
_ARDUPILOT_NUMBERS = (
    "reads ArduPilot's own numbers of modes in what is sent (test_px4_gaps: TestPersonsAtPages)"
)
_ARDUPILOT_PARAMETERS = "about parameters that PX4 does not have"
_ONE_LIST = "while a list is read or written, PX4 takes no other one"
_ROLLS = "disarmed on its way it rolls on (test_px4_bridge: TestTakeovers)"
_NO_HOME = "a mission has no home item, so that the lists compared are others"
_AS_ANOTHER = (
    "the other autopilot in it is PX4 (test_px4_bridge: test_an_autopilot_that_was_swapped_is_not_believed)"
)
_ROVER = "sets the mode inside ArduPilot's simulated rover"

CANNOT = {
    "test_a_click_becomes_a_verified_mission_and_a_drive": _ENFORCED,
    "test_a_plan_outside_what_was_measured_says_so_and_promises_nothing": _ARDUPILOT_PARAMETERS,
    "test_a_plan_outside_what_was_measured_is_uploaded_only_where_the_model_is_trusted": _ARDUPILOT_PARAMETERS,
    "test_a_target_that_is_only_said_again_changes_nothing": _ENFORCED,
    "test_other_ways_to_ask_and_how_to_close_them": _NO_GUIDED,
    "test_the_echo_of_a_target_in_guided": _NO_GUIDED,
    "test_the_ids_in_mission_current_tell_of_a_fence_that_changed_unheard": "it always tells ids, a second late: noticed after 2.06 s, not 2.0",
    "test_the_operator_takes_over_and_a_new_target_gives_back": "RTL disarms it at home",
    "test_a_mission_changed_by_somebody_else_is_noticed_and_left": _NO_HOME,
    "test_over_a_bad_link_a_fence_across_the_route_is_driven_around_within_ten_seconds": "the loop of HOLD, and its fence that counts later: 12.0 to 14.1 s",
    "test_a_parameter_that_comes_as_no_number_while_it_drives_is_told_once_and_changes_nothing": _ARDUPILOT_PARAMETERS,
    "test_a_parameter_that_cannot_be_does_not_end_the_bridge": _ARDUPILOT_PARAMETERS,
    "test_a_mission_longer_than_the_vehicle_holds_is_shortened_or_refused": _NO_HOME,
    "test_home_again_and_an_end_are_asked_of_the_bridge_too": "a mission that ends with RTL is refused (test_px4_gaps)",
    "test_a_target_across_a_seam_of_a_union_is_refused_with_what_would_do": "there is no union of inclusions",
    "test_the_mode_of_a_disarmed_vehicle_is_left_alone": _ROVER,
    "test_a_rover_that_somebody_else_drives_or_that_was_armed_before_is_not_told_of": _ROVER,
    "test_a_disarmed_vehicle_that_somebody_left_in_auto_is_told_of": _ROVER,
    "test_disarmed_between_the_look_and_the_switch_it_is_put_back_to_hold": _ROLLS,
    "test_over_a_bad_link_too": "a change of mode shows in the next heartbeat only, a second apart: at a loss of 25 % HOLD may go unconfirmed, and is said so",
    "test_a_vehicle_that_does_not_go_to_hold_is_told_of": _ARDUPILOT_NUMBERS,
    "test_after_our_drive_it_stands_in_hold": _HOLDS_ITSELF,
    "test_an_arrival_without_hold_is_an_outcome": _HOLDS_ITSELF,
    "test_what_the_vehicle_does_at_the_end_by_its_own_settings_is_left_to_it": _ARDUPILOT_PARAMETERS,
    "test_a_drive_that_somebody_else_began_is_not_held_at_its_end": _HOLDS_ITSELF,
    "test_a_mission_that_the_vehicle_calls_complete_may_be_replaced": _HOLDS_ITSELF,
    "test_a_hold_stops_a_drive_and_nothing_goes_on_by_itself": _ARDUPILOT_NUMBERS,
    "test_a_hold_that_is_lost_on_the_way_is_sent_until_a_heartbeat_shows_it": _ARDUPILOT_NUMBERS,
    "test_a_hold_ends_whatever_was_on_the_way_to_a_drive": _NO_HOME,
    "test_a_verified_mission_waits_for_the_word_and_a_new_target_takes_it_back": _ENFORCED,
    "test_without_permission_the_word_does_nothing": _ENFORCED,
    "test_a_fence_that_changes_during_an_upload_is_not_driven_into": _ONE_LIST,
    "test_a_fence_that_changed_unheard_is_read_before_the_drive": _ONE_LIST,
    "test_a_fence_that_broke_the_route_while_the_link_was_lost": _ONE_LIST,
    "test_a_parameter_of_the_fence_that_changes_under_the_drive": _ARDUPILOT_PARAMETERS,
    "test_a_lost_link_does_not_make_the_upload_only_bridge_forget": _ENFORCED,
    "test_the_heartbeat_before_the_drive_is_asked_for": "it waits for its fence first",
    "test_a_flood_while_it_drives_is_one_event_and_one_hold": _ARDUPILOT_NUMBERS,
    "test_a_typed_target_settles_it_and_all_is_read_anew": "it still turns HOLD's loop, and is held first (test_px4_gaps: TestClashes)",
    "test_it_is_told_again_after_it_was_settled": "it still turns HOLD's loop, and is held first (test_px4_gaps: TestClashes)",
    "test_another_autopilot_with_the_vehicles_ids_is_no_news_of_it": _AS_ANOTHER,
    "test_a_vehicle_whose_autopilot_was_swapped_is_driven_no_more": _AS_ANOTHER,
    "test_after_arming_auto_waits_for_a_heartbeat_that_shows_hold": _ROVER,
}
"""Scenarios that PX4's rover cannot take, and why."""


def scenarios_of(module) -> dict:
    """The scenarios of a module that are its own."""
    return {
        name: test
        for name, test in vars(module).items()
        if name.startswith("test_") and getattr(test, "__module__", "") == module.__name__
    }


ALL = {name: test for module in MODULES for name, test in scenarios_of(module).items()}
globals().update({name: test for name, test in ALL.items() if name not in CANNOT})


VERSIONS_DIFFER = {test_disarmed.__name__, test_lost_answers.__name__, test_takeover.__name__}
"""Scenarios of both versions: 1.17 accepts every change of mode, and 1.18 only what it does."""


def pytest_generate_tests(metafunc):
    """Run a scenario with 1.18, and with 1.17 where that answers otherwise."""
    both = metafunc.function.__module__ in VERSIONS_DIFFER and metafunc.definition.originalname in ALL
    metafunc.parametrize("as_px4", [V1_17, V1_18] if both else [V1_18], indirect=True, ids=str)


@pytest.fixture(autouse=True)
def as_px4(request, monkeypatch):
    """Put a PX4 rover in the place of ArduPilot's."""
    put_in_place(monkeypatch, MODULES, request.param)


def test_all_scenarios_are_run_or_named():
    there = {path.stem for path in Path(__file__).parents[1].glob("test_*.py")}
    assert there == {module.__name__.rpartition(".")[2] for module in MODULES} | set(OWN_TESTS)
    assert set(CANNOT) <= set(ALL)
