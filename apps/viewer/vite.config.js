// One file and nothing beside it: the program carries the page within itself.
import { defineConfig } from 'vite';

/// Puts scripts and styles into the page. The server puts a nonce in the place of NONCE each time it sends the page.
function inline() {
  return {
    name: 'inline',
    enforce: 'post',
    generateBundle(_, bundle) {
      const page = bundle['index.html'];
      let html = page.source;
      for (const [name, file] of Object.entries(bundle)) {
        const escaped = name.replace(/[.*+?^${}()|[\]\\]/g, '\\$&');
        if (name.endsWith('.js')) {
          const code = file.code.replaceAll('</script', '<\\/script');
          html = html.replace(new RegExp(`<script[^>]*src="[^"]*${escaped}"[^>]*></script>`), '');
          html = html.replace('</body>', () => `<script type="module" nonce="NONCE">${code}</script>\n  </body>`);
          delete bundle[name];
        } else if (name.endsWith('.css')) {
          html = html.replace(new RegExp(`<link[^>]*href="[^"]*${escaped}"[^>]*>`), () => `<style nonce="NONCE">${file.source}</style>`);
          delete bundle[name];
        }
      }
      page.source = html;
    },
  };
}

export default defineConfig({
  base: './',
  build: { target: 'es2022', modulePreload: false, assetsInlineLimit: 1e9, chunkSizeWarningLimit: 2000 },
  plugins: [inline()],
});
