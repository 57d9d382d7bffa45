import { defineConfig } from 'vite';

export default defineConfig({
  base: './',
  esbuild: { jsx: 'automatic', jsxImportSource: 'preact', legalComments: 'none' },
  build: {
    outDir: 'dist',
    emptyOutDir: true,
    modulePreload: false,
    target: 'es2022',
    cssCodeSplit: false,
    rollupOptions: { output: { entryFileNames: 'page.js', assetFileNames: 'page.[ext]', inlineDynamicImports: true } },
  },
});
