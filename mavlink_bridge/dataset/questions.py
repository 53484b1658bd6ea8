"""Ready questions to a dataset, and SQL of one's own."""

from __future__ import annotations

import contextlib
import datetime as dt
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from mavlink_bridge.dataset.store import words_of_duckdb
from mavlink_bridge.errors import DatasetError
from missions.picture.charts import Chart, Series
from missions.vehicle.calibration import SPEED_STEP_MPS, TURN_STEP_DEG

if TYPE_CHECKING:
    from mavlink_bridge.dataset.store import Dataset

MOST_ROWS: Final = 1_000_000
"""An answer has no more rows. Chosen: of one number each they take some 90 MB in Python; a query without an end would take all memory there is."""


@dataclass(frozen=True, slots=True)
class Plotted:
    """How an answer is drawn: what lies along the axes, and by which columns the rows are parted into lines."""

    x: str
    x_label: str
    ys: tuple[str, ...]
    y_label: str
    by: tuple[str, ...] = ()
    bars: bool = False
    diagonal: bool = False
    """Whether the line on which both are equal is drawn too."""


@dataclass(frozen=True, slots=True)
class Question:
    """A ready question.

    Parameters
    ----------
    name : str
    about : str
        What is asked, in words.
    sql : str
        Over the tables and views; ``$promise`` is what the user names as promised, or NULL.
    plotted : Plotted
    """

    name: str
    about: str
    sql: str
    plotted: Plotted


@dataclass(frozen=True, slots=True)
class AnswerRows:
    """Rows with the names of their columns."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]


_CLASSES = f"""CAST(floor(angle_deg / {TURN_STEP_DEG}) * {TURN_STEP_DEG} AS INTEGER) AS angle_from_deg,
    floor(speed_mps / {SPEED_STEP_MPS}) * {SPEED_STEP_MPS} AS speed_from_mps"""

QUESTIONS: Final = {
    question.name: question
    for question in (
        Question(
            "clearance",
            "How near did each drive come to the fence, site by site?",
            """SELECT site, vehicle, begun_utc, log, drive, round(least_clearance_m, 2) AS least_clearance_m,
    round(predicted_least_clearance_m, 2) AS predicted_least_clearance_m, driven_m, arrived
FROM drive_grades WHERE least_clearance_m IS NOT NULL
ORDER BY site, least_clearance_m, begun_utc, log, drive""",
            Plotted("site", "site", ("least_clearance_m",), "least clearance (m)"),
        ),
        Question(
            "promise",
            "Which drives came nearer to the fence than promised (--promise M), or than the drive model predicts?",
            """SELECT coalesce($promise, predicted_least_clearance_m) AS promised_m, least_clearance_m,
    least_clearance_m >= coalesce($promise, predicted_least_clearance_m) AS kept,
    round(greatest(coalesce($promise, predicted_least_clearance_m) - least_clearance_m, 0), 2) AS short_m,
    site, vehicle, begun_utc, log, drive, outside_m
FROM drive_grades WHERE least_clearance_m IS NOT NULL AND coalesce($promise, predicted_least_clearance_m) IS NOT NULL
ORDER BY kept, short_m DESC, begun_utc, log, drive""",
            Plotted(
                "promised_m", "promised (m)", ("least_clearance_m",), "least clearance (m)", diagonal=True
            ),
        ),
        Question(
            "corners",
            "How deep were corners cut and how far did the rover swing out, by angle and speed, compared with the drive model's bound?",
            f"""SELECT {_CLASSES}, count(*) AS corners,
    round(quantile_cont(inside_cut_m, 0.5), 2) AS cut_median_m, round(quantile_cont(inside_cut_m, 0.99), 2) AS cut_99_m,
    round(max(inside_cut_m), 2) AS cut_most_m, round(max(predicted_inside_cut_m), 2) AS cut_bound_m,
    round(quantile_cont(outside_overshoot_m, 0.5), 2) AS overshoot_median_m,
    round(quantile_cont(outside_overshoot_m, 0.99), 2) AS overshoot_99_m,
    round(max(outside_overshoot_m), 2) AS overshoot_most_m, round(max(predicted_outside_overshoot_m), 2) AS overshoot_bound_m,
    count(*) FILTER (inside_excess_m > 0 OR outside_excess_m > 0) AS beyond_bound
FROM corners WHERE NOT stands GROUP BY 1, 2 ORDER BY 1, 2""",  # noqa: S608 - numbers of ours
            Plotted(
                "angle_from_deg",
                "turn from (°)",
                ("cut_most_m", "cut_bound_m", "overshoot_most_m", "overshoot_bound_m"),
                "off the legs (m)",
                by=("speed_from_mps",),
            ),
        ),
        Question(
            "drift",
            "How do a rover's corners change from month to month, compared with the drive model's bound?",
            """SELECT month, vehicle, count(*) AS corners,
    round(quantile_cont(inside_excess_m, 0.5), 3) AS cut_excess_median_m,
    round(quantile_cont(inside_excess_m, 0.95), 3) AS cut_excess_95_m,
    round(quantile_cont(outside_excess_m, 0.5), 3) AS overshoot_excess_median_m,
    round(quantile_cont(outside_excess_m, 0.95), 3) AS overshoot_excess_95_m
