"""The shortest path by another method than the planner's: a visibility graph and Dijkstra, all geometry by shapely."""

import heapq
from collections import Counter

import numpy as np
import shapely

PINCH_M = 1e-6
FAT_M = 1e-9


def rings_of(free):
    parts = shapely.get_parts(free)
    return list(shapely.get_rings(parts[shapely.get_dimensions(parts) == 2]))


def pinches(free):
    """Return the points that several rings share: no path may pass them."""
    count = Counter(point for ring in rings_of(free) for point in ring.coords[:-1])
    return [point for point, times in count.items() if times > 1]


def shortest_length(free, start, goal):
    """Return the length of the shortest path in closed free space that squeezes through no pinch; infinite if there is none."""
    # An end on a pinch may leave it to either side.
    touching = [point for point in pinches(free) if point not in {tuple(start), tuple(goal)}]
    if touching:
        free = free.difference(
            shapely.union_all(shapely.buffer(shapely.points(touching), PINCH_M, quad_segs=2))
        )
    corners = np.unique(np.concatenate([shapely.get_coordinates(ring) for ring in rings_of(free)]), axis=0)
    # An end on the boundary may lie beside it by a rounding.
    ends = [
        shapely.get_coordinates(shapely.shortest_line(free, shapely.Point(end)))[0] for end in (start, goal)
    ]
    points = np.vstack([*ends, corners])
    one, two = np.triu_indices(len(points), 1)
    lines = shapely.linestrings(np.stack([points[one], points[two]], axis=1))
    fat = shapely.buffer(free, FAT_M, join_style="mitre")
    shapely.prepare(fat)
    seen = shapely.covers(fat, lines)
    ways = [[] for _ in points]
    for a, b in zip(one[seen].tolist(), two[seen].tolist(), strict=True):
        length = float(np.hypot(*(points[a] - points[b])))
        ways[a].append((b, length))
        ways[b].append((a, length))
    best = [np.inf] * len(points)
    best[0] = 0.0
    queue = [(0.0, 0)]
    while queue:
        length, here = heapq.heappop(queue)
        if here == 1:
            return length
        if length > best[here]:
            continue
        for there, step in ways[here]:
            if length + step < best[there]:
                best[there] = length + step
                heapq.heappush(queue, (length + step, there))
    return np.inf
