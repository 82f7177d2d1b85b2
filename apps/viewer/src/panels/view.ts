// How the light is shown: exposure, false colours, layers.
import { isError, type App } from '../app';
import { CURVES, type Curve } from '../curve';
import { MOST } from '../exposure';
import { shared } from '../surface';
import type { Layer } from '../wire';
import { button, choice, el, fillNumber, section, slider, toggle } from './parts';

/** What people call a layer. */
export function layerName(app: App, layer: Layer): string {
  if (layer === 'total') return 'All light';
  if (layer === 'direct') return 'Direct light';
  if (layer === 'indirect') return 'Indirect light';
  if (layer === 'error') return 'Noise of rays, lx';
  if (layer === 'relative_error') return 'Noise of rays, % of the light there';
  if ('bounce' in layer) return layer.bounce === 1 ? 'First bounce' : `Bounce ${layer.bounce}`;
  const light = app.lights.get(layer.light);
  if (light && light.sharing > 1) return `${light.sharing} more lights together`;
  return light ? app.lightName(light) : `Light ${layer.light + 1}`;
}

/** In what a layer is told. */
export function unitOf(layer: Layer): string {
  return layer === 'relative_error' ? '%' : 'lx';
}

/** Bounces that have a layer of their own. */
const BOUNCES = 6;

export function viewPanel(app: App): HTMLElement {
  const look = choice('Colours', [['eye', 'As seen', 'F2'], ['lux', 'Lux', 'F2']], (value) => {
    // Noise has false colours alone.
    if (value === 'eye' && isError(app.layer)) app.showLayer('total');
    app.showFalseColours(value === 'lux');
  });
  look.id = 'colours';
  const exposure = slider('Exposure', { min: -16, max: 8, step: 0.1, unit: 'EV' }, (value) => {
    app.forgive();
    app.exposure.set(value);
    if (app.exposure.value !== value) app.refuse(`Exposure goes from −${MOST} to ${MOST} EV.`);
    return app.exposure.value;
  });
  const curve = el('select', {
    id: 'curve', 'aria-label': 'Tone curve', title: 'Tone curve: how exposed light becomes what the display shows; the soft shoulder is that of `radiosity render`', change: () => app.setCurve(curve.value as Curve),
  }, ...CURVES.map(([value, text]) => el('option', { value }, text)));
  const automatic = toggle('Automatic exposure', (is) => (is ? app.exposure.automatic() : app.exposure.set(app.exposure.value)), '0');
  const isolines = toggle('Isolines', (is) => app.showIsolines(is), 'I');
  const edges = toggle('Edges of elements', (is) => app.showEdges(is), 'E');
  const rays = toggle('Rays of the picked element', (is) => app.measuring.showRays(is), 'T');
  const layer = el('select', {
    id: 'layer', 'aria-label': 'Layer of light', change: () => app.showLayer(JSON.parse(layer.value) as Layer),
  });
  const resting = el('p', { class: 'warning', id: 'resting' });
  const unit = el('span', { class: 'unit' });
  const low = el('input', { type: 'number', min: 0, step: 'any', change: () => setRange() });
  const high = el('input', { type: 'number', min: 0, step: 'any', change: () => setRange() });
  const setRange = () => {
    const range: [number, number] = [low.valueAsNumber, high.valueAsNumber];
    if (range[0] > 0 && range[1] > range[0]) app.exposure.setRange(range);
    else {
      app.refuse('The scale goes from a number above 0 to a larger one: it is as before.');
      app.tell('view');
    }
  };
  const scale = el('div', { class: 'row scale-row' }, el('span', { class: 'quiet' }, 'Scale'), low, el('span', { class: 'quiet' }, 'to'), high, unit,
    button('Auto', () => app.exposure.setRange(null), { title: 'Fit the scale to what is seen' }));

  const options = () => {
    const option = (value: Layer) => el('option', { value: JSON.stringify(value) }, layerName(app, value));
    const there = [...app.lights.values()].filter((light) => !light.deleted);
    // Those that are shown together are one choice: the first of them.
    const first = there.find(({ sharing }) => sharing > 1);
    const lights = there.filter((light) => light.sharing === 1 || light === first).map((light) => option({ light: light.id }));
    const bounces = Array.from({ length: BOUNCES }, (_, i) => option({ bounce: i + 1 }));
    layer.replaceChildren(option('total'), option('direct'), option('indirect'),
      el('optgroup', { label: 'Bounces' }, ...bounces), lights.length > 0 ? el('optgroup', { label: 'Lights alone' }, ...lights) : '',
      el('optgroup', { label: 'Noise of rays' }, option('relative_error'), option('error')));
    layer.value = JSON.stringify(app.layer);
  };
  let names = '';
  app.on('lights', () => {
    const now = [...app.lights.values()].map((light) => `${light.name} ${light.deleted} ${light.sharing}`).join('\n');
    if (now !== names || layer.options.length === 0) options();
    names = now;
  });
  app.on('view', () => {
    look.set(app.falseColours || isError(app.layer) ? 'lux' : 'eye');
    exposure.set(app.exposure.value);
    curve.value = app.curve;
    automatic.set(app.exposure.isAutomatic);
    isolines.set(shared.isolines.value);
    edges.set(app.edges);
    rays.set(app.measuring.raysShown);
    layer.value = JSON.stringify(app.layer);
    resting.textContent = app.resting;
    resting.hidden = !app.resting;
    scale.hidden = !app.falseColours && !shared.isolines.value && !isError(app.layer) && !app.measuring.plane;
    for (const [input, end] of [[low, 'Lower'], [high, 'Upper']] as const) input.setAttribute('aria-label', `${end} end of the scale, ${unitOf(app.layer)}`);
    unit.textContent = unitOf(app.layer);
    for (const [input, value] of [[low, app.exposure.range[0]], [high, app.exposure.range[1]]] as const) {
      fillNumber(input, value, 3);
    }
  });
  return section('view', 'View', true,
    el('div', { class: 'row' }, look),
    scale,
    el('label', { class: 'field' }, el('span', { class: 'quiet' }, 'Layer'), layer), resting,
    el('div', { class: 'field' }, el('span', { class: 'quiet' }, 'Exposure'), exposure),
    automatic,
    el('label', { class: 'field' }, el('span', { class: 'quiet' }, 'Tones'), curve), isolines, edges, rays,
    el('div', { class: 'row mouse' }, button('Look freely with the mouse', () => app.lookFreely(), { key: 'Y' })));
}
