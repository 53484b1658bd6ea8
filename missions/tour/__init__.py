"""Several targets: the order of visits, the way home, the end of the mission."""
