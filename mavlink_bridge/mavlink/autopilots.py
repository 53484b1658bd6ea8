"""Each autopilot as one table: what differs between them on the wire, in one place.

The protocol machines ask the table of the vehicle they talk to (`Peer.autopilot`) and never which autopilot it is. ArduPilot's numbers were measured
on ArduPilot Rover (docs/transfers.md), PX4's on v1.17.0 and the line of 1.18 (docs/px4.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mavlink_bridge.mavlink.drive_rules import (
    ARDUPILOT_DRIVING,
    ARDUPILOT_FENCE,
    PX4_DRIVING,
    PX4_FENCE,
    DriveRules,
    FenceRules,
)
from mavlink_bridge.mavlink.incident_rules import ARDUPILOT_INCIDENTS, PX4_INCIDENTS, IncidentRules
from mavlink_bridge.mavlink.messages import Autopilot, MissionResult, MissionType
from mavlink_bridge.mavlink.modes import ARDUPILOT_MODES, PX4_MODES, Modes
from mavlink_bridge.mavlink.px4_form import PX4_1_17_FORM, PX4_1_18_FORM
from mavlink_bridge.mavlink.stored_form import ARDUPILOT_FORM, StoredForm
from missions.firmware import Firmware
from missions.vehicle.asked_parameters import ASKED_NAMES, CHECKED_NAMES, PX4_ASKED_NAMES
from missions.vehicle.item_limit import MISSION_ITEMS

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True, slots=True, kw_only=True)
class ListRules:
    """How an autopilot's side of the mission protocol works.

    Parameters
    ----------
    form : StoredForm
        How it wants lists sent, and how they read back.
    is_atomic : bool
        Whether a list is replaced as a whole with its last item: an upload that broke off, was cancelled or refused leaves the old list whole.
    asks_again_s : float
        After how long it repeats a request that brought no item.
    gives_up_after_s : float
        After how long without a message of ours it gives a transfer up.
    busy : frozenset of MissionResult
        What it answers while it is busy with another transfer. Where ERROR is among them it says nothing by itself: an item that nobody waits for, and one
        that is refused, are answered so, too.
    in_order : bool
        Whether a download is a transfer with a state: items are given in order, or the last one again; whatever else is asked for ends it. It also
        begins at MISSION_REQUEST_LIST and ends at our MISSION_ACK, and until then the vehicle is busy.
    asked_by_item : bool
        Whether an item sent once more shows how an upload stands: the one waited for is taken, a wrong one ignored, the last one after the end is
        acknowledged again. Otherwise MISSION_REQUEST_LIST does.
    heeds_cancel : bool
        Whether MISSION_ACK with OPERATION_CANCELLED ends a transfer.
    has_float_form : bool
        Whether items may be asked for by the old MISSION_REQUEST where the exact form stays unanswered.
    most_items : mapping of MissionType to int
        What it holds, where that is known: of a list left out it decides itself (NO_SPACE).
    fence_bytes : int, optional
        Storage for the fence, where that counts, too.
    has_storage_parameters : bool
        Whether parameters tell of more storage (BRD_SD_MISSION, BRD_SD_FENCE).
    """

    form: StoredForm
    is_atomic: bool
    asks_again_s: float
    gives_up_after_s: float
    busy: frozenset[MissionResult]
    in_order: bool
    asked_by_item: bool
    heeds_cancel: bool
    has_float_form: bool
    most_items: Mapping[MissionType, int]
    fence_bytes: int | None = None
    has_storage_parameters: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterRules:
    """How an autopilot encodes parameters.

    Parameters
    ----------
    is_bytewise : bool
        Whether the float's bits hold a whole number; otherwise it is cast. A PARAM_SET of another type than the parameter's is then not answered.
    asked, checked : tuple of str
        Which are asked for where a mission is to be planned and driven, and where any mission is checked. A name that is missing takes most of a second to find out.
    left_out : frozenset of str
        What it sends among its parameters that is none.
    """

    is_bytewise: bool
    asked: tuple[str, ...]
    checked: tuple[str, ...]
    left_out: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class Texts:
    """Which STATUSTEXTs matter, as regular expressions that match at a text's beginning, in either case.

    Parameters
    ----------
    noise : str
        Texts on success and progress, whatever their severity.
    own_state : str
        Repeated texts on the vehicle's own state: no reason to refuse a list.
    list_stored : str, optional
        What a text that a mission was stored begins with; None where there is none.
    busy : str, optional
        What a text begins with that is all the answer to a download request while another transfer runs; None where DENIED is the answer.
    """

    noise: str
    own_state: str
    list_stored: str | None = None
    busy: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotTable:
    """All that is known of how an autopilot speaks.

    Parameters
    ----------
    name : str
        Its name, with the version that the table is of where versions differ.
    autopilot : int
        MAV_AUTOPILOT.
    modes : Modes
        Its modes.
    lists : ListRules
        Its side of the mission protocol.
    parameters : ParameterRules
        How it encodes parameters.
    texts : Texts
        Its texts.
    driving : DriveRules
        How it is set driving and stopped.
    fence : FenceRules
        When a new fence counts.
    incidents : IncidentRules
        How it tells of breaches and failsafes.
    goes_to_position_targets, goes_to_guided_items : bool
        Whether SET_POSITION_TARGET_GLOBAL_INT, or a mission item with ``current`` 2, makes it drive there. DO_REPOSITION does on all.
    new_fence_armed : str
        What a person should know before a new fence is sent to an armed vehicle; empty where there is nothing.
    measured_from : Firmware, optional
        The oldest version of which this was measured; None where versions do not differ here.
    """

    name: str
    autopilot: int
    modes: Modes
    lists: ListRules
    parameters: ParameterRules
    texts: Texts
    driving: DriveRules
    fence: FenceRules
    incidents: IncidentRules
    goes_to_position_targets: bool
    goes_to_guided_items: bool
    new_fence_armed: str = ""
    measured_from: Firmware | None = None

    @property
    def kind(self) -> str:
        """Its name without a version: for what is said before the version is known."""
        return self.name.partition(" ")[0]

    def remark(self, firmware: Firmware | None) -> str | None:
        """Return what is to be said of a vehicle's version; None where there is nothing."""
        if self.measured_from is None or (firmware is not None and firmware >= self.measured_from):
            return None
        if firmware is None:
            return f"the vehicle does not report its version: it is treated as {self.name}"
        return f"the vehicle reports version {firmware}, which was not measured: it is treated as {self.name}"

    def __str__(self) -> str:
        return self.name


