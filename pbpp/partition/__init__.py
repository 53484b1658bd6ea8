"""Partitions of free space into convex blocks.

A partition is a set of convex cells, here called blocks as in the paper, with the portals through which one is left for the next.
"""

from .base import Partition, Portals

__all__ = ["Partition", "Portals"]
