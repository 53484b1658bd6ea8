"""What follows from each signal of the director's parts, in one table beside that of the transitions.

All that one part leads to in another stands here; a handler tells the parts what to do, and returns what follows next.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.director.events import EventName
from mavlink_bridge.director.orders import TargetSource
from mavlink_bridge.director.states import Cue, Notice, Signal, State
from mavlink_bridge.director.takeover import Takeover
from mavlink_bridge.director.targets import Target
from mavlink_bridge.errors import OutcomeError
from mavlink_bridge.mavlink import messages as m

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from mavlink_bridge.director.parts import Parts


def _let_loose(parts: Parts) -> None:
    """Forget what was wanted and what is under way, but for an upload and for learning."""
    core = parts.core
    core.operator.stop()
    parts.inbox.let_go()
    parts.halter.let_go()
    parts.driver.drive = None
    core.target = None
    if core.state not in (State.WITHDRAWING, State.CLASHING, State.LEARNING):
        core.steps.clear()


# The vehicle: found, learnt, silent, switched off and on


def _learn(parts: Parts, now_s: float) -> None:
    parts.learner.learn(now_s)
    is_wanted = parts.learner.is_first_time and bool(parts.core.orders.request.targets)
    parts.inbox.watch_while_waiting(is_wanted=is_wanted)


def _learn_again(parts: Parts, now_s: float) -> None:
    if not parts.core.orders.once:
        _learn(parts, now_s)


def _on_learnt(parts: Parts, now_s: float) -> Iterable[Signal]:
    core, inbox = parts.core, parts.inbox
    parts.lists.settle(now_s)
    core.voice.learnt(now_s, core.situation)
    parts.caller.learnt(now_s)
    is_first_time, parts.learner.is_first_time = parts.learner.is_first_time, False
    is_adopted = is_first_time and parts.adopter.look(now_s)
    targets = core.orders.request.targets
    if not is_first_time:
        if core.orders.once:
            return core.give_up(OutcomeError("the vehicle rebooted meanwhile"))
        inbox.note_lists()
        parts.hand_over.put_back_after_silence(now_s)
        return [*_take_up_again(parts), Notice.TARGET_IS_DUE]
    if is_adopted and targets and parts.adopter.leads_to(targets[-1]):
        targets = ()  # that is where it drives
    if is_adopted or inbox.waiting is not None or targets:
        inbox.note_lists()
        waiting = inbox.take_waiting()
        return waiting or (inbox.take(Target(targets[-1], TargetSource.TYPED)) if targets else [])
    if core.orders.once:
        return [Notice.ROUTE_WANTED]
    return [Notice.MISSION_HEARD, Notice.RALLY_HEARD]


def _take_up_again(parts: Parts) -> Iterable[Signal]:
    """Go on where a lost link left us: with watching, never with driving; somebody may have had the vehicle meanwhile."""
    core = parts.core
    if not core.is_driving_ours:
        parts.adopter.forget()
    if core.plan is None or not core.has_our_mission:
        return []
    core.target = Target(core.plan.targets[-1], TargetSource.TYPED)
    if core.is_driving_ours:
        return [*parts.driver.resume("still driving our mission"), *_look_at_fence(parts)]
    if core.orders.drive:
        core.target = None
        return []
    return [Cue.STILL_THERE]


def _look_at_fence(parts: Parts) -> Iterable[Signal]:
    """Return that the fence changed, where it did while nobody heard of it."""
    return [Notice.FENCE_CHANGED] if parts.desk.is_in_doubt else []


def _on_fence_changed(parts: Parts, now_s: float) -> Iterable[Signal]:
    parts.keeper.hurry()
    return parts.desk.fence_changed(now_s)


def _on_still_there(parts: Parts, now_s: float) -> Iterable[Signal]:
    return parts.desk.fence_changed(now_s) if parts.desk.is_stale else ()


def _on_heard_again(parts: Parts, now_s: float) -> None:
    text = "the vehicle is heard again; reading everything again"
    parts.core.voice.tell(now_s, EventName.LINK_BACK, text)
    _learn(parts, now_s)


def _on_silence(parts: Parts, now_s: float) -> Iterable[Signal]:
    parts.caller.lose_sight()
    parts.hand_over.note_silence()
    parts.core.steps.clear()
    _let_loose(parts)
    parts.inbox.watch_while_waiting()
    return parts.learner.fallen_silent(now_s)


def _on_rebooted(parts: Parts, now_s: float) -> None:
    text = "the vehicle rebooted; reading everything again"
    parts.core.voice.tell(now_s, EventName.REBOOTED, text)
    parts.caller.lose_sight()
    _let_loose(parts)
    parts.hand_over.was_in_auto_by_us = False  # it starts in another mode
    parts.hand_over.incidents.forget()
    parts.core.ours = None
    parts.adopter.forget()
    parts.inbox.waiting = None
    parts.learner.learns_later = parts.core.state is State.WITHDRAWING
    if not parts.learner.learns_later:
        _learn(parts, now_s)


# Targets and routes


def _on_typed(parts: Parts, now_s: float) -> None:
    parts.core.operator.stop()
    _learn(parts, now_s)


def _on_target_waits(parts: Parts, now_s: float) -> None:
    parts.halter.stop_at_once(parts.inbox.came, now_s)
    parts.inbox.watch_while_waiting()


def _on_route_wanted(parts: Parts, _now_s: float, *, is_own_idea: bool = False) -> Iterable[Signal]:
    parts.desk.is_own_idea = is_own_idea
    return [Cue.TARGET_WHILE_MOVING if parts.halter.may_stop_it else Cue.TARGET]


def _on_route_outdated(parts: Parts, now_s: float) -> Iterable[Signal]:
    if parts.halter.may_stop_it and parts.hold_watch.goes_on_first(now_s):
        return ()
    return _on_route_wanted(parts, now_s, is_own_idea=True)


def _on_target_came(parts: Parts, now_s: float) -> Iterable[Signal]:
    """Go into a target; one that has not set the vehicle going waits where that is to go on before its HOLD."""
    core, inbox = parts.core, parts.inbox
    if not inbox.came.is_home:
        parts.caller.begin_anew()
    if inbox.came.has_set_off or not parts.halter.may_stop_it or not parts.hold_watch.goes_on_first(now_s):
        return inbox.go_into(now_s)
    if not inbox.came.is_home:
        core.operator.take_target(now_s, is_click=False)
    inbox.waiting = inbox.came
    return ()


def _on_gone_on(parts: Parts, now_s: float) -> Iterable[Signal]:
    if parts.inbox.waiting is not None:
        return [Notice.TARGET_IS_DUE]
    return _on_route_wanted(parts, now_s, is_own_idea=True)


def _on_target(parts: Parts, _now_s: float) -> None:
    parts.writer.is_confirmed = parts.starter.is_told = False
    parts.adopter.forget()
    parts.driver.stand_by()


def _on_target_while_moving(parts: Parts, now_s: float) -> None:
    parts.writer.is_confirmed = parts.starter.is_told = False
    parts.adopter.stop_waiting()
    parts.driver.drive = None
    target = parts.core.target
    is_home = target is not None and target.is_home
    parts.halter.hold("stopping for the way home" if is_home else "stopping for a new route", now_s)


def _on_planned(parts: Parts, now_s: float) -> Iterable[Signal]:
    core = parts.core
    assert core.plan is not None
    parts.inbox.answers.settle(m.MavResult.ACCEPTED)
    if core.target is not None and core.target.is_home:
        parts.caller.planned(now_s)
    core.voice.planned(now_s, core.plan)
    return parts.writer.go_on()


def _on_no_plan(parts: Parts, now_s: float) -> Iterable[Signal]:
    """Tell why there is no plan; one that waits for an obstacle to go has not failed."""
    if parts.desk.is_waiting:
        parts.inbox.answers.settle(m.MavResult.TEMPORARILY_REJECTED)
        return ()
    parts.inbox.answers.settle(m.MavResult.DENIED)
    signals = parts.desk.no_plan(now_s)
    target = parts.core.target
    if target is not None and target.is_home:
        parts.caller.refused(now_s)
    return signals


# Missions and drives


def _on_adopted(parts: Parts, now_s: float) -> Iterable[Signal]:
    parts.adopter.adopted(now_s)
    parts.caller.adopted(now_s)
    return parts.desk.tell_less(now_s) if parts.desk.promises_less else _look_at_fence(parts)


def _on_upload_ended(parts: Parts, now_s: float) -> Iterable[Signal]:
    """Go on from an upload that has ended, well or badly."""
    was_rebooted, parts.learner.learns_later = parts.learner.learns_later, False
    if was_rebooted:
        parts.core.ours = None
        if parts.core.move(Cue.REBOOTED):
            _learn(parts, now_s)
    yield from parts.hand_over.withdrawn()
    if parts.core.state is State.CLASHED:
        yield from parts.guard.settle("the mission is verified on the vehicle, but it is not driven")
    elif not was_rebooted and not parts.core.is_done:
        yield from _after_upload(parts, now_s)


def _after_upload(parts: Parts, now_s: float) -> Iterable[Signal]:
    signals = parts.inbox.take_waiting()
    if signals or parts.core.state is not State.VERIFIED:
        if not signals and parts.core.state is State.READY:
            parts.caller.not_written(now_s)
        return signals
    parts.inbox.note_lists()
    found = parts.desk.recheck(1)
    if not found.holds and parts.desk.is_stale:
        return parts.desk.broke(found, now_s)
    return parts.fence.verified(now_s, may_begin=parts.starter.may_begin)


def _on_mission_invalid(parts: Parts, now_s: float) -> Iterable[Signal]:
    """Go on from where the vehicle itself holds: our mission is not valid any more to it, for its fence is another one. It is read, and a new route made."""
    parts.lists.suspect_all()
    parts.halter.expect_hold()
    return _on_gone_on(parts, now_s)


def _on_taken_unseen(parts: Parts, _now_s: float) -> Iterable[Signal]:
    """Leave the vehicle to who has it: no change of mode was seen, and what it does is not ours."""
    parts.hand_over.taken = Takeover(parts.core.situation.mode)
    return [Cue.TAKEN_OVER]


def _on_held_unseen(parts: Parts, _now_s: float) -> Iterable[Signal]:
    """Drive nothing on from a HOLD that may have overridden somebody: it stands, and who wants it to drive gives a target."""
    if not parts.core.heeds(Cue.TAKEN_OVER) or parts.core.state is State.ARRIVED:
        return [Notice.HOLD_ENDED]
    parts.hand_over.taken = Takeover(parts.core.modes.hold, is_unseen=True)
    return [Cue.TAKEN_OVER]


def _on_hold_ended(parts: Parts, _now_s: float) -> Iterable[Signal]:
    if parts.core.state is State.HOLDING and not parts.halter.is_hold_granted:
        parts.caller.not_held()
        trouble = OutcomeError("the vehicle did not switch to HOLD; nothing was written")
        return parts.core.fail_step(trouble)
    if parts.core.state is State.CLASHED:
        return parts.guard.hold_ended()
    if parts.core.state is State.ARRIVED and parts.driver.holds_after_arrival:
        return parts.driver.held_after_arrival()
    return ()


def _on_drive_ended(parts: Parts, now_s: float) -> Iterable[Signal]:
    """End a drive that has arrived; a single job is done with it."""
    parts.driver.holds_after_arrival = False
    parts.caller.arrived(now_s)
    parts.adopter.forget()
    _let_loose(parts)
    return [*parts.core.end(), Notice.TARGET_IS_DUE]


# The operator's word


def _on_taken_over(parts: Parts, now_s: float) -> Iterable[Signal]:
    """Leave the vehicle to who took it, or the mission to who changed it, until a new target comes."""
    parts.adopter.forget()
    parts.caller.overruled(now_s)
    taken, was_in_auto = parts.hand_over.taken, parts.halter.may_be_in_auto
    so_far = parts.driver.drive.so_far if parts.driver.drive is not None else ""
    _let_loose(parts)
    if taken is None:
        return ()
    parts.inbox.waiting = None
    parts.learner.is_first_time = False
    return parts.hand_over.account_for(taken, so_far, now_s, was_in_auto=was_in_auto)


def _on_hold_asked(parts: Parts, now_s: float) -> None:
    """Send a person's HOLD; whatever the state, and nothing is wanted after it."""
    parts.inbox.waiting = None
    parts.learner.is_first_time = False
    parts.halter.hold_for_good(parts.hand_over.why_held, now_s)


