"""Charts, drawn with matplotlib in the colours of all pictures."""

from __future__ import annotations

import textwrap
from io import BytesIO
from typing import TYPE_CHECKING, Any

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from missions.picture import style
from missions.picture.figure import UNDATED
from missions.words import harmless

if TYPE_CHECKING:
    from missions.picture.charts import Chart

_SIZE_IN = (8.0, 5.0)  # a page's width, as scenes have
_DPI = 150  # as scenes have
_TITLE_COLUMNS = 82  # of its font across the page
_MOST_NAMES = 24  # along an axis; chosen: more overlap
_MARKS = ("o", "s", "^", "D", "v", "P")


def chart_image(chart: Chart, suffix: str) -> bytes:
    """Return a chart as an image of the format that a suffix names: the same bytes for the same chart."""
    kind = suffix.lower()[1:]
    image = BytesIO()
    with rc_context({"svg.hashsalt": "pbpp"}):
        chart_figure(chart).savefig(image, format=kind, dpi=_DPI, metadata=UNDATED.get(kind))
    return image.getvalue()


def chart_figure(chart: Chart) -> Figure:
    """Draw a chart: a figure with one axes."""
    figure = Figure(figsize=_SIZE_IN, layout="constrained", dpi=_DPI)
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    left_out = len(chart.series) - style.MOST_LOOKS
    title = f"{chart.title}\n{left_out} lines more than can be drawn" if left_out > 0 else chart.title
    lines = [part for line in title.splitlines() for part in textwrap.wrap(harmless(line), _TITLE_COLUMNS)]
    axes.set_title("\n".join(lines), fontsize=11, parse_math=False)
    axes.set(xlabel=chart.x_label, ylabel=chart.y_label)
    axes.grid(visible=True, color=style.OUTSIDE, linewidth=0.6)
    axes.set_axisbelow(True)
    _draw_series(axes, chart)
    if chart.diagonal:
        axes.axline((0, 0), slope=1, color=style.UNSAFE, linewidth=1.2, linestyle="--", label="as promised")
    if not any(one.ys for one in chart.series):
        axes.text(0.5, 0.5, "no such rows", transform=axes.transAxes, ha="center")
    if len(chart.series) > 1 or chart.diagonal:
        legend = figure.legend(loc="outside lower center", ncols=3, frameon=False, fontsize=8)
        for text in legend.get_texts():
            text.set_parse_math(False)
    return figure


def _draw_series(axes: Any, chart: Chart) -> None:  # noqa: ANN401 - matplotlib is untyped
    shown = chart.series[: style.MOST_LOOKS]
    names = sorted({x for one in shown for x in one.xs if isinstance(x, str)})
    place = {name: number for number, name in enumerate(names)}
    looks = style.track_looks(str(number) for number in range(len(shown)))
    below: dict[float, float] = {}
    for number, one in enumerate(shown):
        color, dashes = looks[str(number)]
        xs = [place[x] if isinstance(x, str) else float(x) for x in one.xs]
        label = harmless(one.name)
        if chart.bars:
            heights: dict[float, float] = {}
            for x, y in zip(xs, one.ys, strict=True):
                heights[x] = heights.get(x, 0.0) + y
            at = list(heights)
            axes.bar(
                at,
                list(heights.values()),
                bottom=[below.get(x, 0.0) for x in at],
                color=color,
                edgecolor="white",
                label=label,
            )
            below |= {x: below.get(x, 0.0) + y for x, y in heights.items()}
        else:
            look = {"color": color, "marker": _MARKS[number % len(_MARKS)], "markersize": 5}
            is_line = len(shown) > 1 and len(set(xs)) == len(xs)
            axes.plot(xs, one.ys, dashes if is_line else "", linewidth=1.2, label=label, **look)
    if names:
        step = 1 + (len(names) - 1) // _MOST_NAMES
        labels = [harmless(name) for name in names[::step]]
        axes.set_xticks(
            range(0, len(names), step), labels, rotation=45, ha="right", fontsize=8, parse_math=False
        )
