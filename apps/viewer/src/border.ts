// Cracks between surfaces. Elements of neighbours are cut as finely as each of them needs, so that corners of one lie on an edge
// of the other, and rounding leaves pixels between them through which one sees what is behind: the sky through a wall. Surfaces
// are drawn a tenth of a pixel beyond their borders instead, where the neighbour's are, too.

/** Pixels by which borders are drawn farther out: more than places on the screen are rounded by (graphics hardware may do so to
 *  1/16), and too few to be seen. They go as far square to each edge as it is seen: where they went along the surface, cracks opened in
 *  ceilings that are seen at an angle. */
const BEYOND = 0.1;

/** Least cosine of angles between ways that are opposite, but for its sign. */
const OPPOSITE = 0.9999;

/** What stands for 1. */
const ONE = 32767;

const dot = (a: number[], b: number[]) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Moves what is drawn at the border of a surface, which has `before` and `after` for ways along it: `at` is where it is in clip space. */
export const WIDEN = /* glsl */ `
  uniform vec2 pixels;
  in vec3 before;
  in vec3 after;
  // Square to a way on the screen: the surface is on its left.
  vec2 square(vec4 at, vec4 way) {
    vec2 step = (way.xy * at.w - at.xy * way.w) * pixels;
    float size = length(step);
    return size > 0.0 ? vec2(step.y, -step.x) / size : vec2(0.0);
  }
  vec4 widened(vec4 at, mat4 placed) {
    vec2 a = square(at, placed * vec4(before, 0.0));
    vec2 b = square(at, placed * vec4(after, 0.0));
    // As far from both, but for spikes.
    vec2 move = (a + b) / max(1.0 + dot(a, b), 0.5);
    return at + vec4(move * ${(2 * BEYOND).toFixed(2)} / pixels * at.w, 0.0, 0.0);
  }
`;

/** Two ways along the border of a surface at each of its vertices. */
export interface Borders {
  before: Int16Array;
  after: Int16Array;
}

/** Of a surface without borders. */
export const unbordered = (vertices: number): Borders => ({ before: new Int16Array(3 * vertices), after: new Int16Array(3 * vertices) });

/** The ways along the border of a surface at each vertex, anticlockwise; zero within it. A border is an edge of one triangle only. */
export function bordersOf(positions: ArrayLike<number>, indices: ArrayLike<number>): Borders {
  const vertices = positions.length / 3;
  const key = (from: number, to: number) => Math.min(from, to) * vertices + Math.max(from, to);
  const keys = new Float64Array(indices.length);
  const next = (corner: number) => (corner % 3 === 2 ? corner - 2 : corner + 1);
  for (let corner = 0; corner < indices.length; corner += 1) keys[corner] = key(indices[corner], indices[next(corner)]);
  const sorted = keys.slice().sort();
  const single = new Set<number>();
  for (let i = 0; i < sorted.length; i += 1) {
    if (sorted[i] !== sorted[i - 1] && sorted[i] !== sorted[i + 1]) single.add(sorted[i]);
  }
  const ways = new Map<number, number[][]>();
  for (let corner = 0; corner < indices.length; corner += 1) {
    if (!single.has(keys[corner])) continue;
    const [from, to] = [indices[corner], indices[next(corner)]];
    const edge = [0, 1, 2].map((axis) => positions[3 * to + axis] - positions[3 * from + axis]);
    const length = Math.sqrt(dot(edge, edge));
    if (!(length > 0)) continue;
    for (const vertex of [from, to]) {
      const own = ways.get(vertex) ?? [];
      own.push(edge.map((x) => x / length));
      ways.set(vertex, own);
    }
  }
  const borders = unbordered(vertices);
  for (const [vertex, own] of ways) {
    // Where an edge of one side goes on as two of the other, their common ends stay on the line, and corners between them cross it.
    const left = own.filter((way) => !own.some((other) => dot(way, other) < -OPPOSITE));
    if (left.length === 0) continue;
    // Of more than two, one and that which differs most from it.
    const before = left[0];
    const after = left.reduce((most, way) => (dot(way, before) < dot(most, before) ? way : most));
    borders.before.set(before.map((x) => Math.round(ONE * x)), 3 * vertex);
    borders.after.set(after.map((x) => Math.round(ONE * x)), 3 * vertex);
  }
  return borders;
}
