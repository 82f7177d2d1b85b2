// three.js in a headless Chromium, with a model loaded: open(MODEL.glb) gives
//   measure(points)      irradiance (lx per band) that is shown at points [x, y, z, nx, ny, nz], NaN where nothing is
//   picture(file, view)  a PNG as the viewer draws it
// page.html is what the browser sees.
import { createServer } from 'node:http';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { dirname, extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const here = dirname(fileURLToPath(import.meta.url));
const three = join(here, '..', 'node_modules', 'three');
const types = { '.html': 'text/html', '.js': 'text/javascript', '.glb': 'model/gltf-binary' };

/// `plugin`: whether the viewer knows MOZ_lightmap; without it, it is three.js as everybody has it.
export async function open(model, { executablePath = '/usr/bin/chromium', plugin = true } = {}) {
  const server = createServer(async (request, response) => {
    const path = normalize(new URL(request.url, 'http://localhost').pathname);
    const file = path === '/' ? join(here, 'page.html')
      : path === '/model.glb' ? model
        : path.startsWith('/three/') ? join(three, path.slice('/three/'.length)) : null;
    try {
      const body = await readFile(file);
      response.writeHead(200, { 'content-type': types[extname(file)] ?? 'application/octet-stream' }).end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  const profile = await mkdtemp(join(tmpdir(), 'lightmap-check-'));
  let browser;
  const close = async () => {
    await browser?.close();
    server.close();
    await rm(profile, { recursive: true, force: true });
  };
  try {
    browser = await chromium.launchPersistentContext(profile, {
      executablePath,
      headless: true,
      args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-quic', '--no-first-run',
        '--disable-background-networking', '--disable-component-update', '--disable-sync'],
    });
    const page = await browser.newPage();
    const faults = [];
    page.on('console', (message) => {
      if (message.type() === 'error') faults.push(message.text());
    });
    page.on('pageerror', (error) => faults.push(String(error)));
    await page.goto(`http://127.0.0.1:${server.address().port}/`);
    await page.waitForFunction(() => window.ready === true);
    await page.evaluate((plugin) => window.load(plugin), plugin);
    const rejected = () => {
      if (faults.length > 0) throw new Error(`page: ${faults.join('; ')}`);
    };
    rejected();
    return {
      close,
      async measure(points, { reach } = {}) {
        const rows = await page.evaluate(([points, reach]) => window.measure(points, reach), [points, reach]);
        rejected();
        return rows.map((row) => row ?? [NaN, NaN, NaN]);
      },
      /// `view`: width, height, eye, target, fov (degrees, vertical), exposure (factor; chosen where missing), lamps
      /// (whether the file's own lights shine as well). Returns the exposure.
      async picture(file, view) {
        const [url, exposure] = await page.evaluate((view) => window.picture(view), view);
        rejected();
        await writeFile(file, Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
        return exposure;
      },
    };
  } catch (error) {
    await close();
    throw error;
  }
}
