// What stands on the screen: surfaces, sky, a camera; drawn only when something has changed.
import {
  BackSide, Box3, DataTexture, FloatType, GLSL3, Group, LinearFilter, Matrix4, Mesh, Object3D, PerspectiveCamera,
  Quaternion, Ray, RepeatWrapping, RGBAFormat, Scene, ShaderMaterial, type Side, SphereGeometry, Vector2, Vector3, WebGLRenderer,
  WebGLRenderTarget,
} from 'three';
import { Batches } from './batch';
import { Cuts } from './cuts';
import { luminance } from './luminance';
import { Outline } from './outline';
import { DISPLAY, type Look, Mode, shared, type Surface } from './surface';
import type { CameraPlace, CutsFrame, SceneNotice } from './wire';

/** The colour of what is marked. */
export const ACCENT = 0xe8b04a;

/** A place of a surface. */
export interface Place {
  surface: Surface;
  triangle: number;
  /** Weights of the triangle's corners 1 and 2. */
  uv: [number, number];
}

/** Where a ray ended. */
export interface Hit extends Place {
  /** In the world, whose zenith is +Y. */
  point: Vector3;
  /** Of the side that the ray came to. */
  normal: Vector3;
  distance: number;
}

/** Pixels drawn for one shown, along each side: fewer while something moves and frames take long. */
const SHARPNESS = [1, 0.7, 0.5, 0.35];

/** Milliseconds for a frame that are too many, and few enough for more pixels; how many frames in a row decide. */
const SLOW = 34;
const QUICK = 12;
const IN_A_ROW = 4;

/** Milliseconds of rest before all is drawn sharp. */
const REST = 250;

/** Milliseconds that a picture waits for the light of a layer that was just chosen, and for the rest of it after the first: one that is
 *  dark takes as long to draw as one that is not, which is a second where the processor draws. */
const PATIENCE = 400;
const TOGETHER = 40;

/** The picture that the meter sees. */
export const METER = [64, 40];

/** Places that are looked at where a scale is wanted at once: some milliseconds of rays. */
const SAMPLED = [32, 20];

/** What the meter saw: luminance and illuminance of the pixels that show a surface. */
export interface Metered {
  luminance: number[];
  illuminance: number[];
  /** Illuminance of all pixels, row by row from below; 0 where there is no surface. */
  picture: Float32Array;
}

export class Stage {
  readonly canvas = document.createElement('canvas');
  readonly renderer: WebGLRenderer;
  readonly scene = new Scene();
  /** The scene's axes, turned so that its zenith is +Y. */
  readonly root = new Group();
  readonly camera = new PerspectiveCamera(50, 1, 0.01, 1000);
  readonly surfaces = new Map<number, Surface>();
  private batches = new Batches(this.root);
  private cuts = new Cuts(this.batches);
  /** What is drawn over the scene and is no part of it. */
  readonly overlay = new Group();
  /** Things that stand in the overlay but not in the scene's axes. */
  readonly tools = new Group();
  readonly bounds = new Box3(new Vector3(-1, 0, -1), new Vector3(1, 2, 1));
  readonly outline = new Outline(ACCENT);
  frames = 0;
  /** Counts what came, went or moved. */
  moves = 0;
  private dirty = true;
  /** Nothing is drawn before. */
  private heldUntil = 0;
  private isAwaited = false;
  private boxes = new Map<number, Box3>();
  private sky: Mesh<SphereGeometry, ShaderMaterial>;
  private meter = new WebGLRenderTarget(METER[0], METER[1], { type: FloatType, format: RGBAFormat });
  private isMetering = false;
  /** What is seen at places all over the canvas, and from where. */
  private seen: { view: string; hits: Hit[] } = { view: '', hits: [] };
  /** Of `SHARPNESS`: in motion, and now. */
  private coarseness = 0;
  private drawn = 0;
  private row = 0;
  /** Vertical angle of view that was asked for, radians. */
  private fov = 0.87;
  private lastFrame = 0;

