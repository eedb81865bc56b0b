"""What hostile clients cost a server: its memory, and whether it still answers.

    python3 benches/hostile.py path/to/lumencast [lazy_readers|long_messages|silent ...]

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


def main():
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        path = scene(folder)
        attacks = [lazy_readers, long_messages, silent]
        for attack in [a for a in attacks if a.__name__ in sys.argv[2:] or not sys.argv[2:]]:
            server = Server(program, path)
            try:
                sockets = attack(server)
                time.sleep(3)
                held, answers = server.memory() - server.first, server.answers()
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
