"""``python -m mavlink_bridge.cli`` is ``pbpp``."""

from mavlink_bridge.cli.app import main

main()
