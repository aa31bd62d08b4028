"""A client of esvr-view that needs only the standard library: it opens the socket of the page
(RFC 6455), sends messages, and takes answers apart."""
import base64
import json
import os
import socket
import struct
import urllib.parse

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Client:
    def __init__(self, url, timeout=120):
        self.url = urllib.parse.urlparse(url)
        self.socket = socket.create_connection((self.url.hostname, self.url.port), timeout)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.rest = b""
        self._open()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def _open(self):
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(
            (f"GET {self.url.path}socket HTTP/1.1\r\nHost: {self.url.netloc}\r\n"
             f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
             "Sec-WebSocket-Version: 13\r\n\r\n").encode())
        while b"\r\n\r\n" not in self.rest:
            self._more()
        head, self.rest = self.rest.split(b"\r\n\r\n", 1)
        status = head.split(b"\r\n")[0]
        if b" 101 " not in status:
            raise ConnectionError(status.decode())

    def _more(self):
        data = self.socket.recv(1 << 16)
        if not data:
            raise ConnectionError("the server closed the connection")
        self.rest += data

    def _take(self, count):
        parts = []
        while count > len(self.rest):
            parts.append(self.rest)
            count -= len(self.rest)
            self.rest = b""
            self._more()
        parts.append(self.rest[:count])
        self.rest = self.rest[count:]
        return b"".join(parts)

    def send_frame(self, kind, data):
        """Sends a frame. A client masks its frames; a mask of zeros leaves them as they are."""
        size = len(data)
        if size < 126:
            length = struct.pack("!B", 0x80 | size)
        elif size < 1 << 16:
            length = struct.pack("!BH", 0x80 | 126, size)
        else:
            length = struct.pack("!BQ", 0x80 | 127, size)
        self.socket.sendall(struct.pack("!B", 0x80 | kind) + length + bytes(4) + data)

    def send(self, **message):
        self.send_frame(TEXT, json.dumps(message).encode())

    def receive(self):
        """The next answer: its head, and its bytes or None."""
        while True:
            first, second = self._take(2)
            size = second & 127
            if size == 126:
                size, = struct.unpack("!H", self._take(2))
            elif size == 127:
                size, = struct.unpack("!Q", self._take(8))
            data, kind = self._take(size), first & 15
            if kind == PING:
                self.send_frame(PONG, data)
            elif kind == CLOSE:
                raise ConnectionError(f"the server closed the socket: {data[2:].decode()}")
            elif kind == TEXT:
                return json.loads(data), None
            elif kind == BINARY:
                length, = struct.unpack("<I", data[:4])
                return json.loads(data[4:4 + length]), data[4 + length:]

    def ask(self, **message):
        self.send(**message)
        return self.receive()
