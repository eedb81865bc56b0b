import { defineConfig } from 'vitest/config';

export default defineConfig({
  // Node packages are otherwise resolved without our own condition.
  ssr: { resolve: { conditions: ['lumencast-source', 'module', 'node', 'import', 'default'] } },
  // A busy machine is late, not wrong.
  test: { include: ['test/**/*.test.ts'], testTimeout: 60_000, hookTimeout: 60_000 },
});
