import type { Session } from '@lumencast/client';

/** What a session must offer; {@link Session} does. */
export type LightSession = Pick<
  Session,
  'files' | 'catalog' | 'status' | 'stats' | 'on' | 'edit' | 'light' | 'sceneTime' | 'setCamera' | 'close'
> &
  Partial<Pick<Session, 'saved' | 'unshown'>>;
