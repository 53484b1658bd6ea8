# ruff: noqa: ANN001, ANN201
"""pyvisgraph: Lee's sweep; it knows no inclusion, so the square's edge is left out."""

import pyvisgraph


def build(case):
    graph = pyvisgraph.VisGraph()
    graph.build([[pyvisgraph.Point(*point) for point in ring] for ring in case["exclusions"]], status=False)
    return graph


def query(graph, start, goal):
    return [
        (point.x, point.y) for point in graph.shortest_path(pyvisgraph.Point(*start), pyvisgraph.Point(*goal))
    ]
