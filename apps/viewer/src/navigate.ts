// Moving about: on foot with feet on the floor and walls in the way, or around a thing.
import { DoubleSide, Euler, Vector3 } from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import type { Stage } from './stage';

/** A person: eyes above the floor, width, pace, metres and metres a second. */
const EYE = 1.6;
const RADIUS = 0.25;
const PACE = 1.6;
const RUN = 3;

/** The height of a room that a person is made for; models of rooms are walked by people as much smaller. */
const ROOM = 2.4;

/** Highest step, as a share of the eye's height: a quarter of a metre. Twice as high people would climb sofas. */
const STEP = 0.16;

/** Longest way that is gone at a time, metres: by longer ones, where few pictures are drawn, feet would miss what they step on. */
const STRIDE = 0.1;

/** Way on which feet come nearer to what they step on by a factor of e, metres: at once would jolt. */
const SETTLE = 0.06;

/** Radians a second by keys, and by each pixel of the pointer, dragged and locked. */
const TURN = 1.6;
const DRAG = 0.0042;
const FREE = 0.0022;

/** How near the ground eyes come that go around a thing, metres; and how many things may lie above each other on it. */
const GROUND = 0.05;
const STOREYS = 32;

/** Which way one goes: right, up, back, and turning. */
export interface Drive {
  right: number;
  up: number;
  back: number;
  yaw: number;
  pitch: number;
  fast: boolean;
}

export const STILL: Drive = { right: 0, up: 0, back: 0, yaw: 0, pitch: 0, fast: false };

export class Navigator {
  mode: 'walk' | 'orbit' = 'walk';
  /** By keys and the stick. */
  drive: Drive = { ...STILL };
  readonly orbit: OrbitControls;
  /** Nothing moves while something is dragged. */
  held = false;
  /** As long as a metre is to people who fit into the scene. */
  scale = 1;
  private dragged: number | null = null;
  private fingers = new Set<number>();
  private last: [number, number] = [0, 0];

  constructor(private stage: Stage) {
    const { canvas } = stage;
    this.orbit = new OrbitControls(stage.camera, canvas);
    this.orbit.enableDamping = false;
    this.orbit.enabled = false;
    this.orbit.addEventListener('change', () => {
      this.above();
      stage.change();
    });
    canvas.addEventListener('pointerdown', (event) => {
      canvas.focus({ preventScroll: true });
      if (this.mode !== 'walk' || this.held || event.button > 1 || document.pointerLockElement) return;
      this.fingers.add(event.pointerId);
      // One finger turns the head; two do nothing that either of them would.
      if (this.fingers.size > 1) this.dragged = null;
      else {
        this.dragged = event.pointerId;
        this.last = [event.clientX, event.clientY];
        canvas.setPointerCapture(event.pointerId);
      }
    });
    canvas.addEventListener('pointermove', (event) => {
      if (document.pointerLockElement === canvas && !this.held) {
        // Freely one looks where the pointer goes; dragging pulls the picture along, the other way.
        this.turn(-event.movementX * FREE, -event.movementY * FREE);
        return;
      }
      if (event.pointerId !== this.dragged || this.held) return;
      const [x, y] = [event.clientX - this.last[0], event.clientY - this.last[1]];
      this.last = [event.clientX, event.clientY];
      this.turn(x * DRAG, y * DRAG);
    });
    const release = (event: PointerEvent) => {
      this.fingers.delete(event.pointerId);
      if (event.pointerId === this.dragged) this.dragged = null;
    };
    canvas.addEventListener('pointerup', release);
    canvas.addEventListener('pointercancel', release);
    canvas.addEventListener('wheel', (event) => {
      if (this.mode !== 'walk') return;
      event.preventDefault();
      this.go(new Vector3(0, 0, Math.sign(event.deltaY) * 0.25 * this.scale).applyQuaternion(this.level()));
    }, { passive: false });
  }

  /** Takes the measure of a scene. */
  begin(): void {
    const size = this.stage.bounds.getSize(new Vector3());
    this.scale = Math.min(1, size.y > 0 ? size.y / ROOM : 1);
    this.orbit.minDistance = 0.02 * size.length();
    this.orbit.maxDistance = 3 * size.length();
  }

