"""Run one planner on one case in its own process: ``python drive.py PLANNER CASE.json MOST_QUERIES``.

Prints one line of JSON: import, build and query times (of the CPU: the machine may be shared), the paths, and the peak memory above that of the imports.
"""

from __future__ import annotations

import importlib
import json
import resource
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))


def peak_mb() -> float:
    """Return the peak resident memory of this process in megabytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main(planner: str, case_file: str, most: str) -> None:
    """Run the planner and print what it did."""
    case = json.loads(Path(case_file).read_text())
    began = time.process_time()
    module = importlib.import_module(f"peer_{planner}")
    import_s = time.process_time() - began
    idle_mb = peak_mb()
    began = time.process_time()
    state = module.build(case)
    build_s = time.process_time() - began
    query_s, paths = [], []
    for query in case["queries"][: int(most)]:
        began = time.process_time()
        path = module.query(state, tuple(query[:2]), tuple(query[2:]))
        query_s.append(time.process_time() - began)
        paths.append(None if path is None else [[float(x), float(y)] for x, y in path])
    memory_mb = peak_mb() - idle_mb
    print(
        json.dumps(
            {
                "import_s": import_s,
                "build_s": build_s,
                "query_s": query_s,
                "paths": paths,
                "memory_mb": memory_mb,
            }
        )
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
