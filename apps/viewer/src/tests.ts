// What tests read from the page and do to it, as `window.radiosity`.
import { DataUtils, Vector3 } from 'three';
import type { App } from './app';
import { corners, type Hit } from './stage';
import { UNIT } from './surface';

export function tests(app: App) {
  /** A vertex attribute at a point of a surface, interpolated as it is drawn. */
  const interpolated = ({ surface, triangle, uv }: Hit, at: (vertex: number, band: number) => number): number[] => {
    const index = surface.geometry.index!;
    const weights = [1 - uv[0] - uv[1], ...uv];
    return [0, 1, 2].map((band) => weights.reduce((sum, weight, k) => sum + weight * at(index.getX(3 * triangle + k), band), 0));
  };
  const light = ({ surface, triangle, uv }: Hit) => app.stage.light(surface, triangle, uv);
  const behind = (hit: Hit) => {
    const { surface } = hit;
    const values = surface.light.array as Uint16Array;
    return surface.isSheet ? interpolated(hit, (vertex, band) => UNIT * DataUtils.fromHalfFloat(values[3 * surface.otherSide[vertex] + band])) : [0, 0, 0];
  };
  /** Illuminance at a point of a surface, lx. `normal` says on which side. */
  const lux = ([x, y, z, nx, ny, nz]: number[]): number | null => {
    const point = app.stage.root.localToWorld(new Vector3(x, y, z));
    const normal = new Vector3(nx, ny, nz).transformDirection(app.stage.root.matrixWorld);
    const size = app.stage.bounds.getSize(new Vector3()).length();
    const hit = app.stage.cast(point.clone().addScaledVector(normal, 2e-4 * size), normal.clone().negate(), 1e-3 * size);
    return hit && app.stage.lux(hit.surface, hit.triangle, hit.uv);
  };
  return {
    app,
    lux,
    /** The picture that is drawn now, with all pixels and without what is drawn over it, at places of the canvas (shares of
     *  its sides, from above left); and what is known there of the light that it should show. None where there is nothing,
     *  or an edge. Where pixels are few, light changes much across one. */
    seen(places: [number, number][]) {
      const { stage } = app;
      stage.overlay.visible = stage.tools.visible = false;
      stage.drawSharp();
      stage.overlay.visible = stage.tools.visible = true;
      stage.change();
      const gl = stage.renderer.getContext();
      const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
      const pixels = new Uint8Array(4 * width * height);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      return places.map(([x, y]) => {
        const [column, row] = [Math.floor(x * width), Math.floor((1 - y) * height)];
        const pick = (i: number, j: number) => stage.pick((2 * (column + i + 0.5)) / width - 1, (2 * (row + j + 0.5)) / height - 1);
        const hit = pick(0, 0);
        const around = [[-2, -2], [-2, 2], [2, -2], [2, 2]].map(([i, j]) => pick(i, j));
        if (!hit || around.some((other) => other?.surface !== hit.surface || other.normal.dot(hit.normal) < 0.999)) return null;
        const { tint, emission, transmittance, texture } = hit.surface.look;
        const paint = hit.surface.geometry.attributes.paint.array;
        return {
          name: app.objects.get(hit.surface.object)!.name,
          pixel: [...pixels.subarray(4 * (row * width + column), 4 * (row * width + column) + 3)],
          irradiance: light(hit),
          behind: behind(hit),
          reflectance: interpolated(hit, (vertex, band) => paint[3 * vertex + band] * tint[band]),
          transmittance, emission, hasPicture: texture !== null,
        };
      });
    },
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
      selectedLight: app.selectedLight,
      isDragging: app.gizmo.isDragging,
      undo: app.undoable,
      redo: app.redoable,
      bookmarks: app.bookmarks,
      camera: app.stage.place('').matrix,
      mode: app.navigator.mode,
      frames: app.stage.frames,
      received: app.connection.received,
      grid: app.measuring.grid && {
        least: app.measuring.grid.least, mean: app.measuring.grid.mean, largest: app.measuring.grid.largest, count: app.measuring.grid.points.length, covered: app.measuring.grid.points.filter(({ isCovered }) => isCovered).length, cell: app.measuring.grid.cell, size: app.measuring.grid.size,
        first: app.measuring.grid.points[0].point.toArray(),
      },
      plane: app.measuring.plane && { height: app.measuring.plane.height, border: app.measuring.plane.border, ...app.measuring.plane.answer },
      layer: app.layer,
      probe: app.measuring.probed?.answer ?? null,
      exposure: app.exposure.value,
      inSight: app.sight.error,
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
