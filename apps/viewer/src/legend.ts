// The scale of false colours, and the numbers of a grid, over the picture.
import { Vector3 } from 'three';
import { isError, type App } from './app';
import { places } from './isolines';
import { el } from './panels/parts';
import { layerName, unitOf } from './panels/view';
import { measured } from './plane';
import { PALETTE, readable } from './scale';
import { shared } from './surface';

export function legend(app: App): HTMLElement {
  const colours = PALETTE.map((c, i) => `rgb(${c.map((x) => Math.round(255 * x)).join(' ')}) ${(100 * i) / (PALETTE.length - 1)}%`);
  const bar = el('i', { style: `background:linear-gradient(to top, ${colours.join(', ')})` });
  const marks = el('div', { class: 'ticks' });
  const unit = el('span', { class: 'unit' });
  const element = el('aside', { class: 'legend', id: 'legend', 'aria-label': 'Scale of the colours' }, unit, el('div', { class: 'scale' }, bar, marks));
  app.on('view', () => {
    element.hidden = !isScaled(app);
    bar.hidden = !isColoured(app);
    unit.textContent = `${isError(app.layer) ? 'noise, ' : ''}${unitOf(app.layer)}`;
    app.marks.colourPlane();
    marks.replaceChildren(...app.exposure.levels.map((level) => el('span', { style: `bottom:${100 * share(app, level)}%` }, readable(level))));
  });
  return element;
}

/** Whether colours stand for numbers, and whether colours or lines do. */
const isColoured = (app: App): boolean => app.falseColours || isError(app.layer) || Boolean(app.measuring.plane?.answer);
const isScaled = (app: App): boolean => isColoured(app) || shared.isolines.value;

/** Where a value is on the scale, 0..1. */
function share({ exposure: { range: [low, high] } }: App, value: number): number {
  return Math.log(value / low) / Math.log(high / low);
}

/** Draws what the page has over the picture into it: the scale, with what it is of, and the numbers of a grid. */
export function drawOver(app: App, pen: CanvasRenderingContext2D): void {
  const page = app.stage.canvas.getBoundingClientRect();
  pen.scale(pen.canvas.width / page.width, pen.canvas.height / page.height);
  pen.textBaseline = 'middle';
  pen.lineJoin = 'round';
  pen.font = '600 11px system-ui, sans-serif';
  [pen.strokeStyle, pen.lineWidth, pen.fillStyle] = ['#000', 3, '#fff'];
  for (const span of document.querySelectorAll<HTMLElement>('.numbers-over span:not([hidden])')) {
    const box = span.getBoundingClientRect();
    const at: [string, number, number] = [span.textContent ?? '', box.left - page.left, box.top + 0.5 * box.height - page.top];
    pen.strokeText(...at);
    pen.fillText(...at);
  }
  if (isScaled(app)) drawScale(app, pen, page.height);
}

/** The scale at the lower left of a picture, as the page has it; `tall` is the picture, CSS pixels. */
function drawScale(app: App, pen: CanvasRenderingContext2D, tall: number): void {
  pen.font = '12px system-ui, sans-serif';
  const title = isError(app.layer) ? layerName(app, app.layer) : `${layerName(app, app.layer)}, lx`;
  const height = Math.min(0.38 * tall, 260);
  const [left, top] = [26, tall - 28 - height];
  pen.fillStyle = '#101214d0';
  pen.beginPath();
  pen.roundRect(14, top - 36, Math.max(60, pen.measureText(title).width) + 24, height + 50, 8);
  pen.fill();
  pen.fillStyle = '#e8e6e1';
  pen.fillText(title, left, top - 20);
  for (const level of app.exposure.levels) {
    const y = top + height * (1 - share(app, level));
    pen.fillRect(left + 14, y - 0.5, 5, 1);
    pen.fillText(readable(level), left + 22, y);
  }
  if (!isColoured(app)) return;
  const colours = pen.createLinearGradient(0, top + height, 0, top);
  PALETTE.forEach((c, i) => colours.addColorStop(i / (PALETTE.length - 1), `rgb(${c.map((x) => Math.round(255 * x)).join(' ')})`));
  pen.fillStyle = colours;
  pen.fillRect(left, top, 14, height);
}

