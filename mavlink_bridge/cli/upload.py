"""``pbpp upload``: missions, fences, rally points and parameters to the vehicle, verified; and an old list back to it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
from mavlink_bridge.errors import BridgeError, OutcomeError, RefusedError, UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from mavlink_bridge.backup import Backup, BackupStore
    from mavlink_bridge.cli.session import Session
    from mavlink_bridge.messages import MissionType
    from mavlink_bridge.protocol.limits import Limits
    from mavlink_bridge.protocol.verified_upload import VerifiedUpload, VerifiedUploadOutcome
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


@dataclass(frozen=True, slots=True)
class _Done:
    """One list that is on the vehicle now, verified."""

    mission_type: MissionType
    outcome: VerifiedUploadOutcome
    backup: Path | None
    took_s: float

    def document(self) -> dict[str, Any]:
        """Give it for JSON."""
        return {
            "list": self.mission_type.name.lower(),
            "items": len(self.outcome.found or ()),
            "outcome": str(self.outcome.kind),
            "pushes": self.outcome.pushes,
            "backup": str(self.backup) if self.backup else None,
            "transfer_s": round(self.took_s, 3),
        }


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
    if not connect:
        raise UsageError("upload needs --connect CONNECTION")
    if file is None and not restore:
        raise UsageError("what is to be uploaded? Give a FILE, or --restore")
    lists, parameters = _content(file, only or [], restore=restore)

    from mavlink_bridge.backup import BackupStore  # noqa: PLC0415 - usage errors need not wait for it
    from mavlink_bridge.cli.interrupting import interruptible, terminable  # noqa: PLC0415
    from mavlink_bridge.cli.session import Address, open_session  # noqa: PLC0415
    from mavlink_bridge.cli.starting import make_ready, start_driving  # noqa: PLC0415

    address = Address(connect, (source_system, source_component), system, any_vehicle, timeout, signing_key)
    done: list[_Done] = []
    changed: dict[str, tuple[float | None, float]] = {}
    with (
        terminable(),
        progress_bar(quiet=quiet or json_output) as show,
        open_session(address, show) as session,
        interruptible(session.at_hand(show.aside, lambda: _on_it(done, changed))),
    ):
        store = BackupStore()
        if restore and file is None:
            lists = _interrupted_lists(store, session.vehicle.system)
        elif not restore:
            warn(interrupted_warnings(store, session.vehicle.system))
        if not session.is_ardupilot:
            raise UsageError("the vehicle's autopilot is not ArduPilot: what it stores could not be verified")
        make_ready(session, hold=hold, replace_active=replace_active)
        limits = _limits(session, lists)
        for mission_type, items in lists:
            done.append(
                _upload_list(session, store, mission_type, items, limits, replace_active=replace_active)
            )
        if parameters:
            _upload_parameters(session, parameters, changed)
        if drive:
            start_driving(session)
    _report(session, done, changed, json_output=json_output, quiet=quiet)


def interrupted_warnings(store: BackupStore, system: int) -> list[str]:
    """Say which uploads to a vehicle never came to their outcome."""
    return [
        f"an upload of the {backup.mission_type.name.lower()} to system {system} was interrupted: the list may be part old, part new. "
        f"`pbpp upload --restore` puts back the old one ({len(backup.items)} items, read {backup.time:%Y-%m-%d %H:%M:%S} UTC, {backup.path})"
        for backup in _interrupted(store, system)
    ]


def _interrupted(store: BackupStore, system: int) -> list[Backup]:
    from mavlink_bridge.messages import MissionType  # noqa: PLC0415

    found = (store.interrupted(system, MissionType[name.upper()]) for name in _LISTS)
    return [backup for backup in found if backup]


def _interrupted_lists(store: BackupStore, system: int) -> list[tuple[MissionType, tuple[MissionItem, ...]]]:
    backups = _interrupted(store, system)
    if not backups:
        raise UsageError(
            f"no upload to system {system} was interrupted; to restore another backup give its file (they are in {store.folder})"
        )
    return [(backup.mission_type, backup.items) for backup in backups]


def _content(
    file: Path | None, only: Sequence[str], *, restore: bool
) -> tuple[list[tuple[MissionType, tuple[MissionItem, ...]]], Mapping[str, float]]:
    """Read the file: lists as they go over the wire, or parameters."""
    from mavlink_bridge.messages import MissionType  # noqa: PLC0415 - usage errors need not wait for it

    if unknown := [name for name in only if name not in _LISTS]:
        raise UsageError(f"--only {unknown[0]}: expected one of {', '.join(_LISTS)}")
    if file is None:
        return [], {}
    if restore:
        from mavlink_bridge.backup import read_backup  # noqa: PLC0415

        backup = read_backup(file)
        return [(backup.mission_type, backup.items)], {}
    if file.suffix.lower() in _PARAMETER_SUFFIXES:
        from missions.formats import read_parameters  # noqa: PLC0415

        return [], read_parameters(file)
    found = _lists_of(file)
    chosen = [name for name in _LISTS if name in found and (not only or name in only)]
    if not chosen:
        raise UsageError(f"{file} holds no {' or '.join(only or _LISTS)}")
    return [(MissionType[name.upper()], found[name]) for name in chosen], {}


def _lists_of(file: Path) -> dict[str, tuple[MissionItem, ...]]:
    from missions.fence import fence_to_items  # noqa: PLC0415
    from missions.formats import read_situation  # noqa: PLC0415
    from missions.geo import LatLon  # noqa: PLC0415
    from missions.items import with_home  # noqa: PLC0415
    from missions.rally import rally_to_items  # noqa: PLC0415

    situation = read_situation(file)
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


def _limits(session: Session, lists: Sequence[tuple[MissionType, tuple[MissionItem, ...]]]) -> Limits:
    """Give what fits; where the usual limits are too small, the vehicle is asked for its SD card's."""
    from mavlink_bridge.protocol.limits import Limits  # noqa: PLC0415

    limits = Limits()
    if not any(limits.problem(items, mission_type) for mission_type, items in lists):
        return limits
    from mavlink_bridge.protocol.parameters import ReadParameters  # noqa: PLC0415

    # ARMING_CHECK is on every vehicle: an answer to it tells a missing parameter from a lossy link.
    reading = ReadParameters(session.vehicle, ("ARMING_CHECK", "BRD_SD_MISSION", "BRD_SD_FENCE"))
    session.run(reading, "reading the vehicle's limits")
    return Limits.from_parameters(reading.outcome.values) if reading.outcome else limits


