import { defineConfig } from 'vitest/config';

export default defineConfig({
  test: { include: ['tests/client/**/*.test.ts'], testTimeout: 120_000, pool: 'forks' },
});
