"""``pbpp rally``: rally points to which RTL drives straight and free, for a vehicle whose companion computer fails."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mavlink_bridge.cli.common import inform, remarks_document, warn
from mavlink_bridge.cli.kept_files import write_kept
from mavlink_bridge.cli.mission_source import check_source, mission_situation, source_kind, start_of
from mavlink_bridge.cli.pictures import check_plots, draw, stills
from mavlink_bridge.cli.terminal import echo, print_json
from mavlink_bridge.cli.vehicle_options import with_vehicle
from mavlink_bridge.errors import UsageError
from missions.checking.check import check_mission, plan_of
from missions.checking.rtl_failsafes import failsafe_advice
from missions.formats import Part, check_writable_format, format_of, write_situation
from missions.picture.plans import plan_scene
from missions.picture.scene import Mark, TrackLine
from missions.rally import RallyPoint
from missions.request import GoTo
from missions.routing.rally_points import RTL_PARAMETERS, choose_rally_points
from missions.situation import Known
from missions.words import counted, metres

if TYPE_CHECKING:
    from pathlib import Path

    from mavlink_bridge.cli.options.rally import RallyOptions
    from missions.checking.check import MissionCheck
    from missions.picture.scene import PictureScene
    from missions.routing.rally_points import RallyChoice
    from missions.situation import Situation

_PARAMETERS = (".parm", ".param", ".params")


def rally(options: RallyOptions) -> None:
    """Choose them, write and draw them, and upload them if that is asked for."""
    _check_options(options)
    asked = GoTo(clearance_m=options.clearance, accepts_less=options.accept_less)
    request = with_vehicle(asked, options)
    situation, unknown = mission_situation(options)
    assert situation.mission is not None
    request = replace(request, start=start_of(options, situation))
    checked = check_mission(situation.mission.value, situation, request)
    choice = choose_rally_points(checked, situation, request, options.most)
    warnings = [*situation.remarks, *unknown, *choice_warnings(choice, checked, situation)]
    inform(checked.info)
    warn(warnings)
    for path in options.output:
        _write(path, choice, situation)
    drawn = draw(
        lambda: _scene(checked, situation, choice),
        lambda scene: stills().check_still(
            scene,
            checked,
            plan_of(checked, situation),
            situation,
            request,
            source_kind(options),
            warnings,
            choice.points,
        ),
        options.plot,
    )
    verified = False
    if options.upload:
        from mavlink_bridge.cli.rally_upload import upload_rally  # noqa: PLC0415 - pymavlink only with a link

        upload_rally(options, choice)
        verified = True
    advice = failsafe_advice(situation.parameters, checked.vehicle)
    if options.json_output:
        print_json(
            {
                **_document(choice, options, warnings, checked, situation),
                "failsafes": [one.document() for one in advice],
                "outputs": [str(path) for path in (*options.output, *drawn)],
                "uploaded": verified,
                "verified": verified,
            }
        )
    elif not options.quiet:
        _report(choice, [*options.output, *drawn], verified=verified)
        for one in advice:
            echo(f"  {one}")


def choice_warnings(choice: RallyChoice, checked: MissionCheck, situation: Situation) -> list[str]:
    """Return what a person should know of the rally points before relying on them."""
    vehicle, warnings = checked.vehicle, []
    if choice.clearance_m < choice.asked_m:
        less = metres(choice.clearance_m) if choice.clearance_m else "nothing beside the predicted corridor"
        warnings.append(
            f"no set of rally points was found with which the lines keep {metres(choice.asked_m)}; these keep {less}"
        )
        if vehicle.avoids_fence and choice.clearance_m < vehicle.stops_within_m:
            warnings.append(
                f"within {vehicle.fence.margin_name} {vehicle.stops_within_m:g} m of the fence the vehicle's avoidance stops it in RTL too (AVOID_ENABLE)"
            )
    if choice.left_out_m > 0:
        warnings.append(
            f"{choice.left_out_m:.0f} m of the route lie outside the allowed area: RTL from there is not considered"
        )
    if not checked.holds:
        warnings.append(
            "the mission itself does not pass the check (pbpp check); the rally points are for its drawn lines"
        )
    if vehicle.oa_type:
        warnings.append(
            f"OA_TYPE {vehicle.oa_type}: RTL plans its own way and does not drive straight; the result is valid only with OA_TYPE 0"
        )
    rtl_mps = situation.parameters.get("RTL_SPEED", 0.0)
    if rtl_mps > vehicle.speed_mps:
        warnings.append(
            f"RTL_SPEED {rtl_mps:g} is faster than the {vehicle.speed_mps:g} m/s that the corridor is predicted for; set RTL_SPEED 0"
        )
    return warnings


def _check_options(options: RallyOptions) -> None:
    """Find what cannot work before any work is done."""
    check_source(options)
    check_plots(options.plot, json_output=options.json_output)
    if options.upload and options.connect is None:
        raise UsageError("--upload needs a live link: --connect CONNECTION")
    for path in options.output:
        check_writable_format(path, _part(path))


def _part(path: Path) -> Part:
    return Part.PARAMETERS if path.suffix.lower() in _PARAMETERS else Part.RALLY


def _write(path: Path, choice: RallyChoice, situation: Situation) -> None:
    """Write the rally points, with mission and fence where the format holds all; or the parameters."""
    if _part(path) is Part.PARAMETERS:
        write_situation(
            replace(situation, parameters=RTL_PARAMETERS), path, Part.PARAMETERS, write=write_kept
        )
        return
    points = tuple(RallyPoint(*place) for place in choice.points)
    told = replace(situation, rally=Known(points, None, "chosen"), parameters={})
    part = None if format_of(path, "write").together else Part.RALLY
    write_situation(told, path, part, write=write_kept)


def _scene(checked: MissionCheck, situation: Situation, choice: RallyChoice) -> PictureScene:
    """Return the mission with the rally points, some lines to them, and where one takes over from the other."""
    title = f"{counted(len(choice.points), 'rally point')}\n{_kept(choice)}"
    scene = plan_scene(plan_of(checked, situation), title=title)
    local = choice.ground.frame.to_local_array
    lines = [TrackLine("RTL to the nearest", local(line)) for line in choice.lines]
    borders = [TrackLine("where the nearest changes", points) for points in choice.borders]
    marks = [Mark(point, f"R{number}") for number, point in enumerate(local(choice.points), 1)]
    return replace(
        scene,
        tracks=(*borders, *lines),
        marks=tuple(marks),
        marks_name="rally point",
        targets=np.empty((0, 2)),
        asked=np.empty((0, 2)),
        marks_narrowest=False,
    )


def _kept(choice: RallyChoice) -> str:
    kept = (
        f"{metres(choice.clearance_m)} while driving"
        if choice.clearance_m
        else "the predicted corridor off the fence"
    )
    return f"RTL's straight lines from the whole route keep {kept}"


def _report(choice: RallyChoice, outputs: list[Path], *, verified: bool) -> None:
    home = ", home among them" if choice.has_home else ""
    echo(f"{counted(len(choice.points), 'rally point')}{home}: {'; '.join(map(str, choice.points))}")
    echo(f"{_kept(choice)}; so do those from {100 * choice.field_share:.0f} % of the allowed area")
    for path in outputs:
        if str(path) != "-":
            echo(f"Wrote {path}")
    pairs = ", ".join(f"{name} {value:g}" for name, value in RTL_PARAMETERS.items())
    if verified:
        echo(f"Uploaded and verified, with {pairs}")
    else:
        echo(
            f"The rally points are valid only with {pairs}: set both, with --upload or by uploading the parameters (-o FILE.param)"
        )
    echo("If the companion computer fails, the vehicle drives there on its own only with:")


def _document(
    choice: RallyChoice,
    options: RallyOptions,
    warnings: list[str],
    checked: MissionCheck,
    situation: Situation,
) -> dict[str, object]:
    return {
        "status": "ok",
        "command": "rally",
        "system": situation.system,
        "points": [list(place) for place in choice.points],
        "has_home": choice.has_home,
        "most": options.most,
        "clearance_m": round(choice.clearance_m, 4),
        "asked_m": round(choice.asked_m, 4),
        "line_keeps_m": round(choice.keep_m, 4),
        "route_m": round(choice.route_m, 1),
        "left_out_m": round(choice.left_out_m, 1),
        "field_share": round(choice.field_share, 3),
        "parameters": RTL_PARAMETERS,
        **remarks_document(checked.info, warnings),
    }