def _upload_list(
    session: Session,
    store: BackupStore,
    mission_type: MissionType,
    items: tuple[MissionItem, ...],
    limits: Limits,
    *,
    replace_active: bool,
) -> _Done:
    from mavlink_bridge.link import now_s  # noqa: PLC0415 - pymavlink takes its time
    from mavlink_bridge.outcomes import upload_trouble  # noqa: PLC0415
    from mavlink_bridge.protocol.verified_upload import Held, VerifiedUpload  # noqa: PLC0415

    system, name = session.vehicle.system, mission_type.name.lower()
    was_interrupted = store.interrupted(system, mission_type) is not None
    machine = VerifiedUpload(
        session.vehicle,
        mission_type,
        items,
        limits=limits,
        replace_active=replace_active,
    )
    machine.know_vehicle(session.watch, session.link.now_s())
    backup: Path | None = None

    def step() -> None:
        nonlocal backup
        if (old := machine.pending_backup) is not None:
            backup = store.begin(system, mission_type, old)
            machine.backup_stored(now_s())

    begun_s = time.monotonic()
    try:
        session.run(machine, f"{name}: {len(items)} items", step)
    except KeyboardInterrupt:
        raise _interrupt(machine, backup, name) from None
    outcome = machine.outcome
    assert outcome is not None
    trouble = upload_trouble(outcome)
    if trouble is None:
        store.end(system, mission_type)
        return _Done(mission_type, outcome, backup, time.monotonic() - begun_s)
    if outcome.held in (Held.OLD, Held.FOREIGN) and not was_interrupted:
        store.end(system, mission_type)
    raise with_backup(trouble, name, backup, is_old_there=outcome.held is Held.OLD)


def with_backup(trouble: BridgeError, name: str, backup: Path | None, *, is_old_there: bool) -> BridgeError:
    """Give an upload's error with where the old list lies."""
    message = f"{name}: {trouble}"
    if backup is not None and not is_old_there:
        message += f"; the old list is kept in {backup}, `pbpp upload --restore {backup}` puts it back"
    return type(trouble)(message, **trouble.details, list=name, backup=str(backup) if backup else None)


def _interrupt(machine: VerifiedUpload, backup: Path | None, name: str) -> KeyboardInterrupt:
    if backup is None or machine.pending_backup is not None:
        return KeyboardInterrupt()
    return KeyboardInterrupt(
        f"interrupted while the {name} was written: the vehicle may hold part of the old and part of the new list; "
        f"do not drive it. The old list is kept in {backup}, `pbpp upload --restore` puts it back"
    )


def _upload_parameters(
    session: Session, wanted: Mapping[str, float], changed: dict[str, tuple[float | None, float]]
) -> None:
    """Set the parameters that differ; note their old and new values."""
    from mavlink_bridge.protocol.parameters import ReadParameters, SetParameter  # noqa: PLC0415

    reading = ReadParameters(session.vehicle, wanted)
    session.run(reading, "reading parameters")
    read = reading.outcome
    assert read is not None
    if read.is_silent:
        raise OutcomeError("the vehicle does not answer when asked for its parameters; none was set")
    if read.missing:
        raise RefusedError(
            f"the vehicle has no parameter {', '.join(read.missing)}; none was set",
            missing=list(read.missing),
        )
    for name, value in wanted.items():
        if _is_same(read.values[name], value):
            continue
        setting = SetParameter(session.vehicle, name, value)
        session.run(setting, f"setting {name}")
        outcome = setting.outcome
        assert outcome is not None
        if not outcome.is_confirmed:
            now = "an unknown value" if outcome.value is None else f"{outcome.value:g}"
            raise OutcomeError(
                f"parameter {name} was to be {value:g}, the vehicle holds {now}; set before it: {', '.join(changed) or 'none'}",
                parameter=name,
                wanted=value,
                found=outcome.value,
                changed=list(changed),
            )
        changed[name] = (read.values[name], value)


def _is_same(held: float, wanted: float) -> bool:
    return abs(held - wanted) <= 1e-6 * abs(wanted)


def _on_it(done: Sequence[_Done], changed: Mapping[str, object]) -> str:
    """Return what the command has put on the vehicle so far, for people."""
    lists = [f"{entry.mission_type.name.lower()} ({len(entry.outcome.found or ())} items)" for entry in done]
    parameters = [f"parameters {', '.join(changed)}"] if changed else []
    put = ", ".join((*lists, *parameters))
    return f"put on it and verified: {put}" if put else ""


def _report(
    session: Session,
    done: Sequence[_Done],
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
        typer.echo(f"{name}: {len(entry.outcome.found or ())} items, {how}, read back and verified{coarse}")
        if entry.backup:
            typer.echo(f"  the list before is kept in {entry.backup}")
    for name, (old, new) in changed.items():
        typer.echo(f"{name}: {old:g} -> {new:g}, confirmed")
    if not done and not changed:
        typer.echo("all parameters have these values already")
