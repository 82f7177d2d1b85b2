// The scale of false colours, and the numbers of a grid, over the picture.
import { Vector3 } from 'three';
import type { App } from './app';
import { el } from './panels/parts';
import { measured } from './plane';
import { PALETTE, readable } from './scale';
import { shared } from './surface';

export function legend(app: App): HTMLElement {
  const colours = PALETTE.map((c, i) => `rgb(${c.map((x) => Math.round(255 * x)).join(' ')}) ${(100 * i) / (PALETTE.length - 1)}%`);
  const bar = el('i', { style: `background:linear-gradient(to top, ${colours.join(', ')})` });
  const marks = el('div', { class: 'ticks' });
  const unit = el('span', { class: 'unit' }, 'lx');
  const element = el('aside', { class: 'legend', id: 'legend', 'aria-label': 'Scale of illuminance' }, unit, el('div', { class: 'scale' }, bar, marks));
  app.on('view', () => {
    const isColoured = app.falseColours || app.layer === 'error' || Boolean(app.plane?.answer);
    element.hidden = !isColoured && !shared.isolines.value;
    bar.hidden = !isColoured;
    app.marks.colourPlane();
    const [low, high] = app.exposure.range;
    const place = (value: number) => (100 * Math.log(value / low)) / Math.log(high / low);
    marks.replaceChildren(...app.exposure.levels.map((level) => el('span', { style: `bottom:${place(level)}%` }, readable(level))));
  });
  return element;
}

/** Most numbers that are written on the picture. */
const WRITTEN = 150;

/** Numbers at the points of a grid; they follow the camera. */
export function gridNumbers(app: App): { element: HTMLElement; update(): void } {
  const element = el('div', { class: 'numbers-over', 'aria-hidden': 'true' });
  let spans: { span: HTMLElement; point: Vector3 }[] = [];
  let last = '';
  const update = () => {
    if (spans.length === 0) return;
    const { camera } = app.stage;
    const now = camera.matrixWorld.elements.join() + camera.fov + app.stage.canvas.clientWidth;
    if (now === last) return;
    last = now;
    const taken: [number, number][] = [];
    for (const { span, point } of spans) {
      const at = app.stage.project(point);
      // Numbers that would lie on each other are left out.
      const isFree = at !== null && taken.every(([x, y]) => Math.abs(x - at.x) > 34 || Math.abs(y - at.y) > 15);
      span.hidden = !isFree;
      if (!at || !isFree) continue;
      taken.push([at.x, at.y]);
      span.style.transform = `translate(${at.x.toFixed(1)}px, ${at.y.toFixed(1)}px) translate(-50%, -130%)`;
    }
  };
  app.on('grid', () => {
    last = '';
    const points = measured(app);
    const every = Math.ceil(points.length / WRITTEN) || 1;
    spans = points.filter((_, i) => i % every === 0).map(({ point, lux }) => ({ point, span: el('span', {}, readable(lux)) }));
    element.replaceChildren(...spans.map(({ span }) => span));
    update();
  });
  return { element, update };
}
