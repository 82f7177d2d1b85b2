// What is measured: at a point, and on a grid.
import type { App } from '../app';
import { readable } from '../scale';
import type { Share } from '../wire';
import { button, el, fact, hex, section } from './parts';

export function meterPanel(app: App): HTMLElement {
  const none = el('p', { class: 'quiet' }, 'Click a surface, or press Enter for what is under the cross.');
  const lux = el('div', { class: 'big', id: 'lux', 'aria-live': 'polite' });
  const facts = el('div', { class: 'facts' });
  const lights = el('div', { class: 'bars' });
  const surfaces = el('div', { class: 'bars' });
  const body = el('div', {}, lux, facts, el('h3', {}, 'From which light, reflections included'), lights, el('h3', {}, 'From where it arrives'), surfaces);
  app.on('probe', () => {
    const { probed } = app;
    body.hidden = !probed;
    none.hidden = Boolean(probed);
    if (!probed) return;
    const { answer } = probed;
    if (!answer) {
      if (!lux.textContent) lux.textContent = '…';
      return;
    }
    lux.replaceChildren(readable(answer.illuminance), el('span', { class: 'unit' }, 'lx'));
    const luminance = (c: number[]) => 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    const point = app.stage.toScene(probed.hit.point);
    facts.replaceChildren(
      fact('Reflectance', el('span', {}, el('i', { class: 'swatch', style: `background:${hex(answer.reflectance)}` }), `${(100 * luminance(answer.reflectance)).toFixed(1)} %`)),
      fact('Radiosity', `${readable(luminance(answer.radiosity))} lm/m²`),
      fact('Luminance', `${readable(luminance(answer.radiosity) / Math.PI)} cd/m²`),
      fact('Place', point.toArray().map((x) => x.toFixed(2)).join(', ') + ' m'),
    );
    lights.replaceChildren(...answer.lights.map(bar));
    surfaces.replaceChildren(...answer.surfaces.map(bar));
  });
  return section('meter', 'Light meter', true, none, body);
}

function bar({ name, share }: Share): HTMLElement {
  return el('div', { class: 'bar' }, el('span', {}, name), el('b', {}, `${(100 * share).toFixed(1)} %`), el('i', { style: `width:${Math.min(100, 100 * share)}%` }));
}

export function gridPanel(app: App): HTMLElement {
  const facts = el('div', { class: 'facts' });
  const clear = button('Take away', () => app.clearGrid());
  app.on('grid', () => {
    clear.hidden = !app.grid;
    facts.hidden = !app.grid;
    if (!app.grid) return;
    const { least, mean, largest, uniformity, points, spacing, size } = app.grid;
    facts.replaceChildren(
      fact('Mean', `${readable(mean)} lx`),
      fact('Least', `${readable(least)} lx`),
      fact('Most', `${readable(largest)} lx`),
      fact('Uniformity', uniformity.toFixed(2)),
      fact('Points', `${points.length}, ${spacing.toFixed(2)} m apart`),
      fact('Surface', `${size.map((side) => side.toFixed(2)).join(' × ')} m`),
    );
  });
  return section('grid', 'Measuring grid', false,
    el('p', { class: 'quiet' }, 'Over the plane surface that was picked, spaced as EN 12464-1 asks.'),
    el('div', { class: 'row' }, button('Lay over the picked surface', () => app.measure(), { key: 'G' }), clear), facts);
}
