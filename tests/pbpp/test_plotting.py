import matplotlib as mpl
import pytest

mpl.use("Agg")
from matplotlib import pyplot as plt

import pbpp


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    plt.close("all")


@pytest.mark.parametrize(("method", "partition"), [("optimal", None), ("pbpp", None), ("pbpp-taut", "slabs")])
def test_a_picture_shows_free_space_blocks_sequence_and_path(method, partition, load_case):
    case = load_case("paper_3")
    planner = pbpp.Planner([case["inclusion"]], case["exclusions"], partition=partition)
    path = planner.plan((160, 180), (30, 30), method=method)
    ax = path.plot()
    drawn = [line.get_xydata().tolist() for line in ax.lines]
    assert path.points.tolist() in drawn
    blocks = ax.collections[0].get_paths()
    assert len(blocks) == path.blocks
    assert len(ax.collections) == (2 if path.sequence else 1)
    assert f"{path.length_m:.2f} m" in ax.get_title()


def test_blocks_may_be_left_out_and_axes_given(load_case):
    case = load_case("paper_L")
    query = case["queries"][0]
    path = pbpp.plan_path([case["inclusion"]], case["exclusions"], query[:2], query[2:])
    _, mine = plt.subplots()
    assert path.plot(mine, show_blocks=False) is mine
    assert not mine.collections