def _on_clash(parts: Parts, now_s: float) -> Iterable[Signal]:
    halter = parts.halter
    parts.adopter.forget()
    hold, may_be_in_auto = halter.stopping, halter.may_be_in_auto
    _let_loose(parts)
    parts.inbox.waiting = None
    halter.stopping, halter.may_be_in_auto = hold, may_be_in_auto  # a HOLD on its way gets there
    return parts.guard.answer(now_s)


HANDLERS: dict[Signal, Callable[[Parts, float], Iterable[Signal] | None]] = {
    # Cues: the state has moved as the table says
    Cue.FOUND: _learn,
    Cue.LEARNT: _on_learnt,
    Cue.ADOPTED: _on_adopted,
    Cue.HELD: lambda parts, _now_s: parts.adopter.forget(),
    Cue.NOT_FORESEEN: lambda parts, now_s: parts.halter.wait_for_rest(now_s),
    Cue.TARGET: _on_target,
    Cue.TARGET_WHILE_MOVING: _on_target_while_moving,
    Cue.PLANNED: _on_planned,
    Cue.NO_PLAN: _on_no_plan,
    Cue.UPLOAD: lambda parts, now_s: parts.writer.begin(now_s),
    Cue.ENFORCED: lambda parts, now_s: parts.fence.enforced(now_s, may_begin=parts.starter.may_begin),
    Cue.RENEWED: lambda parts, now_s: parts.fence.verified(now_s, may_begin=parts.starter.may_begin),
    Cue.DRIVE: lambda parts, now_s: parts.starter.begin(now_s),
    Cue.RESUMED: lambda parts, now_s: parts.driver.resumed(now_s),
    Cue.STILL_THERE: _on_still_there,
    Cue.STARTED: lambda parts, now_s: parts.driver.begin(now_s),
    Cue.REACHED: lambda parts, now_s: parts.driver.arrived(now_s),
    Cue.TAKEN_OVER: _on_taken_over,
    Cue.CLASH: _on_clash,
    Cue.TYPED: _on_typed,
    Cue.SILENCE: _on_silence,
    Cue.HEARD: _on_heard_again,
    Cue.REBOOTED: _on_rebooted,
    Cue.GIVE_UP: lambda parts, _now_s: parts.core.steps.clear(),
    # UPLOAD_VERIFIED, TROUBLE and END move the state, and that is all.
    # Notices: the state is as it was
    Notice.TARGET_CAME: _on_target_came,
    Notice.TARGET_WAITS: _on_target_waits,
    Notice.TARGET_AGAIN: lambda parts, now_s: parts.halter.stop_again(parts.inbox.came, now_s),
    Notice.TARGET_IS_DUE: lambda parts, _now_s: parts.inbox.take_waiting(),
    Notice.ROUTE_WANTED: _on_route_wanted,
    Notice.ROUTE_OUTDATED: _on_route_outdated,
    Notice.GONE_ON: _on_gone_on,
    Notice.OBSTACLES_CHANGED: lambda parts, now_s: parts.desk.obstacles_changed(now_s),
    Notice.FENCE_CHANGED: _on_fence_changed,
    Notice.WAYS_KNOWN: lambda parts, _now_s: parts.caller.try_again(),
    Notice.MISSION_READ: lambda parts, _now_s: parts.writer.mission_read(),
    Notice.MISSION_TAKEN: lambda parts, now_s: parts.writer.mission_taken(now_s),
    Notice.MISSION_HEARD: lambda parts, _now_s: parts.inbox.take_mission_target(),
    Notice.RALLY_HEARD: lambda parts, _now_s: parts.inbox.take_rally_target(),
    Notice.WAY_CHOSEN: lambda parts, _now_s: _look_at_fence(parts),
    Notice.LEARNING_FAILED: _learn_again,
    Notice.HOLD_ASKED: _on_hold_asked,
    Notice.HOLD_ENDED: _on_hold_ended,
    Notice.HELD_UNSEEN: _on_held_unseen,
    Notice.SWITCHED_BACK: _on_taken_unseen,
    Notice.DRIVEN_IN_HOLD: _on_taken_unseen,
    Notice.MISSION_INVALID: _on_mission_invalid,
    Notice.UPLOAD_ENDED: _on_upload_ended,
    Notice.DRIVE_ENDED: _on_drive_ended,
}
"""What follows from each signal."""
