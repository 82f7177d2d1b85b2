// The handles by which a thing is moved and turned.
import { Matrix4, Object3D, Quaternion, Vector3 } from 'three';
import { TransformControls } from 'three/addons/controls/TransformControls.js';
import type { App } from './app';

export class Gizmo {
  private controls: TransformControls;
  /** What the handles hold: a stand-in at the foot of the thing, in the world's axes. */
  private handle = new Object3D();
  private start = new Matrix4();
  private original = new Matrix4();
  private gesture = 0;
  isDragging = false;

  constructor(private app: App) {
    const { stage } = app;
    this.controls = new TransformControls(stage.camera, stage.canvas);
    this.controls.setSize(0.8);
    this.controls.setSpace('world');
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
    // A thing on a floor turns about the zenith; who wants more has the numbers.
    this.controls.showX = this.controls.showZ = mode === 'translate';
    this.app.tell('selection');
    this.app.stage.change();
  }

  /** Whether the pointer is on a handle, and so on nothing else. */
  get isOver(): boolean {
    return this.controls.axis !== null;
  }

  /** Puts the handles to what is selected. */
  place(): void {
    const { app } = this;
    const matrix = this.matrix();
    if (!matrix) {
      this.controls.detach();
      app.stage.change();
      return;
    }
    const surface = app.selected === null ? undefined : app.stage.surfaces.get(app.selected);
    this.handle.quaternion.identity();
    this.handle.position.copy(surface ? app.middle(surface) : new Vector3().setFromMatrixPosition(matrix));
    this.handle.updateMatrixWorld();
    this.controls.attach(this.handle);
    app.stage.change();
  }

  /** Of what is selected, in the world; none if it stays where it is. */
  private matrix(): Matrix4 | null {
    const { app } = this;
    const { root } = app.stage;
    if (app.selectedLight !== null) {
      const light = app.lights.get(app.selectedLight);
      return light?.matrix ? root.matrixWorld.clone().multiply(new Matrix4().fromArray(light.matrix)) : null;
    }
    const object = app.selected === null ? undefined : app.objects.get(app.selected);
    if (!object?.movable || object.deleted) return null;
    return root.matrixWorld.clone().multiply(new Matrix4().fromArray(object.matrix));
  }

  private begin(): void {
    this.gesture = this.app.nextGesture();
    this.handle.updateMatrixWorld();
    this.start.copy(this.handle.matrixWorld);
    this.original.copy(this.matrix() ?? new Matrix4());
  }

  private drag(): void {
    if (!this.isDragging) return;
    const { app } = this;
    this.handle.updateMatrixWorld();
    const world = this.handle.matrixWorld.clone().multiply(this.start.clone().invert()).multiply(this.original);
    const matrix = app.stage.root.matrixWorld.clone().invert().multiply(world);
    if (app.selectedLight !== null) {
      const light = app.lights.get(app.selectedLight)!;
      light.matrix = matrix.toArray();
      app.marks.light(light);
      app.edit({ move_light: { light: light.id, matrix: light.matrix } }, this.gesture);
    } else if (app.selected !== null) {
      app.move(app.selected, matrix, this.gesture);
    }
  }
}

/** Place and turn of a thing as people write them: metres, and degrees about the zenith. */
export function turnOf(matrix: number[], up: Vector3): number {
  const q = new Quaternion();
  new Matrix4().fromArray(matrix).decompose(new Vector3(), q, new Vector3());
  return (2 * Math.atan2(q.x * up.x + q.y * up.y + q.z * up.z, q.w) * 180) / Math.PI;
}
