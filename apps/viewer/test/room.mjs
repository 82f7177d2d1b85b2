// A closed room as .obj whose walls are fans of triangles of many sizes, and so are cut into elements more or less finely: corners
// of one lie on edges of others, within walls and between them. The ceiling is strips around a panel, whose corners lie so, too.
const [WIDTH, HEIGHT, DEPTH] = [4.3, 2.9, 5.7];

/** Turned, so that no coordinate is a round number. */
const placed = ([x, y, z]) => {
  const [sine, cosine] = [Math.sin(0.37), Math.cos(0.37)];
  return [cosine * x + sine * z + 0.123, y + 0.077, cosine * z - sine * x - 0.211];
};

/** The middle of the room. */
export const middle = placed([0, HEIGHT / 2, 0]);

/** The room as .obj. */
export function room() {
  const corner = (x, y, z) => [(x - 0.5) * WIDTH, y * HEIGHT, (z - 0.5) * DEPTH];
  // Each wall from a corner along two sides; counter-clockwise as seen from within.
  const walls = {
    floor: [[0, 0, 1], [1, 0, 0], [0, 0, -1]],
    ceiling: [[0, 1, 0], [1, 0, 0], [0, 0, 1]],
    back: [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
    front: [[1, 0, 1], [-1, 0, 0], [0, 1, 0]],
    left: [[0, 0, 1], [0, 0, -1], [0, 1, 0]],
    right: [[1, 0, 0], [0, 0, 1], [0, 1, 0]],
  };
  const lines = [];
  let count = 0;
  const on = ([from, along, up]) => ([u, v]) => `v ${placed(corner(...from.map((x, k) => x + u * along[k] + v * up[k]))).join(' ')}`;
  Object.entries(walls).forEach(([name, sides], wall) => {
    if (name === 'ceiling') return;
    // Around, with a corner more on one side; the hub is near a corner, so that triangles are of many sizes.
    const border = [[0, 0], [0.31, 0], [1, 0], [1, 1], [0, 1]];
    lines.push(`o ${name}`, ...[[0.13 + 0.05 * wall, 0.83], ...border].map(on(sides)));
    border.forEach((_, i) => lines.push(`f ${count + 1} ${count + 2 + i} ${count + 2 + ((i + 1) % border.length)}`));
    count += 1 + border.length;
  });
  const quad = ([u, v, width, height]) => {
    lines.push(...[[u, v], [u + width, v], [u + width, v + height], [u, v + height]].map(on(walls.ceiling)));
    lines.push(`f ${[1, 2, 3, 4].map((k) => count + k).join(' ')}`);
    count += 4;
  };
  lines.push('o ceiling');
  for (const strip of [[0, 0, 1, 0.13], [0, 0.13, 0.31, 0.09], [0.57, 0.13, 0.43, 0.09], [0, 0.22, 1, 0.61], [0, 0.83, 1, 0.17]]) quad(strip);
  lines.push('o panel');
  quad([0.31, 0.13, 0.26, 0.09]);
  return lines.join('\n');
}
