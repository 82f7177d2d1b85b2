// A working plane above a picked floor, or a grid over a surface: the server measures them, with rays of each point. They are
// measured again when light changes, and say so while what they tell is older than what is seen.
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

/** Asks for the plane or the grid that is laid, one question at a time. */
export class Asker {
  private question = 0;
  private isWaiting = false;
  /** Whether light has changed since the question. */
  private isDue = false;

  constructor(private app: App) {}

  /** Asks for another plane or grid, whatever was asked before. */
  begin(): void {
    this.isWaiting = false;
    this.ask();
  }

  /** Asks again, at once or after the answer that is awaited. */
  ask(): void {
    this.isDue = this.isWaiting;
    if (this.isWaiting) return;
    const { measuring: { plane, grid }, connection, layer } = this.app;
    if (plane) {
      const { surface: { object }, triangle, uv, height, border } = plane;
      this.question += 1;
      this.isWaiting = connection.send({ kind: 'plane', question: this.question, about: { object, triangle, uv, height, border } });
    } else if (grid && layer === 'total') {
      grid.asked = open(grid);
      const places = grid.asked.map(({ triangle, uv: [v, w] }): [number, number, number] => [triangle, Number(v.toFixed(6)), Number(w.toFixed(6))]);
      this.question += 1;
      this.isWaiting = connection.send({ kind: 'survey', question: this.question, object: grid.surface.object, places });
    }
  }

  /** Takes an answer, if it is that to the last question, and asks the next one then: it may be about other points. */
  hear(question: number, take: () => void): void {
    if (question !== this.question || !this.isWaiting) return;
    this.isWaiting = false;
    take();
    if (this.isDue) this.ask();
  }
}

/** Whether a plane or a grid tells of light that still changes, or of a scene before the last change; else nothing. */
export function lateness({ measuring: { plane, grid }, status, layer }: App): string {
  if (!plane && (!grid || layer !== 'total')) return '';
  const answer = plane ? plane.answer : grid!.answer;
  if (!answer) return 'Measuring …';
  if (status && answer.edits < status.edits) return 'The numbers are those before the last change; new ones are on their way.';
  return answer.is_done ? '' : 'The light still gets finer; the numbers follow.';
}

/** The points that are written on the picture and saved: of the plane or of the grid. */
export function measured({ measuring: { plane, grid }, stage }: App): { point: Vector3; lux: number }[] {
  if (plane?.answer) return plane.answer.points.map(([x, y, z, lux]) => ({ point: stage.toWorld([x, y, z]), lux }));
  return grid ? open(grid) : [];
}
