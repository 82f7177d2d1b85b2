// Exposure as the program chooses it for pictures: the median of what is seen at 0.24 of white, the brightest tenth below 0.8.
import type { Stage } from './stage';
import { shared } from './surface';
import { rangeOf, ticks } from './scale';

/** Milliseconds between looks at the meter, and how long the eye takes. */
const EVERY = 250;
const ADAPTATION = 180;

export class Exposure {
  /** log2 of the factor from cd/m² to the display. */
  value = 0;
  isAutomatic = true;
  /** The scale of false colours, lx. */
  range: [number, number] = [10, 1000];
  isRangeAutomatic = true;
  levels: number[] = [];
  private wanted = 0;
  private isDue = false;
  private last = 0;
  private hasLight = false;

  constructor(private stage: Stage, private changed: () => void) {
    this.scale([10, 1000]);
  }

  /** Light has come. */
  lit(): void {
    this.isDue = true;
  }

  /** Looks again soon. */
  meter(): void {
    this.isDue = true;
    this.last = 0;
  }

  set(value: number): void {
    this.isAutomatic = false;
    this.value = this.wanted = Math.max(-24, Math.min(24, value));
    this.apply();
  }

  automatic(): void {
    this.isAutomatic = true;
    this.meter();
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
    if (!this.isDue || now - this.last < EVERY) return;
    this.isDue = false;
    this.last = now;
    void this.look();
  }

  private async look(): Promise<void> {
    const seen = await this.stage.metering();
    if (!seen) {
      this.isDue = true;
      return;
    }
    if (this.isAutomatic && seen.luminance.length > 0) {
      seen.luminance.sort((a, b) => a - b);
      const at = (share: number) => Math.max(seen.luminance[Math.floor((seen.luminance.length - 1) * share)], 1e-30);
      this.wanted = Math.log2(Math.min(0.24 / at(0.5), 0.8 / at(0.9)));
      if (!this.hasLight) {
        // The first light comes up from the dark.
        this.hasLight = true;
        this.value = this.wanted - 5;
        this.apply();
      }
    }
    const range = this.isRangeAutomatic ? rangeOf(seen.illuminance) : null;
    if (range && (range[0] !== this.range[0] || range[1] !== this.range[1])) {
      this.scale(range);
      this.changed();
    }
  }
}
