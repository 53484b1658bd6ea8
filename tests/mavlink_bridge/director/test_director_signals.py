"""What the director's parts signal is acted upon, and no part knows one that was made after it."""

from __future__ import annotations

from mavlink_bridge.director import TRANSITIONS, Cue, Director, Orders
from mavlink_bridge.director.core import Core, Part
from mavlink_bridge.director.handlers import HANDLERS
from mavlink_bridge.director.states import Notice

MOVES_ALONE = {Cue.UPLOAD_VERIFIED, Cue.TROUBLE, Cue.END}
"""Cues that move the state, and that is all."""


def test_every_signal_has_a_handler():
    assert set(HANDLERS) == (set(Cue) - MOVES_ALONE) | set(Notice)


def test_every_cue_moves_some_state():
    assert {cue for row in TRANSITIONS.values() for cue in row} == set(Cue)


def test_parts_know_only_those_made_before_them():
    made = vars(Director(Orders())._parts)
    parts = [part for part in made.values() if isinstance(part, Part)]
    assert len(parts) == 16
    for place, part in enumerate(parts):
        known = [one for one in vars(part).values() if isinstance(one, Part)]
        assert all(one in parts[:place] for one in known), type(part).__name__


def test_no_class_of_the_director_has_grown_into_another_tower():
    made = vars(Director(Orders())._parts)
    assert [
        len(vars(one)) for one in made.values() if isinstance(one, Part | Core) and len(vars(one)) > 20
    ] == []
    assert all(type(one).__mro__[1] is Part for one in made.values() if isinstance(one, Part))
