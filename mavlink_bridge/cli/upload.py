"""``pbpp upload``: missions, fences, rally points and parameters to the vehicle, verified; and an old list back to it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mavlink_bridge.cli.common import (
    AnyVehicleOption,
    JsonOption,
    QuietOption,
    SourceComponentOption,
    SourceSystemOption,
    SystemOption,
    TimeoutOption,
    print_json,
    progress_bar,
    warn,
)
from mavlink_bridge.cli.field_files import (
    IgnorePointsOption,
    MapOptions,
    OutermostOption,
    RoleOption,
    read_file,
    read_vehicle_file,
)
from mavlink_bridge.cli.restoring import Restoration, backups_to_restore, interrupted_warnings
from mavlink_bridge.cli.terminal import echo
from mavlink_bridge.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from mavlink_bridge.backup.store import BackupStore
    from mavlink_bridge.cli.session import Contact, Session
    from mavlink_bridge.cli.uploading import Done, Lists
    from missions.items import MissionItem

_LISTS = ("fence", "rally", "mission")  # a fence before the mission that it governs
_PARAMETER_SUFFIXES = (".parm", ".param", ".params")

RequiredConnectOption = Annotated[
    str,
    typer.Option(
        "--connect",
        metavar="CONNECTION",
        help="udpin:0.0.0.0:14550, udpout:HOST:PORT, tcp:HOST:PORT, tcpin:…, /dev/ttyACM0[,BAUD], COM7[,BAUD].",
    ),
]
SigningKeyOption = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Sign with this key: 32 bytes, hex, base64, or a passphrase."),
]


def upload(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE", help="A mission, fence, plan or parameter file; with --restore a backup."
        ),
    ] = None,
    connect: RequiredConnectOption = "",
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="|".join(_LISTS), help="Of a file with several lists only these."),
    ] = None,
    restore: Annotated[
        bool,
        typer.Option("--restore", help="Put back what an interrupted upload replaced, or the backup FILE."),
    ] = False,
    hold: Annotated[
        bool, typer.Option("--hold", help="A vehicle that drives in AUTO is switched to HOLD first.")
    ] = False,
    replace_active: Annotated[
        bool, typer.Option("--replace-active", help="Write even while the vehicle is armed in AUTO.")
    ] = False,
    drive: Annotated[
        bool, typer.Option("--drive", help="Switch to AUTO once everything is verified; arms nothing.")
    ] = False,
    other_vehicle: Annotated[
        bool,
        typer.Option("--other-vehicle", help="With --restore FILE: the backup may be another vehicle's."),
    ] = False,
    forget: Annotated[
        bool,
        typer.Option("--forget", help="Put the notes of interrupted uploads aside; the backups stay."),
    ] = False,
    role: RoleOption = None,
    outermost: OutermostOption = None,
    ignore_points: IgnorePointsOption = False,
    signing_key: SigningKeyOption = None,
    system: SystemOption = None,
    any_vehicle: AnyVehicleOption = False,
    source_system: SourceSystemOption = 245,
    source_component: SourceComponentOption = 190,
    timeout: TimeoutOption = 30.0,
    json_output: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Upload FILE to the vehicle: back up the old list, send the new one, read it back and compare.

    For example:

    `pbpp upload mission.waypoints --connect udpin:0.0.0.0:14550`

    `pbpp upload field.plan --connect /dev/ttyACM0 --only fence`

    `pbpp upload --restore --connect udpin:0.0.0.0:14550`
    """
    if other_vehicle and not (restore and file):
        raise UsageError("--other-vehicle goes with --restore FILE: name the backup that is to be written")
    if forget and (file is not None or restore or drive):
        raise UsageError("--forget only puts notes aside; upload or restore in another run")
    if not connect and not forget:
        raise UsageError("upload needs --connect CONNECTION")
    if file is None and not restore and not forget:
        raise UsageError("give a FILE to upload, or --restore")
    restoration = _restoration(file, for_another=other_vehicle) if restore else None
    maps = MapOptions(role, outermost, ignore_points)
    lists, parameters = _content(file, only or [], restoration, maps)

    from mavlink_bridge.backup.store import BackupStore  # noqa: PLC0415 - usage errors need not wait for it
    from mavlink_bridge.cli.interrupting import interruptible, terminable  # noqa: PLC0415
    from mavlink_bridge.cli.session import Contact, open_session  # noqa: PLC0415
    from mavlink_bridge.cli.starting import fence_warnings, make_ready, start_driving  # noqa: PLC0415

    contact = Contact(connect, (source_system, source_component), system, any_vehicle, timeout, signing_key)
    store = BackupStore()
    if forget:
        _forget(store, contact, json_output=json_output, quiet=quiet)
        return

    from mavlink_bridge.cli.uploading import Uploads  # noqa: PLC0415

    with (
        terminable(),
        progress_bar(quiet=quiet or json_output) as show,
        open_session(contact, show) as session,
    ):
        uploads = Uploads(session, store, replace_active=replace_active)
        with interruptible(session.at_hand(show.aside, uploads.on_it)), uploads.begin():
            backups = backups_to_restore(store, uploads.vehicle, restoration) if restoration else []
            if not restoration:
                warn(interrupted_warnings(store, uploads.vehicle))
            make_ready(session, hold=hold, replace_active=replace_active)
            warn(fence_warnings(session, [kind for kind, _ in lists] + [one.mission_type for one in backups]))
            for backup in backups:
                uploads.write_lists([(backup.mission_type, backup.items)], backup.path)
            uploads.write_lists(lists)
            if parameters:
                uploads.write_parameters(parameters)
            if drive:
                start_driving(session)
    _report(session, uploads.done, uploads.changed, json_output=json_output, quiet=quiet)


