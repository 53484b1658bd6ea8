"""The way from a situation and a request to a plan: the one door for the command line, the bridge and replays."""
