// What is measured: the picked point and its rays, a grid over a surface, or a working plane.
import type { App } from './app';
import { cover } from './cover';
import { keepLaid, keptLaid } from './laid';
import { follow, lay, open, read, type Grid } from './grid';
import { Asker, BORDER, HEIGHT, type WorkingPlane } from './plane';
import { corners, type Hit, type Place } from './stage';
import type { Surface } from './surface';
import type { PlaneAnswer, ProbeAnswer, SurveyAnswer } from './wire';

/** What was measured at a point, and where it is. */
export interface Probed {
  hit: Hit;
  answer: ProbeAnswer | null;
}

export class Measuring {
  probed: Probed | null = null;
  raysShown = false;
  grid: Grid | null = null;
  /** A working plane; it or the grid is laid, not both. */
  plane: WorkingPlane | null = null;
  planeHeight = HEIGHT;
  planeBorder = BORDER;
  private asker: Asker;
  private question = 0;
  private hasBegun = false;
  /** Of which light was asked last. */
  private asked = '';
  /** Moves of things up to which it is known what covers the grid. */
  private gridMoves = 0;

  constructor(private app: App) {
    this.asker = new Asker(app);
  }

  // What the server says.

  hearProbe(question: number, answer: ProbeAnswer | null): void {
    if (!this.probed || question !== this.question) return;
    this.probed.answer = answer;
    this.app.tell('probe');
  }

  hearRays(question: number, rays: number[][][]): void {
    if (question === this.question) this.app.marks.rays(rays);
  }

  hearPlane(question: number, answer: PlaneAnswer | null, why: string | null): void {
    this.asker.hear(question, () => this.tellPlane(answer, why));
  }

  hearSurvey(question: number, answer: SurveyAnswer): void {
    this.asker.hear(question, () => {
      if (!this.grid) return;
      this.grid.asked.forEach((point, i) => { point.measured = answer.lux[i]; });
      this.grid.answer = answer;
      this.readGrid();
    });
  }

  /** All is there, for the first time or again after the connection was lost. */
  begin(): void {
    if (!this.hasBegun) this.restore();
    this.hasBegun = true;
    this.asker.begin();
  }

  /** What was laid on an object, before the connection was lost, lies on the new surface of it. */
  replace(surface: Surface): void {
    for (const laid of [this.grid, this.plane, this.probed?.hit]) if (laid?.surface.object === surface.object) laid.surface = surface;
  }

  /** A surface is gone, and what was laid on it. */
  lose(surface: Surface): void {
    if ((this.grid ?? this.plane)?.surface === surface) this.clearGrid();
    if (this.probed?.hit.surface === surface) this.clearProbe();
  }

  /** Light has come: what was read before is read again. */
  outdate(): void {
    this.asked = '';
  }

  /** Asks again what depends on light, where that is another one than was asked of. */
  refresh(light: string): void {
    if (light === this.asked) return;
    this.asked = light;
    this.askProbe();
    if (this.grid) this.readGrid();
    this.asker.ask();
  }

  // What a person does.

  /** Measures what is at a place of the canvas (−1..1 right and up) and selects its object. */
  pick(x: number, y: number): void {
    const hit = this.app.stage.pick(x, y);
    if (!hit) {
      this.clearProbe();
      this.app.select(null);
      return;
    }
    this.probed = { hit, answer: null };
    this.app.marks.point(hit);
    this.app.select(hit.surface.object);
    this.askProbe();
    this.app.tell('probe');
  }

  /** Whether the point that is picked, or none, still is, and nothing else is laid meanwhile. */
  private whileProbed(): () => boolean {
    const { probed, grid, plane } = this;
    return () => this.probed === probed && this.grid === grid && this.plane === plane;
  }

  private clearProbe(): void {
    this.probed = null;
    this.app.marks.point(null);
    this.app.marks.rays([]);
    this.app.tell('probe');
  }

  /** What is marked on a surface goes with it. */
  follow(surface: Surface): void {
    this.app.marks.follow(surface);
    if (this.grid?.surface === surface) this.readGrid();
    const hit = this.probed?.hit;
    if (hit?.surface !== surface) return;
    const [a, b, c] = corners(surface, hit.triangle).map((corner) => corner.applyMatrix4(surface.matrixWorld));
    const [v, w] = hit.uv;
    hit.point.copy(a).multiplyScalar(1 - v - w).addScaledVector(b, v).addScaledVector(c, w);
    hit.normal.copy(b.sub(a).cross(c.sub(a)).normalize());
    this.app.marks.point(hit);
  }

