// nav2d: A* over triangles and a funnel; not the shortest. Its "main" is a bundle that node cannot import.
import { NavMesh } from "nav2d/src/nav2d.js";

export const build = ({ triangles }) => new NavMesh(triangles, { triangulate: false });

export const query = (mesh, start, goal) => mesh.findPath(start, goal)?.map(({ x, y }) => [x, y]) ?? null;
