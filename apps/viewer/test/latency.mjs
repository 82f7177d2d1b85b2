// How long pages wait, without one: [THING=NAME] node --experimental-websocket latency.mjs PROGRAM [SCENE and options of `view`]...
// Milliseconds from the start of the program and from each change to the first complete update, as a page would receive it.
import { spawn } from 'node:child_process';
import { createInterface } from 'node:readline';

const [program, ...options] = process.argv.slice(2);
const begin = performance.now();
const child = spawn(program, ['view', '--json', '--no-open', ...options], { stdio: ['ignore', 'pipe', 'inherit'] });
const url = await new Promise((found) => {
  createInterface(child.stdout).on('line', (line) => {
    const event = JSON.parse(line);
    if (event.event === 'listening') found(new URL(event.url));
  });
});
const listening = performance.now() - begin;

const socket = new WebSocket(`ws://${url.host}${url.pathname}socket`, { headers: { origin: url.origin } });
socket.binaryType = 'arraybuffer';
const [objects, lights] = [new Map(), new Map()];
let status = null;
let bytes = 0;
let wake = () => {};
let opened = null;
let lit = null;
socket.onopen = () => socket.send(JSON.stringify({ kind: 'layer', layer: 'total', epoch: 1 }));
socket.onmessage = ({ data }) => {
  if (typeof data === 'string') {
    const notice = JSON.parse(data);
    if (notice.kind === 'object') objects.set(notice.id, notice);
    if (notice.kind === 'light') lights.set(notice.id, notice);
    if (notice.kind === 'caught_up') opened = performance.now() - begin;
    if (notice.kind === 'status') {
      status = notice;
      if (status.rays > 0) lit ??= performance.now() - begin;
    }
  } else {
    bytes += data.byteLength;
  }
  wake();
};
const until = async (is) => {
  while (!is()) await new Promise((done) => { wake = done; });
};
await until(() => status?.is_done);
const converged = performance.now() - begin;

/** Makes changes one after the other; the median of milliseconds that each took, and of bytes that came. */
async function changes(name, count, edit) {
  const [times, sizes] = [[], []];
  for (let i = 0; i < count; i += 1) {
    await until(() => status.is_done);
    const [before, edits, came] = [performance.now(), status.edits, bytes];
    socket.send(JSON.stringify({ kind: 'edit', edit: edit(i) }));
    await until(() => status.edits > edits && status.doing !== 'Following the change');
    times.push(performance.now() - before);
    sizes.push(bytes - came);
  }
  const median = (list) => list.sort((a, b) => a - b)[Math.floor(list.length / 2)];
  console.log(`${name}: ${median(times).toFixed(0)} ms (${Math.min(...times).toFixed(0)} to ${Math.max(...times).toFixed(0)}), ${(median(sizes) / 1000).toFixed(0)} kB`);
}

console.log(`${status.elements} elements; listening after ${listening.toFixed(0)} ms, scene there after ${opened.toFixed(0)} ms, ` +
  `first light after ${lit.toFixed(0)} ms, done after ${(converged / 1000).toFixed(1)} s`);
const light = [...lights.values()][0];
const things = [...objects.values()].filter((object) => object.movable && !object.deleted);
const thing = things.find((object) => object.name === process.env.THING) ?? things[0];
const group = things.filter((object) => object.group === thing.group);
await changes(`dimming '${light.name}'`, 11, (i) => ({ light: { light: light.id, dimming: 0.3 + 0.05 * i, colour: [1, 1, 1] } }));
await changes(`painting '${thing.name}'`, 11, (i) => ({ reflectance: { object: thing.id, reflectance: [0.2, 0.3 + 0.03 * i, 0.4] } }));
await changes(`moving '${thing.name}'`, 11, (i) => ({
  several: group.map(({ id }) => ({ move: { object: id, matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.02 * (i + 1), 0, 0.01 * (i + 1), 1] } })),
}));
socket.close();
child.kill('SIGINT');