FROM corners WHERE NOT stands GROUP BY month, vehicle ORDER BY month, vehicle""",
            Plotted(
                "month", "month", ("cut_excess_95_m",), "cut beyond its bound, 95 % (m)", by=("vehicle",)
            ),
        ),
        Question(
            "links",
            "How did transfers end, and how often was something sent again, month by month?",
            """SELECT month, vehicle, kind, way, count(*) AS transfers,
    count(*) FILTER (ending = 'complete') AS complete, count(*) FILTER (ending = 'partial') AS "partial",
    count(*) FILTER (ending = 'unanswered') AS unanswered, count(*) FILTER (ending = 'refused') AS refused,
    CAST(sum(seen) AS BIGINT) AS items, CAST(sum(repeats) AS BIGINT) AS repeats,
    round(100 * sum(repeats) / nullif(sum(seen), 0), 2) AS repeats_per_100
FROM transfers GROUP BY ALL ORDER BY month, vehicle, kind, way""",
            Plotted("month", "month", ("repeats_per_100",), "sent again, per 100 items", by=("kind", "way")),
        ),
        Question(
            "modes",
            "How long was each vehicle in which mode, and how far did it drive there, month by month?",
            """SELECT month, vehicle, name AS mode, armed, count(*) AS stretches,
    round(sum(ended_s - begun_s) / 3600, 3) AS hours, round(sum(driven_m) / 1000, 3) AS driven_km
FROM modes GROUP BY ALL ORDER BY month, vehicle, mode, armed""",
            Plotted("month", "month", ("hours",), "hours", by=("mode",), bars=True),
        ),
    )
}
"""Every ready question by its name."""


def ask(dataset: Dataset, question: Question, promise_m: float | None = None) -> AnswerRows:
    """Return the answer to a ready question.

    Parameters
    ----------
    dataset : Dataset
    question : Question
    promise_m : float, optional
        The clearance that was promised; default: what the drive model predicted for each drive.

    Raises
    ------
    DatasetError
        There is no dataset, or it is of another version.
    """
    values = {"promise": promise_m} if "$promise" in question.sql else {}
    sql = question.sql.replace("$promise", "CAST($promise AS DOUBLE)")
    return _answer(dataset, sql, values)


def ask_sql(dataset: Dataset, sql: str) -> AnswerRows:
    """Return the answer to SQL of the user's own, which reads the dataset's tables and views and nothing else.

    Raises
    ------
    DatasetError
        There is no dataset; or DuckDB refuses the SQL, in its words.
    """
    return _answer(dataset, sql, {}, is_users=True)


def _answer(dataset: Dataset, sql: str, values: dict[str, Any], *, is_users: bool = False) -> AnswerRows:
    with contextlib.closing(dataset.open()) as database:
        try:
            if is_users:
                _check_only_reads(database, sql)
            found = database.execute(sql, values) if values else database.execute(sql)
            columns = tuple(str(one[0]) for one in found.description or ())
            rows = tuple(found.fetchmany(MOST_ROWS + 1))
        except Exception as error:
            text = words_of_duckdb(error)
            if text is None:
                raise
            if not is_users:
                raise dataset.unreadable(text) from None
            raise DatasetError(
                f"the SQL is refused: {text}", sql=sql, advice="see docs/dataset.md for tables and views"
            ) from None
    if len(rows) > MOST_ROWS:
        raise DatasetError(
            f"the answer has more than {MOST_ROWS:,} rows",
            sql=sql,
            most=MOST_ROWS,
            advice="ask for fewer: LIMIT, or sums by GROUP BY; DuckDB and Polars read the dataset's files themselves",
        )
    return AnswerRows(columns, rows)


def _check_only_reads(database: Any, sql: str) -> None:  # noqa: ANN401 - a duckdb connection
    """Refuse what is not one query: COPY can write wherever DuckDB may read, into the dataset's own files too."""
    kinds = [one.type.name for one in database.extract_statements(sql)]
    if kinds != ["SELECT"]:
        raise DatasetError(
            f"the SQL is refused: it is {' and '.join(kinds) or 'empty'}; expected one SELECT",
            sql=sql,
            advice="ask with SELECT; --csv FILE keeps the answer",
        )


def chart(question: Question, answer: AnswerRows) -> Chart:
    """Return the picture of an answer."""
    plotted = question.plotted
    place = {name: number for number, name in enumerate(answer.columns)}
    groups: dict[str, list[tuple[Any, ...]]] = {}
    for row in answer.rows:
        groups.setdefault(", ".join(_told(row[place[name]], name) for name in plotted.by), []).append(row)
    series = []
    for group, rows in groups.items():
        for name in plotted.ys:
            named = name.removesuffix("_m").replace("_", " ")
            points = [
                (row[place[plotted.x]], row[place[name]]) for row in rows if row[place[name]] is not None
            ]
            label = f"{named}, {group}" if group and len(plotted.ys) > 1 else group or named
            series.append(Series(label, tuple(x for x, _ in points), tuple(float(y) for _, y in points)))
    return Chart(
        question.about,
        plotted.x_label,
        plotted.y_label,
        tuple(series),
        bars=plotted.bars,
        diagonal=plotted.diagonal,
    )


def _told(value: object, name: str) -> str:
    if name.endswith("_mps"):
        return f"{value} m/s"
    return f"vehicle {value}" if name == "vehicle" else str(value)


def as_json(answer: AnswerRows) -> list[dict[str, Any]]:
    """Return an answer's rows as JSON has them: times as ISO 8601 in UTC."""
    return [
        {name: _plain(value) for name, value in zip(answer.columns, row, strict=True)} for row in answer.rows
    ]


def _plain(value: Any) -> Any:  # noqa: ANN401 - whatever a database holds
    if isinstance(value, dt.datetime):
        return value.isoformat() + ("" if value.tzinfo else "Z")
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    return str(value)
