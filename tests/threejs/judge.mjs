// node judge.mjs THREE TRUTH OTHER [RATE]: how far OTHER's motion is from TRUTH's, both played in three.js; JSON.
import { library, open } from "./load.mjs";
import * as match from "./match.mjs";
import { player, resting, times } from "./play.mjs";
import { beats, diagonal, farthest, placed, reach, surfaces } from "./surfaces.mjs";

const RATE = 120; // frames per second looked at, besides all keys

async function main(folder, truthFile, otherFile, rate = RATE) {
  const modules = await library(folder);
  const truth = await prepared(modules, truthFile);
  const other = await prepared(modules, otherFile);
  const objects = match.nodes(truth, other);
  const size = diagonal(truth.surfaces.length ? truth.surfaces.map((each) => placed(each)) : truth.nodes.map(origin));
  const { pairs, own } = match.surfacePairs(truth.surfaces, other.surfaces, objects, truth.nodes, size);
  const clips = match.clips(truth.clips, other.clips);
  const bare = withoutVertices(truth);
  const judged = clips.pairs.map(([ours, theirs]) => {
    const seek = [player(modules.three, truth, truth.rest, ours), player(modules.three, other, other.rest, theirs)];
    return clip(ours, theirs, times(theirs ? [ours, theirs] : [ours], Number(rate)), (time, floor) => {
      for (const each of seek) each(time);
      return { surface: worstVertex(pairs, floor), node: worstNode(bare, truth.nodes, objects) };
    });
  });
  const ignored = truth.ignored.map((each) => ({ file: "truth", ...each }));
  ignored.push(...other.ignored.map((each) => ({ file: "other", ...each })));
  return {
    diagonal_m: size,
    surfaces: pairs.length,
    surfaces_by_vertex: own,
    clips: judged.map((each) => named(each, truth)),
    missing_clips: clips.missing,
    extra_clips: clips.extra,
    unmatched_nodes: truth.names.filter((_, i) => truth.nodes[i] && !objects[i]),
    ignored_channels: ignored,
  };
}

async function prepared(modules, file) {
  const scene = await open(modules, file);
  scene.root.updateMatrixWorld(true);
  return { ...scene, surfaces: surfaces(scene), rest: resting(scene) };
}

function clip(ours, theirs, moments, look) {
  const surface = { distance: 0 };
  const node = { distance: 0 };
  for (const time of moments) {
    const found = look(time, surface.distance);
    for (const [best, each] of [[surface, found.surface], [node, found.node]]) {
      if (beats(each.distance, best.distance)) Object.assign(best, each, { time });
    }
  }
  return { ours, theirs, moments, surface, node };
}

function named({ ours, theirs, moments, surface, node }, { names }) {
  return {
    name: ours.name,
    other: theirs?.name ?? null,
    duration_s: ours.duration,
    other_duration_s: theirs?.duration ?? null,
    times: moments.length,
    max_error_m: number(surface.distance),
    node: names[surface.node] ?? "",
    vertex: surface.vertex ?? null,
    time_s: surface.time ?? null,
    bare_error_m: number(node.distance),
    bare_node: names[node.node] ?? "",
    bare_time_s: node.time ?? null,
  };
}

function number(distance) {
  if (!Number.isFinite(distance)) throw new Error("a vertex or node is nowhere: not a number");
  return distance;
}

// Searched only where it could be above `floor`.
function worstVertex(pairs, floor) {
  let worst = { distance: floor };
  for (const [ours, theirs] of pairs) {
    if (!beats(reach(ours, theirs), worst.distance)) continue;
    ours.cloud = placed(ours, ours.cloud);
    theirs.cloud = placed(theirs, theirs.cloud);
    const found = farthest(ours.cloud, theirs.cloud);
    if (beats(found.distance, worst.distance)) worst = { ...found, node: ours.node };
  }
  return worst;
}

function worstNode(bare, nodes, objects) {
  let worst = { distance: 0 };
  for (const number of bare) {
    if (!objects[number]) continue;
    const { distance } = farthest(origin(nodes[number]), origin(objects[number]));
    if (beats(distance, worst.distance)) worst = { distance, node: number };
  }
  return worst;
}

const origin = (node) => (node ? node.matrixWorld.elements.slice(12, 15) : []);

// Numbers of the nodes that no vertex hangs on.
function withoutVertices({ nodes, surfaces: all }) {
  const busy = new Set(all.flatMap(({ carriers, joint }) => [...new Set(joint)].map((each) => carriers[each])));
  return nodes.map((_, i) => i).filter((i) => nodes[i] && !busy.has(nodes[i]));
}

main(...process.argv.slice(2)).then(
  (found) => process.stdout.write(JSON.stringify(found)),
  (error) => {
    process.stderr.write(`${error?.message ?? error}\n`);
    process.exitCode = 1;
  },
);
