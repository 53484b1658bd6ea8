"""Texts from vehicles, files and other people reach a terminal, a picture and a ground station harmless."""

from __future__ import annotations

import ast
import io
import json
import os
import re
import unicodedata
import warnings
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from logbook.making import Log
from rich.console import Console
from rich.progress import Progress
from typer.testing import CliRunner

import mavlink_bridge.cli
from mavlink_bridge.cli import common, download, drawing, terminal
from mavlink_bridge.cli.app import app
from mavlink_bridge.cli.bridge_view import LiveView
from mavlink_bridge.cli.failing import ExitCode, begin_telling, report, report_defect
from mavlink_bridge.director import Event, EventName
from mavlink_bridge.director.announcer import Announcer
from mavlink_bridge.mavlink import messages as m
from mavlink_bridge.protocol.parameters import ParametersOutcome
from missions.geo import LatLon
from missions.picture import draw_scene
from missions.picture.drives import drive_scene
from missions.situation import Situation
from missions.words import harmless

FOLDER = Path(mavlink_bridge.cli.__file__).parent
TITLE = "\x1b]0;PWNED\x07"
NASTY = f"{TITLE}\x1b[2J\n\rerror: verified\x7f\x9b2J\u202edlrow\u2066\ud800[red]x[/red]"
SHOWN = r"\x1b]0;PWNED\x07\x1b[2J\n\rerror: verified\x7f\x9b2J\u202edlrow\u2066\ud800[red]x[/red]"

# Anything, and above all what does harm.
texts = st.text(st.characters(exclude_categories=())) | st.text(
    st.sampled_from("\x00\x07\x08\t\n\r\x1b\x7f\x85\x9b\x9d\xa0\xad\u200b\u200e\u2028\u202a\u202e\u2066\u2069\ufeff\ud800\udfff[]\\a")
)  # fmt: skip


class TestHarmless:
    @given(texts)
    @example("\x1b[31m")
    @example("\U000e0041")
    def test_every_character_is_seen_and_stands_on_one_line(self, text):
        shown = harmless(text)
        for character in shown:
            assert unicodedata.category(character)[0] != "C"
            assert unicodedata.category(character) not in ("Zl", "Zp")
        assert len(shown.splitlines()) <= 1
        shown.encode()  # no lone surrogates
        assert harmless(shown) == shown

    @given(texts)
    def test_nothing_is_lost(self, text):
        if "\\" not in text:
            assert re.sub(r"\\(x..|u.{4}|U.{8}|[ntr])", unescaped, harmless(text)) == text

    @pytest.mark.parametrize(
        "text", ["C:\\new\\x1b", "Wiese 7, Süd", "поле", "שדה", "田\u3000圃", "1\xa0m", "⠤▓├─┤", "👩"]
    )
    def test_what_people_write_stays(self, text):
        assert harmless(text) == text

    def test_all_kinds_at_once(self):
        assert harmless(NASTY) == SHOWN


def unescaped(found):
    return {"n": "\n", "t": "\t", "r": "\r"}.get(found[1]) or chr(int(found[1][1:], 16))


