// How far the picture is off: the noise of all light together is that of its brightest part, a lawn in the sun, and knows nothing of
// edges of shadows. The server measures at places in sight, when the camera rests or the light is another.
import type { App } from './app';

/** Milliseconds between looks. */
const EVERY = 300;

export class Sight {
  /** Relative error of what is shown in sight; none while it is not known. */
  error: number | null = null;
  private question = 0;
  /** From where it was asked, and of which light. */
  private asked = '';
  private view = '';

  constructor(private app: App) {
    setInterval(() => this.look(), EVERY);
  }

  /** All is there, and nothing is asked yet: what was asked on a connection that is lost has no answer. */
  begin(): void {
    this.asked = '';
  }

  /** The server says how far it is. */
  hear(question: number, error: number | null): void {
    if (question === this.question) this.put(error);
  }

  private put(error: number | null): void {
    this.error = error;
    this.app.tell('sight');
  }

  private look(): void {
    const { stage, status, connection, isCaughtUp } = this.app;
    const { matrix } = stage.place('');
    const { angle: fov, camera: { aspect } } = stage;
    const view = JSON.stringify([matrix, fov, aspect]);
    const isStill = view === this.view;
    this.view = view;
    if (!isCaughtUp || !status) return;
    if (status.error === null) {
      // As long as nothing is known of the light, nothing is known of a part of it.
      this.asked = '';
      if (this.error !== null) this.put(null);
      return;
    }
    const now = `${view} ${status.rays} ${status.edits} ${status.error} ${status.is_done}`;
    if (!isStill || now === this.asked) return;
    this.question += 1;
    if (connection.send({ kind: 'in_sight', question: this.question, matrix, fov, aspect })) this.asked = now;
  }
}