  /** On foot inside, around from outside. */
  choose(): void {
    this.set(this.stage.bounds.containsPoint(this.stage.camera.position) ? 'walk' : 'orbit');
  }

  set(mode: 'walk' | 'orbit'): void {
    this.mode = mode;
    this.orbit.enabled = mode === 'orbit' && !this.held;
    if (mode === 'orbit') {
      const { camera, bounds } = this.stage;
      const ahead = camera.getWorldDirection(new Vector3());
      const hit = this.stage.cast(camera.position, ahead);
      const reach = hit ? hit.distance : Math.max(bounds.getCenter(new Vector3()).sub(camera.position).dot(ahead), 0.1 * this.scale);
      this.orbit.target.copy(camera.position).addScaledVector(ahead, reach);
      this.above();
      this.orbit.update();
    } else {
      // The head is upright again.
      const angles = new Euler().setFromQuaternion(this.stage.camera.quaternion, 'YXZ');
      this.stage.camera.quaternion.setFromEuler(new Euler(angles.x, angles.y, 0, 'YXZ'));
    }
    this.stage.change();
  }

  hold(is: boolean): void {
    this.held = is;
    this.orbit.enabled = !is && this.mode === 'orbit';
    if (is) this.dragged = null;
  }

  private level() {
    const angles = new Euler().setFromQuaternion(this.stage.camera.quaternion, 'YXZ');
    return this.stage.camera.quaternion.clone().setFromEuler(new Euler(0, angles.y, 0));
  }

  private turn(yaw: number, pitch: number): void {
    const { camera } = this.stage;
    const angles = new Euler().setFromQuaternion(camera.quaternion, 'YXZ');
    const limit = 0.495 * Math.PI;
    camera.quaternion.setFromEuler(new Euler(Math.max(-limit, Math.min(limit, angles.x + pitch)), angles.y + yaw, 0, 'YXZ'));
    this.stage.change();
  }

  /** Moves for a time, seconds. */
  update(seconds: number): void {
    const { right, up, back, yaw, pitch, fast } = this.drive;
    const pace = PACE * this.scale * (fast ? RUN : 1) * seconds;
    if (this.held || (!right && !up && !back && !yaw && !pitch)) return;
    if (this.mode === 'orbit') {
      this.around((yaw - right) * TURN * seconds, (pitch + up) * TURN * seconds, 1 + back * seconds);
      return;
    }
    if (yaw || pitch) this.turn(-yaw * TURN * seconds, pitch * TURN * seconds);
    if (right || back) {
      const strides = Math.max(1, Math.ceil(pace / (STRIDE * this.scale)));
      const way = new Vector3(right, 0, back).normalize().multiplyScalar(pace / strides).applyQuaternion(this.level());
      for (let stride = 0; stride < strides; stride += 1) this.go(way);
    }
    if (up) this.lift(up * pace);
  }

  private around(azimuth: number, elevation: number, nearer: number): void {
    const { camera } = this.stage;
    const from = camera.position.clone().sub(this.orbit.target);
    const radius = from.length() * nearer;
    const polar = Math.acos(Math.max(-1, Math.min(1, from.y / from.length())));
    const angle = Math.atan2(from.x, from.z) + azimuth;
    const tilt = Math.max(0.02, Math.min(this.orbit.maxPolarAngle, polar - elevation));
    camera.position.copy(this.orbit.target).add(new Vector3().setFromSphericalCoords(radius, tilt, angle));
    camera.lookAt(this.orbit.target);
    this.orbit.update();
    this.stage.change();
  }

  /** Around a thing one stays above the lowest floor beneath it: from below, floors are not seen. */
  private above(): void {
    const { target } = this.orbit;
    const ground = this.ground(target);
    target.y = Math.max(target.y, ground);
    const radius = Math.max(this.stage.camera.position.distanceTo(target), 1e-9);
    const below = Math.min(1, Math.max(0, target.y - ground - GROUND * this.scale) / radius);
    this.orbit.maxPolarAngle = Math.min(Math.PI - 0.02, 0.5 * Math.PI + Math.asin(below));
  }

