// A measuring grid over a plane surface, with the spacing of EN 12464-1: p = 0.2 · 5^lg d, d the longer side.
import { Vector3 } from 'three';
import { DataUtils } from 'three';
import { corners, type Hit } from './stage';
import { UNIT, type Surface } from './surface';

/** A point of a grid. */
export interface GridPoint {
  point: Vector3;
  lux: number;
}

/** A grid that was measured. */
export interface Grid {
  points: GridPoint[];
  normal: Vector3;
  /** Metres between points. */
  spacing: number;
  size: [number, number];
  least: number;
  mean: number;
  largest: number;
  /** Least over mean. */
  uniformity: number;
}

/** Farthest from the plane of the picked triangle, as a share of the size; and by how much normals may differ. */
const FLAT = 1e-3;
const PARALLEL = 0.9995;

/** Illuminance at the vertices of a triangle, lx. */
function lux(surface: Surface, triangle: number): number[] {
  const values = surface.light.array as Uint16Array;
  const index = surface.geometry.index!;
  return [0, 1, 2].map((k) => {
    const at = 3 * index.getX(3 * triangle + k);
    const [r, g, b] = [0, 1, 2].map((band) => UNIT * DataUtils.fromHalfFloat(values[at + band]));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  });
}

export function grid({ surface, triangle }: Hit): Grid | null {
  const world = (k: number) => corners(surface, k).map((p) => p.applyMatrix4(surface.matrixWorld));
  const first = world(triangle);
  const normalOf = ([a, b, c]: Vector3[]) => b.clone().sub(a).cross(c.clone().sub(a)).normalize();
  const normal = normalOf(first);
  const origin = first[0];
  surface.geometry.boundingSphere ?? surface.geometry.computeBoundingSphere();
  const thick = FLAT * Math.max(1e-3, surface.geometry.boundingSphere!.radius * surface.matrixWorld.getMaxScaleOnAxis());

  // Axes along the surface: level where there is a level direction.
  const up = new Vector3(0, 1, 0);
  const u = (Math.abs(normal.dot(up)) < 0.99 ? up.clone().cross(normal) : new Vector3(1, 0, 0).cross(normal).cross(normal).negate()).normalize();
  const v = normal.clone().cross(u);
  const flat = (p: Vector3): [number, number] => [p.clone().sub(origin).dot(u), p.clone().sub(origin).dot(v)];

  const triangles: { flat: [number, number][]; lux: number[] }[] = [];
  const [low, high] = [[Infinity, Infinity], [-Infinity, -Infinity]];
  for (let k = 0; k < surface.geometry.index!.count / 3; k += 1) {
    const points = world(k);
    if (normalOf(points).dot(normal) < PARALLEL) continue;
    if (points.some((p) => Math.abs(p.clone().sub(origin).dot(normal)) > thick)) continue;
    const at = points.map(flat);
    for (const p of at) {
      for (const axis of [0, 1]) {
        low[axis] = Math.min(low[axis], p[axis]);
        high[axis] = Math.max(high[axis], p[axis]);
      }
    }
    triangles.push({ flat: at, lux: lux(surface, k) });
  }
  const size: [number, number] = [high[0] - low[0], high[1] - low[1]];
  const [longer, shorter] = [Math.max(...size), Math.min(...size)];
  if (!(shorter > 0)) return null;
  const spacing = Math.min(10, 0.2 * 5 ** Math.log10(longer), shorter / 2);
  const counts = size.map((side) => Math.max(2, Math.min(60, Math.round(side / spacing))));
  const points: GridPoint[] = [];
  for (let j = 0; j < counts[1]; j += 1) {
    for (let i = 0; i < counts[0]; i += 1) {
      const at: [number, number] = [low[0] + ((i + 0.5) / counts[0]) * size[0], low[1] + ((j + 0.5) / counts[1]) * size[1]];
      const value = look(triangles, at);
      if (value === null) continue;
      points.push({ point: origin.clone().addScaledVector(u, at[0]).addScaledVector(v, at[1]), lux: value });
    }
  }
  if (points.length === 0) return null;
  const values = points.map((p) => p.lux);
  const mean = values.reduce((a, b) => a + b, 0) / values.length;
  const least = Math.min(...values);
  return { points, normal, spacing: longer / Math.max(...counts), size, least, mean, largest: Math.max(...values), uniformity: mean > 0 ? least / mean : 0 };
}

function look(triangles: { flat: [number, number][]; lux: number[] }[], [x, y]: [number, number]): number | null {
  for (const { flat: [a, b, c], lux: values } of triangles) {
    const double = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
    const v = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / double;
    const w = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / double;
    if (v >= -1e-9 && w >= -1e-9 && v + w <= 1 + 1e-9) return values[0] * (1 - v - w) + values[1] * v + values[2] * w;
  }
  return null;
}
