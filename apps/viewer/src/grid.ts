// A measuring grid over a plane surface. Its cells are as EN 12464-1 asks: no longer than p = 0.2 · 5^lg d and 10 m, d the
// longer side, or the shorter one where that is half of it or less. The number of cells is rounded up, so that they are
// never larger. A grid stays where it was laid, goes with its surface, and is read again when light changes.
import { DoubleSide, Ray, Vector3 } from 'three';
import { barycentric, corners, type Place, type Stage } from './stage';
import type { Surface } from './surface';
import type { SurveyAnswer } from './wire';

/** A point of a grid, and where on the surface it is: weights of the triangle's corners 1 and 2. */
export interface GridPoint {
  point: Vector3;
  triangle: number;
  uv: [number, number];
  /** Of all light as it was measured there, or of another layer as it is shown. */
  lux: number;
  /** What was measured there last; none before. */
  measured: number | null;
  /** Whether it lies beneath something: it does not count then. */
  isCovered: boolean;
}

/** A grid that was laid. */
export interface Grid {
  surface: Surface;
  /** Where it was picked: the triangle, and weights of its corners 1 and 2. */
  picked: Pick<GridPoint, 'triangle' | 'uv'>;
  /** All of them; figures are of those that are not covered. */
  points: GridPoint[];
  /** Sides of the surface and of a cell, metres. */
  size: [number, number];
  cell: [number, number];
  /** Whether there would be more points than can be shown, so that cells are larger than the standard has them. */
  isCoarse: boolean;
  normal: Vector3;
  least: number;
  mean: number;
  largest: number;
  /** Least over mean. */
  uniformity: number;
  /** Of what was measured last. */
  answer: SurveyAnswer | null;
  /** The points that are being measured. */
  asked: GridPoint[];
}

/** Farthest from the plane of the picked triangle, as a share of the size; and by how much normals may differ. */
const FLAT = 1e-3;
const PARALLEL = 0.9995;

/** The largest cell of the standard, metres. */
const LARGEST = 10;

/** Most points: more are too many to draw and to read, and take seconds to measure. */
const MOST = 4000;

/** How many cells a surface with these sides has each way. */
export function cells(size: [number, number]): [number, number] {
  const [longer, shorter] = [Math.max(...size), Math.min(...size)];
  const d = longer >= 2 * shorter ? shorter : longer;
  const p = Math.min(LARGEST, 0.2 * 5 ** Math.log10(d));
  // What is a whole number but for rounding is that number.
  return [Math.ceil(size[0] / p - 1e-9), Math.ceil(size[1] / p - 1e-9)];
}

/** Directions that differ by less are taken for one: parts of a quarter turn. */
const DIRECTIONS = 900;

/** A rectangle around points of a plane: its axes, and its corners along them. One side is level; where all are, it is the
 * smallest with a side along one of `sides` (Freeman and Shapira 1975). */
