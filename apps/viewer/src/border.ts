// Cracks between surfaces. Elements of neighbours are cut as finely as each of them needs, so that corners of one lie on an edge
// of the other, and rounding leaves pixels between them through which one sees what is behind: the sky through a wall. Surfaces
// are drawn a tenth of a pixel beyond their borders instead, where the neighbour's are, too.

/** Pixels by which borders are drawn farther out: more than places on the screen are rounded by (graphics hardware may do so to
 *  1/16), and too few to be seen. Faces seen at an angle go as far: with less, by how narrow they look, cracks in hedges opened
 *  again. */
const BEYOND = 0.1;

/** Moves what is drawn at the border of a surface: `at` is where it is in clip space, `way` what one more `outward` adds to that. */
export const WIDEN = /* glsl */ `
  uniform vec2 pixels;
  vec4 widened(vec4 at, vec4 way) {
    // By how much it goes on the screen, in pixels and by the square of the distance.
    vec2 step = (way.xy * at.w - at.xy * way.w) * pixels;
    float size = length(step);
    return size > 0.0 ? at + vec4(step / size * ${(2 * BEYOND).toFixed(2)} / pixels * at.w, 0.0, 0.0) : at;
  }
`;

/** For each vertex the direction away from the surface, in its plane; zero within it. A border is an edge of one triangle only. */
export function outwards(positions: ArrayLike<number>, indices: ArrayLike<number>): Float32Array {
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
  const out = new Float32Array(positions.length);
  const at = (corner: number, axis: number) => positions[3 * indices[corner] + axis];
  for (let corner = 0; corner < indices.length; corner += 1) {
    if (!single.has(keys[corner])) continue;
    const [from, to] = [corner, next(corner)];
    const third = next(to);
    // From the third corner to the edge, square to it.
    const edge = [0, 1, 2].map((axis) => at(to, axis) - at(from, axis));
    const side = [0, 1, 2].map((axis) => at(from, axis) - at(third, axis));
    const dot = (a: number[], b: number[]) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const share = dot(side, edge) / Math.max(dot(edge, edge), Number.MIN_VALUE);
    const away = side.map((x, axis) => x - share * edge[axis]);
    const length = Math.sqrt(dot(away, away));
    if (!(length > 0)) continue;
    for (const vertex of [indices[from], indices[to]]) {
      for (let axis = 0; axis < 3; axis += 1) out[3 * vertex + axis] += away[axis] / length;
    }
  }
  // Where an edge of one side goes on as two of the other, both sides pull at its ends and these stay; only rounding is left.
  for (let vertex = 0; vertex < vertices; vertex += 1) {
    const own = out.subarray(3 * vertex, 3 * vertex + 3);
    if (Math.hypot(own[0], own[1], own[2]) < 1e-3) own.fill(0);
  }
  return out;
}
