"""Learn fence, parameters and position from a vehicle and plan; nothing is written: ``plan_on_a_vehicle.py CONNECTION LAT,LON``."""

# begin
import sys

from mavlink_bridge import Director, Orders, open_link
from mavlink_bridge.link import now_s
from missions import GoTo, Plan
from missions.geo import parse_lat_lon


def plan_to(connection: str, target: str) -> Plan:
    """Return the plan; what goes wrong is raised as a BridgeError or MissionError."""
    orders = Orders(identity=(245, 190), request=GoTo(target=parse_lat_lon(target)), once=True)
    director = Director(orders)

    def step() -> None:
        if (task := director.pending_plan) is not None:  # made in between; the bridge has a thread for it
            director.plan_made(task, task.made(), now_s())

    with open_link(connection, orders.identity) as link:
        link.run(director, on_step=step)
    if director.trouble is not None:
        raise director.trouble
    return director.plan


# end

if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: plan_on_a_vehicle.py CONNECTION LAT,LON")
    plan = plan_to(*sys.argv[1:])
    print(f"{plan.length_m:.1f} m, {len(plan.items)} waypoints")
    for warning in plan.warnings:
        print(f"warning: {warning}")
