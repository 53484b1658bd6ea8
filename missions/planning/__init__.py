"""The door: from a situation and a request to a plan, for the command line, the bridge, replays and programs."""
