/** Passes an error to where uncaught ones go (the console, and whoever watches them) without unwinding. */
export function reportUncaught(error: unknown): void {
  queueMicrotask(() => {
    throw error;
  });
}
