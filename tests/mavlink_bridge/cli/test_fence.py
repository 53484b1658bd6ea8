"""``pbpp fence merge``: areas drawn in pieces, for the vehicle in one."""

from __future__ import annotations

import json

import pytest
from charts import IN, OUT, box, place
from typer.testing import CliRunner

from mavlink_bridge.cli.app import app
from missions.fence import CircleZone, Fence
from missions.formats import read_fence, read_situation, write_fence
from missions.ground.merged_fence import merged_fence

PIECES = Fence((box(IN, -50, -20, 10, 20), box(IN, -10, -5, 60, 5), box(OUT, -30, -5, -20, 5)))


def run(*arguments):
    return CliRunner().invoke(app, list(map(str, arguments)))


@pytest.fixture
def pieces(tmp_path):
    path = tmp_path / "pieces.waypoints"
    write_fence(PIECES, path)
    return path


def test_a_route_through_areas_that_overlap_once_they_are_one(pieces, tmp_path):
    ends = ("--start", ",".join(map(str, place(-45, 10))), "--target", ",".join(map(str, place(55, 0))))
    asked = (*ends, "--clearance", "1", "--home", ",".join(map(str, place(-45, 10))))
    refused = run("plan", "--fence", pieces, *asked)
    assert refused.exit_code == 4
    assert "only the intersection of all inclusions" in refused.stderr
    merged = tmp_path / "field.plan"
    result = run("fence", "merge", pieces, "-o", merged)
    assert (result.exit_code, result.stdout) == (
        0,
        f"Wrote {merged}: 2 inclusions merged into one; 2 zones in all\n",
    )
    assert run("plan", "--fence", merged, *asked).exit_code == 0


@pytest.mark.parametrize("suffix", [".plan", ".waypoints", ".geojson"])
def test_what_is_written_is_the_merged_fence(pieces, tmp_path, suffix):
    output = tmp_path / f"field{suffix}"
    document = json.loads(run("fence", "merge", pieces, "-o", output, "--json").stdout)
    wanted = merged_fence(PIECES)
    written = read_fence(output)  # GeoJSON has rules of its own for which way round
    assert [(zone.kind, sorted(zone.vertices)) for zone in written.zones] == [
        (zone.kind, sorted(zone.vertices)) for zone in wanted.zones
    ]
    assert (document["command"], document["action"], document["outputs"]) == ("fence", "merge", [str(output)])
    assert (document["merged_inclusions"], document["zones"], document["vertices"]) == (
        2,
        2,
        wanted.vertex_count,
    )


def test_pieces_of_a_map_whose_roles_are_said_beside_it(tmp_path):
    path, output = tmp_path / "pieces.geojson", tmp_path / "field.plan"
    features = [
        {
            "type": "Feature",
            "properties": {"name": f"piece {number}"},
            "geometry": {
                "type": "Polygon",
                "coordinates": [[[lon, lat] for lat, lon in (*zone.vertices, zone.vertices[0])]],
            },
        }
        for number, zone in enumerate(PIECES.zones[:2], start=1)
    ]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    unsaid = run("fence", "merge", path, "-o", output)
    assert (unsaid.exit_code, output.exists()) == (3, False)
    assert "--role" in unsaid.stderr
    said = ("--role", "piece 1=inclusion", "--role", "piece 2=inclusion")
    document = json.loads(run("fence", "merge", path, "-o", output, *said, "--json").stdout)
    assert (document["merged_inclusions"], document["zones"], document["warnings"]) == (2, 1, [])
    assert read_fence(output).zones == merged_fence(Fence(PIECES.zones[:2])).zones


def test_exclusions_out_of_reach_are_left_out_with_a_word(tmp_path):
    path, output = tmp_path / "pieces.waypoints", tmp_path / "field.plan"
    far = box(OUT, 90_000, 0, 90_100, 100)
    write_fence(Fence((*PIECES.zones, far)), path)
    result = run("fence", "merge", path, "-o", output)
    assert (result.exit_code, len(read_fence(output).zones)) == (0, 2)
    assert "exclusions left out, more than 1 km from every inclusion: 1" in result.stderr


def test_the_other_parts_of_a_plan_stay(fields, tmp_path):
    plan = tmp_path / "both.plan"
    assert run("plan", "--fence", fields / "yard-fence.waypoints", "--start", "40.071374,-105.229930",
               "--target", "40.0720926,-105.2286152", "--clearance", "1", "-o", plan).exit_code == 0  # fmt: skip
    result = run("fence", "merge", plan, "-o", tmp_path / "same.plan")
    assert "1 inclusion, nothing to merge; 4 zones in all" in result.stdout
    before, after = read_situation(plan), read_situation(tmp_path / "same.plan")
    assert after.mission.value == before.mission.value
    assert after.fence.value == before.fence.value


def test_wrong_use_and_fences_that_cannot_be_merged(pieces, fields, tmp_path):
    output = tmp_path / "out.plan"
    assert run("fence", "split", pieces, "-o", output).exit_code == 2
    assert run("fence", "merge", pieces).exit_code == 2
    assert run("fence", "merge", pieces, "-o", pieces).exit_code == 2
    assert run("fence", "merge", pieces, "-o", tmp_path / "out.gpx").exit_code == 3
    assert run("fence", "merge", fields / "yard-mission.waypoints", "-o", output).exit_code == 3
    write_fence(Fence((box(IN, 0, 0, 20, 20), CircleZone(IN, place(40, 0), 10.0))), pieces)
    apart = run("fence", "merge", pieces, "-o", output)
    assert apart.exit_code == 3
    assert "separate areas" in apart.stderr
    assert not output.exists()
