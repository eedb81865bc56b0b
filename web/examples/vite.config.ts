import { defineConfig } from 'vite';

export default defineConfig({
  // Our packages are read from their sources; a program of its own needs no such line.
  resolve: { conditions: ['lumencast-source', 'module', 'browser', 'development|production'] },
});
