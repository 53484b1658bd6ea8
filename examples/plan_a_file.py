"""Plan around the fence of a file and write the mission: ``plan_a_file.py FENCE START TARGET MISSION`` (positions are LAT,LON)."""

# begin
import sys
from pathlib import Path

from missions import GoTo, MissionError, plan, read_situation
from missions.geo import parse_lat_lon


def main(fence: Path, start: str, target: str, mission: Path) -> None:
    """Plan, say how long the route is, write it."""
    situation = read_situation(fence)
    request = GoTo(start=parse_lat_lon(start), target=parse_lat_lon(target), clearance_m=2.0)
    planned = plan(situation, request)
    print(f"{planned.length_m:.1f} m, at least {planned.drawn_clearance_m:.2f} m from every fence")
    planned.write(mission, situation)


# end

if __name__ == "__main__":
    if len(sys.argv) != 5:
        sys.exit("usage: plan_a_file.py FENCE START TARGET MISSION (positions are LAT,LON)")
    try:
        main(Path(sys.argv[1]), sys.argv[2], sys.argv[3], Path(sys.argv[4]))
    except MissionError as error:
        sys.exit(f"{type(error).__name__}: {error} {error.details}")