class TestTheOneWay:
    """`terminal` is the only module of the command line that prints, and `drawing` the one that has a console made."""

    @pytest.mark.parametrize(
        "path", sorted(FOLDER.rglob("*.py")), ids=lambda path: str(path.relative_to(FOLDER))
    )
    def test_nothing_else_prints(self, path):
        if path.name != "terminal.py":
            found = list(printing(ast.parse(path.read_text(encoding="utf-8"))))
            assert found == ["Console(stderr=err, highlight=False, markup=False)"] * (
                path.name == "drawing.py"
            )

    @pytest.mark.parametrize(
        "code",
        [
            "print(x)", "typer.echo(x)", "typer.secho(x, err=True)", "click.echo(x)", "sys.stdout.write(x)", "sys.stderr.write(x)",
            "sys.stdout.buffer.write(x)", "sys.stdout.writelines(x)", "Console().print(x)", "rich.print(x)", "table.add_row(x)",
            "table.add_row(cell(x), f'{x}')", "os.write(1, x)", "write_mission(situation, path)", "draw_plan(plan, path)",
        ],
    )  # fmt: skip
    def test_the_look_finds_what_prints_or_overwrites(self, code):
        assert list(printing(ast.parse(code)))

    @pytest.mark.parametrize("put", [terminal.echo, terminal.say])
    def test_lines(self, capsys, put):
        put(f"the vehicle says {NASTY}")
        assert "".join(capsys.readouterr()) == f"the vehicle says {SHOWN}\n"

    def test_questions(self, capsys):
        terminal.say(f"{TITLE}? [Y/n] ", nl=False)
        assert capsys.readouterr().err == r"\x1b]0;PWNED\x07? [Y/n] "

    def test_several_lines_and_labels(self, capsys):
        terminal.echo_lines(["one", NASTY])
        terminal.echo_labelled("ok", "green", NASTY)
        assert capsys.readouterr().out == f"one\n{SHOWN}\nok  {SHOWN}\n"

    def test_warnings_errors_and_details(self, capsys):
        begin_telling("plan", verbose=True)
        common.warn([NASTY])
        report("plan", "LinkError", NASTY, ExitCode.LINK, {"advice": NASTY, "text": NASTY}, wants_json=False)
        lines = [
            f"warning: {SHOWN}",
            f"error: {SHOWN}",
            f"details: text = {SHOWN}",
            f"advice: {SHOWN}",
        ]
        assert capsys.readouterr().err.split("\n") == [*lines, ""]

    def test_tracebacks(self, capsys):
        with pytest.raises(ValueError, match="PWNED") as caught:
            float(TITLE)
        report_defect("plan", caught.value, wants_json=False, verbose=True)
        told = capsys.readouterr().err
        assert is_plain(told)
        assert told.count(r"ValueError: could not convert string to float: '\x1b]0;PWNED\x07'") == 2

    @given(st.dictionaries(texts, texts | st.floats() | st.lists(texts)))
    @example({NASTY: NASTY})
    def test_json_is_ascii_on_one_line(self, document):
        line = json_line(document)
        assert line.isascii()
        assert line[:-1].isprintable()
        assert line.endswith("\n")

    @given(st.dictionaries(st.text(), st.text() | st.integers() | st.lists(st.text())))
    @example({"text": "\x1b\x7f\x9b\n"})
    def test_json_says_the_same(self, document):
        assert json.loads(json_line(document)) == document


def json_line(document):
    out = io.StringIO()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.stdout", out)
        terminal.print_json(document)
    return out.getvalue()


