// Run one planner on one case in a process of its own: node drive.mjs PLANNER CASE.json MOST_QUERIES
// Prints what drive.py prints. The case holds the triangles of its free space too, which a planner over a mesh is given.
import { readFileSync } from "node:fs";

const [planner, caseFile, most] = process.argv.slice(2);
const cpuS = () => {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1e6;
};
const peakMb = () => process.resourceUsage().maxRSS / 1024;
const fieldCase = JSON.parse(readFileSync(caseFile, "utf8"));
let began = cpuS();
const peer = await import(`./peer_${planner}.mjs`);
const importS = cpuS() - began;
const idleMb = peakMb();
began = cpuS();
const state = peer.build(fieldCase);
const buildS = cpuS() - began;
const queryS = [];
const paths = [];
for (const [startEast, startNorth, goalEast, goalNorth] of fieldCase.queries.slice(0, Number(most))) {
  began = cpuS();
  const path = peer.query(state, [startEast, startNorth], [goalEast, goalNorth]);
  queryS.push(cpuS() - began);
  paths.push(path);
}
console.log(
  JSON.stringify({ import_s: importS, build_s: buildS, query_s: queryS, paths, memory_mb: peakMb() - idleMb }),
);
