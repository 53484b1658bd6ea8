"""Wrong inputs of every command: one clear error, the right exit code, never a traceback; with --json one document."""

from __future__ import annotations

import json
import os
import shutil
import socket
import subprocess
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

import pytest
from typer.testing import CliRunner

from mavlink_bridge.cli import convert as convert_command
from mavlink_bridge.cli.app import COMMANDS, app, load

if TYPE_CHECKING:
    from pathlib import Path

USAGE, INPUT, NO_ROUTE, LINK = 2, 3, 4, 5
START, TARGET = "40.071374,-105.229930", "40.0720926,-105.2286152"
WPL = "QGC WPL 110\n"
TRIANGLE = "".join(
    f"{seq}\t0\t3\t5001\t3\t0\t0\t0\t{lat}\t{lon}\t0\t1\n"
    for seq, (lat, lon) in enumerate([(40.0710, -105.2300), (40.0710, -105.2280), (40.0725, -105.2290)])
)
YARD = ("plan", "--fence", "yard.waypoints")
FROM_TO = (*YARD, "--start", START, "--target", TARGET)
CHECK = ("check", "--mission", "mission.waypoints")
DEAD = "DEAD"  # a TCP port that nobody listens on

FILES = {
    "empty.waypoints": "",
    "empty.plan": "",
    "empty.geojson": "",
    "empty.kml": "",
    "empty.fen": "",
    "empty.poly": "",
    "empty.parm": "",
    "header.waypoints": WPL,
    "version.waypoints": "QGC WPL 120\n" + TRIANGLE,
    "short.waypoints": WPL + "0\t0\t3\t5001\n",
    "words.waypoints": WPL + TRIANGLE.replace("40.071", "north"),
    "nan.waypoints": WPL + TRIANGLE.replace("40.071", "nan"),
    "beyond.waypoints": WPL + TRIANGLE.replace("40.071", "140.071"),
    "two.waypoints": WPL + "".join(TRIANGLE.splitlines(keepends=True)[:2]),
    "seq.waypoints": WPL + TRIANGLE.replace("\n1\t", "\n7\t"),
    "bow.waypoints": WPL
    + "".join(
        f"{seq}\t0\t3\t5001\t4\t0\t0\t0\t{lat}\t{lon}\t0\t1\n"
        for seq, (lat, lon) in enumerate([(0, 0), (0, 0), (0, 0), (0, 0)])
    ),
    "circle.waypoints": WPL + "0\t0\t3\t5003\t-5\t0\t0\t0\t40.0715\t-105.2290\t0\t1\n",
    "binary.waypoints": "\x00\x01\x02",
    "list.plan": "[]",
    "cut.plan": '{"fileType": "Plan", "geoFence": {"polygons": [',
    "other.plan": '{"fileType": "Parameters"}',
    "bare.plan": '{"fileType": "Plan"}',
    "text.geojson": "hello",
    "crs.geojson": '{"type": "FeatureCollection", "crs": {"type": "name", "properties": {"name": "EPSG:3857"}}, "features": []}',
    "role.geojson": '{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {"role": "keep away"}, "geometry": {"type": "Point", "coordinates": [-105.2, 40.0]}}]}',
    "entity.kml": '<!DOCTYPE x [<!ENTITY a "b">]><kml>&a;</kml>',
    "cut.kml": "<kml><Document>",
    "open.fen": "40.0713 -105.2299\n40.0710 -105.2300\n40.0710 -105.2280\n40.0725 -105.2290\n",
    "words.poly": "here there\n",
    "words.parm": "not a parameter file\n",
    "negative.parm": "FENCE_MARGIN -1\n",
    "nan.parm": "WP_RADIUS nan\n",
    "twice.parm": "WP_RADIUS\n",
    "mission.waypoints": WPL
    + "0\t1\t0\t16\t0\t0\t0\t0\t40.071374\t-105.229930\t0\t1\n1\t0\t3\t16\t0\t0\t0\t0\t40.0720926\t-105.2286152\t0\t1\n",
    "empty.tlog": "",
    "words.tlog": "this is no telemetry log, and it is long enough to look at for a while\n" * 20,
    "notoml.toml": "[plan",
    "unknown.toml": "[plan]\nnonsense = 3\n[upload]\nnonsense = 3\n[sim]\nnonsense = 3\n",
    "outside.toml": "clearance = 2\n",
    "wrongtype.toml": '[plan]\nsystem = "many"\n',
    "drives.toml": "[plan]\ndrive = true\n[bridge]\ndrive = true\n",
    "all-drives.toml": "[all]\ndrive = true\n",
    "arms.toml": "[bridge]\nupload = true\narm = true\n",
    "endless.toml": "[bridge]\ntimeout = inf\n",
    "array.toml": "[plan]\nclearance = [1, 2]\n",
    "open.key": "0" * 64,
    "short.key": "",
    "latin.parm": "WP_RADIUS 2 # Höhe\n",
    "expect.jsonl": "{",
    "backup.json": "{}",
    "backup-list.json": "[1, 2]",
}