def printing(tree):
    """Return what puts something on the terminal, or over a file, on a way of its own."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        called = ast.unparse(node.func)
        is_print = called in ("print", "rich.print", "os.write") or re.fullmatch(r"(\w+\.)*Console", called)
        is_echo = re.fullmatch(r"(typer|click)\.(echo|secho|style|echo_via_pager)", called)
        is_stream = re.fullmatch(r"sys\.(stdout|stderr)(\.buffer)?\.write(lines)?", called)
        is_raw_row = called.endswith(".add_row") and not all(is_cell(one) for one in node.args)
        writes = called in ("write_mission", "write_situation", "write_fence", "draw_plan", "draw_scene")
        is_unkept = writes and not any(one.arg == "write" for one in node.keywords)
        if is_print or is_echo or is_stream or is_raw_row or is_unkept:
            yield ast.unparse(node)


def is_cell(node):
    return re.match(r"\*?(map\(cell, |cell\()", ast.unparse(node)) is not None


class TestWhatRichDraws:
    def test_bridge_view(self):
        out = io.StringIO()
        view = LiveView(None, Console(file=out, force_terminal=False, width=200))
        view.tell(Event.of(0.0, EventName.LINK_BACK, NASTY, ()))
        assert SHOWN in out.getvalue()
        assert is_plain(out.getvalue())

    def test_progress(self, monkeypatch):
        out = io.StringIO()
        shown = []
        monkeypatch.setattr("sys.stderr", out)
        monkeypatch.setattr(out, "isatty", lambda: True)
        monkeypatch.setattr(Progress, "update", lambda _self, _task, **values: shown.append(values))
        with drawing.progress_bar(quiet=False) as show:
            show(NASTY, 1, 2)
        assert shown == [{"description": SHOWN, "completed": 1, "total": 2}]

    @pytest.mark.skipif(os.name != "posix", reason="no such file names elsewhere")
    def test_logs(self, tmp_path):
        log = Log()
        log.heartbeat()
        log.parameters()
        log.fence()
        log.heartbeat(armed=True)
        path = tmp_path / f"{TITLE}[red]x[red].tlog"
        log.write(path)
        result = CliRunner(env={"COLUMNS": "160"}).invoke(app, ["log", str(path)])
        assert result.exit_code == 0, result.output
        assert is_plain(result.output)
        assert result.stdout.startswith(r"\x1b]0;PWNED\x07[red]x[red].tlog: ")


@pytest.mark.skipif(os.name != "posix", reason="no such file names elsewhere")
class TestFiles:
    def test_names_and_contents(self, tmp_path):
        path = tmp_path / f"f{TITLE}.geojson"
        ring = [[0, 0], [0, 1], [1, 1], [0, 0]]
        feature = {
            "type": "Feature",
            "properties": {"role": f"{NASTY}keep calm"},
            "geometry": {"type": "Polygon", "coordinates": [ring]},
        }
        path.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}))
        for arguments in (
            ["convert", str(path), str(tmp_path / "o.plan")],
            ["plan", "--fence", str(path), "--start", "1,1", "--target", "2,2"],
        ):
            result = CliRunner().invoke(app, arguments)
            assert result.exit_code == 3
            assert is_plain(result.output)
            assert r"f\x1b]0;PWNED\x07.geojson: features[0]: role" in result.stderr

    @pytest.mark.parametrize(
        ("arguments", "code"),
        [
            (["plan", "--fence", f"{TITLE}.plan", "--start", "1,1", "--target", "2,2"], 3),
            (["plan", "--fence", f"\udcff{TITLE}.plan", "--start", "1,1", "--target", "2,2"], 3),
            (["plan", f"--{TITLE}"], 2),
            ([TITLE], 2),
            (["convert", f"a{TITLE}", "b"], 3),
            (["log", f"{TITLE}.tlog"], 3),
            (["replay", f"{TITLE}.tlog"], 3),
            (["download", TITLE, "--connect", "tcp:127.0.0.1:1"], 2),
            (["plan", "--connect", TITLE, "--target", "1,1"], 5),
            (["upload", f"{TITLE}.plan", "--connect", "tcp:127.0.0.1:1"], 3),
            (["config", "--config", f"{TITLE}.toml"], 2),
        ],
    )
    def test_what_is_typed(self, arguments, code):
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == code, result.output
        assert is_plain(result.output)
        assert r"\x1b]0;PWNED\x07" in result.output

    def test_names_of_parameters(self, tmp_path):
        path = tmp_path / "p.parm"
        path.write_text(f"FENCE_{TITLE} abc\n")
        fence = Path(__file__).parents[2] / "fields" / "maze-fence.waypoints"
        arguments = [
            "plan",
            "--fence",
            str(fence),
            "--start",
            "1,1",
            "--target",
            "2,2",
            "--vehicle",
            str(path),
        ]
        result = CliRunner().invoke(app, arguments)
        assert result.exit_code == 3
        assert is_plain(result.output)

    def test_a_vehicles_parameter_writes_no_line_of_its_own(self, tmp_path, capsys):
        values = {"WP_SPEED": 2.0, "A\nFENCE_ENABLE 0": 1.0, TITLE: 1.0}
        for suffix, row in (
            (".parm", "WP_SPEED 2"),
            (".param", "WP_SPEED,2"),
            (".params", "1\t1\tWP_SPEED\t2\t9"),
        ):
            path = tmp_path / f"rover{suffix}"
            download._write_parameters(path, ParametersOutcome(values), Situation())
            assert [line for line in path.read_text().splitlines() if not line.startswith("#")] == [row]
        told = capsys.readouterr().err
        assert is_plain(told)
        assert "left out, not valid parameter names: 'A\\nFENCE_ENABLE 0', " in told


class TestPictures:
    NAME = f"{TITLE}<b>a</b> <a href='javascript:1'>$x_{{$ & [red].tlog"
    SCENE = drive_scene(
        (NAME,),
        None,
        [(NAME, (LatLon(0.0, 0.0), LatLon(0.0, 0.001)))],
        breaches=[(NAME, LatLon(0.0, 0.0005))],
    )

    def test_svg(self, tmp_path):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            draw_scene(self.SCENE, tmp_path / "x.svg")
        text = (tmp_path / "x.svg").read_text(encoding="utf-8")
        ET.fromstring(text)
        assert is_plain(text)


def test_what_the_bridge_says_to_ground_stations():
    announcer = Announcer()
    announcer.say(6, f"refused; {TITLE}\n")
    assert announcer.due(0.0) == [m.Statustext(6, r"pbpp: refused; \x1b]0;PWNED\x07\n")]


def is_plain(text):
    """Return whether a text has our line breaks and otherwise only what is seen."""
    return all(harmless(line) == line for line in text.split("\n"))
