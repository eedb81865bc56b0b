"""What hostile clients cost a server: its memory, and whether it still answers.

    cargo build --release --example hostile -p lumencast-server
    python3 benches/hostile.py path/to/lumencast path/to/examples/hostile [ATTACK ...]

Starts servers on loopback and ends them. Linux: memory is read from /proc. The scene has 200 MB, most
of it a buffer that nothing uses.
"""

import http.client
import json
import os
import resource
import socket
import struct
import subprocess
import sys
import tempfile
import time

LENGTH = 200_000_000


def scene(folder):
    path = os.path.join(folder, "large.gltf")
    with open(os.path.join(folder, "large.bin"), "wb") as file:
        file.write(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0))
        file.truncate(LENGTH)
    position = {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                "min": [0, 0, 0], "max": [1, 1, 0]}
    document = {
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "large.bin", "byteLength": LENGTH}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [position],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    with open(path, "w") as file:
        json.dump(document, file)
    return path


class Server:
    def __init__(self, program, scene):
        arguments = [program, "serve", scene, "--volume", "2x2x2", "--samples", "1",
                     "--listen", "127.0.0.1:0", "--json"]
        # As few descriptors as many systems give.
        limit = lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (1024, 1024))
        self.process = subprocess.Popen(arguments, stdout=subprocess.PIPE,
                                        stderr=subprocess.DEVNULL, preexec_fn=limit)
        self.port = json.loads(self.process.stdout.readline())["port"]
        time.sleep(2)
        self.first = self.memory()

    def memory(self):
        with open(f"/proc/{self.process.pid}/status") as file:
            line = next(line for line in file if line.startswith("VmRSS"))
        return int(line.split()[1]) / 1024

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.port), timeout=30)

    def answers(self):
        """Whether it answers somebody at another address."""
        client = http.client.HTTPConnection("127.0.0.1", self.port, timeout=5,
                                            source_address=("127.0.0.2", 0))
        try:
            client.request("GET", "/healthz")
            return client.getresponse().status == 200
        except (OSError, http.client.HTTPException):
            return False
        finally:
            client.close()

    def end(self):
        self.process.terminate()
        self.process.wait()


def lazy_readers(server):
    """20 requests for a file of 200 MB, none of which is read."""
    sockets = []
    for _ in range(20):
        s = server.connect()
        s.sendall(f"GET /scene/large.bin HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n\r\n".encode())
        sockets.append(s)
    return sockets


def long_messages(server):
    """8 WebSocket sessions that each send 61 MB of a message that does not end."""
    sockets = []
    for _ in range(8):
        s = server.connect()
        s.sendall((f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\nUpgrade: websocket\r\n"
                   "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                   "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                   "Sec-WebSocket-Protocol: qmux-01.moq-lite-05\r\n\r\n").encode())
        s.recv(4096)
        part = bytes([0x00, 0xFF]) + (1 << 20).to_bytes(8, "big") + bytes(4 + (1 << 20))
        try:
            s.sendall(bytes([0x02]) + part[1:])
            for _ in range(60):
                s.sendall(part)
        except OSError:
            pass
        sockets.append(s)
    return sockets


def silent(server):
    """1,100 connections that say nothing."""
    sockets = []
    for _ in range(1100):
        try:
            sockets.append(server.connect())
        except OSError:
            break
    return sockets


def streams(server):
    """5,000 HTTP/2 requests on 20 connections, none of whose answers is read."""
    # A client's preface, its settings with a window of nothing, and requests by indexed headers.
    frame = lambda kind, flags, stream, body: (
        len(body).to_bytes(3, "big") + bytes([kind, flags]) + stream.to_bytes(4, "big") + body)
    authority = f"127.0.0.1:{server.port}".encode()
    literal = lambda name, value: bytes([name, len(value)]) + value
    head = bytes([0x82, 0x86]) + literal(0x04, b"/scene/large.gltf") + literal(0x01, authority)
    sockets = []
    for _ in range(20):
        s = server.connect()
        try:
            s.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
                      + frame(4, 0, 0, bytes([0, 4, 0, 0, 0, 0])))
            for stream in range(250):
                s.sendall(frame(1, 5, 2 * stream + 1, head))
        except OSError:
            pass
        sockets.append(s)
    return sockets


def by_client(name, what):
    """An attack over Media over QUIC, by the example `hostile`."""
    def attack(server):
        address = f"http://127.0.0.1:{server.port}/large"
        done = subprocess.run([sys.argv[2], address, name], capture_output=True, text=True)
        attack.seen = done.stdout.strip() or done.stderr.strip()
        return []
    attack.__name__, attack.__doc__ = name, what
    return attack


def picture(folder, name):
    """An HDR picture of 4096 × 2048 white texels, 100 MB in memory."""
    row = bytes([2, 2, 16, 0]) + b"".join(bytes([255, value] * 32 + [160, value]) for value in
                                          (128, 128, 128, 129))
    with open(os.path.join(folder, name), "wb") as file:
        file.write(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2048 +X 4096\n" + row * 2048)


BY_CLIENT = [
    by_client("files", "200 edits that name a file of 200 MB which is no glTF."),
    by_client("spellings", "A picture of the environment under 30 spellings, then another."),
    by_client("names", "A session under 1,024 names."),
    by_client("impostor", "Another's name, also with a path before it, and numbers far ahead."),
    by_client("numbers", "A number beyond 2^53."),
    by_client("long_edit", "An edit of 5 KB before another."),
]


def main():
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        path = scene(folder)
        for name in ["sky.hdr", "other.hdr"]:
            picture(folder, name)
        attacks = [lazy_readers, streams, long_messages, silent, *BY_CLIENT]
        for attack in [a for a in attacks if a.__name__ in sys.argv[3:] or not sys.argv[3:]]:
            server = Server(program, path)
            try:
                sockets = attack(server)
                time.sleep(3)
                held, answers = server.memory() - server.first, server.answers()
                if attack in BY_CLIENT:
                    print(f"{attack.__doc__} Memory: +{held:.0f} MB. {attack.seen}", flush=True)
                    continue
                time.sleep(40)
                later, recovers = server.memory() - server.first, server.answers()
                print(f"{attack.__doc__} Memory: +{held:.0f} MB, after 43 s +{later:.0f} MB. "
                      f"Answers: {answers}, after 43 s {recovers}.", flush=True)
                for s in sockets:
                    s.close()
            finally:
                server.end()


if __name__ == "__main__":
    main()
