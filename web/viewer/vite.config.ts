import { defineConfig } from 'vite';

export default defineConfig({
  // The page may be served under any path.
  base: './',
  resolve: { conditions: ['lumencast-source', 'module', 'browser', 'development|production'] },
  build: { target: 'es2023', sourcemap: true, chunkSizeWarningLimit: 900 },
  // The page without a server (test/fake) reads scenes from beside the repository.
  server: { fs: { allow: ['..', process.env.LUMENCAST_SCENES ?? '../../../shared/scenes'] } },
});
