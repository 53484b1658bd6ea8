"""The clearance that is promised while driving, and what the predicted track has to keep for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from missions.vehicle import known_ardupilot, known_type, vehicle_from_parameters
from missions.vehicle.calibration import calibrated, calibration_info, calibration_warnings

if TYPE_CHECKING:
    from missions.request import Request
    from missions.situation import Situation
    from missions.vehicle import Vehicle

MARGIN_RESERVE_M = 0.1
"""More than FENCE_MARGIN, where coming nearer stops the vehicle for good: so far measured rovers left the drive model's band."""

# Chosen, not measured: what is promised where nothing is asked for, so much beyond FENCE_MARGIN and no less than a metre.
DEFAULT_BEYOND_MARGIN_M = 0.5
LEAST_DEFAULT_M = 1.0

_FIX_NOT_TOLD = "GPS accuracy unknown: nothing added for GPS error (use --position-error M)"

FIX_ERRORS_M = {3: 1.5, 4: 0.6, 5: 0.3, 6: 0.05}
"""By GPS_FIX_TYPE (3D, DGPS, RTK float, RTK fixed), where the receiver does not report its own error (h_acc). Chosen, not measured: what is kept for its error."""


@dataclass(frozen=True, slots=True)
class Promise:
    """What is promised, and what that asks for.

    Parameters
    ----------
    promised_m : float
        The vehicle, the middle of it, keeps this to any fence while driving.
    error_m : float
        Of its position, and the owner's reserve for wind and slip.
    allowance_m : float or None
        Room asked for everywhere on top of the promise; None where the route is fitted to the drive model.
    warnings : tuple of str
        What differs from what was asked for, and what is unknown.
    info : tuple of str
        What else was added.
    asked_m : float or None
        What was asked for; the vehicle may need more. None where nothing was.
    """

    promised_m: float
    error_m: float
    allowance_m: float | None
    warnings: tuple[str, ...]
    info: tuple[str, ...] = ()
    asked_m: float | None = None

    @property
    def words(self) -> str:
        """What was asked for, as the one who asked knows it, and what it was raised to."""
        if self.asked_m is None or self.asked_m == self.promised_m:
            return f"{self.promised_m:g} m"
        return f"{self.asked_m:g} m (raised to {self.promised_m:g} m)"

    @property
    def required_m(self) -> float:
        """What the predicted track has to keep."""
        return self.promised_m + self.error_m

    @property
    def drawn_m(self) -> float:
        """What the drawn lines have to keep."""
        return self.required_m + (self.allowance_m or 0.0)


def known_vehicle(situation: Situation, request: Request) -> Vehicle:
    """Return the vehicle, with the speed that is asked for.

    Raises
    ------
    VehicleError
        A parameter cannot be used.
    """
    # What the vehicle reported, but as no number, must not be taken for what it did not report: a default in its place would be a guess.
    no_numbers = {name: float(came) for name, came in situation.no_numbers.items()}
    vehicle = vehicle_from_parameters(
        {**no_numbers, **situation.parameters},
        mav_type=known_type(situation),
        firmware=situation.firmware,
        ardupilot=known_ardupilot(situation),
    )
    vehicle = calibrated(vehicle, situation)
    if request.speed_mps is None:
        return vehicle
    return replace(vehicle, speed_mps=request.speed_mps)


def promise(situation: Situation, request: Request, vehicle: Vehicle) -> Promise:
    """Return the clearance to promise: what is asked, but no less than the vehicle's own avoidance and its corners need."""
    warnings = calibration_warnings(vehicle, situation)
    told = calibration_info(vehicle)
    promised_m = request.clearance_m
    if promised_m is None:
        promised_m = max(vehicle.fence.margin_m + DEFAULT_BEYOND_MARGIN_M, LEAST_DEFAULT_M)
        warnings += [str(assumed) for assumed in vehicle.assumed if assumed.parameter == "FENCE_MARGIN"]
    swept_m = request.footprint.swept_radius_m
    if promised_m < swept_m:
        warnings.append(
            f"the vehicle's corners sweep {swept_m:.2f} m when it turns: the clearance of {promised_m:g} m is raised to that"
        )
        promised_m = swept_m
    if request.corner_allowance_m is not None:
        if promised_m < vehicle.stops_within_m:
            warnings.append(f"{_stops(vehicle)}; the clearance of {promised_m:g} m is less")
        error_m = request.reserve_m + (request.position_error_m or 0.0)
        return Promise(
            promised_m, error_m, request.corner_allowance_m, tuple(warnings), told, request.clearance_m
        )
    error_m, trouble = _position_error_m(situation, request)
    is_ours = bool(error_m) and request.position_error_m is None
    info = (f"added {error_m:g} m for GPS error (--position-error)",) if is_ours else ()
    # Avoidance goes by where the vehicle believes to be: the error of its position counts towards the margin.
    raised_m = vehicle.stops_within_m + MARGIN_RESERVE_M - error_m
    if vehicle.avoids_fence and promised_m < raised_m:
        if not request.widest:
            warnings.append(
                f"{_stops(vehicle)}; the clearance of {promised_m:g} m is raised to {raised_m:g} m"
            )
        promised_m = raised_m
    return Promise(
        promised_m,
        error_m + request.reserve_m,
        None,
        (*warnings, *trouble),
        (*info, *told),
        request.clearance_m,
    )


def asked_clearance(situation: Situation, request: Request) -> tuple[Vehicle, float]:
    """Return the situation's vehicle and the clearance that a plan would promise."""
    vehicle = known_vehicle(situation, request)
    return vehicle, promise(situation, request, vehicle).promised_m


def stop_warnings(vehicle: Vehicle, promised: Promise) -> list[str]:
    """Return a warning where a clearance that nobody asked for, that of the widest route, lets the vehicle's own avoidance stop it."""
    if not vehicle.avoids_fence or promised.required_m >= vehicle.stops_within_m + MARGIN_RESERVE_M:
        return []
    return [f"{_stops(vehicle)}; the clearance of {promised.promised_m:g} m is less"]


def _stops(vehicle: Vehicle) -> str:
    return (
        f"within {vehicle.fence.margin_name} {vehicle.stops_within_m:g} m of the fence the vehicle stops in AUTO and does not resume "
        "(AVOID_ENABLE)"
    )


def _position_error_m(situation: Situation, request: Request) -> tuple[float, tuple[str, ...]]:
    """Return what is kept for the position's error, and a warning where it is unknown."""
    if request.position_error_m is not None:
        return request.position_error_m, ()
    if situation.fix is None:
        return 0.0, (_FIX_NOT_TOLD,) if situation.system is not None else ()
    fix = situation.fix.value
    if fix.error_m is not None:
        return fix.error_m, ()
    if fix.kind in FIX_ERRORS_M:
        return FIX_ERRORS_M[fix.kind], ()
    return 0.0, ("no 3D GPS fix: nothing added for GPS error (use --position-error M)",)
