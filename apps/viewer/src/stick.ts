// A stick for thumbs: walks where there is no keyboard.
import type { App } from './app';
import { STILL } from './navigate';
import { el } from './panels/parts';

/** Farthest that the knob goes, CSS pixels. */
const REACH = 40;

export function stick(app: App): HTMLElement {
  const knob = el('i');
  const element = el('div', { class: 'stick', 'aria-hidden': 'true' }, knob);
  let held: number | null = null;
  const drive = (x: number, y: number) => {
    knob.style.transform = `translate(${x}px, ${y}px)`;
    app.navigator.drive = { ...STILL, right: x / REACH, back: y / REACH };
  };
  element.addEventListener('pointerdown', (event) => {
    held = event.pointerId;
    element.setPointerCapture(event.pointerId);
    event.preventDefault();
  });
  element.addEventListener('pointermove', (event) => {
    if (event.pointerId !== held) return;
    const box = element.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left - box.width / 2, event.clientY - box.top - box.height / 2];
    const scale = Math.min(1, REACH / Math.max(1, Math.hypot(x, y)));
    drive(x * scale, y * scale);
  });
  const release = () => {
    held = null;
    drive(0, 0);
  };
  element.addEventListener('pointerup', release);
  element.addEventListener('pointercancel', release);
  app.on('view', () => { element.hidden = app.navigator.mode !== 'walk'; });
  return element;
}
