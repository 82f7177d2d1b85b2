// What tests read from the page and do to it, as `window.radiosity`.
import { DataUtils, Vector3 } from 'three';
import type { App } from './app';
import { luminance } from './luminance';
import { corners } from './stage';
import { UNIT } from './surface';

export function tests(app: App) {
  /** Illuminance at a point of a surface, lx: interpolated as it is drawn. `normal` says on which side. */
  const lux = ([x, y, z, nx, ny, nz]: number[]): number | null => {
    const point = app.stage.root.localToWorld(new Vector3(x, y, z));
    const normal = new Vector3(nx, ny, nz).transformDirection(app.stage.root.matrixWorld);
    const size = app.stage.bounds.getSize(new Vector3()).length();
    const hit = app.stage.cast(point.clone().addScaledVector(normal, 2e-4 * size), normal.clone().negate(), 1e-3 * size);
    if (!hit) return null;
    const values = hit.surface.light.array as Uint16Array;
    const index = hit.surface.geometry.index!;
    const weights = [1 - hit.uv[0] - hit.uv[1], ...hit.uv];
    return luminance([0, 1, 2].map((band) => UNIT * weights.reduce((mean, weight, k) =>
      mean + weight * DataUtils.fromHalfFloat(values[3 * index.getX(3 * hit.triangle + k) + band]), 0)));
  };
  return {
    app,
    lux,
    /** Points spread over the surfaces by area, x, y, z and the normal, in the scene's axes. */
    points(count: number): number[][] {
      const found: { area: number; make(): number[] }[] = [];
      for (const surface of app.stage.surfaces.values()) {
        if (!surface.visible) continue;
        for (let k = 0; k < surface.geometry.index!.count / 3; k += 1) {
          const [a, b, c] = corners(surface, k).map((p) => p.applyMatrix4(surface.matrix));
          const cross = b.clone().sub(a).cross(c.clone().sub(a));
          found.push({
            area: cross.length() / 2,
            make: () => [...a.clone().add(b).add(c).divideScalar(3).toArray(), ...cross.clone().normalize().toArray()],
          });
        }
      }
      const total = found.reduce((sum, { area }) => sum + area, 0);
      const points: number[][] = [];
      let passed = 0;
      for (const { area, make } of found) {
        passed += area;
        if (passed >= ((points.length + 0.5) * total) / count) points.push(make());
      }
      return points;
    },
    state: () => ({
      isCaughtUp: app.isCaughtUp,
      opened: app.opened,
      isConnected: app.isConnected,
      status: app.status,
      message: app.message,
      objects: [...app.objects.values()],
      lights: [...app.lights.values()],
      selected: app.selected,
      undo: app.undoable,
      redo: app.redoable,
      bookmarks: app.bookmarks,
      camera: app.stage.place('').matrix,
      mode: app.navigator.mode,
      frames: app.stage.frames,
      received: app.connection.received,
      grid: app.grid && { least: app.grid.least, mean: app.grid.mean, largest: app.grid.largest, count: app.grid.points.length },
      probe: app.probed?.answer ?? null,
      exposure: app.exposure.value,
    }),
    /** Frames a second while the camera turns without pause. */
    frameRate: (seconds: number) => new Promise<number>((done) => {
      const begin = performance.now();
      let frames = 0;
      const tick = () => {
        app.stage.camera.rotateY(0.01);
        app.stage.change();
        frames += 1;
        const passed = (performance.now() - begin) / 1000;
        if (passed < seconds) requestAnimationFrame(tick);
        else done(frames / passed);
      };
      requestAnimationFrame(tick);
    }),
  };
}
