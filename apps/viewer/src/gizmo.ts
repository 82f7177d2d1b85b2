// The handles by which a thing is moved and turned.
import { Matrix4, Object3D, Quaternion, Vector3 } from 'three';
import { TransformControls } from 'three/addons/controls/TransformControls.js';
import type { App } from './app';
import { ACCENT } from './stage';
import type { Surface } from './surface';
import type { LightNotice } from './wire';

export class Gizmo {
  private controls: TransformControls;
  /** What the handles hold: a stand-in at the foot of the thing, in the world's axes. */
  private handle = new Object3D();
  private start = new Matrix4();
  private places = new Map<Surface, Matrix4>();
  private light: Pick<LightNotice, 'matrix' | 'position' | 'direction'> | null = null;
  private gesture = 0;
  isDragging = false;

  constructor(private app: App) {
    const { stage } = app;
    this.controls = new TransformControls(stage.camera, stage.canvas);
    this.controls.setSize(0.8);
    this.controls.setSpace('world');
    this.controls.setColors(0xd9695f, 0x74b566, 0x5b97d8, ACCENT);
    stage.tools.add(this.handle, this.controls.getHelper());
    this.controls.addEventListener('change', () => stage.change());
    this.controls.addEventListener('dragging-changed', (event) => {
      this.isDragging = event.value as boolean;
      app.navigator.hold(this.isDragging);
      if (this.isDragging) this.begin();
      else this.place();
    });
    this.controls.addEventListener('objectChange', () => this.drag());
  }

  get mode(): 'translate' | 'rotate' {
    return this.controls.mode as 'translate' | 'rotate';
  }

  setMode(mode: 'translate' | 'rotate'): void {
    this.controls.setMode(mode);
    this.offer();
    this.app.tell('selection');
    this.app.stage.change();
  }

  /** A thing on a floor turns about the zenith; a lamp every way. */
  private offer(): void {
    this.controls.showX = this.controls.showZ = this.mode === 'translate' || this.app.selectedLight !== null;
  }

  /** Whether the pointer is on a handle, and so on nothing else. */
  get isOver(): boolean {
    return this.controls.axis !== null;
  }

  /** Where the handles are, in the world. */
  where(): number[] {
    return this.handle.position.toArray();
  }

  /** Puts the handles to what is selected, unless they are held. */
  place(): void {
    if (this.isDragging) return;
    const { app } = this;
    this.offer();
    const light = app.selectedLight === null ? undefined : app.lights.get(app.selectedLight);
    if (light?.position) this.handle.position.copy(app.stage.root.localToWorld(new Vector3().fromArray(light.position)));
    else if (app.isMovable) this.handle.position.copy(app.middle());
    else {
      this.controls.detach();
      app.stage.change();
      return;
    }
    this.handle.quaternion.identity();
    this.handle.updateMatrixWorld();
    this.controls.attach(this.handle);
    app.stage.change();
  }

  private begin(): void {
    const { app } = this;
    this.gesture = app.nextGesture();
    this.handle.updateMatrixWorld();
    this.start.copy(this.handle.matrixWorld);
    this.places = new Map(app.group().map((surface) => [surface, surface.matrix.clone()]));
    const light = app.selectedLight === null ? undefined : app.lights.get(app.selectedLight);
    this.light = light ?? null;
  }

  private drag(): void {
    if (!this.isDragging) return;
    const { app } = this;
    this.handle.updateMatrixWorld();
    const motion = this.handle.matrixWorld.clone().multiply(this.start.clone().invert());
    if (app.selectedLight !== null && this.light) app.moveLight(app.selectedLight, motion, this.gesture, this.light);
    else app.move(motion, this.gesture, (surface) => this.places.get(surface) ?? surface.matrix);
  }
}

/** By how much a thing was turned about the zenith, degrees. */
export function turnOf(matrix: number[], up: Vector3): number {
  const q = new Quaternion();
  new Matrix4().fromArray(matrix).decompose(new Vector3(), q, new Vector3());
  return (2 * Math.atan2(q.x * up.x + q.y * up.y + q.z * up.z, q.w) * 180) / Math.PI;
}
