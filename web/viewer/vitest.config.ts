import { defineConfig, mergeConfig } from 'vitest/config';
import page from './vite.config.js';

export default mergeConfig(
  page,
  defineConfig({
    // Tests judge what they see, however late a busy machine shows it.
    test: { testTimeout: 180_000, hookTimeout: 180_000, expect: { poll: { timeout: 60_000 } } },
  }),
);