  /** The lowest surface beneath a place that looks up; where there is none, the lowest of all. */
  private ground(place: Vector3): number {
    const { bounds } = this.stage;
    const from = place.clone().setY(place.y + 0.01 * this.scale);
    let ground = bounds.min.y;
    for (let storey = 0; storey < STOREYS; storey += 1) {
      const hit = this.stage.cast(from, new Vector3(0, -1, 0));
      if (!hit) break;
      ground = hit.point.y;
      from.y = ground - 0.01 * this.scale;
    }
    return ground;
  }

  /** Flies up or down, unless something is there. */
  private lift(by: number): void {
    const { camera } = this.stage;
    const direction = new Vector3(0, Math.sign(by), 0);
    const hit = this.stage.cast(camera.position, direction, Math.abs(by) + RADIUS * this.scale, DoubleSide);
    if (!hit) camera.position.y += by;
    this.stage.change();
  }

  /** Goes as far as walls let, along them where one goes at them; up and down with the floor. */
  private go(step: Vector3): void {
    const { camera } = this.stage;
    const left = step.clone();
    for (let attempt = 0; attempt < 3 && left.lengthSq() > 1e-12; attempt += 1) {
      const obstacle = this.obstacle(left);
      if (!obstacle) {
        camera.position.add(left);
        break;
      }
      // Up to the wall; of the rest, what would go into it is lost, what goes along it stays.
      const share = obstacle.room / left.length();
      camera.position.addScaledVector(left, share);
      left.multiplyScalar(1 - share);
      left.addScaledVector(obstacle.normal, -left.dot(obstacle.normal));
    }
    this.stand(step.length());
    this.stage.change();
  }

  private height(): number {
    return EYE * this.scale;
  }

  /** The level normal of what a body would meet on its way and how far it gets, if it meets anything: rays at the knee, the
   *  hip and the eyes. Backs that are not seen are not in the way either: so one comes out of what one stands in. */
  private obstacle(step: Vector3): { normal: Vector3; room: number } | null {
    const { position } = this.stage.camera;
    const direction = step.clone().normalize();
    const reach = step.length() + RADIUS * this.scale;
    const floor = this.floor();
    const height = floor === null ? this.height() : Math.min(this.height(), position.y - floor);
    let nearest: { distance: number; normal: Vector3 } | null = null;
    const side = new Vector3(-direction.z, 0, direction.x).multiplyScalar(0.7 * RADIUS * this.scale);
    for (const below of [0, 0.45, 0.9 - STEP * 0.5]) {
      for (const across of [0, -1, 1]) {
        const from = position.clone().addScaledVector(side, across);
        from.y -= below * height;
        const hit = this.stage.cast(from, direction, reach);
        if (!hit || (nearest && hit.distance >= nearest.distance)) continue;
        const normal = new Vector3(hit.normal.x, 0, hit.normal.z);
        if (normal.lengthSq() < 1e-3) continue;
        nearest = { distance: hit.distance, normal: normal.normalize() };
      }
    }
    if (!nearest || nearest.normal.dot(direction) > -1e-3) return null;
    return { normal: nearest.normal, room: Math.max(0, nearest.distance - RADIUS * this.scale) };
  }

  private floor(): number | null {
    const { position } = this.stage.camera;
    const hit = this.stage.cast(position, new Vector3(0, -1, 0), 2.2 * this.height(), DoubleSide);
    return hit ? hit.point.y : null;
  }

  /** Feet to the floor after a way, if it is near enough to step on; where one flies above it, or there is none, nothing. */
  private stand(way: number): void {
    const { position } = this.stage.camera;
    const floor = this.floor();
    if (floor === null) return;
    const wanted = floor + this.height();
    if (Math.abs(position.y - wanted) < STEP * this.height()) {
      position.y += (1 - Math.exp(-way / (SETTLE * this.scale))) * (wanted - position.y);
    }
  }
}
