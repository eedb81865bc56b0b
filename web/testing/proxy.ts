import { createServer, type IncomingMessage, request } from 'node:http';
import { type AddressInfo, connect, type Socket } from 'node:net';

/** A reverse proxy that has a server under a path, as a web server in front of several programs does. */
export interface Proxy {
  readonly port: number;
  /** Paths that were asked for, those of WebSockets marked. */
  readonly asked: string[];
  close(): Promise<void>;
}

/** Passes requests and WebSockets under `prefix`, as `/light`, on to a port of this machine, without it. */
export async function startProxy(prefix: string, port: number): Promise<Proxy> {
  const asked: string[] = [];
  const sockets = new Set<Socket>();
  const pathOf = ({ url = '' }: IncomingMessage) =>
    url.startsWith(`${prefix}/`) ? url.slice(prefix.length) : undefined;

  const server = createServer((asking, answer) => {
    asked.push(asking.url ?? '');
    const path = pathOf(asking);
    if (path === undefined) return void answer.writeHead(404).end();
    const { method, headers } = asking;
    const onward = request({ port, path, method, headers }, (response) => {
      answer.writeHead(response.statusCode ?? 502, response.headers);
      response.pipe(answer);
    });
    onward.on('error', () => answer.destroy());
    asking.pipe(onward);
  });
  server.on('upgrade', (asking, socket: Socket, head) => {
    asked.push(`websocket ${asking.url}`);
    const path = pathOf(asking);
    if (path === undefined) return void socket.destroy();
    const onward = connect(port, '127.0.0.1', () => {
      const fields = asking.rawHeaders.map((text, i) => (i % 2 === 0 ? `${text}: ` : `${text}\r\n`));
      onward.write(`${asking.method} ${path} HTTP/1.1\r\n${fields.join('')}\r\n`);
      onward.write(head);
      onward.pipe(socket).pipe(onward);
    });
    for (const end of [socket, onward]) {
      sockets.add(end);
      end.on('error', () => [socket, onward].forEach((other) => other.destroy()));
    }
  });
  await new Promise<void>((resolve) => server.listen(0, '127.0.0.1', resolve));
  return {
    port: (server.address() as AddressInfo).port,
    asked,
    close() {
      for (const socket of sockets) socket.destroy();
      server.closeAllConnections();
      return new Promise((resolve) => server.close(() => resolve()));
    },
  };
}
