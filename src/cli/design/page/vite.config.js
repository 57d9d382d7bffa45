import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { defineConfig } from 'vite';

// Beside the page, the build writes the licences of what is in it, and hashes by which a test without Node sees whether the sources were changed since.
const here = import.meta.dirname;
const OTHERS = ['index.html', 'package-lock.json', 'package.json', 'public/icon.svg', 'tsconfig.json', 'vite.config.js'];
const MADE = ['dist/icon.svg', 'dist/index.html', 'dist/licences.txt', 'dist/page.css', 'dist/page.js'];

/** FNV-1a of 64 bits. */
function hash(bytes) {
  let h = 0xcbf29ce484222325n;
  for (const b of bytes) h = ((h ^ BigInt(b)) * 0x100000001b3n) & 0xffffffffffffffffn;
  return h.toString(16).padStart(16, '0');
}

/** The packages in the page, those that they need too. */
function packages() {
  const lock = JSON.parse(readFileSync(join(here, 'package-lock.json'), 'utf8')).packages;
  return Object.entries(lock)
    .filter(([path, of]) => path && !of.dev && !of.optional)
    .map(([path, of]) => {
      const folder = join(here, path);
      const file = readdirSync(folder).find((f) => /^licen[cs]e/i.test(f));
      return { name: path.replace(/^.*node_modules\//, ''), version: of.version, licence: of.license, text: readFileSync(join(folder, file), 'utf8').trim() };
    });
}

const records = {
  name: 'records',
  closeBundle() {
    const rule = '-'.repeat(80);
    const parts = packages().map((p) => `${rule}\n${p.name} ${p.version} (${p.licence})\n${rule}\n\n${p.text}\n`);
    const head = 'The page of `cittert design` contains these packages. The coast lines in world-atlas are by Natural Earth, in the public domain.\n';
    writeFileSync(join(here, 'dist/licences.txt'), [head, ...parts].join('\n'));
    const sources = readdirSync(join(here, 'src')).map((f) => `src/${f}`);
    const lines = [...OTHERS, ...sources, ...MADE].sort().map((f) => `${hash(readFileSync(join(here, f)))}  ${f}\n`);
    writeFileSync(join(here, 'dist/hashes.txt'), lines.join(''));
  },
};

export default defineConfig({
  base: './',
  esbuild: { jsx: 'automatic', jsxImportSource: 'preact', legalComments: 'none' },
  plugins: [records],
  build: {
    outDir: 'dist',
    emptyOutDir: true,
    modulePreload: false,
    target: 'es2022',
    cssCodeSplit: false,
    rollupOptions: { output: { entryFileNames: 'page.js', assetFileNames: 'page.[ext]', inlineDynamicImports: true } },
  },
});