export function rectangle(points: Vector3[], origin: Vector3, normal: Vector3, sides: Vector3[]) {
  const up = new Vector3(0, 1, 0);
  const isLevel = Math.abs(normal.dot(up)) >= 0.99;
  const right = isLevel ? new Vector3(1, 0, 0).cross(normal).cross(normal).negate().normalize() : up.cross(normal).normalize();
  const forward = normal.clone().cross(right);
  const flat = points.map((p) => [p.dot(right) - origin.dot(right), p.dot(forward) - origin.dot(forward)]);
  const turned = (angle: number) => {
    const [cosine, sine] = [Math.cos(angle), Math.sin(angle)];
    const [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
    for (const [x, y] of flat) {
      [cosine * x + sine * y, cosine * y - sine * x].forEach((at, i) => {
        low[i] = Math.min(low[i], at);
        high[i] = Math.max(high[i], at);
      });
    }
    return { angle, low, high, area: (high[0] - low[0]) * (high[1] - low[1]) };
  };
  let best = turned(0);
  const tried = new Set([0]);
  for (const side of isLevel ? sides : []) {
    const turn = Math.atan2(side.dot(forward), side.dot(right)) / (Math.PI / 2);
    const direction = Math.round((turn - Math.floor(turn)) * DIRECTIONS) % DIRECTIONS;
    if (tried.has(direction)) continue;
    tried.add(direction);
    const found = turned((turn - Math.round(turn)) * (Math.PI / 2));
    // By more than rounding.
    if (found.area < best.area * (1 - 1e-6)) best = found;
  }
  const u = right.multiplyScalar(Math.cos(best.angle)).addScaledVector(forward, Math.sin(best.angle));
  return { u, v: normal.clone().cross(u), low: best.low, high: best.high };
}

/** Lays a grid over the plane that was hit. */
export function lay({ surface, triangle, uv }: Place): Grid | null {
  const world = (k: number) => corners(surface, k).map((p) => p.applyMatrix4(surface.matrixWorld));
  const normalOf = ([a, b, c]: Vector3[]) => b.clone().sub(a).cross(c.clone().sub(a)).normalize();
  const first = world(triangle);
  const [origin, normal] = [first[0], normalOf(first)];
  surface.geometry.boundingSphere ?? surface.geometry.computeBoundingSphere();
  const thick = FLAT * Math.max(1e-3, surface.geometry.boundingSphere!.radius * surface.matrixWorld.getMaxScaleOnAxis());

  const own = new Set<number>();
  const sides: Vector3[] = [];
  const around: Vector3[] = [];
  for (let k = 0; k < surface.geometry.index!.count / 3; k += 1) {
    const points = world(k);
    if (normalOf(points).dot(normal) < PARALLEL) continue;
    if (points.some((p) => Math.abs(p.clone().sub(origin).dot(normal)) > thick)) continue;
    own.add(k);
    around.push(...points);
    sides.push(...points.map((p, i) => points[(i + 1) % 3].clone().sub(p)));
  }
  const { u, v, low, high } = rectangle(around, origin, normal, sides);
  const size: [number, number] = [high[0] - low[0], high[1] - low[1]];
  if (!(Math.min(...size) > 0)) return null;
  let counts = cells(size);
  const isCoarse = counts[0] * counts[1] > MOST;
  if (isCoarse) {
    const share = Math.sqrt(MOST / (counts[0] * counts[1]));
    counts = counts.map((count) => Math.max(1, Math.floor(count * share))) as [number, number];
  }
  const cell: [number, number] = [size[0] / counts[0], size[1] / counts[1]];

  // A ray falls on the surface at the middle of each cell; where there is a hole, or something else, there is no point.
  const inverse = surface.matrixWorld.clone().invert();
  const points: GridPoint[] = [];
  for (let j = 0; j < counts[1]; j += 1) {
    for (let i = 0; i < counts[0]; i += 1) {
      const at = origin.clone().addScaledVector(u, low[0] + (i + 0.5) * cell[0]).addScaledVector(v, low[1] + (j + 0.5) * cell[1]);
      const ray = new Ray(at.clone().addScaledVector(normal, 2 * thick), normal.clone().negate()).applyMatrix4(inverse);
      const hit = surface.tree.raycast(ray, DoubleSide).find(({ faceIndex }) => own.has(faceIndex!));
      if (hit) points.push({ point: at, triangle: hit.faceIndex!, uv: barycentric(surface, hit.faceIndex!, hit.point), lux: 0, measured: null, isCovered: false });
    }
  }
  if (points.length === 0) return null;
  const picked = { triangle, uv };
  const grid: Grid = { surface, picked, points, size, cell, isCoarse, normal, least: 0, mean: 0, largest: 0, uniformity: 0, answer: null, asked: [] };
  return grid;
}

/** Puts the points of a grid where its surface is now; what comes back is where it was picked. */
export function follow(grid: Grid): Vector3 {
  const { surface } = grid;
  const place = ({ triangle, uv: [v, w] }: Grid['picked']) => {
    const [a, b, c] = corners(surface, triangle).map((corner) => corner.applyMatrix4(surface.matrixWorld));
    grid.normal.copy(b.clone().sub(a).cross(c.clone().sub(a)).normalize());
    return a.multiplyScalar(1 - v - w).addScaledVector(b, v).addScaledVector(c, w);
  };
  grid.points.forEach((point) => point.point.copy(place(point)));
  return place(grid.picked);
}

/** The points of a grid that count. */
export function open({ points }: Grid): GridPoint[] {
  return points.filter((point) => !point.isCovered);
}

/** Reads a grid: what was measured, or of a layer that is no whole light, and before anything is measured, what is shown. */
export function read(grid: Grid, isWhole: boolean, stage: Stage): void {
  const lux = open(grid).map((point) => {
    point.lux = (isWhole ? point.measured : null) ?? stage.lux(grid.surface, point.triangle, point.uv);
    return point.lux;
  });
  grid.mean = lux.reduce((a, b) => a + b, 0) / Math.max(1, lux.length);
  [grid.least, grid.largest] = lux.reduce(([least, largest], x) => [Math.min(least, x), Math.max(largest, x)], [Infinity, 0]);
  grid.uniformity = grid.mean > 0 ? grid.least / grid.mean : 0;
}
