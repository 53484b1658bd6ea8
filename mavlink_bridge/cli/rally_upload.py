"""Rally points on their way to the vehicle, with the parameters without which they do not hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_bridge.backup.store import BackupStore
from mavlink_bridge.cli.common import warn
from mavlink_bridge.cli.interrupting import interruptible
from mavlink_bridge.cli.options_session import session_for
from mavlink_bridge.cli.restoring import interrupted_warnings
from mavlink_bridge.cli.starting import make_ready
from mavlink_bridge.cli.uploading import Uploads
from mavlink_bridge.mavlink.messages import MissionType
from missions.rally import RallyPoint, rally_to_items
from missions.routing.rally_points import RTL_PARAMETERS

if TYPE_CHECKING:
    from mavlink_bridge.cli.options.rally import RallyOptions
    from missions.routing.rally_points import RallyChoice


def upload_rally(options: RallyOptions, choice: RallyChoice) -> None:
    """Write the points and the parameters, each verified; a vehicle that drives its mission is left alone.

    Raises
    ------
    BridgeError
        What it ended with.
    """
    assert options.connect is not None
    items = rally_to_items(RallyPoint(*place) for place in choice.points)
    store = BackupStore()
    with session_for(options, options.connect) as (session, show):
        uploads = Uploads(session, store, replace_active=False)
        with interruptible(session.at_hand(show.aside, uploads.on_it)), uploads.begin():
            warn(interrupted_warnings(store, uploads.vehicle))
            make_ready(session, hold=False, replace_active=False)
            uploads.write_lists([(MissionType.RALLY, items)])
            uploads.write_parameters(RTL_PARAMETERS)
