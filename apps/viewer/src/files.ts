// Pictures of what is seen, and tables of what was measured.
import type { App } from './app';
import { drawOver } from './legend';
import { measured } from './plane';

/** Hands the points of the grid or of the plane to the person: with normals, as `radiosity measure` reads points. */
export function savePoints(app: App): void {
  const { measuring: { grid, plane }, stage } = app;
  const [u, v] = plane?.answer?.axes ?? [[], []];
  const up = grid ? (grid.answer?.normal ?? stage.toScene(grid.normal).toArray()) : [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const row = ({ point, lux }: ReturnType<typeof measured>[number]) =>
    [...stage.toScene(point).toArray().map((x) => Number(x.toPrecision(9))), ...up.map((x) => x.toFixed(6)), lux.toPrecision(6)].join(',');
  const read = grid && app.layer;
  const column = read === 'relative_error' ? 'noise_percent' : read === 'error' ? 'noise_lux' : 'page_lux';
  const rows = [`x,y,z,nx,ny,nz,${column}`, ...measured(app).map(row), ''];
  save(app, new Blob([rows.join('\n')], { type: 'text/csv' }), plane ? 'plane.csv' : 'grid.csv');
  app.say('Points saved, each with its place and normal.');
}

/** Hands a file to the person, named after the scene. */
function save(app: App, blob: Blob, ending: string): string {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = `${app.scene?.name || 'scene'}${ending.startsWith('.') ? '' : '-'}${ending}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
  return link.download;
}

/** Hands the picture on the screen to the person, with what was measured and the scale of its colours. */
export function screenshot(app: App): void {
  const { canvas } = app.stage;
  const show = app.marks.hide();
  app.stage.drawSharp();
  const pen = Object.assign(document.createElement('canvas'), { width: canvas.width, height: canvas.height }).getContext('2d')!;
  // At once: the browser may forget what was drawn when it shows the page.
  pen.drawImage(canvas, 0, 0);
  show();
  app.stage.change();
  drawOver(app, pen);
  pen.canvas.toBlob((blob) => {
    if (!blob) return app.say('The picture could not be made.');
    app.say(`Screenshot saved as ${save(app, blob, `${next(app)}.png`)}.`);
  }, 'image/png');
}

/** The number of the next picture of a scene: each is a file of its own, also when the page was opened anew. */
function next(app: App): number {
  const key = `radiosity.pictures.${app.scene?.name ?? ''}`;
  try {
    pictures = Math.max(pictures, Number(localStorage.getItem(key)) || 0);
    localStorage.setItem(key, String(pictures + 1));
  } catch {
    // Where nothing may be kept, pictures are counted from one whenever the page is opened.
  }
  pictures += 1;
  return pictures;
}

let pictures = 0;
