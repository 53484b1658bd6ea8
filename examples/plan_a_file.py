"""Plan around the fence of a file and write the mission: ``plan_a_file.py FENCE START TARGET MISSION`` (positions are LAT,LON)."""

# begin
import sys
from dataclasses import replace
from pathlib import Path

from missions import Mission, MissionError, Request, plan_mission, read_situation, write_mission
from missions.geo import parse_lat_lon
from missions.situation import Known


def main(fence: Path, start: str, target: str, mission: Path) -> None:
    """Plan, say how long the route is, write it."""
    situation = read_situation(fence)
    request = Request(start=parse_lat_lon(start), targets=(parse_lat_lon(target),), clearance_m=2.0)
    plan = plan_mission(situation, request)
    print(f"{plan.length_m:.1f} m, at least {plan.drawn_clearance_m:.2f} m from every fence")
    found = Known(Mission(plan.items, plan.start), None, "planned")
    write_mission(replace(situation, mission=found), mission)


# end

if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]), sys.argv[2], sys.argv[3], Path(sys.argv[4]))
    except MissionError as error:
        sys.exit(f"{type(error).__name__}: {error} {error.details}")