def _restoration(file: Path | None, *, for_another: bool) -> Restoration:
    from mavlink_bridge.backup.store import read_backup  # noqa: PLC0415 - usage errors need not wait for it

    return Restoration(read_backup(file) if file else None, for_another)


def _forget(store: BackupStore, contact: Contact, *, json_output: bool, quiet: bool) -> None:
    """Put notes aside: all that there are, those of a system id, or those that may be about the vehicle on a link."""
    if contact.connection:
        from mavlink_bridge.cli.session import open_session  # noqa: PLC0415 - usage errors need not wait for it

        with progress_bar(quiet=quiet or json_output) as show, open_session(contact, show) as session:
            notes = store.interrupted(session.which_vehicle())
    else:
        notes = [note for note in store.notes() if contact.system in (None, note.vehicle.system)]
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
    if json_output:
        print_json({"status": "ok", "command": "upload", "forgotten": document})
    elif not quiet:
        for entry in document:
            backup = entry["backup"] or "not known"
            echo(
                f"{entry['list']} of {entry['vehicle']}: put aside as {entry['note']}; the backup is {backup}"
            )
        if not document:
            echo("no interrupted upload is noted")


def _content(
    file: Path | None, only: Sequence[str], restoration: Restoration | None, maps: MapOptions
) -> tuple[Lists, Mapping[str, float]]:
    """Read the file, lists as they go over the wire or parameters; all that it holds can be sent."""
    from mavlink_bridge.mavlink.messages import MissionType  # noqa: PLC0415 - usage errors need not wait for it
    from mavlink_bridge.protocol.sendable import check_items, check_parameters  # noqa: PLC0415

    if unknown := [name for name in only if name not in _LISTS]:
        raise UsageError(f"--only {unknown[0]}: expected one of {', '.join(_LISTS)}")
    if restoration is not None and restoration.backup is not None:
        check_items(restoration.backup.items, restoration.backup.mission_type, allow_infinite=True)
    if file is None or restoration is not None:
        return [], {}
    if file.suffix.lower() in _PARAMETER_SUFFIXES:
        parameters = read_vehicle_file(file)
        check_parameters(parameters)
        return [], parameters
    found = _lists_of(file, maps)
    chosen = [name for name in _LISTS if name in found and (not only or name in only)]
    if not chosen:
        raise UsageError(f"{file} holds no {' or '.join(only or _LISTS)}")
    lists = [(MissionType[name.upper()], found[name]) for name in chosen]
    for mission_type, items in lists:
        check_items(items, mission_type)
    return lists, {}


def _lists_of(file: Path, maps: MapOptions) -> dict[str, tuple[MissionItem, ...]]:
    from missions.fence import fence_to_items  # noqa: PLC0415
    from missions.geo import LatLon  # noqa: PLC0415
    from missions.items import with_home  # noqa: PLC0415
    from missions.rally import rally_to_items  # noqa: PLC0415

    situation = read_file(file, maps)
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


def _report(
    session: Session,
    done: Sequence[Done],
    changed: Mapping[str, tuple[float | None, float]],
    *,
    json_output: bool,
    quiet: bool,
) -> None:
    if json_output:
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
    if quiet:
        return
    for entry in done:
        how = "was there already" if entry.outcome.pushes == 0 else f"uploaded in {entry.took_s:.1f} s"
        coarse = " (positions read back to about 1 m only)" if entry.outcome.is_coarse else ""
        name = entry.mission_type.name.lower()
        echo(f"{name}: {len(entry.outcome.found or ())} items, {how}, read back and verified{coarse}")
        if entry.backup:
            echo(f"  the list before is kept in {entry.backup}")
    for name, (old, new) in changed.items():
        echo(f"{name}: {'no number' if old is None else f'{old:g}'} -> {new:g}, confirmed")
    if not done and not changed:
        echo("all parameters have these values already")
