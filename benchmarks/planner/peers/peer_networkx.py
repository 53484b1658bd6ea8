# ruff: noqa: ANN001, ANN201
"""A visibility graph by shapely, searched by networkx."""

import networkx as nx
import numpy as np
import shapely


def build(case):
    blocked = shapely.union_all([shapely.Polygon(ring) for ring in case["exclusions"]])
    free = shapely.difference(shapely.Polygon(case["inclusion"]), blocked)
    fat = shapely.buffer(free, 1e-9, join_style="mitre")
    shapely.prepare(fat)
    points = np.unique(shapely.get_coordinates(free), axis=0)
    graph = nx.Graph()
    one, two = np.triu_indices(len(points), 1)
    seen = shapely.covers(fat, shapely.linestrings(np.stack([points[one], points[two]], axis=1)))
    lengths = np.hypot(*(points[one[seen]] - points[two[seen]]).T)
    graph.add_weighted_edges_from(zip(one[seen].tolist(), two[seen].tolist(), lengths.tolist(), strict=True))
    return graph, points, fat


def query(state, start, goal):
    graph, points, fat = state
    ends = np.array([start, goal])
    every = np.vstack([points, ends])
    count = len(points)
    for number in (count, count + 1):
        others = np.arange(number)
        lines = shapely.linestrings(
            np.stack([every[others], np.broadcast_to(every[number], (number, 2))], axis=1)
        )
        for other in others[shapely.covers(fat, lines)].tolist():
            graph.add_edge(number, other, weight=float(np.hypot(*(every[number] - every[other]))))
    try:
        return every[nx.dijkstra_path(graph, count, count + 1)]
    except (nx.NetworkXNoPath, nx.NodeNotFound):
        return None
    finally:
        graph.remove_nodes_from([count, count + 1])
