import { readdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { defineConfig, type Plugin } from 'vite';

/** Writes a compressed copy beside every file of text, for the server to send. */
function compressed(): Plugin {
  let folder = '';
  return {
    name: 'compressed',
    apply: 'build',
    configResolved: (config) => { folder = config.build.outDir; },
    closeBundle: () => {
      for (const name of readdirSync(folder, { recursive: true, encoding: 'utf8' })) {
        if (!/\.(js|css|html|svg)$/.test(name)) continue;
        writeFileSync(join(folder, `${name}.gz`), gzipSync(readFileSync(join(folder, name)), { level: 9 }));
      }
    },
  };
}

const service = process.env.CREASED_URL ?? 'http://127.0.0.1:8080';

export default defineConfig({
  base: './',
  resolve: { alias: { 'creased-client': new URL('../js/src/index.ts', import.meta.url).pathname } },
  build: {
    outDir: process.env.CREASED_PAGE_OUT ?? 'dist',
    emptyOutDir: true,
    target: 'es2022',
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 900,
    rollupOptions: { input: { index: 'index.html', docs: 'docs.html' } },
  },
  worker: { format: 'es' },
  plugins: [compressed()],
  server: { proxy: { '/v1': service, '/openapi.json': service } },
});
