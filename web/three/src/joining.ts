import { ConnectError, type Problem, type Session } from '@lumencast/client';

/** Attempts that may fail before a program hears of it, while there is nothing to show. */
const ATTEMPTS = 3;
/** What may pass by itself, as while a server starts; anything else is said at once. */
const PASSING: ReadonlySet<Problem> = new Set<Problem>(['unreachable', 'refused', 'silent']);

/**
 * Resolves once the server has said what it offers.
 * @throws ConnectError when {@link ATTEMPTS} have failed, or one in a way that will not pass
 */
export function joined(session: Session): Promise<void> {
  return new Promise((resolve, reject) => {
    let failed = 0;
    const off = session.on('status', (status) => {
      if (status.state !== 'lost') return;
      const { problem = 'unreachable', reason } = status;
      if (++failed >= ATTEMPTS || !PASSING.has(problem)) reject(new ConnectError(problem, reason));
    });
    session.ready.then(resolve, reject).finally(off);
  });
}

/**
 * Says when there is no connection, once for each loss and for each other reason that turns up, and when
 * there is one again. Returns the function that ends this.
 */
export function reportLosses(session: Pick<Session, 'on'>, warn: (message: string) => void): () => void {
  const said = new Set<Problem>();
  return session.on('status', (status) => {
    if (status.state === 'connected') {
      if (said.size > 0) warn('connected to the server');
      said.clear();
    } else if (status.state === 'lost') {
      const { problem = 'unreachable', reason } = status;
      if (said.has(problem)) return;
      said.add(problem);
      warn(`not connected, trying again: ${reason}`);
    } else if (status.state === 'closed' && status.problem) warn(status.reason);
  });
}
