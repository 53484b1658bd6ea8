"""Whatever a file holds, reading it is bounded, and the bound is told; and nothing but `MissionFormatError` comes of it."""

from __future__ import annotations

import random
import string
import struct
import zipfile
from typing import TYPE_CHECKING

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from missions.errors import MissionError, MissionFormatError
from missions.formats import FORMATS, Choices, read_situation

if TYPE_CHECKING:
    from pathlib import Path

KML = "<kml><Placemark><Point><coordinates>{}</coordinates></Point></Placemark></kml>"


@pytest.mark.parametrize(
    ("module", "bound", "name", "text", "problem"),
    [
        (
            "xml_tree",
            "MOST_XML_ELEMENTS",
            "x.kml",
            "<kml>" + "<a/>" * 9 + "</kml>",
            "more than 5 XML elements",
        ),
        ("kml", "MOST_POSITIONS", "x.kml", KML.format("1,2 " * 15), "more than 5 positions"),
        ("json_node", "MOST_JSON_VALUES", "x.geojson", "[" + "[]," * 9 + "[]]", "more than 5 JSON values"),
        ("bounds", "MOST_LINES", "x.parm", "A 1\n" * 9, "more than 5 lines"),
        ("bounds", "MOST_LINES", "x.fen", "1 2\n" * 9, "more than 5 lines"),
        ("waypoints", "MOST_ITEMS", "x.waypoints", "QGC WPL 110\n" + "x\n" * 9, "more than 5 items"),
        ("positions_csv", "MOST_FEATURES", "x.csv", "lat,lon\n" + "1,2\n" * 9, "more than 5 rows"),
        ("positions_csv", "MOST_COLUMNS", "x.csv", "lat,lon" + "," * 9, "more than 5 columns"),
        ("feature_reading", "MOST_FEATURES", "x.csv", "lat,lon\n" + "1,2\n" * 9, "more than 5 features"),
        ("texts", "MOST_BYTES", "x.plan", " " * 9, "more than 0 MB"),
    ],
)
def test_the_bound_is_told(tmp_path, monkeypatch, module, bound, name, text, problem):
    monkeypatch.setattr(f"missions.formats.{module}.{bound}", 5)
    (tmp_path / name).write_text(text)
    with pytest.raises(MissionFormatError, match=problem):
        read_situation(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("x.kml", "<kml>" + "<Folder>" * 200 + "</Folder>" * 200 + "</kml>"),
        ("x.geojson", '{"type":"GeometryCollection","geometries":[' * 200 + "]}" * 200),
    ],
)
def test_depth_is_bounded(tmp_path, name, text):
    (tmp_path / name).write_text(text)
    with pytest.raises(MissionFormatError, match="nested more than 100 levels deep"):
        read_situation(tmp_path / name)


def kmz(path: Path, text: str, method: int = zipfile.ZIP_DEFLATED) -> bytearray:
    with zipfile.ZipFile(path, "w", method) as archive:
        archive.writestr("doc.kml", text)
    return bytearray(path.read_bytes())


def test_a_small_kmz_of_millions_of_elements(tmp_path):
    data = kmz(tmp_path / "x.kmz", "<kml>" + "<a/>" * 24_000_000 + "</kml>")
    assert len(data) < 100_000
    with pytest.raises(MissionFormatError, match="more than 500,000 XML elements"):
        read_situation(tmp_path / "x.kmz")


def test_a_kmz_whose_directory_lies_of_its_size(tmp_path):
    data = kmz(tmp_path / "x.kmz", "<kml>" + " " * 1_000_000 + "</kml>")
    entry = data.rindex(b"PK\x01\x02")
    data[entry + 24 : entry + 28] = struct.pack("<I", 50)
    (tmp_path / "x.kmz").write_bytes(data)
    with pytest.raises(MissionFormatError, match="is not a readable zip file: Bad CRC-32"):
        read_situation(tmp_path / "x.kmz")


@pytest.mark.parametrize("method", [zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
@pytest.mark.parametrize("is_broken", [True, False])
def test_a_kmz_packed_otherwise_is_named(tmp_path, method, is_broken):
    data = kmz(tmp_path / "x.kmz", "<kml>" + "<a/>" * 2000 + "</kml>", method)
    if is_broken:
        data[60:75] = bytes(byte ^ 0x5A for byte in data[60:75])
        (tmp_path / "x.kmz").write_bytes(data)
    with pytest.raises(MissionFormatError, match=r"doc\.kml is not compressed with deflate") as caught:
        read_situation(tmp_path / "x.kmz")
    assert "ordinary zip file" in str(caught.value.details["advice"])


@given(st.integers(0, 10**6), st.integers(0, 40))
def test_a_damaged_kmz_is_one_clear_error(tmp_path_factory, seed, count):
    path = tmp_path_factory.mktemp("kmz") / "x.kmz"
    data = kmz(path, KML.format("1,2") * 3)
    chance = random.Random(seed)
    for _ in range(count):
        data[chance.randrange(len(data))] = chance.randrange(256)
    path.write_bytes(data)
    with pytest.raises(MissionFormatError, match=r"x\.kmz"):
        read_situation(path)


PIECES = st.sampled_from(
    [
        *string.printable, "\ufeff", "\x00", "\u2028", "é", "QGC WPL 110\n", "QGC WPL 100\n", "RALLY ", "0\t1\t0\t16\t0\t0\t0\t0\t48.1\t11.5\t0\t1\n",
        "1\t0\t3\t5001\t3\t0\t0\t0\t48.1\t11.5\t0\t1\n", "48.1 11.5\n", "1e999", "nan", "-", "lat,lon\n", "48.1;11.5\n", '"', "<kml>", "</kml>", "<gpx>",
        "</gpx>", '<wpt lat="1" lon="2"/>', "<rte>", "</rte>", "<trk><trkseg>", "<Placemark>", "</Placemark>", "<Point>", "</Point>", "<Polygon>", "</Polygon>",
        "<outerBoundaryIs><LinearRing><coordinates>", "1,2 3,4 5,7", "</coordinates></LinearRing></outerBoundaryIs>", '{"type":"Polygon","coordinates":', "[[[1,2],[3,4],[5,9]]]",
        '{"type":"Feature","properties":', '"geometry":', "null", "{}", "[]", '{"fileType":"Plan",', '"mission":', '"geoFence":', '"version":2', ":", ",", "}", "]", "FENCE_ENABLE 1\n", "0x1F",
    ]
)  # fmt: skip
TEXTS = st.lists(PIECES, max_size=30).map("".join)


@given(TEXTS, st.sampled_from([suffix for suffix, one in FORMATS.items() if one.read]), st.booleans())
@example("<gpx><wpt/></gpx>", ".gpx", True)
@example("lat,lon,radius_m\n1,2,x\n", ".csv", True)
@example("<gpx><trk><trkseg><trkpt lat='1' lon='2'/></trkseg></trk></gpx>", ".gpx", False)
def test_nothing_but_errors_of_ours(text, suffix, flags):
    format_ = FORMATS[suffix]
    extra = (Choices({}, flags, flags),) if format_.is_map else ()
    try:
        situation = format_.read(text, f"f{suffix}", *extra)
    except MissionError as error:
        assert str(error).startswith(f"f{suffix}")  # noqa: PT017 - any text may be read or not
    else:
        assert all(f"f{suffix}" in remark for remark in situation.remarks)
