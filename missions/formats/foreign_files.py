"""What files are that are not read as missions, fences or parameters: named, with what to do instead."""

from __future__ import annotations

from missions.errors import MissionFormatError

_LOG_ADVICE = "use the telemetry log (.tlog) that the ground station recorded, with --log"
_BY_SUFFIX: dict[str, tuple[str, str]] = {
    ".tlog": ("a telemetry log", "use --log FILE.tlog; `pbpp log FILE.tlog` summarises it"),
    ".bin": ("an ArduPilot DataFlash log", "use --log FILE.bin; `pbpp log FILE.bin` summarises it"),
    ".log": ("an ArduPilot DataFlash log, or another program's log", _LOG_ADVICE),
    ".ulg": ("a PX4 ULog", _LOG_ADVICE),
    ".rlog": ("a Mission Planner raw log", _LOG_ADVICE),
    ".mission": ("an iNav mission (XML)", "save it from the iNav Configurator as .kml, or draw it again"),
    ".dxf": ("a CAD drawing", "export the zones from it as .geojson or .kml, in WGS 84"),
    ".dbf": ("a shapefile's table", "give the .shp beside it"),
    ".shx": ("a shapefile's index", "give the .shp beside it"),
    ".prj": ("a shapefile's projection", "give the .shp beside it"),
}
_MAGIC: tuple[tuple[bytes, str], ...] = (
    (b"\xa3\x95", ".bin"),
    (b"ULog\x01\x12\x35", ".ulg"),
    (b"\x00\x00\x27\x0a", ".shp"),
    (b"SQLite format 3\x00", ".gpkg"),
    (b"PK\x03\x04", ".zip"),
    (b"PK\x05\x06", ".zip"),
    (b"\x89PNG", ".png"),
    (b"\xff\xd8\xff", ".jpg"),
    (b"%PDF", ".pdf"),
    (b"\x1f\x8b", ".gz"),
    (b"7z\xbc\xaf", ".7z"),
)
_KINDS = {
    ".shp": (
        "a shapefile",
        "rename it to .shp; reading it needs the gis extra (pip install 'pbpp-rover[gis]')",
    ),
    ".gpkg": (
        "a GeoPackage",
        "rename it to .gpkg; reading it needs the gis extra (pip install 'pbpp-rover[gis]')",
    ),
    ".zip": (
        "a zip archive",
        "rename it to .kmz if it contains KML, to .zip if it contains a shapefile, or unpack it",
    ),
    ".png": ("a picture (PNG)", "draw the zones on a map and save them as .kml, .geojson or .plan"),
    ".jpg": ("a picture (JPEG)", "draw the zones on a map and save them as .kml, .geojson or .plan"),
    ".pdf": ("a PDF document", "draw the zones on a map and save them as .kml, .geojson or .plan"),
    ".gz": ("a gzip archive", "unpack it first"),
    ".7z": ("a 7z archive", "unpack it first"),
}


def kind_of(head: bytes) -> tuple[str, str] | None:
    """Return what a file is by its first bytes, and advice; None where they do not tell."""
    suffix = next((suffix for magic, suffix in _MAGIC if head.startswith(magic)), None)
    return None if suffix is None else (_BY_SUFFIX | _KINDS)[suffix]


def kind_of_suffix(suffix: str) -> tuple[str, str] | None:
    """Return what files of a suffix are, and advice; None where it is not known."""
    return (_BY_SUFFIX | _KINDS).get(suffix.lower())


def check_head(head: bytes, source: str, expected: str) -> None:
    """Check that a file's first bytes are not those of something else.

    Raises
    ------
    MissionFormatError
        They are; the message names it.
    """
    kind = kind_of(head)
    if kind is not None:
        raise MissionFormatError(f"{source} is {kind[0]}; expected {expected}", file=source, advice=kind[1])
