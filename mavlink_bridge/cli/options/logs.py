"""The options of ``pbpp logs``, and its help."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import typer

from mavlink_bridge.cli.options.shared import CommonOptions, ManyOptions, metres, option

ACTIONS = ("build", "ask", "calibrate")
_ASK, _CALIBRATE = "ask", "calibrate"


@dataclass(frozen=True, slots=True, kw_only=True)
class LogsOptions(ManyOptions, CommonOptions):
    """Make tables of many logs, ask them questions, and calibrate the drive model to one rover.

    `build` reads all logs in folders (.tlog, .raw, DataFlash .bin, packed with gzip or not) into a dataset of Parquet files. Logs that it already
    has are skipped; bad ones are listed and do not stop the others. `ask` answers a ready question (clearance, promise, corners, drift, links, modes) or SQL.
    `calibrate` writes how one rover drives, for `--vehicle` of other commands.

    For example:

    `pbpp logs build recordings -o fleet`

    `pbpp logs ask fleet corners --plot corners.png`

    `pbpp logs ask fleet --sql "SELECT * FROM drive_grades WHERE outside_m > 0.25"`

    `pbpp logs calibrate fleet --system 7 -o rover.toml`
    """

    action: Annotated[
        str,
        typer.Argument(
            metavar="|".join(ACTIONS), help="Build a dataset, ask it a question, or calibrate a rover."
        ),
    ]
    words: Annotated[
        list[str],
        typer.Argument(
            metavar="FOLDER...|DATASET [QUESTION]",
            help="For build: folders and logs. For ask: the dataset, and a question. For calibrate: the dataset.",
        ),
    ]
    output: Annotated[
        Path | None,
        option(
            "For build: the dataset's folder. For calibrate: the file to write.",
            "DATASET|FILE.toml",
            "-o",
            "--output",
        ),
    ] = None
    sql: Annotated[
        str | None, option("Ask in SQL, over the dataset's tables and views (DuckDB).", "SQL", panel=_ASK)
    ] = None
    promise: Annotated[
        float | None,
        metres("The clearance promised, for the question `promise`. Default: what was predicted.", _ASK),
    ] = None
    csv: Annotated[Path | None, option("Write the answer as CSV.", "FILE.csv", panel=_ASK)] = None
    plot: Annotated[
        list[Path], option("Draw the answer to a ready question: .png, .svg, .pdf.", "FILE", panel=_ASK)
    ] = field(default_factory=list)
    system: Annotated[
        int | None,
        option(
            "System id of the rover, when the dataset has several.", "N", min=1, max=255, panel=_CALIBRATE
        ),
    ] = None
