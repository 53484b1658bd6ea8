"""Runs in a virtual environment of its own: MAVSDK's Python package uploads, reads and clears a mission and a fence.

Usage: ``mavsdk_client.py CONNECTION STEP FILE``; the items of FILE go up, or what is read comes back in it, as JSON.
"""

import json
import sys
from pathlib import Path

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.geofence import Geofence
from mavsdk.plugins.mission_raw import MissionItem, MissionRaw

FIELDS = (
    "seq",
    "frame",
    "command",
    "current",
    "autocontinue",
    "param1",
    "param2",
    "param3",
    "param4",
    "x",
    "y",
    "z",
    "mission_type",
)


def main(connection, step, path):
    with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        mavsdk.add_any_connection(connection)
        system = mavsdk.first_autopilot(15.0)
        assert system is not None, "no autopilot"
        mission = MissionRaw(system)
        if step.startswith("upload"):
            with Path(path).open(encoding="utf-8") as file:
                items = [MissionItem(**item) for item in json.load(file)]
            result = (
                mission.upload_mission(items) if step == "upload-mission" else mission.upload_geofence(items)
            )
        elif step == "clear-mission":
            result = mission.clear_mission()
        elif step == "clear-fence":
            geofence = Geofence(system)
            result = geofence.clear_geofence()
            geofence.destroy()
        else:
            items = mission.download_mission() if step == "download-mission" else mission.download_geofence()
            with Path(path).open("w", encoding="utf-8") as file:
                json.dump([{name: getattr(item, name) for name in FIELDS} for item in items], file)
            result = f"{len(items)} items"
        print(step, result)
        mission.destroy()


if __name__ == "__main__":
    main(*sys.argv[1:])
