// Points on the surfaces of a lit model, spread by area, to compare what is shown with what is measured:
//   node sample.mjs LIT.glb [--points 2000] [--edges 500] [--seed 1] > POINTS.csv
// Columns x,y,z,nx,ny,nz (metres, glTF's +Y up; the normal is the interpolated one that the surface is lit with), kind
// and texel. Kind is `area` for points at least one texel away from every border of the light's layout and from every
// other surface, `edge` for the others, of which about --edges are added. A texel is the width of a lightmap texel, or
// the longest edge of the triangle where light is at vertices. Points inside solids, which nobody sees, are left out.
import { fileURLToPath } from 'node:url';
import { parseArgs } from 'node:util';
import { add, dot, length, mix, mul, readGlb, sub, unit } from './glb.mjs';
import { Tree, cosineDirection, toSegment } from './tree.mjs';

/// Rays that decide whether a point is inside a solid: it is when 7 in 8 of them meet backs.
const PROBES = 16;

/// Most candidates for each edge point asked for: a scene without edges shall end as well.
const TRIES = 40;

/// `edges` points near edges are drawn after the `count` points by area, which keep their mix of both kinds.
export async function sample(path, count, edges, seed) {
  const model = await readGlb(path);
  const { triangles, size } = model;
  const tree = new Tree(triangles);
  const patches = layout(triangles, size);
  const texel = triangles.map(texelOf);
  const random = numbers(seed);

  const starts = [0];
  for (const triangle of triangles) starts.push(starts[starts.length - 1] + triangle.area);
  const total = starts[triangles.length];
  const pick = (wanted) => {
    let [low, high] = [0, triangles.length];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (starts[middle] <= wanted) low = middle;
      else high = middle;
    }
    return low;
  };
  const buried = (point, { normal }) => {
    const start = add(point, mul(normal, 1e-6 * size));
    let backs = 0;
    for (let k = 0; k < PROBES; k++) {
      backs += tree.first(start, cosineDirection(normal, (k + random()) / PROBES, random()), 1e-9 * size) === 'back';
    }
    return backs >= (7 / 8) * PROBES;
  };
  const point = (index) => {
    const triangle = triangles[index];
    const [root, v] = [Math.sqrt(random()), random()];
    const weights = [1 - root, root * (1 - v), root * v];
    const place = mix(triangle.corners, weights);
    let normal = triangle.normals ? unit(mix(triangle.normals, weights)) : triangle.normal;
    // As in the program: a normal that points to the other side is a mistake of the file.
    if (!(dot(normal, triangle.normal) > 0.1)) normal = triangle.normal;
    const [patch, reach] = [patches.of[index], texel[index]];
    const other = (i) => patches.of[i] !== patch && !coplanar(triangles[i], triangle, size)
      && inFront(triangles[i], place, triangle.normal, size);
    const edge = patches.borders[patch].some(([a, b]) => toSegment(place, a, b) < reach) || tree.near(place, reach, other);
    return { point: place, normal, flat: triangle.normal, kind: edge ? 'edge' : 'area', texel: reach, triangle, weights };
  };

  const points = [];
  for (let i = 0; i < count; i++) {
    const found = point(pick(((i + random()) / count) * total));
    if (!buried(found.point, found.triangle)) points.push(found);
  }
  for (let [found, tries] = [0, 0]; found < edges && tries < TRIES * edges; tries++) {
    const extra = point(pick(random() * total));
    if (extra.kind === 'edge' && !buried(extra.point, extra.triangle)) {
      points.push(extra);
      found++;
    }
  }
  return { points, model };
}

/// Patches of triangles over which light is laid out in one piece, and the edges that end each.
function layout(triangles, size) {
  const grid = 1e-6 * size;
  const key = (triangle, k) => {
    const carried = triangle.uvs?.[k] ?? triangle.light?.[k] ?? [];
    const place = triangle.corners[k].map((x) => Math.round(x / grid));
    return [...place, triangle.page, ...carried.map((x) => x.toPrecision(5))].join();
  };
  const edges = new Map();
  triangles.forEach((triangle, t) => {
    const keys = [0, 1, 2].map((k) => key(triangle, k));
    for (let k = 0; k < 3; k++) {
      const [a, b] = [keys[k], keys[(k + 1) % 3]];
      const name = a < b ? `${a}|${b}` : `${b}|${a}`;
      if (!edges.has(name)) edges.set(name, []);
      edges.get(name).push([t, k]);
    }
  });
  const parent = triangles.map((_, i) => i);
  const root = (i) => {
    while (parent[i] !== i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const open = [];
  for (const users of edges.values()) {
    const smooth = users.length === 2 && dot(triangles[users[0][0]].normal, triangles[users[1][0]].normal) > 0.5;
    if (smooth) parent[root(users[0][0])] = root(users[1][0]);
    else open.push(...users);
  }
  const of = triangles.map((_, i) => root(i));
  const borders = triangles.map(() => []);
  for (const [t, k] of open) borders[of[t]].push([triangles[t].corners[k], triangles[t].corners[(k + 1) % 3]]);
  return { of, borders };
}

/// Whether a triangle lies in the plane of another.
function coplanar(other, triangle, size) {
  return other.corners.every((p) => Math.abs(dot(sub(p, triangle.corners[0]), triangle.normal)) < 1e-6 * size);
}

/// Whether some of a triangle stands before a surface at `point`; what lies behind casts no shadow on it.
function inFront(other, point, normal, size) {
  return other.corners.some((p) => dot(sub(p, point), normal) > -1e-6 * size);
}

/// Width of a texel, metres.
function texelOf({ corners, uvs, pageSize, area }) {
  if (!uvs) return Math.max(...[0, 1, 2].map((k) => length(sub(corners[k], corners[(k + 1) % 3]))));
  const [width, height] = pageSize;
  const [a, b, c] = uvs.map(([u, v]) => [u * width, v * height]);
  const texels = 0.5 * Math.abs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
  // A chart thinner than half a texel is one row of them: its width says nothing, its length does.
  const side = Math.max(...[[a, b], [b, c], [c, a]].map(([p, q]) => Math.hypot(q[0] - p[0], q[1] - p[1])));
  const along = Math.max(...[0, 1, 2].map((k) => length(sub(corners[k], corners[(k + 1) % 3]))));
  return texels > 1e-3 ? Math.sqrt(area / texels) : along / Math.max(side, 1);
}

/// Uniform numbers in 0..1 (mulberry32).
function numbers(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 2 ** 32;
  };
}

export function csv(points) {
  const rows = points.map(({ point, normal, kind, texel }) =>
    [...point.map((x) => x.toFixed(7)), ...normal.map((x) => x.toFixed(7)), kind, texel.toPrecision(4)].join());
  return ['x,y,z,nx,ny,nz,kind,texel', ...rows].join('\n') + '\n';
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const { values, positionals } = parseArgs({
    allowPositionals: true,
    options: {
      points: { type: 'string', default: '2000' },
      edges: { type: 'string', default: '500' },
      seed: { type: 'string', default: '1' },
    },
  });
  if (positionals.length !== 1) {
    console.error('usage: node sample.mjs LIT.glb [--points 2000] [--edges 500] [--seed 1] > POINTS.csv');
    process.exit(2);
  }
  const { points } = await sample(positionals[0], Number(values.points), Number(values.edges), Number(values.seed));
  process.stdout.write(csv(points));
}
