"""The names people may rely on, and that importing the packages stays cheap."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGES = ("pbpp", "missions", "mavlink_bridge")


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_is_there(package):
    module = importlib.import_module(package)
    for name in module.__all__:
        assert getattr(module, name) is not None
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = module.no_such_name


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_is_on_the_page(package):
    page = (Path(__file__).parents[1] / "docs" / "api.md").read_text(encoding="utf-8")
    listed = []
    for kind, path in re.findall(r"\.\. auto(module|class|function):: (\S+)", page):
        if kind == "module":
            module = importlib.import_module(path)
            listed += [getattr(module, name) for name in getattr(module, "__all__", dir(module))]
        else:
            home, _, name = path.rpartition(".")
            listed.append(getattr(importlib.import_module(home), name))
    module = importlib.import_module(package)
    missing = [name for name in module.__all__ if not any(getattr(module, name) is one for one in listed)]
    assert missing == []


@pytest.mark.parametrize("package", ["missions", "mavlink_bridge", "mavlink_bridge.cli"])
def test_importing_loads_nothing_heavy(package):
    heavy = "{'numpy', 'shapely', 'pyproj', 'pymavlink', 'matplotlib', 'serial'}"
    code = f"import sys, {package}; print(sorted({heavy} & set(sys.modules)))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_planning_from_a_file_never_loads_pymavlink(fields):
    code = (
        "import sys; from pathlib import Path; from missions import GoTo, LatLon, plan, read_situation;"
        f"s = read_situation(Path({str(fields / 'yard-fence.waypoints')!r}));"
        "plan(s, GoTo(start=LatLon(40.071374, -105.22993), target=LatLon(40.0720926, -105.2286152)));"
        "print('pymavlink' in sys.modules)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "False"


@pytest.mark.parametrize("name", ["plan_mission", "plan_tour"])
def test_a_deprecated_name_is_the_one_in_its_place(name):
    missions = importlib.import_module("missions")
    with pytest.warns(DeprecationWarning, match=f"missions.{name} is deprecated: call missions.plan"):
        assert getattr(missions, name) is missions.plan
