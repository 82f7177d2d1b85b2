// Places of an element that is cut, row by row as the server counts them.

/** Where a row of places begins. */
export const row = (parts: number, j: number) => j * (parts + 1) - (j * (j - 1)) / 2;

/** Whether a place sees the lamp, by bits. */
export const isLit = (bits: Uint32Array, place: number) => ((bits[place >> 5] >>> (place & 31)) & 1) === 1;

/** The lines between places next to each other of which one sees the lamp: of each place in turn to the next one of its row, the one above, and the one before that. */
export function crossed(parts: number, bits: Uint32Array): [number, number][] {
  const lines: [number, number][] = [];
  for (let j = 0; j <= parts; j += 1) {
    for (let i = 0; i <= parts - j; i += 1) {
      const [here, above] = [row(parts, j) + i, row(parts, j + 1) + i];
      const ends = i + j < parts ? [here + 1, above] : [];
      if (i > 0) ends.push(above - 1);
      for (const end of ends) if (isLit(bits, here) !== isLit(bits, end)) lines.push([here, end]);
    }
  }
  return lines;
}
