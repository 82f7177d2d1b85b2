// A working plane above a picked floor: the server measures it, as its points lie in the air. It is measured again when light
// changes, and says so while what it tells is older than what is seen.
import type { Vector3 } from 'three';
import type { App } from './app';
import { open } from './grid';
import type { Surface } from './surface';
import type { PlaneAnswer } from './wire';

/** What EN 12464-1 takes where nothing else is agreed: desks, and half a metre along walls. Metres. */
export const HEIGHT = 0.75;
export const BORDER = 0.5;

/** A plane that was laid. */
export interface WorkingPlane {
  surface: Surface;
  /** The picked place: a triangle, and the weights of its corners 1 and 2. */
  triangle: number;
  uv: [number, number];
  /** Metres above it, and of the zone that is left out. */
  height: number;
  border: number;
  /** None until it has come. */
  answer: PlaneAnswer | null;
}

/** Asks for the plane that is laid, one question at a time. */
export class PlaneAsker {
  private question = 0;
  private isWaiting = false;
  /** Whether light has changed since the question. */
  private isDue = false;

  constructor(private app: App) {}

  /** Asks for another plane, whatever was asked before. */
  begin(): void {
    this.isWaiting = false;
    this.ask();
  }

  /** Asks again, at once or after the answer that is awaited. */
  ask(): void {
    const { measuring: { plane }, connection } = this.app;
    this.isDue = this.isWaiting;
    if (!plane || this.isWaiting) return;
    this.question += 1;
    const { surface: { object }, triangle, uv, height, border } = plane;
    this.isWaiting = connection.send({ kind: 'plane', question: this.question, about: { object, triangle, uv, height, border } });
  }

  /** Whether an answer is that to the last question. */
  hear(question: number): boolean {
    if (question !== this.question || !this.isWaiting) return false;
    this.isWaiting = false;
    if (this.isDue) this.ask();
    return true;
  }
}

/** Whether a plane tells of light that still changes, or of a scene before the last change; else nothing. */
export function lateness({ measuring: { plane }, status }: App): string {
  if (!plane) return '';
  if (!plane.answer) return 'Measuring …';
  if (status && plane.answer.edits !== status.edits) return 'The numbers are those before the last change; new ones are on their way.';
  return plane.answer.is_done ? '' : 'The light still gets finer; the numbers follow.';
}

/** The points that are written on the picture and saved: of the plane or of the grid. */
export function measured({ measuring: { plane, grid }, stage }: App): { point: Vector3; lux: number }[] {
  if (plane?.answer) return plane.answer.points.map(([x, y, z, lux]) => ({ point: stage.toWorld([x, y, z]), lux }));
  return grid ? open(grid) : [];
}
