// What was read of the picked place, over the picture: where the panel is folded, as on phones, there is no other meter.
import type { App } from './app';
import { el } from './panels/parts';
import { readable } from './scale';

export function reading(app: App): { element: HTMLElement; update(): void } {
  const element = el('div', { class: 'reading', id: 'reading', role: 'status', hidden: true });
  const update = () => {
    const { measuring: { probed }, stage } = app;
    const at = probed?.answer && document.body.classList.contains('folded') ? stage.project(probed.hit.point) : null;
    element.hidden = !at;
    if (!at) return;
    const text = `${readable(probed!.answer!.illuminance)} lx`;
    if (element.textContent !== text) element.textContent = text;
    // It stays within the picture, and above the finger.
    const { clientWidth: width, clientHeight: height } = stage.canvas;
    const [x, y] = [Math.min(width - 44, Math.max(44, at.x)), Math.min(height - 8, Math.max(56, at.y))];
    element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, calc(-100% - 18px))`;
  };
  return { element, update };
}
