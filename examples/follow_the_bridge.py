"""Run ``pbpp bridge`` as a process, give it a target and read its events: ``follow_the_bridge.py CONNECTION LAT,LON``."""

# begin
import json
import subprocess
import sys


def main(connection: str, target: str) -> int:
    """Upload a mission to the target; tell what happens; give the bridge's exit code."""
    command = [
        sys.executable,
        "-m",
        "mavlink_bridge.cli",
        "bridge",
        "--connect",
        connection,
        "--target",
        target,
    ]
    with subprocess.Popen(
        [*command, "--upload", "--once", "--json"], stdout=subprocess.PIPE, text=True
    ) as bridge:
        for line in bridge.stdout:
            event = json.loads(line)
            if event["event"] == "planned":
                print(f"planned: {event['length_m']} m, {event['waypoints']} waypoints")
            elif event["event"] == "verified":
                print(f"on the vehicle: {event['mission_items']} mission items")
            elif event["severity"] in ("warning", "error", "critical"):
                print(f"{event['severity']}: {event['text']}")
    return bridge.returncode


# end

if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: follow_the_bridge.py CONNECTION LAT,LON")
    sys.exit(main(*sys.argv[1:]))
