import { expect, it } from 'vitest';

import { capabilities } from '../src/capabilities.js';

const all = { isSecureContext: true, WebTransport: {}, VideoDecoder: {}, WebSocket: {} };

it('is silent when all is there', () => {
  expect(capabilities(all).notices).toEqual([]);
});

it('says that a page must be secure', () => {
  const { secureContext, notices } = capabilities({ isSecureContext: false, WebSocket: {} });
  expect(secureContext).toBe(false);
  expect(notices.length).toBe(2);
  for (const notice of notices) expect(notice).toContain('https');
});

it('does not blame the page for what the browser lacks', () => {
  const { notices } = capabilities({ ...all, WebTransport: undefined });
  expect(notices).toEqual([expect.stringContaining('This browser has no WebTransport')]);
});

it('says when nothing can be received', () => {
  expect(capabilities({ isSecureContext: true, VideoDecoder: {} }).notices[0]).toContain('no light');
});
