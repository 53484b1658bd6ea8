# ruff: noqa: ANN001, ANN002, ANN201, ANN202, ANN204, N802
"""OMPL: BIT* for one second a query, with exact checks of motions by shapely."""

import numpy as np
import ompl.base as ob
import ompl.geometric as og
import shapely

SECONDS = 1.0


def build(case):
    blocked = shapely.union_all([shapely.Polygon(ring) for ring in case["exclusions"]])
    free = shapely.difference(shapely.Polygon(case["inclusion"]), blocked)
    fat = shapely.buffer(free, 1e-9, join_style="mitre")
    shapely.prepare(fat)
    return fat, case["bounds"]


class _Motion(ob.MotionValidator):
    def __init__(self, information, free):
        super().__init__(information)
        self._free = free

    def checkMotion(self, one, two, *_):
        return bool(shapely.covers(self._free, shapely.linestrings([(one[0], one[1]), (two[0], two[1])])))


def query(state, start, goal):
    free, (west, south, east, north) = state
    space = ob.RealVectorStateSpace(2)
    bounds = ob.RealVectorBounds(2)
    for axis, (low, high) in enumerate(((west, east), (south, north))):
        bounds.setLow(axis, low)
        bounds.setHigh(axis, high)
    space.setBounds(bounds)
    setup = og.SimpleSetup(space)
    setup.setStateValidityChecker(lambda s: bool(shapely.intersects_xy(free, s[0], s[1])))
    information = setup.getSpaceInformation()
    motion = _Motion(information, free)
    information.setMotionValidator(motion)
    first, last = space.allocState(), space.allocState()
    first[0], first[1] = start
    last[0], last[1] = goal
    setup.setStartAndGoalStates(first, last)
    setup.setPlanner(og.BITstar(information))
    if not setup.solve(SECONDS) or not setup.haveExactSolutionPath():
        return None
    path = setup.getSolutionPath()
    return np.array([(s[0], s[1]) for s in path.getStates()])