WRONG: list[tuple[tuple[str, ...], int, str]] = [
    # commands and their options
    ((), USAGE, ""),
    (("paln",), USAGE, "did you mean plan"),
    (("nonsense",), USAGE, "commands are plan"),
    (("--nonsense",), USAGE, "--nonsense"),
    (("plan", "--claerance", "2"), USAGE, "--clearance"),
    (("plan", "--targt", TARGET), USAGE, "--target"),
    (("check", "--misson", "x"), USAGE, "--mission"),
    (("sim", "--sped", "2"), USAGE, "--speedup"),
    (("demo", "--speedup", "0"), USAGE, "--speedup"),
    (("demo", "--speedup", "fast"), USAGE, "--speedup"),
    (("plan",), USAGE, "one SOURCE"),
    (("plan", "--clearance"), USAGE, "--clearance"),
    (("plan", "an-argument"), USAGE, "an-argument"),
    ((*YARD, "--log", "empty.tlog"), USAGE, "one SOURCE"),
    ((*YARD, "--connect", "udpin:127.0.0.1:1"), USAGE, "one SOURCE"),
    ((*YARD, "--upload"), USAGE, "--connect"),
    ((*YARD, "--drive"), USAGE, "--drive needs --upload"),
    ((*FROM_TO, "--method", "magic"), USAGE, "optimal"),
    ((*FROM_TO, "--clearance", "-1"), USAGE, "(0 to 1000000)"),
    ((*FROM_TO, "--clearance", "wide"), USAGE, "wide"),
    ((*FROM_TO, "--clearance", "nan"), USAGE, "nan"),
    ((*FROM_TO, "--clearance", "inf"), USAGE, "inf"),
    ((*FROM_TO, "--corner-allowance", "-0.1"), USAGE, "--corner-allowance"),
    ((*FROM_TO, "--corner-allowance", "some"), USAGE, "some"),
    ((*FROM_TO, "--snap", "-1"), USAGE, "--snap"),
    ((*FROM_TO, "--snap", "nan"), USAGE, "--snap"),
    ((*FROM_TO, "--system", "0"), USAGE, "--system"),
    ((*FROM_TO, "--system", "256"), USAGE, "--system"),
    ((*FROM_TO, "--system", "one"), USAGE, "--system"),
    ((*FROM_TO, "--source-system", "0"), USAGE, "--source-system"),
    ((*FROM_TO, "--source-component", "999"), USAGE, "--source-component"),
    ((*FROM_TO, "--timeout", "0"), USAGE, "--timeout"),
    ((*FROM_TO, "--timeout", "soon"), USAGE, "--timeout"),
    ((*FROM_TO, "--plot", "-", "--json"), USAGE, "--plot"),
    ((*FROM_TO, "-o", "yard.waypoints"), USAGE, "overwrite"),
    # permissions rest on each other, whatever else is given
    (("plan", "--connect", DEAD, "--target", TARGET, "--drive"), USAGE, "--drive needs --upload"),
    (("plan", "--connect", DEAD, "--via-mission", "missing.plan", "--drive"), USAGE, "--upload"),
    (("plan", "--connect", DEAD, "--target", TARGET, "--hold"), USAGE, "--hold needs --upload"),
    (("plan", "--connect", DEAD, "--config", "drives.toml"), USAGE, "--drive needs --upload"),
    (("plan", "--connect", DEAD, "--config", "all-drives.toml"), USAGE, "--drive needs --upload"),
    (("bridge", "--connect", DEAD, "--drive"), USAGE, "--drive needs --upload"),
    (("bridge", "--connect", DEAD, "--arm"), USAGE, "--arm needs --upload --drive"),
    (("bridge", "--connect", DEAD, "--upload", "--arm"), USAGE, "--arm needs --upload --drive"),
    (("bridge", "--connect", DEAD, "--config", "drives.toml"), USAGE, "--drive needs --upload"),
    (("bridge", "--connect", DEAD, "--config", "arms.toml"), USAGE, "--arm needs"),
    # numbers beyond any use
    *[
        ((*FROM_TO, option, value), USAGE, option)
        for option, most in (
            ("--clearance", "1e6"),
            ("--corner-allowance", "1e6"),
            ("--snap", "1e6"),
            ("--reserve", "1e6"),
            ("--position-error", "1e6"),
            ("--length", "100"),
            ("--width", "100"),
            ("--speed", "100"),
            ("--timeout", "86400"),
        )
        for value in (
            "1e308",
            f"{most}1",
            "-1e-9",
            "-inf",
            "Infinity",
            "NaN",
            "1e999",
            "1_0",
            "0x10",
            "ten",
            "",
        )
    ],
    *[
        ((*FROM_TO, "--gps", value), USAGE, "--gps")
        for value in ("inf,0", "0,nan", "1e308,0", "0,101", "0", "0,0,0", "", "east,0", "1_0,0")
    ],
    ((*FROM_TO, "--speed", "0"), USAGE, "0.05 to 100"),
    ((*FROM_TO, "--speed", "1e-320"), USAGE, "0.05 to 100"),
    ((*FROM_TO, "--system", "1e308"), USAGE, "--system"),
    ((*FROM_TO, "--system", "9" * 400), USAGE, "--system"),
    ((*CHECK, "--fence", "yard.waypoints", "--clearance", "1e308"), USAGE, "--clearance"),
    ((*CHECK, "--fence", "yard.waypoints", "--clearance", "nan"), USAGE, "--clearance"),
    ((*CHECK, "--fence", "yard.waypoints", "--timeout", "inf"), USAGE, "--timeout"),
    (("upload", "mission.waypoints", "--connect", DEAD, "--timeout", "inf"), USAGE, "--timeout"),
    (("download", "mission", "--connect", DEAD, "--timeout", "nan"), USAGE, "--timeout"),
    (("bridge", "--connect", DEAD, "--timeout", "inf"), USAGE, "--timeout"),
    (("bridge", "--connect", DEAD, "--timeout", "1e308"), USAGE, "--timeout"),
    (("bridge", "--connect", DEAD, "--snap", "inf"), USAGE, "--snap"),
    (("bridge", "--connect", DEAD, "--clearance", "1e308"), USAGE, "--clearance"),
    (("bridge", "--connect", DEAD, "--config", "endless.toml"), USAGE, "--timeout"),
    (("replay", "nofence.tlog", "--speed", "inf"), USAGE, "--speed"),
    (("replay", "nofence.tlog", "--clearance", "1e308"), USAGE, "--clearance"),
    (("replay", "nofence.tlog", "--jobs", "9" * 30), USAGE, "--jobs"),
    (("demo", "--speedup", "nan"), USAGE, "--speedup"),
    (("demo", "--speedup", "inf"), USAGE, "--speedup"),
    *[
        (("sim", option, value), USAGE, option)
        for option in ("--speedup", "--loss", "--duplicate", "--latency", "--jitter")
        for value in ("nan", "inf", "1e308", "-1")
    ],
    (("sim", "--seed", "9" * 400), USAGE, "--seed"),
    (("sim", "--home", "40.07,-105.2,nan"), USAGE, "heading"),
    (("sim", "--home", "40.07,-105.2,1e308"), USAGE, "heading"),
    (("sim", "--param", "WP_RADIUS=1e39"), USAGE, "NAME=VALUE"),
    (("sim", "--param", "WP_RADIUS=inf"), USAGE, "NAME=VALUE"),
    # options from files
    ((*FROM_TO, "--config", "missing.toml"), USAGE, "missing.toml"),
    ((*FROM_TO, "--config", "notoml.toml"), USAGE, "not TOML"),
    ((*FROM_TO, "--config", "unknown.toml"), USAGE, "nonsense"),
    ((*FROM_TO, "--config", "outside.toml"), USAGE, "outside a table"),
    ((*FROM_TO, "--config", "wrongtype.toml"), USAGE, "--system"),
    ((*FROM_TO, "--config", "array.toml"), USAGE, ""),
    (("sim", "--config", "unknown.toml"), USAGE, "nonsense"),
    (("upload", "mission.waypoints", "--config", "unknown.toml"), USAGE, "nonsense"),
    (("config", "--config", "missing.toml"), USAGE, "missing.toml"),
    # positions
    ((*YARD, "--start", "40.07"), USAGE, "40.07"),
    ((*YARD, "--start", "north,east"), USAGE, "north"),
    ((*YARD, "--start", "91,0"), USAGE, "91"),
    ((*YARD, "--start", "40,181"), USAGE, "181"),
    ((*YARD, "--start", "nan,0"), USAGE, "nan"),
    ((*YARD, "--start", ""), USAGE, ""),
    ((*YARD, "--start", START, "--target", "40.07;-105.2"), USAGE, "40.07;-105.2"),
    ((*YARD, "--start", START, "--target", "1,2,3"), USAGE, "1,2,3"),
    ((*YARD, "--target", TARGET), INPUT, ""),
    ((*YARD, "--start", START), INPUT, ""),
    ((*YARD, "--start", "0,0", "--target", TARGET), NO_ROUTE, "11304 km"),
    ((*YARD, "--start", START, "--target", "0,0"), NO_ROUTE, "11304 km"),
    *[
        ((*YARD, f"{near}={START}", f"{far}={place}"), NO_ROUTE, "km from the fence")
        for near, far in (("--start", "--target"), ("--target", "--start"))
        for place in (
            "41.0,-105.2299",
            "-40.0717,74.77",
            "89.9999,0",
            "-90,0",
            "40.0713,179.9999",
            "40.0713,-180",
        )
    ],
    ((*FROM_TO, "--target", "0,0"), NO_ROUTE, "km from the fence"),
    ((*FROM_TO, "--target", "0,0", "--order", "best"), NO_ROUTE, "km from the fence"),
    ((*FROM_TO, "--home", "0,0", "--return"), NO_ROUTE, "km from the fence"),
    ((*YARD, "--start", START, "--target", "abc"), USAGE, "'abc' is not a position"),
    ((*FROM_TO, "--home", "abc"), USAGE, "'abc' is not a position"),
    ((*FROM_TO, "--target", "40.07,-105.2,"), USAGE, "--target"),
    ((*FROM_TO, "--target", "inf,inf"), USAGE, "--target"),
    ((*FROM_TO, "--target", "4_0,-105"), USAGE, "--target"),
    ((*YARD, "--start", "40.08,-105.23", "--target", TARGET), NO_ROUTE, "start"),
    ((*YARD, "--start", START, "--target", "40.08,-105.23"), NO_ROUTE, "target"),
    ((*FROM_TO, "--clearance", "60"), NO_ROUTE, ""),
    # files that hold no usable fence
    *[
        (("plan", "--fence", name, "--start", START, "--target", TARGET), INPUT, word)
        for name, word in (
            ("missing.waypoints", "missing.waypoints"),
            ("folder.plan", "folder.plan"),
            ("empty.waypoints", "empty.waypoints"),
            ("empty.plan", "empty.plan"),
            ("empty.geojson", "empty.geojson"),
            ("empty.kml", "empty.kml"),
            ("empty.fen", "empty.fen"),
            ("empty.poly", "empty.poly"),
            ("empty.parm", "no fence"),
            ("mission.waypoints", "no fence"),
            ("header.waypoints", "header.waypoints"),
            ("version.waypoints", "version.waypoints"),
            ("short.waypoints", "line 2"),
            ("words.waypoints", "line 2"),
            ("nan.waypoints", "line 2"),
            ("beyond.waypoints", "140.071"),
            ("two.waypoints", "two.waypoints"),
            ("bow.waypoints", ""),
            ("circle.waypoints", "circle.waypoints"),
            ("binary.waypoints", "binary.waypoints"),
            ("list.plan", "list.plan"),
            ("cut.plan", "cut.plan"),
            ("other.plan", "other.plan"),
            ("bare.plan", "no fence"),
            ("text.geojson", "text.geojson"),
            ("crs.geojson", "crs"),
            ("role.geojson", "features[0]"),
            ("entity.kml", "DOCTYPE"),
            ("cut.kml", "cut.kml"),
            ("open.fen", "open.fen"),
            ("words.poly", "line 1"),
            ("fence.xyz", ".xyz"),
            ("fence", "extension"),
        )
    ],
    ((*FROM_TO, "--vehicle", "missing.parm"), INPUT, "missing.parm"),
    ((*FROM_TO, "--vehicle", "words.parm"), INPUT, "line 1"),
    ((*FROM_TO, "--vehicle", "negative.parm"), INPUT, "FENCE_MARGIN"),
    ((*FROM_TO, "--vehicle", "nan.parm"), INPUT, "WP_RADIUS"),
    ((*FROM_TO, "--vehicle", "twice.parm"), INPUT, "line 1"),
    ((*FROM_TO, "--vehicle", "mission.waypoints"), INPUT, "mission.waypoints"),
    # files that cannot be written
    ((*FROM_TO, "-o", "mission.xyz"), INPUT, ".xyz"),
    ((*FROM_TO, "-o", "mission"), INPUT, "extension"),
    ((*FROM_TO, "-o", "missing/mission.plan"), INPUT, "missing"),
    ((*FROM_TO, "-o", "folder.plan"), INPUT, "folder.plan"),
    ((*FROM_TO, "-o", "fence.parm"), INPUT, ".parm"),
    ((*FROM_TO, "--plot", "picture.bmp"), INPUT, ".bmp"),
    ((*FROM_TO, "--plot", "missing/picture.png"), INPUT, "missing"),
    ((*FROM_TO, "--plot", "folder.png"), INPUT, "folder.png"),
    # logs
    (("plan", "--log", "missing.tlog"), INPUT, "missing.tlog"),
    (("plan", "--log", "empty.tlog"), INPUT, "empty.tlog"),
    (("plan", "--log", "words.tlog"), INPUT, "words.tlog"),
    (("plan", "--log", "folder.tlog"), INPUT, "folder.tlog"),
    (("plan", "--log", "nofence.tlog"), INPUT, "no fence"),
    (("plan", "--log", "nofence.tlog", "--system", "9"), INPUT, "system 9"),
    (("log",), USAGE, "FILE"),
    (("log", "missing.tlog"), INPUT, "missing.tlog"),
    (("log", "empty.tlog"), INPUT, "empty.tlog"),
    (("log", "words.tlog"), INPUT, "words.tlog"),
    (("log", "nofence.tlog", "--plot", "track.bmp"), INPUT, ".bmp"),
    (("log", "nofence.tlog", "nofence.tlog", "--plot", "track.png"), USAGE, "one FILE"),
    (("replay",), USAGE, "LOG"),
    (("replay", "missing.tlog"), INPUT, "missing.tlog"),
    (("replay", "empty.tlog"), INPUT, "empty.tlog"),
    (("replay", "nofence.tlog", "--speed", "0"), USAGE, "--speed"),
    (("replay", "nofence.tlog", "--speed", "nan"), USAGE, "--speed"),
    (("replay", "nofence.tlog", "--jobs", "0"), USAGE, "--jobs"),
    (("replay", "nofence.tlog", "--clearance", "-2"), USAGE, "--clearance"),
    (("replay", "nofence.tlog", "--expect", "missing.jsonl"), INPUT, "missing.jsonl"),
    (("replay", "nofence.tlog", "--expect", "expect.jsonl"), INPUT, "expect.jsonl"),
    (("replay", "nofence.tlog", "--send", "nonsense"), LINK, "nonsense"),
    (("replay", "nofence.tlog", "--send", "udpout:127.0.0.1:1", "--record"), USAGE, "--send"),
    # checks
    (("check",), USAGE, "--mission"),
    (CHECK, INPUT, "fence"),
    ((*CHECK, "--fence", "missing.plan"), INPUT, "missing.plan"),
    ((*CHECK, "--fence", "bare.plan"), INPUT, "no fence"),
    ((*CHECK, "--fence", "yard.waypoints", "--clearance", "-1"), USAGE, "--clearance"),
    ((*CHECK, "--fence", "yard.waypoints", "--start", "here"), USAGE, "here"),
    ((*CHECK, "--fence", "yard.waypoints", "--vehicle", "words.parm"), INPUT, "words.parm"),
    ((*CHECK, "--fence", "yard.waypoints", "--plot", "check.bmp"), INPUT, ".bmp"),
    (("check", "--mission", "yard.waypoints"), INPUT, "no mission"),
    (("check", "--mission", "missing.waypoints"), INPUT, "missing.waypoints"),
    (("check", "--log", "missing.tlog"), INPUT, "missing.tlog"),
    (("check", "--log", "nofence.tlog", "--connect", "tcp:127.0.0.1:1"), USAGE, "--connect"),
    # conversions
    (("diff",), USAGE, "A"),
    (("diff", "yard.waypoints"), USAGE, "B"),
    (("diff", "missing.plan", "yard.waypoints"), INPUT, "missing.plan"),
    (("diff", "yard.waypoints", "yard.waypoints", "--only", "home"), USAGE, "--only"),
    (("convert",), USAGE, "IN"),
    (("logs", "melt", "x"), USAGE, "is not an action"),
    (("logs", "build", "x"), USAGE, "needs -o DATASET"),
    (("logs", "build", "nowhere", "-o", "dataset"), INPUT, "no such folder or file"),
    (("logs", "ask", "nowhere", "modes"), INPUT, "there is no dataset"),
    (("logs", "ask", "nowhere", "weather"), USAGE, "is not a question"),
    (("logs", "calibrate", "nowhere", "-o", "rover.toml"), INPUT, "there is no dataset"),
    (("fence", "merge"), USAGE, "FILE"),
    (("fence", "split", "x.plan", "-o", "y.plan"), USAGE, "expected merge"),
    (("convert", "yard.waypoints"), USAGE, "OUT"),
    (("convert", "missing.plan", "out.plan"), INPUT, "missing.plan"),
    (("convert", "yard.waypoints", "yard.waypoints"), USAGE, "same file as IN"),
    (("convert", "yard.waypoints", "out.xyz"), INPUT, ".xyz"),
    (("convert", "yard.waypoints", "out.gpx"), INPUT, ""),
    (("convert", "yard.waypoints", "out.plan", "--only", "everything"), USAGE, "everything"),
    (("convert", "yard.waypoints", "out.plan", "--only", "mission"), INPUT, "mission"),
    (("convert", "yard.waypoints", "out.poly"), INPUT, "out.poly"),
    (("convert", "mission.waypoints", "out.plan", "--return-point", START), USAGE, "--return-point"),
    (("convert", "yard.waypoints", "out.plan", "--return-point", "home"), USAGE, "home"),
    (("convert", "yard.waypoints", "missing/out.plan"), INPUT, "missing"),
    # links
    (("plan", "--connect", "nonsense", "--target", TARGET), LINK, "nonsense"),
    (("plan", "--connect", "", "--target", TARGET), LINK, ""),
    (("plan", "--connect", "tcp:127.0.0.1", "--target", TARGET), LINK, "HOST:PORT"),
    (("plan", "--connect", "tcp:127.0.0.1:99999", "--target", TARGET), LINK, "99999"),
    (("plan", "--connect", "tcp:127.0.0.1:port", "--target", TARGET), LINK, "port"),
    (("plan", "--connect", "carrier-pigeon:127.0.0.1", "--target", TARGET), LINK, "carrier-pigeon"),
    (("plan", "--connect", "/dev/does-not-exist", "--target", TARGET), LINK, "/dev/does-not-exist"),
    (("plan", "--connect", "/dev/ttyACM0,fast", "--target", TARGET), LINK, "BAUD"),
    (("plan", "--connect", "/dev/null", "--target", TARGET), LINK, "/dev/null"),
    (("plan", "--connect", DEAD, "--target", TARGET), LINK, ""),
    (("plan", "--connect", "udpin:127.0.0.1:0", "--timeout", "0.2", "--target", TARGET), LINK, ""),
    (("plan", "--connect", "udpin:203.0.113.1:14550", "--target", TARGET), LINK, "203.0.113.1"),
    (
        ("plan", "--connect", "tcp:no.such.host.invalid:5760", "--target", TARGET),
        LINK,
        "no.such.host.invalid",
    ),
    (("upload",), USAGE, "--connect"),
    (("upload", "mission.waypoints"), USAGE, "--connect"),
    (("upload", "--connect", DEAD), USAGE, "FILE"),
    (("upload", "missing.plan", "--connect", DEAD), INPUT, "missing.plan"),
    (("upload", "bare.plan", "--connect", DEAD), USAGE, "bare.plan"),
    (("upload", "mission.waypoints", "--only", "all", "--connect", DEAD), USAGE, "--only"),
    (("upload", "mission.waypoints", "--only", "fence", "--connect", DEAD), USAGE, "fence"),
    (("upload", "words.parm", "--connect", DEAD), INPUT, "words.parm"),
    (("upload", "mission.waypoints", "--connect", DEAD), LINK, ""),
    (("upload", "mission.waypoints", "--connect", "nonsense"), LINK, "nonsense"),
    (("upload", "--restore", "backup.json", "--connect", DEAD), 7, "backup.json"),
    (("upload", "--restore", "backup-list.json", "--connect", DEAD), 7, "backup-list.json"),
    (("upload", "--restore", "missing.json", "--connect", DEAD), 7, "missing.json"),
    (
        ("upload", "mission.waypoints", "--connect", DEAD, "--signing-key", "missing.key"),
        USAGE,
        "missing.key",
    ),
    (("upload", "mission.waypoints", "--connect", DEAD, "--signing-key", "short.key"), USAGE, "short.key"),
    (("download",), USAGE, "mission|fence"),
    (("download", "everything", "--connect", DEAD), USAGE, "everything"),
    (("download", "mission"), USAGE, "--connect"),
    (("download", "mission", "--connect", DEAD), LINK, ""),
    (("download", "mission", "--connect", DEAD, "-o", "out.xyz"), USAGE, ".xyz"),
    (("download", "parameters", "--connect", DEAD, "-o", "out.plan"), USAGE, ".plan"),
    (("serve",), USAGE, "give one SOURCE"),
    (("serve", "--demo", "--connect", DEAD), USAGE, "give one SOURCE"),
    (("serve", "--fence", "f.waypoints", "--upload"), USAGE, "--upload needs a vehicle"),
    (("serve", "--connect", DEAD, "--drive"), USAGE, "--drive needs --upload"),
    (("serve", "--connect", DEAD, "--upload", "--arm"), USAGE, "--arm needs --upload --drive"),
    (("serve", "--connect", DEAD, "--start", "1,2"), USAGE, "--start goes with --fence"),
    (("serve", "--connect", DEAD, "--home", "1,2"), USAGE, "--home goes with"),
    (("serve", "--log", "x.tlog", "--record", "y.tlog"), USAGE, "--record needs a vehicle"),
    (("serve", "--connect", "nonsense"), LINK, "nonsense"),
    (("serve", "--connect", DEAD, "--target-from", "dreams"), USAGE, "dreams"),
    (("serve", "--log", "missing.tlog"), INPUT, "missing.tlog"),
    (("bridge",), USAGE, "--connect"),
    (("bridge", "--connect", "nonsense"), LINK, "nonsense"),
    (("bridge", "--connect", DEAD, "--once"), LINK, ""),
    (("bridge", "--connect", DEAD, "--target-from", "dreams"), USAGE, "dreams"),
    (("bridge", "--connect", DEAD, "--target-from", "home"), USAGE, "home"),
    (("bridge", "--connect", DEAD, "--rtl-by-route"), USAGE, "--rtl-by-route needs --upload --drive"),
    (("bridge", "--connect", DEAD, "--upload", "--drive", "--once", "--rtl-by-route"), USAGE, "--once"),
    (("bridge", "--connect", DEAD, "--gcs-timeout", "5"), USAGE, "--gcs-timeout needs --rtl-by-route"),
    (("bridge", "--connect", DEAD, "--battery-percent", "20"), USAGE, "--battery-percent needs"),
    (("bridge", "--connect", DEAD, "--battery-percent", "0"), USAGE, "--battery-percent"),
    (("bridge", "--connect", DEAD, "--battery-volts", "10"), USAGE, "--battery-volts needs"),
    (("bridge", "--connect", DEAD, "--place", "shed"), USAGE, "NAME=LAT,LON"),
    (("bridge", "--connect", DEAD, "--target", "there"), USAGE, "there"),
    (("bridge", "--connect", DEAD, "--clearance", "-1"), USAGE, "--clearance"),
    (("bridge", "--connect", DEAD, "--vehicle", "words.parm"), INPUT, "words.parm"),
    (("bridge", "--connect", DEAD, "--log", "missing/run.tlog"), INPUT, "missing"),
    # the simulated rover
    (("sim", "--home", "here"), USAGE, "here"),
    (("rally", "--most", "0"), USAGE, "--most"),
    (("sim", "--disc", "40.07,-105.2"), USAGE, "LAT,LON,RADIUS"),
    (("sim", "--disc", "40.07,-105.2,1", "--autopilot", "px4"), USAGE, "no distance sensor"),
    (("sim", "--home", "40.07,-105.2,east"), USAGE, "east"),
    (("sim", "--home", "40.07,-105.2,400"), USAGE, "400"),
    (("sim", "--home", "95,0"), USAGE, "95"),
    (("sim", "--fence", "missing.plan"), INPUT, "missing.plan"),
    (("sim", "--fence", "bare.plan"), INPUT, "no fence"),
    (("sim", "--mission", "yard.waypoints"), INPUT, "no mission"),
    (("sim", "--param", "WP_RADIUS"), USAGE, "NAME=VALUE"),
    (("sim", "--param", "WP_RADIUS=wide"), USAGE, "NAME=VALUE"),
    (("sim", "--param", "NONSENSE=1"), USAGE, "NONSENSE"),
    (("sim", "--loss", "2"), USAGE, "--loss"),
    (("sim", "--speedup", "0"), USAGE, "--speedup"),
    (("sim", "--system", "300"), USAGE, "--system"),
    (("sim", "--listen", "nonsense"), USAGE, "nonsense"),
    (("sim", "--listen", "tcpin:203.0.113.1:5760"), LINK, "203.0.113.1"),
    (("demo", "--out", "yard.waypoints"), INPUT, "yard.waypoints"),
    (("doctor", "an-argument"), USAGE, "an-argument"),
    (("config", "--nonsense"), USAGE, "--nonsense"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, logs, fields) -> Path:
    place = tmp_path_factory.mktemp("wrong")
    for name, content in FILES.items():
        (place / name).write_text(content, encoding="utf-8")
    for name in ("folder.plan", "folder.tlog", "folder.png"):
        (place / name).mkdir()
    for name in ("open.key", "short.key"):
        (place / name).chmod(0o600)
    shutil.copy(fields / "yard-fence.waypoints", place / "yard.waypoints")
    shutil.copy(logs / "no-fence.tlog", place / "nofence.tlog")
    return place


@pytest.fixture(scope="module")
def dead_port() -> str:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return f"tcp:127.0.0.1:{taken.getsockname()[1]}"


@pytest.fixture(autouse=True)
def bare_machine(folder, tmp_path, monkeypatch):
    monkeypatch.chdir(folder)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def run(*arguments: str):
    return CliRunner().invoke(app, list(arguments))


def check_lines(stderr: str) -> str:
    """Return the error's message, once its form is right: warnings, one error, at most one piece of advice."""
    lines = stderr.splitlines()
    assert "Traceback" not in stderr
    assert [
        line.split(":")[0] for line in lines if not line.startswith(("info: ", "warning: ", "link: "))
    ] in (
        ["error"],
        ["error", "advice"],
    )
    warnings = [line for line in lines if line.startswith("warning: ")]
    assert len(warnings) == len(set(warnings)), "each warning once"
    message = next(line for line in lines if line.startswith("error: ")).removeprefix("error: ")
    assert len(message) > 15
    return message


@pytest.mark.parametrize(
    ("arguments", "advice"),
    [
        ((*FROM_TO, "-o", "missing/mission.plan"), "create missing first, or choose another folder"),
        ((*FROM_TO, "-o", "folder.plan"), "choose another name"),
        ((*FROM_TO, "--plot", "folder.png"), "choose another name"),
    ],
)
def test_nobody_is_told_to_mend_a_file_that_could_not_be_written(arguments, advice):
    assert f"advice: {advice}\n" in run(*arguments).stderr


def test_the_table_is_long_and_has_every_command():
    assert len(WRONG) >= 200
    assert {arguments[0] for arguments, _, _ in WRONG if arguments} >= set(COMMANDS)
    assert len({arguments for arguments, _, _ in WRONG}) == len(WRONG)


@pytest.mark.parametrize(("arguments", "code", "said"), WRONG, ids=lambda value: " ".join(value)[:70] or "nothing" if isinstance(value, tuple) else "")  # fmt: skip
def test_wrong_input(arguments, code, said, dead_port):
    words = [dead_port if word == DEAD else word for word in arguments]
    result = run(*words)
    assert result.exit_code == code, result.output
    if not words:
        assert "plan" in result.stdout
        return
    message = check_lines(result.stderr)
    assert said in message
    if "--json" in words or words[0] == "--nonsense":
        return
    assert ("Usage: pbpp" in result.stdout) if len(words) == 1 and words[0] in COMMANDS else not result.stdout
    with_json = run(words[0], "--json", *words[1:])
    assert with_json.exit_code == code
    (line,) = with_json.stdout.splitlines()
    document = json.loads(line)
    assert (document["status"], document["exit_code"]) == ("error", code)
    assert said in document["message"]
    assert document["error"]
    check_lines(with_json.stderr)


def test_nothing_was_written_for_a_wrong_input(folder, fields, logs):
    left = {path.name for path in folder.iterdir()}
    assert left == {*FILES, "folder.plan", "folder.tlog", "folder.png", "yard.waypoints", "nofence.tlog"}
    assert (folder / "yard.waypoints").read_bytes() == (fields / "yard-fence.waypoints").read_bytes()
    assert (folder / "nofence.tlog").read_bytes() == (logs / "no-fence.tlog").read_bytes()


@pytest.mark.skipif(
    os.name != "posix" or os.geteuid() != 0, reason="a file that root owns and others may not read"
)
def test_files_that_may_not_be_read(folder):
    """As another user, for a moment: root may read everything."""
    command = ("plan", "--fence", str(folder / "yard.waypoints"), "--start", START, "--target", TARGET, "-q")
    assert run(*command).exit_code == 0  # which loads all that it needs
    os.seteuid(65534)
    try:
        result = run(*command)
    finally:
        os.seteuid(0)
    assert result.exit_code == INPUT, result.stderr
    assert "Permission denied" in check_lines(result.stderr)


class TestDefects:
    """What should never happen is told in one line that says how to report it."""

    @pytest.fixture(autouse=True)
    def defect(self, monkeypatch):
        def break_down(*_args, **_options):
            raise ZeroDivisionError("by nothing\nat all")

        monkeypatch.setattr(convert_command, "_check_choice", break_down)

    def test_in_one_line(self):
        result = run("convert", "yard.waypoints", "out.plan")
        assert result.exit_code == 1
        error, advice = result.stderr.splitlines()
        assert error.startswith(
            "error: internal error, a bug in pbpp: ZeroDivisionError: by nothing at all (at test_wrong_input.py:"
        )
        assert advice.startswith("advice: please report this line")

    def test_as_one_document(self):
        result = run("convert", "yard.waypoints", "out.plan", "--json")
        document = json.loads(result.stdout)
        assert (result.exit_code, document["error"], document["exit_code"]) == (1, "InternalError", 1)
        assert "report" in document["advice"]

    @pytest.mark.parametrize("way", ["-v", "PBPP_TRACEBACK"])
    def test_with_the_traceback(self, way, monkeypatch):
        if way != "-v":
            monkeypatch.setenv(way, "1")
        result = run("convert", "yard.waypoints", "out.plan", *(["-v"] if way == "-v" else []))
        assert "Traceback (most recent call last)" in result.stderr
        assert "by nothing" in result.stderr.splitlines()[-2]

    def test_in_loading_a_command(self, monkeypatch):
        def lacking(_name):
            raise ModuleNotFoundError("No module named 'pymavlink'")

        monkeypatch.setattr("mavlink_bridge.cli.app.load", lacking)
        result = run("sim", "--json")
        document = json.loads(result.stdout)
        assert (result.exit_code, document["error"]) == (1, "InternalError")
        assert "pymavlink" in document["message"]


def test_details_with_verbose():
    result = run("plan", "--fence", "fence.xyz", "-v")
    assert any(line.startswith("details: ") for line in result.stderr.splitlines())


class TestColour:
    """Colour only on a terminal, and never with NO_COLOR."""

    @staticmethod
    def on_a_terminal(**more: str) -> str:
        """Run with a pseudo-terminal for stderr; return what came there."""
        pty = pytest.importorskip("pty")
        ours, theirs = pty.openpty()
        environment = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "TERM")}
        command = [sys.executable, "-m", "mavlink_bridge.cli", "plan", "--fence", "missing.waypoints"]
        environment |= {"PYTHONPATH": os.pathsep.join(sys.path), "TERM": "xterm", **more}
        process = subprocess.Popen(command, stderr=theirs, env=environment)
        os.close(theirs)
        data = b""
        with suppress(OSError):  # how Linux tells the end
            while more := os.read(ours, 4096):
                data += more
        os.close(ours)
        process.wait()
        return data.decode()

    def test_on_a_terminal(self):
        assert "\x1b[31merror" in self.on_a_terminal()

    @pytest.mark.parametrize("variable", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
    def test_not_wanted(self, variable):
        told = self.on_a_terminal(**variable)
        assert told.startswith("error")
        assert "\x1b" not in told

    def test_not_on_a_terminal(self):
        assert "\x1b" not in run("plan", "--fence", "missing.waypoints").stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_what_all_have(name):
    options = {option for parameter in load(name).params for option in parameter.opts}
    assert {"--verbose", "-v", "--quiet", "-q", "--config", "--json"} <= options


def test_a_reader_that_goes_away_is_no_error(logs):
    """As in `pbpp log … | head -1`."""
    command = [sys.executable, "-m", "mavlink_bridge.cli", "log", "nofence.tlog", "--json"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment)
    process.stdout.close()
    errors = process.stderr.read().decode()
    process.stderr.close()
    assert process.wait(60) in (0, 141)
    assert errors == ""
