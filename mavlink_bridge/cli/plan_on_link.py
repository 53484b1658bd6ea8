"""``pbpp plan --connect``: the orders that the options make, taken to a vehicle."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.cli.live import LiveResult, plan_live
from mavlink_bridge.cli.vehicle_options import described_vehicle
from mavlink_bridge.director import Orders
from mavlink_bridge.director.orders import DEFAULT_SOURCES

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.plan import PlanOptions
    from mavlink_bridge.cli.plan_results import Told
    from missions.request import Request


def plan_on_link(options: PlanOptions, request: Request, told: Told) -> LiveResult:
    """Plan for the vehicle on a link, and take the mission as far as the options allow."""
    assert options.connect is not None
    orders = Orders(
        identity=options.identity,
        system=options.system,
        any_vehicle=options.any_vehicle,
        request=request,
        upload=options.upload,
        drive=options.drive,
        hold=options.hold,
        patience_s=options.timeout,
        # A repaired mission goes where it goes, whatever is clicked meanwhile.
        target_sources=frozenset() if request.repairs else DEFAULT_SOURCES,
    )
    return plan_live(
        options.connect,
        orders,
        described=described_vehicle(options),
        key_file=options.signing_key,
        quiet=options.is_silent,
        on_plan=told.tell,
    )