ARDUPILOT = AutopilotTable(
    name="ArduPilot",
    autopilot=Autopilot.ARDUPILOTMEGA,
    modes=ARDUPILOT_MODES,
    lists=ListRules(
        form=ARDUPILOT_FORM,
        is_atomic=False,
        asks_again_s=1.0,
        gives_up_after_s=8.0,
        busy=frozenset({MissionResult.DENIED}),
        in_order=False,
        asked_by_item=False,
        heeds_cancel=False,
        has_float_form=True,
        most_items={MissionType.MISSION: MISSION_ITEMS, MissionType.FENCE: 84},
        fence_bytes=672,
        has_storage_parameters=True,
    ),
    parameters=ParameterRules(is_bytewise=False, asked=ASKED_NAMES, checked=CHECKED_NAMES),
    texts=Texts(
        noise=(
            r"flight plan received|fence indexed|(rally points? received)|got mission_request"
            r"|mission: \d|reached waypoint|mission complete|auto mission changed|throttle (dis)?armed|arducopter|ardurover|ardupilot ready"
            r"|pbpp:|#"
        ),
        own_state=(
            r"prearm|arm:|arming|battery|ekf|ahrs|dcm|gps|imu|compass|mag|baro|rc\d|radio|crash|logging|chan\d"
            r"|.*\bfailsafe\b|.*\bfences? (in [\d.]+ ?m|breached|cleared)|fence breach|internal error"
        ),
        list_stored="flight plan received",
    ),
    driving=ARDUPILOT_DRIVING,
    fence=ARDUPILOT_FENCE,
    incidents=ARDUPILOT_INCIDENTS,
    goes_to_position_targets=True,
    goes_to_guided_items=True,
    new_fence_armed=(
        "the vehicle is armed, and a new fence takes effect at once: if it stands outside and FENCE_ENABLE is 1, it does what "
        "FENCE_ACTION says (1: RTL, it drives straight home)"
    ),
)


def _px4(name: str, form: StoredForm) -> AutopilotTable:
    return AutopilotTable(
        name=name,
        autopilot=Autopilot.PX4,
        modes=PX4_MODES,
        lists=ListRules(
            form=form,
            is_atomic=True,
            asks_again_s=0.25,
            gives_up_after_s=5.0,
            busy=frozenset({MissionResult.ERROR}),
            in_order=True,
            asked_by_item=True,
            heeds_cancel=True,
            has_float_form=False,
            # Of missions a board holds 500 or 1000, compiled in (read), the simulator 10000: no parameter tells.
            most_items={MissionType.FENCE: 64, MissionType.RALLY: 32},
        ),
        parameters=ParameterRules(
            is_bytewise=True,
            asked=PX4_ASKED_NAMES,
            checked=PX4_ASKED_NAMES,
            left_out=frozenset({"_HASH_CHECK"}),
        ),
        texts=Texts(
            noise=(
                r"mission finished|takeoff detected|landing detected|armed by|disarmed by|gcs connection|ready for takeoff"
                r"|mission download request ignored|pbpp:|#"
            ),
            own_state=r"preflight|arming denied|battery|ekf|gps|compass|mag|baro|accel|gyro|switching to|\[\w+\]|.*\bfailsafe\b|rtl",
            busy="mission download request ignored",
        ),
        driving=PX4_DRIVING,
        fence=PX4_FENCE,
        incidents=PX4_INCIDENTS,
        goes_to_position_targets=False,
        goes_to_guided_items=False,
        measured_from=Firmware(1, 17, 0),
    )


PX4_1_17 = _px4("PX4 1.17", PX4_1_17_FORM)
PX4_1_18 = _px4("PX4 1.18", PX4_1_18_FORM)
_PX4_SINCE_1_18 = Firmware(1, 18, 0, 0)


def autopilot_table(autopilot: int | None, firmware: Firmware | None = None) -> AutopilotTable | None:
    """Return the table of an autopilot; None where there is none of it.

    Parameters
    ----------
    autopilot : int or None
        MAV_AUTOPILOT.
    firmware : Firmware or None
        Its version. PX4 whose version is not known is taken for the newest: it refuses more.
    """
    if autopilot == Autopilot.ARDUPILOTMEGA:
        return ARDUPILOT
    if autopilot == Autopilot.PX4:
        return autopilot_of(ardupilot=False, firmware=firmware)
    return None


def autopilot_of(*, ardupilot: bool | None, firmware: Firmware | None = None) -> AutopilotTable:
    """Return the table of a vehicle of which a situation knows no more than whether it is ArduPilot; where that is not known, it is taken for it."""
    if ardupilot is not False:
        return ARDUPILOT
    return PX4_1_17 if firmware is not None and firmware < _PX4_SINCE_1_18 else PX4_1_18
