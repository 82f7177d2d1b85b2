// What is drawn over the scene: the probe, the outline of what is selected, edges of elements, rays, a grid, a working plane, lights
// without area.
import {
  BufferAttribute, BufferGeometry, CanvasTexture, Color, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh,
  MeshBasicMaterial, type Object3D, Points, PointsMaterial, RingGeometry, Sprite, SpriteMaterial, SRGBColorSpace, Vector3, WireframeGeometry,
} from 'three';
import { open, type Grid } from './grid';
import { falseColour } from './scale';
import { ACCENT, discard, type Hit, type Stage } from './stage';
import { shared, type Surface } from './surface';
import type { LightNotice, PlaneAnswer } from './wire';

/** How much of a cell its colour fills along each side, so that cells are told apart; and how much of what is behind it hides. */
const FILL = 0.94;
const COVER = 0.85;

/** By how much nearer lines and dots are drawn than the surfaces in which they lie, so that these do not hide them, as a factor. Dots are
 *  as wide as pixels are, and surfaces that are seen along come nearer within one. */
const WIRES = 1.0015;
const DOTS = 1.02;

export class Marks {
  private wires = new Map<number, LineSegments>();
  private ring: Group | null = null;
  private lines: LineSegments | null = null;
  private gridded: Group | null = null;
  private cells: { mesh: Mesh; answer: PlaneAnswer; range: number[] } | null = null;
  readonly lamps = new Map<number, Sprite>();
  private lampPicture: CanvasTexture | null = null;

  constructor(private stage: Stage) {}

  /** Hides all but what was measured, for a picture that is kept; what comes back shows it again. */
  hide(): () => void {
    const kept: (Object3D | null | undefined)[] = [this.gridded, this.cells?.mesh];
    const all = [...this.stage.overlay.children, ...this.stage.tools.children];
    const hidden = all.filter((thing) => thing.visible && !kept.includes(thing));
    const show = (is: boolean) => hidden.forEach((thing) => { thing.visible = is; });
    show(false);
    return () => show(true);
  }

  /** A line around what is selected. */
  outline(surfaces: Surface[]): void {
    this.stage.outline.set(surfaces);
    this.stage.change();
  }

  /** A surface has moved. */
  follow(surface: Surface): void {
    const wires = this.wires.get(surface.object);
    wires?.matrix.copy(surface.matrix);
    if (wires) wires.matrixWorldNeedsUpdate = true;
    this.stage.change();
  }

  /** The edges of all elements. */
  edges(surfaces: Map<number, Surface>): void {
    for (const [object, wires] of this.wires) {
      const surface = surfaces.get(object);
      if (!surface || !surface.visible || wires.userData.of !== surface) {
        discard(wires);
        this.wires.delete(object);
      }
    }
    for (const [object, surface] of surfaces) {
      if (!surface.visible || this.wires.has(object)) continue;
      const material = new LineBasicMaterial({ color: 0x8fb7d9, transparent: true, opacity: 0.35, depthWrite: false });
      material.polygonOffset = true;
      const wires = new LineSegments(new WireframeGeometry(surface.geometry), material);
      wires.userData.of = surface;
      wires.matrixAutoUpdate = false;
      wires.matrix.copy(surface.matrix);
      nearer(wires, WIRES);
      this.wires.set(object, wires);
      this.stage.overlay.add(wires);
    }
    this.stage.change();
  }

  /** Where the probe is. */
  point(hit: Hit | null): void {
    if (this.ring) discard(this.ring);
    this.ring = null;
    if (hit) {
      const size = 0.009 * Math.max(hit.distance, 0.05);
      const ring = (inner: number, outer: number, colour: number, order: number) => {
        const mesh = new Mesh(new RingGeometry(inner * size, outer * size, 40), new MeshBasicMaterial({ color: colour, depthTest: false, transparent: true, side: 2, toneMapped: false }));
        mesh.renderOrder = order;
        return mesh;
      };
      this.ring = new Group().add(ring(0.55, 1.25, 0x111111, 4), ring(0.7, 1.1, 0xffffff, 5), ring(0, 0.22, 0xffffff, 5));
      this.ring.position.copy(hit.point).addScaledVector(hit.normal, 0.1 * size);
      this.ring.lookAt(hit.point.clone().addScaledVector(hit.normal, 1));
      this.stage.tools.add(this.ring);
    }
    this.stage.change();
  }