  constructor() {
    this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true, powerPreference: 'high-performance' });
    this.renderer.info.autoReset = true;
    this.canvas.tabIndex = 0;
    this.canvas.id = 'stage';
    this.canvas.setAttribute('role', 'application');
    this.canvas.setAttribute('aria-label', 'The scene. Walk with W A S D or the arrow keys; press H for the list of keys.');
    this.sky = new Mesh(new SphereGeometry(1, 48, 24), new ShaderMaterial({
      glslVersion: GLSL3,
      side: BackSide,
      depthTest: false,
      depthWrite: false,
      uniforms: { ...shared, picture: { value: null }, hasPicture: { value: false }, dimming: { value: new Vector3(1, 1, 1) } },
      vertexShader: /* glsl */ `
        out vec3 direction;
        void main() {
          direction = position;
          gl_Position = (projectionMatrix * vec4(mat3(viewMatrix) * position, 1.0)).xyww;
        }`,
      fragmentShader: /* glsl */ `
        precision highp float;
        in vec3 direction;
        uniform int mode;
        uniform float exposure;
        uniform sampler2D picture;
        uniform bool hasPicture;
        uniform vec3 dimming;
        out vec4 outColour;
        ${DISPLAY}
        void main() {
          vec3 d = normalize(direction);
          vec3 background = vec3(0.055, 0.059, 0.066);
          vec2 at = vec2(atan(d.z, d.x) / 6.28318530718 + 0.5, acos(clamp(d.y, -1.0, 1.0)) / 3.14159265359);
          vec3 colour = hasPicture ? display(texture(picture, at).rgb * dimming, exposure) : background;
          outColour = mode == ${Mode.Meter} ? vec4(0.0) : vec4(mode == ${Mode.Lux} ? background : colour, 1.0);
        }`,
    }));
    this.sky.renderOrder = -1;
    this.sky.frustumCulled = false;
    this.scene.add(this.sky, this.root, this.tools);
    this.root.add(this.overlay);
    this.tools.add(this.outline.line);
    new ResizeObserver(() => {
      this.resize(0);
      this.drawNow();
    }).observe(this.canvas);
  }

  /** The axes, the bounds and the sky of a scene. */
  begin(scene: SceneNotice): void {
    this.root.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(...scene.up), new Vector3(0, 1, 0)));
    this.root.updateMatrixWorld(true);
    this.bounds.set(new Vector3(...scene.low), new Vector3(...scene.high)).applyMatrix4(this.root.matrixWorld);
    const size = this.bounds.getSize(new Vector3()).length();
    this.camera.near = Math.min(0.05, size / 500);
    this.camera.far = Math.max(100, 6 * size);
    this.camera.updateProjectionMatrix();
    if (scene.sky) {
      const { width, height, luminance } = scene.sky;
      const data = new Float32Array(4 * width * height);
      for (let i = 0; i < width * height; i += 1) data.set([...luminance.slice(3 * i, 3 * i + 3), 1], 4 * i);
      const texture = new DataTexture(data, width, height, RGBAFormat, FloatType);
      this.renderer.extensions.has('OES_texture_float_linear');
      texture.wrapS = RepeatWrapping;
      texture.magFilter = texture.minFilter = LinearFilter;
      texture.needsUpdate = true;
      this.sky.material.uniforms.picture.value?.dispose();
      this.sky.material.uniforms.picture.value = texture;
      this.sky.material.uniforms.hasPicture.value = true;
    }
    this.change();
  }

  /** The sky is by so much darker or brighter in each band than in the file. */
  dimSky(factor: number[]): void {
    (this.sky.material.uniforms.dimming.value as Vector3).fromArray(factor);
    this.change();
  }

  /** Something is to be drawn anew. */
  change(): void {
    this.dirty = true;
  }

  put(surface: Surface): void {
    this.remove(surface.object);
    this.surfaces.set(surface.object, surface);
    this.root.add(surface);
    this.moved(surface);
  }

  remove(object: number): void {
    const old = this.surfaces.get(object);
    if (!old) return;
    this.cuts.remove(old);
    this.root.remove(old);
    this.batches.remove(old);
    old.dispose();
    this.surfaces.delete(object);
    this.boxes.delete(object);
    this.change();
  }

  /** A surface looks like this from now on. */
  dress(surface: Surface, look: Look): void {
    surface.look = look;
    this.batches.put(surface);
    this.cuts.dress(surface);
    this.change();
  }

  /** Light has come to vertices of a surface, and to places of its elements that are cut, which follow them. */
  shine(surface: Surface, first: number, values: Uint16Array): void {
    const own = values.subarray(0, Math.max(0, 3 * (surface.light.count - first)));
    if (own.length > 0) {
      (surface.light.array as Uint16Array).set(own, 3 * first);
      this.batches.shine(surface, first, own.length / 3);
    }
    if (own.length < values.length) this.cuts.shine(surface, Math.max(0, first - surface.light.count), values.subarray(own.length));
    this.change();
  }

  /** No light is known, but some will come: pictures wait for it. */
  await(): void {
    for (const surface of this.surfaces.values()) this.darken(surface);
    this.isAwaited = true;
    this.heldUntil = performance.now() + PATIENCE;
  }

  /** What was awaited begins to come. */
  begun(): void {
    if (this.isAwaited) this.heldUntil = Math.min(this.heldUntil, performance.now() + TOGETHER);
    this.isAwaited = false;
  }

  /** None of its light is known. */
  darken(surface: Surface): void {
    this.shine(surface, 0, new Uint16Array(surface.light.array.length + 3 * this.cuts.count(surface)));
  }

  /** Other elements of an object are cut than before. */
  cut(frame: CutsFrame): void {
    const surface = this.surfaces.get(frame.object);
    if (!surface) return;
    this.cuts.cut(surface, frame);
    this.change();
  }

  /** Irradiance at a point of a triangle as it is shown now, lux per band. */
  light(surface: Surface, triangle: number, uv: [number, number]): number[] {
    return this.cuts.light(surface, triangle, uv) ?? surface.between(surface.around(triangle, uv)!);
  }

  /** Illuminance there, lx. */
  lux(surface: Surface, triangle: number, uv: [number, number]): number {
    return luminance(this.light(surface, triangle, uv));
  }

  /** A surface is elsewhere, or there no longer. */
  moved(surface: Surface): void {
    this.moves += 1;
    surface.updateMatrixWorld(true);
    this.batches.place(surface);
    this.cuts.place(surface);
    surface.geometry.boundingBox ?? surface.geometry.computeBoundingBox();
    this.boxes.set(surface.object, surface.geometry.boundingBox!.clone().applyMatrix4(surface.matrixWorld));
    this.change();
  }

  /** What is around a surface in the world. */
  box(surface: Surface): Box3 {
    return this.boxes.get(surface.object)!;
  }

  /** Draws if there is something new; else a tree of boxes is built where one is missing. */
  draw(now: number): void {
    if (performance.now() < this.heldUntil) return;
    if (!this.dirty && this.drawn > 0 && now - this.lastFrame > REST) this.resize(0);
    if (!this.dirty) {
      for (const surface of this.surfaces.values()) {
        if (!surface.isReady) return void surface.tree;
      }
      return;
    }
    this.dirty = false;
    this.pace(now - this.lastFrame);
    this.lastFrame = now;
    this.batches.settle();
    this.outline.prepare(this.renderer, this.scene, this.camera);
    this.renderer.render(this.scene, this.camera);
    this.frames += 1;
  }

  /** Keeps motion smooth on slow machines: fewer pixels while frames take long. */
  private pace(passed: number): void {
    // After a rest the time since the last frame says nothing.
    if (passed > REST) return;
    const way = passed > SLOW ? 1 : passed < QUICK ? -1 : 0;
    this.row = way === Math.sign(this.row) ? this.row + way : way;
    if (Math.abs(this.row) >= IN_A_ROW) {
      this.coarseness = Math.max(0, Math.min(SHARPNESS.length - 1, this.coarseness + way));
      this.row = 0;
    }
    if (this.coarseness !== this.drawn) this.resize(this.coarseness);
  }

  /** Draws now, whatever has changed, for who counts frames or reads pixels. */
  drawNow(): void {
    this.batches.settle();
    this.outline.prepare(this.renderer, this.scene, this.camera);
    this.renderer.render(this.scene, this.camera);
    this.frames += 1;
  }

  /** The same with all pixels, however few the last frames had, for a picture that is kept. */
  drawSharp(): void {
    this.resize(0);
    this.drawNow();
  }

  /** The angle of view: on upright screens it holds across, where else the sides would be lost. */
  private widen(): void {
    const half = Math.tan(0.5 * this.fov) / Math.min(1, this.camera.aspect);
    this.camera.fov = (2 * Math.atan(half) * 180) / Math.PI;
    this.camera.updateProjectionMatrix();
  }

  private resize(coarseness: number): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.drawn = coarseness;
    this.renderer.setPixelRatio(SHARPNESS[coarseness] * Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.renderer.getDrawingBufferSize(shared.pixels.value);
    this.camera.aspect = width / height;
    this.widen();
    this.dirty = true;
  }

  /** The first surface along a ray. `side` says which faces count. */
  cast(origin: Vector3, direction: Vector3, far = Infinity, side: Side | null = null, among: Iterable<Surface> = this.surfaces.values()): Hit | null {
    const ray = new Ray(origin, direction);
    const local = new Ray();
    const inverse = new Matrix4();
    const entry = new Vector3();
    let best: Hit | null = null;
    for (const surface of among) {
      if (!surface.visible) continue;
      const box = this.boxes.get(surface.object)!;
      const reach = best ? best.distance : far;
      if (!box.containsPoint(origin)) {
        if (!ray.intersectBox(box, entry) || entry.distanceTo(origin) > reach) continue;
      }
      inverse.copy(surface.matrixWorld).invert();
      local.copy(ray).applyMatrix4(inverse);
      const found = surface.tree.raycastFirst(local, side ?? surface.material.side);
      if (!found || !found.face) continue;
      const point = found.point.clone().applyMatrix4(surface.matrixWorld);
      const distance = point.distanceTo(origin);
      if (distance >= reach) continue;
      const normal = found.face.normal.clone().transformDirection(surface.matrixWorld);
      if (normal.dot(direction) > 0) normal.negate();
      const triangle = found.faceIndex!;
      best = { surface, point, normal, distance, triangle, uv: barycentric(surface, triangle, found.point) };
    }
    return best;
  }

  /** What is seen at a place of the canvas, −1..1 right and up. */
  pick(x: number, y: number): Hit | null {
    this.camera.updateMatrixWorld();
    const origin = new Vector3().setFromMatrixPosition(this.camera.matrixWorld);
    const direction = new Vector3(x, y, 0.5).unproject(this.camera).sub(origin).normalize();
    return this.cast(origin, direction);
  }

  /** A place of the world on the canvas, CSS pixels; none if it lies behind. */
  project(point: Vector3): Vector2 | null {
    const p = point.clone().project(this.camera);
    if (p.z > 1 || p.z < -1) return null;
    return new Vector2((0.5 + 0.5 * p.x) * this.canvas.clientWidth, (0.5 - 0.5 * p.y) * this.canvas.clientHeight);
  }

  /** Looks from a place of the scene. */
  look(place: CameraPlace): void {
    const world = this.root.matrixWorld.clone().multiply(new Matrix4().fromArray(place.matrix));
    world.decompose(this.camera.position, this.camera.quaternion, new Vector3());
    this.fov = place.fov;
    this.widen();
    this.camera.updateMatrixWorld();
    this.change();
  }

  /** The vertical angle of view that is drawn, radians. */
  get angle(): number {
    return (this.camera.fov * Math.PI) / 180;
  }

  /** Where one looks from now. */
  place(name: string): CameraPlace {
    this.camera.updateMatrixWorld();
    const matrix = this.root.matrixWorld.clone().invert().multiply(this.camera.matrixWorld);
    return { name, matrix: matrix.toArray(), fov: this.fov };
  }

  /** Illuminance at places all over the canvas, as far as it has come, lx. Nothing is drawn for it, which takes a second where the
   *  processor draws. */
  sampled(): number[] {
    const view = `${this.camera.matrixWorld.elements.join()} ${this.camera.fov} ${this.camera.aspect} ${this.moves}`;
    if (view !== this.seen.view) {
      const [across, down] = SAMPLED;
      const places = Array.from({ length: across * down }, (_, i) => this.pick((2 * (i % across) + 1) / across - 1, (2 * Math.floor(i / across) + 1) / down - 1));
      this.seen = { view, hits: places.filter((hit) => hit !== null) };
    }
    return this.seen.hits.map(({ surface, triangle, uv }) => this.lux(surface, triangle, uv));
  }

  /** What the eye is exposed to. */
  async metering(): Promise<Metered | null> {
    if (this.isMetering) return null;
    this.isMetering = true;
    this.batches.settle();
    const mode = shared.mode.value;
    const isolines = shared.isolines.value;
    shared.mode.value = Mode.Meter;
    shared.isolines.value = false;
    this.root.remove(this.overlay);
    this.tools.visible = false;
    this.renderer.setRenderTarget(this.meter);
    this.renderer.setClearColor(0, 0);
    this.renderer.clear();
    this.renderer.render(this.scene, this.camera);
    this.renderer.setRenderTarget(null);
    this.root.add(this.overlay);
    this.tools.visible = true;
    shared.mode.value = mode;
    shared.isolines.value = isolines;
    const pixels = new Float32Array(4 * METER[0] * METER[1]);
    await this.renderer.readRenderTargetPixelsAsync(this.meter, 0, 0, METER[0], METER[1], pixels);
    this.isMetering = false;
    const seen: Metered = { luminance: [], illuminance: [], picture: new Float32Array(METER[0] * METER[1]) };
    const shining: number[] = [];
    for (let i = 0; i < pixels.length; i += 4) {
      if (pixels[i + 3] < 0.5) continue;
      if (pixels[i] > 0) seen.luminance.push(pixels[i]);
      if (pixels[i + 2] > 0) shining.push(pixels[i + 2]);
      if (pixels[i + 1] > 0) seen.illuminance.push(pixels[i + 1]);
      seen.picture[i / 4] = pixels[i + 1];
    }
    // Lamps that fill the picture would leave their room black; where there is nothing else, they count.
    if (seen.luminance.length === 0) seen.luminance = shining;
    return seen;
  }

  /** A point of the scene in the world. */
  toWorld(point: readonly number[]): Vector3 {
    return this.root.localToWorld(new Vector3().fromArray(point as number[]));
  }

  /** A point of the world in the scene's axes. */
  toScene(point: Vector3): Vector3 {
    return this.root.worldToLocal(point.clone());
  }
}

/** Weights of corners 1 and 2 of a triangle at a point of it, in the surface's own frame. */
export function barycentric(surface: Surface, triangle: number, point: Vector3): [number, number] {
  const [a, b, c] = corners(surface, triangle);
  const [ab, ac, ap] = [b.sub(a), c.sub(a), point.clone().sub(a)];
  const normal = ab.clone().cross(ac);
  const scale = 1 / normal.lengthSq();
  const v = ap.clone().cross(ac).dot(normal) * scale;
  const w = ab.clone().cross(ap).dot(normal) * scale;
  return [v, w];
}

/** Corners of a triangle in the surface's own frame. */
export function corners(surface: Surface, triangle: number): [Vector3, Vector3, Vector3] {
  const { position } = surface.geometry.attributes;
  const index = surface.geometry.index!;
  const at = (k: number) => new Vector3().fromBufferAttribute(position, index.getX(3 * triangle + k));
  return [at(0), at(1), at(2)];
}

/** Frees what a thing holds in graphics memory. */
export function discard(thing: Object3D): void {
  thing.removeFromParent();
  thing.traverse((part) => {
    const { geometry, material } = part as Mesh;
    geometry?.dispose();
    for (const one of [material ?? []].flat()) one.dispose();
  });
}
