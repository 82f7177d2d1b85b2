// Exposure as the program chooses it for pictures, but that it leaves out what shines by itself: the median of what is seen at 0.24 of white, the brightest tenth below 0.8.
// It follows the camera, as eyes do. While one looks the same way, changes do not move it: what is dimmed looks darker, and what else
// is there looks no brighter for it. Only where light becomes so bright that the picture would be white it goes down, and back.
import type { Stage } from './stage';
import { shared } from './surface';
import { rangeOf, ticks } from './scale';

/** Milliseconds between looks at the meter, and how long the eye takes. */
const EVERY = 250;
const ADAPTATION = 180;

/** By how much a picture may become brighter than it would be chosen before exposure goes down, log2: then half of what is seen is
 *  above 0.48 of white. */
const GLARE = 1;

/** The most that exposure can be set to, either way, log2: the sun itself and starlight are within. */
export const MOST = 30;

export class Exposure {
  /** log2 of the factor from cd/m² to the display. */
  value = 0;
  isAutomatic = true;
  /** The scale of false colours, lx. */
  range: [number, number] = [10, 1000];
  isRangeAutomatic = true;
  levels: number[] = [];
  /** What alone has colours of the scale, lx, but for what is seen. */
  coloured: () => number[] | null = () => null;
  /** What is shown is not light: eyes stay as they are. */
  isBlind = false;
  /** What the meter saw last, and from where. */
  seen: { picture: Float32Array; view: string } | null = null;
  private wanted = 0;
  private isDue = false;
  private last = 0;
  private hasLight = false;
  /** Another light than before is shown, and the meter has not seen it: how many times there was one. */
  private isNew = false;
  private shown = 0;
  /** What it was before the first change in this view; not higher until the camera moves. */
  private most: number | null = null;
  /** From where one looks. */
  view = '';

  constructor(private stage: Stage, private changed: () => void) {
    this.scale([10, 1000]);
  }

  /** Light has come. */
  lit(): void {
    this.isDue = true;
  }

  /** Something was changed: exposure stays, so that one sees what it does. */
  hold(): void {
    if (this.hasLight) this.most ??= this.wanted;
  }

  /** Looks again soon. */
  meter(): void {
    this.isDue = true;
    this.last = 0;
  }

  /** Another light is shown from now on. */
  show(): void {
    this.isNew = true;
    this.shown += 1;
    this.free();
  }

  /** Looks again soon, as in a new view. */
  free(): void {
    this.most = null;
    this.meter();
  }

  set(value: number): void {
    this.isAutomatic = false;
    this.value = this.wanted = Math.max(-MOST, Math.min(MOST, value));
    this.apply();
  }

  automatic(): void {
    this.isAutomatic = true;
    this.free();
    this.changed();
  }

  setRange(range: [number, number] | null): void {
    this.isRangeAutomatic = range === null;
    if (range) this.scale(range);
    this.meter();
    this.changed();
  }

  private scale(range: [number, number]): void {
    this.range = range;
    this.levels = ticks(range[0], range[1], 14);
    shared.range.value = range;
    this.levels.forEach((level, i) => { shared.levels.value[i] = level; });
    shared.levelCount.value = this.levels.length;
    this.stage.change();
  }

  private apply(): void {
    shared.exposure.value = 2 ** this.value;
    this.stage.change();
    this.changed();
  }

  /** Lets time pass, milliseconds. */
  update(now: number, passed: number): void {
    if (this.isAutomatic && Math.abs(this.wanted - this.value) > 0.01) {
      this.value += (this.wanted - this.value) * (1 - Math.exp(-passed / ADAPTATION));
      if (Math.abs(this.wanted - this.value) <= 0.01) this.value = this.wanted;
      this.apply();
    }
    const { camera } = this.stage;
    const view = `${camera.matrixWorld.elements.join()} ${camera.fov} ${camera.aspect}`;
    if (view !== this.view) {
      this.view = view;
      this.most = null;
      this.isDue = true;
    }
    if (this.isNew && this.isDue) this.fit(this.stage.sampled());
    if (!this.isDue || now - this.last < EVERY) return;
    this.isDue = false;
    this.last = now;
    void this.look();
  }

  /** Fits the scale to light that is seen, unless it was set. */
  private fit(illuminance: number[]): void {
    const range = this.isRangeAutomatic ? (rangeOf(this.coloured() ?? []) ?? rangeOf(illuminance)) : null;
    if (!range || (range[0] === this.range[0] && range[1] === this.range[1])) return;
    this.scale(range);
    this.changed();
  }

  private async look(): Promise<void> {
    const { view, shown } = this;
    const seen = await this.stage.metering();
    // What was shown before is of no use.
    if (!seen || shown !== this.shown) {
      this.isDue = true;
      return;
    }
    if (seen.illuminance.length > 0) this.isNew = false;
    this.seen = { picture: seen.picture, view };
    // In the dark eyes stay as they are.
    if (this.isAutomatic && !this.isBlind && seen.luminance.length > 0) {
      seen.luminance.sort((a, b) => a - b);
      const at = (share: number) => Math.max(seen.luminance[Math.floor((seen.luminance.length - 1) * share)], 1e-30);
      const chosen = Math.log2(Math.min(0.24 / at(0.5), 0.8 / at(0.9)));
      this.wanted = this.most === null ? chosen : Math.min(this.most, chosen + GLARE);
      if (!this.hasLight) {
        // The first light comes up from the dark.
        this.hasLight = true;
        this.value = this.wanted - 5;
        this.apply();
      }
    }
    this.fit(seen.illuminance);
  }
}
