"""Shapefiles (.shp, or zipped with its parts) and GeoPackages (.gpkg), by pyogrio (extra ``gis``)."""

from __future__ import annotations

import warnings
import zipfile
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import shapely
from pyproj import Transformer
from shapely.errors import ShapelyError

from missions.errors import InvalidPositionError, MissionFormatError
from missions.formats.bounds import MOST_BYTES, MOST_POSITIONS, check_bound
from missions.formats.choices import NO_CHOICES
from missions.formats.feature_reading import situation_of
from missions.formats.features import Feature, Shape
from missions.geo import checked_lat_lon
from missions.situation import Reading

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from shapely.geometry.base import BaseGeometry

    from missions.formats.choices import Choices
    from missions.geo import LatLon
    from missions.situation import Situation

_NAMES = ("name", "label", "title")
_KINDS = {".shp": "a shapefile", ".zip": "a zipped shapefile", ".gpkg": "a GeoPackage"}


def read_path(path: Path, choices: Choices = NO_CHOICES) -> Situation:
    """Read a file: its features, in WGS 84 whatever its projection.

    Raises
    ------
    MissionFormatError
        It cannot be read, does not say its projection, or pyogrio is not installed.
    """
    source, kind = str(path), _KINDS[path.suffix.lower()]
    _check_file(path)
    try:
        import pyogrio  # noqa: PLC0415 - an extra
    except ImportError:
        raise MissionFormatError(
            f"{path} is {kind}; reading it needs the gis extra",
            file=source,
            advice="pip install 'pbpp-rover[gis]', or export it as .geojson in EPSG:4326",
        ) from None
    features: list[Feature] = []
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            for layer, _ in pyogrio.list_layers(path):
                features += _features_of_layer(pyogrio, path, layer)
        except (
            pyogrio.errors.DataSourceError,
            pyogrio.errors.DataLayerError,
            ShapelyError,
            ValueError,
            RuntimeError,
        ) as error:
            raise MissionFormatError(
                f"{path} is {kind} that cannot be read: {error}", file=source, advice=_EXPORT
            ) from None
    situation = situation_of(features, source, choices)
    remarks = (f"{source}: {warning.message}" for warning in said)
    return replace(situation, reading=Reading(remarks=(*remarks, *situation.remarks)))


def _features_of_layer(pyogrio: Any, path: Path, layer: str) -> Iterator[Feature]:  # noqa: ANN401 - a module
    meta, _, shapes, columns = pyogrio.raw.read(path, layer=layer, force_2d=True, max_features=MOST_POSITIONS)
    if shapes is None:
        return
    rows: list[dict[str, object]] = [{} for _ in shapes]
    for name, column in zip(meta["fields"], columns, strict=True):
        for row, value in zip(rows, column, strict=True):
            row[name] = value
    yield from _features(meta["crs"], shapes, rows, f"{path}: layer {layer}")


_EXPORT = "export it again, or as .geojson in EPSG:4326"


def _check_file(path: Path) -> None:
    """Check size, and of an archive what is in it, before the library is let loose on it."""
    source = str(path)
    try:
        check_bound(path.stat().st_size, MOST_BYTES, "bytes", source)
        if path.suffix.lower() != ".zip":
            return
        with zipfile.ZipFile(path) as archive:
            parts = archive.infolist()
    except OSError as error:
        raise MissionFormatError(
            f"{path} cannot be read: {error.strerror}",
            file=source,
            advice="check the path",
        ) from None
    except (zipfile.BadZipFile, ValueError, NotImplementedError) as error:
        raise MissionFormatError(f"{path} is not a readable zip file: {error}", file=source) from None
    check_bound(sum(part.file_size for part in parts), MOST_BYTES, "bytes when unpacked", source)
    if not any(part.filename.lower().endswith(".shp") for part in parts):
        raise MissionFormatError(
            f"{path} is a zip archive without a shapefile (.shp) in it",
            file=source,
            advice="unpack it, or rename it to .kmz if it contains KML",
        )


def _features(crs: str | None, shapes: Any, rows: list[dict[str, object]], where: str) -> Iterator[Feature]:  # noqa: ANN401 - an array of WKB
    if crs is None:
        raise MissionFormatError(
            f"{where}: projection unknown (a shapefile's .prj)",
            where=where,
            advice="keep the .prj beside the .shp, or export it as .geojson in EPSG:4326",
        )
    to_wgs84 = Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
    count = 0
    for number, (shape, properties) in enumerate(zip(shapely.from_wkb(shapes), rows, strict=True), start=1):
        place = f"{where}, feature {number}"
        count += int(shapely.get_num_coordinates(shape))
        check_bound(count, MOST_POSITIONS, "positions", where)
        said = {key: value.item() if hasattr(value, "item") else value for key, value in properties.items()}
        names = tuple(str(value) for key, value in said.items() if key.lower() in _NAMES and value)
        for part in _parts(shape):
            lines = tuple(
                tuple(_position(lon, lat, place) for lon, lat in to_wgs84.itransform(points))
                for points in _lines(part)
            )
            yield Feature(_SHAPES[part.geom_type], lines, said, names[:1], place)


_SHAPES = {
    "Point": Shape.POINT,
    "LineString": Shape.LINE,
    "Polygon": Shape.POLYGON,
}


def _parts(shape: BaseGeometry | None) -> Iterator[BaseGeometry]:
    if shape is None or shape.is_empty:
        return
    if hasattr(shape, "geoms"):
        for part in shape.geoms:
            yield from _parts(part)
    else:
        yield shape


def _lines(shape: Any) -> list[list[tuple[float, float]]]:  # noqa: ANN401 - any geometry
    """Return the positions of a geometry; of a polygon its rings, open."""
    if shape.geom_type == "Polygon":
        return [list(ring.coords)[:-1] for ring in (shape.exterior, *shape.interiors)]
    return [list(shape.coords)]


def _position(lon_deg: float, lat_deg: float, where: str) -> LatLon:
    try:
        return checked_lat_lon(lat_deg, lon_deg)
    except InvalidPositionError as error:
        raise MissionFormatError(f"{where}: {error}", where=where) from None
