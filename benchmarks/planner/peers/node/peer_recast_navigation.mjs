// recast-navigation: Recast's mesh over cells and Detour's search, compiled to WebAssembly; not the shortest.
import { init, NavMeshQuery } from "recast-navigation";
import { generateSoloNavMesh } from "recast-navigation/generators";

await init();

const MOST = 2048; // polygons and points of a path

// Recast's y points up; east is x, north is -z.
const upright = ([east, north]) => ({ x: east, y: 0, z: -north });

export const build = ({ triangles, bounds }) => {
  const positions = triangles.flat().flatMap(([east, north]) => [east, 0, -north]);
  const { success, navMesh } = generateSoloNavMesh(positions, [...positions.keys()].slice(0, positions.length / 3), {
    cs: bounds[2] - bounds[0] <= 200 ? 0.25 : 0.5,
    ch: 0.2,
    walkableRadius: 0,
    minRegionArea: 0,
    mergeRegionArea: 0,
  });
  if (!success) throw new Error("Recast made no mesh");
  return new NavMeshQuery(navMesh);
};

export const query = (meshQuery, start, goal) => {
  const found = meshQuery.computePath(upright(start), upright(goal), {
    halfExtents: { x: 2, y: 2, z: 2 },
    maxPathPolys: MOST,
    maxStraightPathPoints: MOST,
  });
  if (!found.success) return null;
  return [start, ...found.path.slice(1, -1).map(({ x, z }) => [x, -z]), goal];
};
