// Places for the numbers of isolines. Between neighbouring pixels of the meter's picture the light passes a level, if it does, about
// where the logarithm says; rays from the eye find the place on the surface, as exactly as the line is drawn.
import type { Vector3 } from 'three';
import type { App } from './app';
import { METER, type Stage } from './stage';

/** Farther apart than this factor, two pixels are of different surfaces, or lines lie too close for numbers. */
const STEEP = 1.5;

/** How far what is read may be from its level, as a factor less one: lines are some percent wide. */
const NEAR = 0.01;

/** CSS pixels from one number to another, and to another of the same level. */
const APART = 48;
const SAME_APART = 220;

/** Places on the isolines that are seen, and their levels. */
export function places({ stage, exposure }: App): { point: Vector3; lux: number }[] {
  if (!exposure.seen) return [];
  const { picture } = exposure.seen;
  const [width, height] = METER;
  const { clientWidth, clientHeight } = stage.canvas;
  const found: { point: Vector3; lux: number; x: number; y: number }[] = [];
  for (let j = 1; j < height - 1; j += 1) {
    for (let i = 1; i < width - 1; i += 1) {
      const at = j * width + i;
      for (const [right, up] of [[1, 0], [0, 1]]) {
        const [a, b] = [picture[at], picture[at + right + up * width]];
        if (!(a > 0 && b > 0) || Math.max(a, b) > STEEP * Math.min(a, b)) continue;
        const lux = exposure.levels.find((level) => (a - level) * (b - level) < 0);
        if (lux === undefined) continue;
        const share = Math.log(lux / a) / Math.log(b / a);
        const [x, y] = [((i + 0.5 + right * share) / width) * clientWidth, (1 - (j + 0.5 + up * share) / height) * clientHeight];
        if (found.some((other) => Math.hypot(other.x - x, other.y - y) < (other.lux === lux ? SAME_APART : APART))) continue;
        const point = along(stage, lux, [a, b], (t) => [(2 * (i + 0.5 + right * t)) / width - 1, (2 * (j + 0.5 + up * t)) / height - 1]);
        if (point) found.push({ point, lux, x, y });
      }
    }
  }
  return found;
}

/** The place between two places of the canvas that has a level, by false position. */
function along(stage: Stage, level: number, [a, b]: number[], place: (t: number) => number[]): Vector3 | null {
  let [from, to] = [{ t: 0, log: Math.log(a / level) }, { t: 1, log: Math.log(b / level) }];
  for (let step = 0; step < 3; step += 1) {
    const t = from.t + ((to.t - from.t) * from.log) / (from.log - to.log);
    const [x, y] = place(t);
    const hit = stage.pick(x, y);
    const log = hit ? Math.log(stage.lux(hit.surface, hit.triangle, hit.uv) / level) : NaN;
    if (hit && Math.abs(log) < NEAR) return hit.point;
    if (!Number.isFinite(log)) return null;
    if (log * from.log > 0) from = { t, log };
    else to = { t, log };
  }
  return null;
}
