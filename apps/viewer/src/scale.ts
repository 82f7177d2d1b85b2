// The scale of false colours: round numbers of lux, evenly apart for the eye.

/** The map "inferno" of matplotlib (CC0) at equal steps: lightness rises evenly, so that more light looks like more light. */
export const PALETTE: [number, number, number][] = [
  [0, 0, 4], [27, 12, 65], [74, 12, 107], [120, 28, 109], [165, 44, 96], [207, 68, 70], [237, 105, 37], [251, 155, 6], [247, 209, 61],
  [252, 255, 164],
].map(([r, g, b]) => [r / 255, g / 255, b / 255]);

/** The colour of an illuminance on a scale, as the surfaces have it. */
export function falseColour(lux: number, [low, high]: number[]): number[] {
  const share = Math.log(Math.max(lux, 1e-9) / low) / Math.log(high / low);
  const at = Math.min(1, Math.max(0, share)) * (PALETTE.length - 1);
  const i = Math.min(Math.floor(at), PALETTE.length - 2);
  return PALETTE[i].map((x, k) => x + (at - i) * (PALETTE[i + 1][k] - x));
}

/** Most lines of equal illuminance. */
export const LEVELS = 24;

const STEPS = [[1], [1, 2, 5], [1, 1.5, 2, 3, 5, 7]];

/** Round numbers from low to high, as fine as their number allows. */
export function ticks(low: number, high: number, most: number): number[] {
  let best: number[] = [];
  for (const steps of STEPS) {
    const found: number[] = [];
    for (let decade = Math.floor(Math.log10(low)) - 1; decade <= Math.log10(high) + 1; decade += 1) {
      for (const step of steps) {
        const value = Number((step * 10 ** decade).toPrecision(3));
        if (value >= low * 0.999 && value <= high * 1.001) found.push(value);
      }
    }
    if (found.length > most) break;
    best = found;
  }
  return best;
}

/** How much more and less than the median of what is seen the scale holds: a garden behind a window is a hundred times as bright as the
 *  room, and would leave it one colour. Less, and patches of lamps on walls would be cut off. */
const [ABOVE, BELOW] = [10, 30];

/** The round numbers about the middle 96 % of what is seen, not too far from the median. */
export function rangeOf(values: number[]): [number, number] | null {
  const lit = values.filter((v) => v > 0).sort((a, b) => a - b);
  if (lit.length < 8) return null;
  const at = (share: number) => lit[Math.floor((lit.length - 1) * share)];
  const high = Math.min(at(0.98), ABOVE * at(0.5));
  const low = Math.max(at(0.02), at(0.5) / BELOW);
  const round = (x: number, up: boolean) => {
    const decade = 10 ** Math.floor(Math.log10(x));
    const steps = [1, 1.5, 2, 3, 5, 7, 10];
    const lead = x / decade;
    const step = up ? steps.find((s) => s >= lead * 0.999) : steps.findLast((s) => s <= lead * 1.001);
    return Number(((step ?? 1) * decade).toPrecision(2));
  };
  const [from, to] = [round(low, false), round(high, true)];
  return to > from ? [from, to] : [from, 2 * from];
}

/** A number as people read it: three digits. */
export function readable(x: number): string {
  if (!Number.isFinite(x)) return '–';
  if (x === 0) return '0';
  const size = Math.abs(x);
  if (size >= 1e6) return x.toExponential(1);
  const decimals = Math.max(0, Math.min(6, 2 - Math.floor(Math.log10(size))));
  return Number(x.toPrecision(3)).toLocaleString('en', { maximumFractionDigits: decimals, useGrouping: size >= 1e4 });
}

/** A place along an axis, metres. Far away, as on a map, single precision tells no more than eight digits. */
export function coordinate(x: number, decimals: number): string {
  if (Math.abs(x) >= 1e8) return x.toExponential(3);
  const before = Math.floor(Math.log10(Math.max(1, Math.abs(x)))) + 1;
  return x.toFixed(Math.max(0, Math.min(decimals, 8 - before)));
}
