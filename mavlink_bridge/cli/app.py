"""The application: its commands and options of its own."""

from __future__ import annotations

from typing import Annotated

import typer

from mavlink_bridge.cli import bridge, check, demo, download, log, plan, replay, sim, upload
from mavlink_bridge.cli.common import guarded

app = typer.Typer(
    name="pbpp",
    no_args_is_help=True,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)

app.command("plan")(guarded(plan.plan))
app.command("check")(guarded(check.check))
app.command("bridge")(guarded(bridge.bridge))
app.command("log")(guarded(log.log))
app.command("replay")(guarded(replay.replay))
app.command("upload")(guarded(upload.upload))
app.command("download")(guarded(download.download))
app.command("sim")(guarded(sim.sim))
app.command("demo")(guarded(demo.demo))


def _version(wanted: bool) -> None:  # noqa: FBT001 - typer's way
    if wanted:
        from importlib.metadata import version  # noqa: PLC0415 - quick help

        typer.echo(f"pbpp {version('pbpp-rover')}")
        raise typer.Exit


@app.callback()
def _app(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """Safe missions for MAVLink ground rovers: routes around fences, verified on the vehicle.

    Nothing is written to a vehicle without `--upload`; nothing drives without `--drive`.
    """


def main() -> None:
    """Run the command line."""
    app()
