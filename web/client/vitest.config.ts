import { defineConfig } from 'vitest/config';

export default defineConfig({
  // Node packages are otherwise resolved without our own condition.
  ssr: { resolve: { conditions: ['lumencast-source', 'module', 'node', 'import', 'default'] } },
  test: { include: ['test/**/*.test.ts'] },
});
