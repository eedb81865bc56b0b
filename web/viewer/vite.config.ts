import { defineConfig } from 'vite';

export default defineConfig({
  // The page may be served under any path.
  base: './',
  resolve: { conditions: ['lumencast-source', 'module', 'browser', 'development|production'] },
  build: { target: 'es2023', sourcemap: true },
});
