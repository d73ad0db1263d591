// The vertices of a scene in flat float64 arrays, with the nodes that carry them; and how far two of them are apart.

const ROUNDING = 1e-6; // weights add up to 1 in float32 only

// Returns one surface for each primitive that the scene shows.
export function surfaces({ nodes }) {
  const found = [];
  for (const [node, object] of nodes.entries()) {
    if (!object) continue;
    const own = object.isMesh ? [object] : object.children.filter((child) => child.isMesh && !nodes.includes(child));
    for (const mesh of own) if (mesh.geometry.attributes.position) found.push(surface(mesh, node, object));
  }
  return found;
}

function surface(mesh, node, object) {
  const { position, skinIndex, skinWeight } = mesh.geometry.attributes;
  const skinned = mesh.isSkinnedMesh && mesh.skeleton;
  const targets = (mesh.geometry.morphAttributes.position ?? []).map((each) => floats(each, 3));
  const points = floats(position, 3);
  const hung = skinned ? influences(floats(skinIndex, 4), floats(skinWeight, 4)) : rigid(position.count);
  return {
    node,
    mesh,
    points,
    targets,
    carriers: skinned ? mesh.skeleton.bones : [object],
    inverses: skinned ? mesh.skeleton.boneInverses.map((each) => each.elements) : [null],
    ...hung,
    boxes: boxes(points, hung),
  };
}

// The box around the vertices that hang on each joint: [joint, low, high].
function boxes(points, { first, joint }) {
  const found = new Map();
  for (let v = 0; v < first.length - 1; v++) {
    for (let i = first[v]; i < first[v + 1]; i++) {
      if (!found.has(joint[i])) found.set(joint[i], [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]]);
      const [low, high] = found.get(joint[i]);
      for (let c = 0; c < 3; c++) {
        low[c] = Math.min(low[c], points[3 * v + c]);
        high[c] = Math.max(high[c], points[3 * v + c]);
      }
    }
  }
  return [...found].map(([number, [low, high]]) => [number, low, high]);
}

// Only influences with weight, one after another; those of vertex v begin at first[v].
function influences(indices, weights) {
  const first = new Int32Array(indices.length / 4 + 1);
  const joint = [];
  const weight = [];
  for (let i = 0; i < indices.length; i++) {
    if (weights[i] !== 0) joint.push(indices[i]), weight.push(weights[i]);
    if (i % 4 === 3) first[(i + 1) / 4] = joint.length;
  }
  return { first, joint: Int32Array.from(joint), weight: Float64Array.from(weight) };
}

function rigid(count) {
  const first = Int32Array.from({ length: count + 1 }, (_, i) => i);
  return { first, joint: new Int32Array(count), weight: new Float64Array(count).fill(1) };
}

function floats(attribute, size) {
  const found = new Float64Array(attribute.count * size);
  for (let i = 0; i < attribute.count; i++) {
    for (let c = 0; c < size; c++) found[i * size + c] = attribute.getComponent(i, c);
  }
  return found;
}

// Returns the same vertices carried by other nodes, and morphed by another mesh's weights.
export function carried(truth, carriers, mesh) {
  return { ...truth, carriers, mesh };
}

// Returns the vertices (3 V) where they are now, in world space; the nodes' world matrices must be up to date.
export function placed(surface, into = new Float64Array(surface.points.length)) {
  const matrices = bound(surface);
  const points = morphed(surface);
  const { first, joint, weight } = surface;
  for (let v = 0, at = 0; v < first.length - 1; v++, at += 3) {
    const x = points[at], y = points[at + 1], z = points[at + 2];
    let px = 0, py = 0, pz = 0;
    for (let i = first[v]; i < first[v + 1]; i++) {
      const m = 12 * joint[i], w = weight[i];
      px += w * (matrices[m] * x + matrices[m + 3] * y + matrices[m + 6] * z + matrices[m + 9]);
      py += w * (matrices[m + 1] * x + matrices[m + 4] * y + matrices[m + 7] * z + matrices[m + 10]);
      pz += w * (matrices[m + 2] * x + matrices[m + 5] * y + matrices[m + 8] * z + matrices[m + 11]);
    }
    into[at] = px, into[at + 1] = py, into[at + 2] = pz;
  }
  return into;
}

// Returns a distance beyond which no vertex can be from its counterpart now: a displacement is convex, so it is largest
// in a corner of a joint's box, and a blend of joints is no worse than the worst. Only for the same unmorphed vertices.
export function reach(ours, theirs) {
  if (ours.targets.length || !same(ours, theirs)) return Infinity;
  const a = bound(ours), b = bound(theirs);
  let most = 0;
  for (const [joint, low, high] of ours.boxes) {
    const m = 12 * joint;
    for (let corner = 0; corner < 8; corner++) {
      const [x, y, z] = [0, 1, 2].map((c) => ((corner >> c) & 1 ? high[c] : low[c]));
      let square = 0;
      for (let row = m; row < m + 3; row++) {
        const across = (a[row] - b[row]) * x + (a[row + 3] - b[row + 3]) * y + (a[row + 6] - b[row + 6]) * z;
        square += (across + a[row + 9] - b[row + 9]) ** 2;
      }
      if (beats(square, most)) most = square;
    }
  }
  return Math.sqrt(most) * (1 + ROUNDING);
}

function same(ours, theirs) {
  theirs.asOurs ??= ["points", "joint", "weight", "first"].every(
    (key) => ours[key] === theirs[key] || (ours[key].length === theirs[key].length && ours[key].every((each, i) => each === theirs[key][i])),
  );
  return theirs.asOurs;
}

function morphed({ points, targets, mesh }) {
  if (!targets.length) return points;
  const found = Float64Array.from(points);
  for (const [number, target] of targets.entries()) {
    const share = mesh.morphTargetInfluences[number];
    if (share) for (let i = 0; i < found.length; i++) found[i] += share * target[i];
  }
  return found;
}

// World matrix times inverse bind matrix of every carrier: three columns and the offset, 12 numbers each.
function bound({ carriers, inverses }) {
  const found = new Float64Array(12 * carriers.length);
  for (const [number, carrier] of carriers.entries()) {
    const a = carrier.matrixWorld.elements, b = inverses[number];
    for (let column = 0; column < 4; column++) {
      for (let row = 0; row < 3; row++) {
        let sum = b ? 0 : a[4 * column + row];
        if (b) for (let k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
        found[12 * number + 3 * column + row] = sum;
      }
    }
  }
  return found;
}

// Whether a is larger; what is not a number is larger than anything, and stays.
export const beats = (a, b) => a > b || (Number.isNaN(a) && !Number.isNaN(b));

// Returns {distance, vertex} of the two points (3 V) that are farthest apart.
export function farthest(a, b) {
  let most = 0, vertex = 0;
  for (let i = 0; i < a.length; i += 3) {
    const x = a[i] - b[i], y = a[i + 1] - b[i + 1], z = a[i + 2] - b[i + 2];
    const square = x * x + y * y + z * z;
    if (beats(square, most)) (most = square), (vertex = i / 3);
  }
  return { distance: Math.sqrt(most), vertex };
}

// Returns the length of the diagonal of the box around all points.
export function diagonal(clouds) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const points of clouds) {
    for (let i = 0; i < points.length; i++) {
      low[i % 3] = Math.min(low[i % 3], points[i]);
      high[i % 3] = Math.max(high[i % 3], points[i]);
    }
  }
  return low[0] <= high[0] ? Math.hypot(...high.map((each, i) => each - low[i])) : 0;
}
