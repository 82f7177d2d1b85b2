// What three.js draws of a lit model, as a picture:
//   node picture.mjs MODEL.glb OUT.png [--eye X,Y,Z] [--target X,Y,Z] [--fov 50] [--size 960x640] [--exposure FACTOR]
//     [--plain] [--lamps] [--white] [--chromium PATH]
// Without --eye: the model's first camera, or one outside that sees all of it. --plain: three.js without the
// MOZ_lightmap plugin. --lamps: the file's own lights shine as well. --white: the light alone, on white surfaces.
// --exposure: factor from cd/m² to display (1 for the unlit style); chosen by itself where missing.
import { parseArgs } from 'node:util';
import { open } from './viewer.mjs';

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    eye: { type: 'string' },
    target: { type: 'string' },
    fov: { type: 'string', default: '50' },
    size: { type: 'string', default: '960x640' },
    exposure: { type: 'string' },
    plain: { type: 'boolean', default: false },
    lamps: { type: 'boolean', default: false },
    white: { type: 'boolean', default: false },
    chromium: { type: 'string', default: '/usr/bin/chromium' },
  },
});
if (positionals.length !== 2) {
  console.error('usage: node picture.mjs MODEL.glb OUT.png [--eye X,Y,Z] [--target X,Y,Z] [--fov 50] [--size WxH] '
    + '[--exposure FACTOR] [--plain] [--lamps] [--white] [--chromium PATH]');
  process.exit(2);
}
const [model, out] = positionals;
const numbers = (text, separator) => text?.split(separator).map(Number);
const [width, height] = numbers(values.size, 'x');
const viewer = await open(model, { executablePath: values.chromium, plugin: !values.plain });
try {
  const view = {
    width, height, eye: numbers(values.eye, ','), target: numbers(values.target, ','), fov: Number(values.fov),
    exposure: values.exposure && Number(values.exposure), lamps: values.lamps, white: values.white,
  };
  const exposure = await viewer.picture(out, view);
  console.log(`${out}: exposure ${exposure.toPrecision(4)}`);
} finally {
  await viewer.close();
}