  /** Rays of an element, from origin to end, in the scene's axes. */
  rays(rays: number[][][]): void {
    if (this.lines) discard(this.lines);
    this.lines = null;
    if (rays.length > 0) {
      const geometry = new BufferGeometry();
      geometry.setAttribute('position', new BufferAttribute(new Float32Array(rays.flat(2)), 3));
      const [near, far] = [new Color(ACCENT), new Color(0x5b97d8)];
      geometry.setAttribute('color', new BufferAttribute(new Float32Array(rays.flatMap(() => [...near.toArray(), ...far.toArray()])), 3));
      this.lines = new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.55, depthWrite: false }));
      this.stage.overlay.add(this.lines);
    }
    this.stage.change();
  }

  /** Points of a grid; their numbers are written by the page. */
  grid(grid: Grid | null): void {
    if (this.gridded) discard(this.gridded);
    this.gridded = null;
    if (grid) {
      const geometry = new BufferGeometry().setFromPoints(open(grid).map((p) => p.point.clone().addScaledVector(grid.normal, 1e-3)));
      const dots = new Points(geometry, new PointsMaterial({ color: 0xffffff, size: 4, sizeAttenuation: false, depthWrite: false, transparent: true }));
      nearer(dots, DOTS);
      dots.renderOrder = 4;
      this.gridded = new Group().add(dots);
      this.stage.tools.add(this.gridded);
    }
    this.stage.change();
  }

  /** Cells of a working plane in false colours. */
  plane(answer: PlaneAnswer | null): void {
    if (this.cells) discard(this.cells.mesh);
    this.cells = null;
    if (answer) {
      const [u, v] = answer.axes.map((axis, k) => new Vector3().fromArray(axis).multiplyScalar((FILL * answer.cell[k]) / 2));
      const above = u.clone().cross(v).normalize().multiplyScalar(1e-3);
      const corners = answer.points.flatMap(([x, y, z]) => {
        const corner = (i: number, j: number) => new Vector3(x, y, z).add(above).addScaledVector(u, i).addScaledVector(v, j);
        const [a, b, c, d] = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
        return [a, b, c, a, c, d];
      });
      const geometry = new BufferGeometry().setFromPoints(corners);
      geometry.setAttribute('color', new BufferAttribute(new Float32Array(3 * corners.length), 3));
      const material = new MeshBasicMaterial({ vertexColors: true, transparent: true, opacity: COVER, side: DoubleSide, depthWrite: false, toneMapped: false });
      this.cells = { mesh: new Mesh(geometry, material), answer, range: [] };
      this.colourPlane();
      this.stage.overlay.add(this.cells.mesh);
    }
    this.stage.change();
  }

  /** The colours of the working plane, by the scale of now. */
  colourPlane(): void {
    const range = shared.range.value;
    if (!this.cells || range === this.cells.range) return;
    const { mesh, answer } = this.cells;
    this.cells.range = range;
    const colours = mesh.geometry.attributes.color;
    answer.points.forEach(([, , , lux], cell) => {
      const [r, g, b] = falseColour(lux, range);
      const colour = new Color().setRGB(r, g, b, SRGBColorSpace);
      for (let k = 0; k < 6; k += 1) colours.setXYZ(6 * cell + k, colour.r, colour.g, colour.b);
    });
    colours.needsUpdate = true;
    this.stage.change();
  }

  /** A light without area. */
  light(light: LightNotice): void {
    let sprite = this.lamps.get(light.id);
    if (!light.position || light.object !== null) {
      // It may have been one with a place before.
      if (sprite) sprite.visible = false;
      return;
    }
    if (!sprite) {
      this.lampPicture ??= lampPicture();
      sprite = new Sprite(new SpriteMaterial({ map: this.lampPicture, depthTest: true, sizeAttenuation: false, toneMapped: false }));
      sprite.scale.setScalar(0.045);
      this.lamps.set(light.id, sprite);
      this.stage.overlay.add(sprite);
    }
    sprite.position.fromArray(light.position);
    sprite.visible = !light.deleted;
    sprite.material.opacity = light.dimming > 0 ? 1 : 0.45;
    this.stage.change();
  }

  /** The light without area at a place of the canvas, CSS pixels. */
  lampAt(x: number, y: number): number | null {
    for (const [id, sprite] of this.lamps) {
      if (!sprite.visible) continue;
      const at = this.stage.project(sprite.getWorldPosition(new Vector3()));
      if (at && Math.hypot(at.x - x, at.y - y) < 16) return id;
    }
    return null;
  }
}

/** Draws something that lies in surfaces a little nearer. */
function nearer(thing: Object3D, factor: number): void {
  thing.onBeforeRender = (_renderer, _scene, camera) => {
    camera.projectionMatrix.elements[14] *= factor;
  };
  thing.onAfterRender = (_renderer, _scene, camera) => {
    camera.projectionMatrix.elements[14] /= factor;
  };
}

function lampPicture(): CanvasTexture {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext('2d')!;
  pen.strokeStyle = pen.fillStyle = '#e8b04a';
  pen.lineWidth = 5;
  pen.lineCap = 'round';
  pen.beginPath();
  pen.arc(32, 32, 11, 0, 2 * Math.PI);
  pen.fill();
  for (let i = 0; i < 8; i += 1) {
    const [x, y] = [Math.cos((i * Math.PI) / 4), Math.sin((i * Math.PI) / 4)];
    pen.beginPath();
    pen.moveTo(32 + 19 * x, 32 + 19 * y);
    pen.lineTo(32 + 27 * x, 32 + 27 * y);
    pen.stroke();
  }
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = 'srgb';
  return texture;
}