  private askProbe(): void {
    if (!this.probed) return;
    const { surface, triangle, uv } = this.probed.hit;
    if (!this.app.stage.surfaces.has(surface.object)) return;
    this.question += 1;
    const about = { question: this.question, object: surface.object, triangle };
    this.app.connection.send({ kind: 'probe', ...about, uv });
    if (this.raysShown) this.app.connection.send({ kind: 'rays', ...about });
  }

  showRays(is: boolean): void {
    this.raysShown = is;
    if (!is) this.app.marks.rays([]);
    else if (this.probed) this.askProbe();
    else this.app.say('Pick a point first: its rays are drawn then.', this.whileProbed());
    this.app.tell('view');
  }

  /** Lays a grid of measuring points over the surface that was picked. */
  measure(): void {
    if (!this.probed) return this.app.say('Pick a point of a surface first: the grid is laid over it.', this.whileProbed());
    this.plane = null;
    this.app.marks.plane(null);
    if (!this.layGrid(this.probed.hit)) this.app.say('There is no plane surface to lay a grid over.', this.whileProbed());
    this.asker.begin();
    this.app.tell('view');
  }

  /** Lays a grid where there is a plane surface; whether there is. */
  private layGrid(place: Place): boolean {
    this.grid = lay(place);
    const isLaid = this.grid !== null;
    this.gridMoves = -1;
    this.keep();
    this.readGrid();
    return isLaid;
  }

  /** Keeps for this tab what is laid. */
  private keep(): void {
    const { grid, plane } = this;
    if (grid) keepLaid({ object: grid.surface.object, ...grid.picked });
    else if (plane) keepLaid({ object: plane.surface.object, triangle: plane.triangle, uv: plane.uv, plane: { height: plane.height, border: plane.border } });
    else keepLaid(null);
  }

  /** Lays what was laid before the page was loaded anew, where that is still there. */
  private restore(): void {
    const laid = keptLaid();
    const surface = laid && this.app.stage.surfaces.get(laid.object);
    if (!surface?.visible || laid!.triangle * 3 >= surface.geometry.index!.count) return;
    const { triangle, uv, plane } = laid!;
    if (!plane) return void this.layGrid({ surface, triangle, uv });
    [this.planeHeight, this.planeBorder] = [plane.height, plane.border];
    this.plane = { surface, triangle, uv, ...plane, answer: null };
    this.app.tell('grid');
    this.app.tell('view');
  }

  /** Lays a working plane above the floor that was picked. */
  measurePlane(): void {
    if (!this.probed) return this.app.say('Pick a point of a floor first: the working plane is laid above it.', this.whileProbed());
    this.clearGrid();
    this.app.say('');
    const { surface, triangle, uv } = this.probed.hit;
    this.plane = { surface, triangle, uv, height: this.planeHeight, border: this.planeBorder, answer: null };
    this.keep();
    this.asker.begin();
    this.app.tell('grid');
  }

  /** The plane that is laid gets another height or another zone along the walls, metres. */
  setPlane(height: number, border: number): void {
    [this.planeHeight, this.planeBorder] = [height, border];
    if (this.plane) {
      // Numbers of the old plane would be taken for those of this one.
      Object.assign(this.plane, { height, border, answer: null });
      this.keep();
      this.app.marks.plane(null);
      this.asker.begin();
    }
    this.app.tell('grid');
    this.app.tell('view');
  }

  private tellPlane(answer: PlaneAnswer | null, why: string | null): void {
    if (!this.plane) return;
    if (!answer) {
      this.clearGrid();
      return this.app.say(why ?? '', this.whileProbed());
    }
    this.plane.answer = answer;
    this.app.exposure.meter();
    this.app.marks.plane(answer);
    this.app.tell('grid');
    this.app.tell('view');
  }

  /** The grid where its surface is now, in the light of now. */
  private readGrid(): void {
    if (this.grid && this.gridMoves !== this.app.stage.moves) {
      this.gridMoves = this.app.stage.moves;
      cover(this.app, this.grid, follow(this.grid));
    }
    if (this.grid && open(this.grid).length === 0) {
      this.clearGrid();
      return this.app.say('All points of the grid lie beneath things.', this.whileProbed());
    }
    if (this.grid) read(this.grid, this.app.layer === 'total', this.app.stage);
    this.app.marks.grid(this.grid);
    this.app.tell('grid');
  }

  clearGrid(): void {
    this.grid = this.plane = null;
    this.keep();
    this.app.marks.grid(null);
    this.app.marks.plane(null);
    this.app.tell('grid');
    this.app.tell('view');
  }
}