/** Most numbers that are written on the picture. */
const WRITTEN = 150;

/** What hides a point is nearer by more than this share of the way: less is the surface that it lies on. */
const BEFORE = 5e-3;

/** Numbers at places of the scene; they follow the camera. `rise` is how far they stand above them, in their own height; `isAnywhere`:
 *  whether things may stand before them, whose numbers are left out then. */
function numbersAt(app: App, rise: number, isAnywhere: boolean): { element: HTMLElement; put(points: { point: Vector3; lux: number }[]): void; update(): void } {
  const element = el('div', { class: 'numbers-over', 'aria-hidden': 'true' });
  let spans: { span: HTMLElement; point: Vector3 }[] = [];
  let last = '';
  const update = () => {
    if (spans.length === 0) return;
    const { camera } = app.stage;
    const now = `${camera.matrixWorld.elements.join()} ${camera.fov} ${app.stage.canvas.clientWidth} ${app.stage.moves}`;
    if (now === last) return;
    last = now;
    const taken: [number, number][] = [];
    const page = app.stage.canvas.getBoundingClientRect();
    const scale = document.querySelector('#legend')!.getBoundingClientRect();
    const isWithin = ({ x, y }: { x: number; y: number }) => x > 0 && y > 0 && x < page.width && y < page.height;
    // A number is this wide and tall at most, and stands above its point.
    const isBehindScale = ({ x, y }: { x: number; y: number }) =>
      scale.width > 0 && x + 20 > scale.left - page.left && x - 20 < scale.right - page.left && y > scale.top - page.top && y - 20 < scale.bottom - page.top;
    const isHidden = (point: Vector3) => {
      const way = point.clone().sub(camera.position);
      const distance = way.length();
      return app.stage.cast(camera.position, way.divideScalar(distance), (1 - BEFORE) * distance) !== null;
    };
    for (const { span, point } of spans) {
      const at = app.stage.project(point);
      // Numbers that would lie on each other, or behind the scale, are left out.
      const isFree = at !== null && isWithin(at) && !isBehindScale(at) && taken.every(([x, y]) => Math.abs(x - at.x) > 34 || Math.abs(y - at.y) > 15)
        && !(isAnywhere && isHidden(point));
      span.hidden = !isFree;
      if (!at || !isFree) continue;
      taken.push([at.x, at.y]);
      span.style.transform = `translate(${at.x.toFixed(1)}px, ${at.y.toFixed(1)}px) translate(-50%, ${-50 - rise}%)`;
    }
  };
  // The scale comes and goes, and is as wide as its numbers.
  app.on('view', () => { last = ''; });
  const put = (points: { point: Vector3; lux: number }[]) => {
    last = '';
    const every = Math.ceil(points.length / WRITTEN) || 1;
    spans = points.filter((_, i) => i % every === 0).map(({ point, lux }) => ({ point, span: el('span', {}, readable(lux)) }));
    element.replaceChildren(...spans.map(({ span }) => span));
    update();
  };
  return { element, put, update };
}

/** Numbers at the points of a grid. */
export function gridNumbers(app: App): { element: HTMLElement; update(): void } {
  const { element, put, update } = numbersAt(app, 80, true);
  app.on('grid', () => put(measured(app)));
  return { element, update };
}

/** Numbers on isolines, but where there are those of a grid. They are found anew when one stands still. */
export function lineNumbers(app: App): { element: HTMLElement; update(): void } {
  const { element, put, update } = numbersAt(app, 0, false);
  let last: unknown[] = [];
  return {
    element,
    update() {
      const { exposure } = app;
      const isShown = shared.isolines.value && measured(app).length === 0;
      const now = [isShown, exposure.seen, exposure.levels];
      const isStill = exposure.seen?.view === exposure.view;
      if (now.some((one, i) => one !== last[i]) && (!isShown || isStill)) {
        last = now;
        put(isShown ? places(app) : []);
      }
      update();
    },
  };
}
