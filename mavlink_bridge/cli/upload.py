"""``pbpp upload``: missions, fences, rally points and parameters to the vehicle, verified; and an old list back to it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from mavlink_bridge.backup.store import BackupStore, read_backup
from mavlink_bridge.cli.common import warn
from mavlink_bridge.cli.enforcing import Enforcement
from mavlink_bridge.cli.field_files import read_file, read_vehicle_file
from mavlink_bridge.cli.interrupting import interruptible
from mavlink_bridge.cli.options.upload import LISTS
from mavlink_bridge.cli.options_session import session_for
from mavlink_bridge.cli.restoring import Restoration, backups_to_restore, interrupted_warnings
from mavlink_bridge.cli.starting import check_drivable, fence_warnings, make_ready, start_driving
from mavlink_bridge.cli.terminal import echo, print_json
from mavlink_bridge.cli.uploading import Uploads
from mavlink_bridge.errors import UsageError
from mavlink_bridge.mavlink.messages import MissionType
from mavlink_bridge.protocol.sendable import check_items, check_parameters
from missions.fence import fence_to_items
from missions.geo import LatLon
from missions.items import with_home, without_home
from missions.rally import rally_to_items
from missions.situation import Situation
from missions.vehicle.parameter_remarks import made_for_remarks, range_remarks

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from mavlink_bridge.backup.store import Backup
    from mavlink_bridge.cli.options.upload import UploadOptions
    from mavlink_bridge.cli.session import Session
    from mavlink_bridge.cli.uploading import Done, Lists
    from missions.items import MissionItem

_PARAMETER_SUFFIXES = (".parm", ".param", ".params")


def upload(options: UploadOptions) -> None:
    """Write what the file or the backups hold, verified; or only put notes aside."""
    _check(options)
    restoration = None
    if options.restore:
        restoration = Restoration(read_backup(options.file) if options.file else None, options.other_vehicle)
    lists, held = _content(options, restoration)
    parameters = held.parameters
    store = BackupStore()
    if options.forget:
        _forget(store, options)
        return
    with session_for(options, options.connect) as (session, show):
        uploads = Uploads(session, store, replace_active=options.replace_active)
        with interruptible(session.at_hand(show.aside, uploads.on_it)), uploads.begin():
            backups = backups_to_restore(store, uploads.vehicle, restoration) if restoration else []
            if not restoration:
                warn(interrupted_warnings(store, uploads.vehicle))
            warn(_file_remarks(options.file, held, session.heard))
            if options.drive:
                missions = (items for kind, items in _kinds(lists, backups) if kind is MissionType.MISSION)
                check_drivable(session, (_as_sent(session, MissionType.MISSION, one) for one in missions))
            make_ready(session, hold=options.hold, replace_active=options.replace_active)
            warn(fence_warnings(session, [kind for kind, _ in lists] + [one.mission_type for one in backups]))
            fences = [items for kind, items in _kinds(lists, backups) if kind is MissionType.FENCE]
            watch = Enforcement(session) if fences and Enforcement.is_needed(session) else None
            if watch is not None:
                warn(watch.foreseen(fences[0]))
            for backup in backups:
                uploads.write_lists([(backup.mission_type, backup.items)], backup.path)
            uploads.write_lists([(kind, _as_sent(session, kind, items)) for kind, items in lists])
            if watch is not None:
                warn(uploads.await_fence(watch, fences[0]))
            if parameters:
                uploads.write_parameters(parameters)
            if options.drive:
                start_driving(session)
    _report(session, uploads.done, uploads.changed, options)


def _kinds(lists: Lists, backups: Sequence[Backup]) -> Lists:
    """Return the lists that are written, whatever they come from."""
    return [*lists, *((one.mission_type, one.items) for one in backups)]


def _check(options: UploadOptions) -> None:
    """Find what cannot work before any work is done."""
    if options.other_vehicle and not (options.restore and options.file):
        raise UsageError("--other-vehicle goes with --restore FILE: name the backup that is to be written")
    if options.forget and (options.file is not None or options.restore or options.drive):
        raise UsageError("--forget only dismisses notes; upload or restore in a separate run")
    if not options.connect and not options.forget:
        raise UsageError("upload needs --connect CONNECTION")
    if options.file is None and not options.restore and not options.forget:
        raise UsageError("give a FILE to upload, or --restore")


def _forget(store: BackupStore, options: UploadOptions) -> None:
    """Put notes aside: all that there are, those of a system id, or those that may be about the vehicle on a link."""
    if options.connect:
        with session_for(options, options.connect) as (session, _show):
            notes = store.interrupted(session.which_vehicle())
    else:
        notes = [note for note in store.notes() if options.system in (None, note.vehicle.system)]
    put_aside = store.forget(notes)
    document = [
        {
            "list": note.mission_type.name.lower(),
            "vehicle": str(note.vehicle),
            "backup": str(note.backup.path) if note.backup else None,
            "note": str(path),
        }
        for note, path in zip(notes, put_aside, strict=True)
    ]
    if options.json_output:
        print_json({"status": "ok", "command": "upload", "forgotten": document})
    elif not options.quiet:
        for entry in document:
            backup = entry["backup"] or "not known"
            echo(
                f"{entry['list']} of {entry['vehicle']}: dismissed, kept as {entry['note']}; the backup is {backup}"
            )
        if not document:
            echo("no interrupted uploads")


def _content(options: UploadOptions, restoration: Restoration | None) -> tuple[Lists, Situation]:
    """Read the file: lists as they go over the wire, and the situation with its parameters; all that it holds can be sent."""
    file, only = options.file, options.only
    if unknown := [name for name in only if name not in LISTS]:
        raise UsageError(f"--only {unknown[0]}: expected one of {', '.join(LISTS)}")
    if restoration is not None and restoration.backup is not None:
        check_items(restoration.backup.items, restoration.backup.mission_type, allow_infinite=True)
    if file is None or restoration is not None:
        return [], Situation()
    if file.suffix.lower() in _PARAMETER_SUFFIXES:
        described = read_vehicle_file(file)
        check_parameters(described.parameters)
        return [], described
    situation = read_file(file, options)
    found = _lists_of(situation)
    chosen = [name for name in LISTS if name in found and (not only or name in only)]
    if not chosen:
        raise UsageError(f"{file} holds no {' or '.join(only or LISTS)}")
    lists = [(MissionType[name.upper()], found[name]) for name in chosen]
    for mission_type, items in lists:
        check_items(items, mission_type)
    return lists, Situation(reading=situation.reading)


def _file_remarks(file: Path | None, held: Situation, vehicle: Situation) -> list[str]:
    """Return what of a file does not fit the vehicle that it is sent to."""
    remarks = []
    if held.system not in (None, vehicle.system):
        remarks.append(f"{file} was saved from vehicle {held.system}; this is vehicle {vehicle.system}")
    if held.parameters:
        remarks += range_remarks(held.parameters, ardupilot=vehicle.ardupilot)
    return [*remarks, *made_for_remarks(replace(vehicle, reading=held.reading))]


def _lists_of(situation: Situation) -> dict[str, tuple[MissionItem, ...]]:
    found: dict[str, tuple[MissionItem, ...]] = {}
    if situation.fence and situation.fence.value.zones:
        found["fence"] = fence_to_items(situation.fence.value)
    if situation.rally and situation.rally.value:
        found["rally"] = rally_to_items(situation.rally.value)
    if situation.mission and situation.mission.value.items:
        mission = situation.mission.value
        # ArduPilot looks at the home item but keeps its own home.
        found["mission"] = with_home(mission.items, mission.home or LatLon(0.0, 0.0))
    return found


def _as_sent(session: Session, kind: MissionType, items: tuple[MissionItem, ...]) -> tuple[MissionItem, ...]:
    """Return a list of a file as the vehicle's autopilot counts it: most missions have no home item."""
    is_first_home = kind is MissionType.MISSION and not session.autopilot.lists.form.has_home_item
    return without_home(items) if is_first_home else items


def _report(
    session: Session,
    done: Sequence[Done],
    changed: Mapping[str, tuple[float | None, float]],
    options: UploadOptions,
) -> None:
    if options.json_output:
        print_json(
            {
                "status": "ok",
                "command": "upload",
                "system": session.vehicle.system,
                "lists": [entry.document() for entry in done],
                "parameters": {name: {"before": old, "now": new} for name, (old, new) in changed.items()},
                "verified": True,
            }
        )
        return
    if options.quiet:
        return
    for entry in done:
        how = "already on the vehicle" if entry.outcome.pushes == 0 else f"uploaded in {entry.took_s:.1f} s"
        coarse = " (positions read back to about 1 m only)" if entry.outcome.is_coarse else ""
        name = entry.mission_type.name.lower()
        counts = "" if entry.not_enforced is None or entry.not_enforced else ", in force now"
        echo(f"{name}: {len(entry.outcome.found or ())} items, {how}, read back and verified{coarse}{counts}")
        if entry.backup:
            echo(f"  the list before is kept in {entry.backup}")
    for name, (old, new) in changed.items():
        echo(f"{name}: {'not a number' if old is None else f'{old:g}'} -> {new:g}, confirmed")
    if not done and not changed:
        echo("all parameters already have these values")
