// Pictures of what is seen.
import type { App } from './app';

/** Hands the picture on the screen to the person. */
export function screenshot(app: App): void {
  const { overlay, tools } = app.stage;
  overlay.visible = tools.visible = false;
  app.stage.drawNow();
  app.stage.canvas.toBlob((blob) => {
    overlay.visible = tools.visible = true;
    app.stage.change();
    if (!blob) return app.say('The picture could not be made.');
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = `${app.scene?.name || 'scene'}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    app.say(`Screenshot saved as ${link.download}.`);
  }, 'image/png');
}
