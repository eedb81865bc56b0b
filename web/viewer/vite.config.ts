import { defineConfig } from 'vite';

export default defineConfig({
  // The page may be served under any path.
  base: './',
  resolve: { conditions: ['lumencast-source', 'module', 'browser', 'development|production'] },
  // three.js alone is a megabyte before compression.
  build: { target: 'es2023', chunkSizeWarningLimit: 1200 },
  // The page without a server (test/fake) reads scenes from beside the repository.
  server: { fs: { allow: ['..', process.env.LUMENCAST_SCENES ?? '../../../shared/scenes'] } },
});
