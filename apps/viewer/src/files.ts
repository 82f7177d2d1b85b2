// Pictures of what is seen, and tables of what was measured.
import type { App } from './app';
import { measured } from './plane';

/** Hands the points of the grid or of the plane to the person: with normals, as `radiosity measure` reads points. */
export function savePoints(app: App): void {
  const { grid, plane, stage } = app;
  const normal = grid && stage.toScene(grid.normal);
  const [u, v] = plane?.answer?.axes ?? [[], []];
  const up = normal?.toArray() ?? [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
  const row = ({ point, lux }: ReturnType<typeof measured>[number]) =>
    [...stage.toScene(point).toArray().map((x) => x.toFixed(5)), ...up.map((x) => x.toFixed(6)), lux.toPrecision(6)].join(',');
  const rows = ['x,y,z,nx,ny,nz,illuminance_lux', ...measured(app).map(row), ''];
  save(app, new Blob([rows.join('\n')], { type: 'text/csv' }), plane ? 'plane.csv' : 'grid.csv');
  app.say('Points saved: place, normal, illuminance.');
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

/** Hands the picture on the screen to the person. */
export function screenshot(app: App): void {
  const { overlay, tools } = app.stage;
  overlay.visible = tools.visible = false;
  app.stage.drawNow();
  app.stage.canvas.toBlob((blob) => {
    overlay.visible = tools.visible = true;
    app.stage.change();
    if (!blob) return app.say('The picture could not be made.');
    app.say(`Screenshot saved as ${save(app, blob, '.png')}.`);
  }, 'image/png');
}
