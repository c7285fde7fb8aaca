"""The server of the live page: who may read it (this machine only, one random address), and how content is sent.

A browser asks for the page once, and then for ``events``, an answer that does not end: whenever the watch has new content,
it is sent there. The address holds a random token, so that other users of this machine, and pages of other hosts that
a browser shows, cannot read it. Nothing here changes a file.
"""

from __future__ import annotations

import hmac
import io
import json
import secrets
import socket
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any

from rftfit.errors import InputError

HOST = "127.0.0.1"
"""Address that other machines cannot reach."""
MOST_CONNECTIONS = 32
"""Most connections open at a time, as each is an open file."""


@dataclass(eq=False)
class Client:
    """A browser that shows the page; it receives only the newest content.

    `query`: Query of the address that it shows, by which content is made for it (medium and run). `content`: The newest,
    html. `content_ready`: Set while this is not sent yet. `is_new`: True until the first content is made.
    """

    query: str
    content: str = ""
    content_ready: Event = field(default_factory=Event)
    is_new: bool = True


class LivePage(ThreadingHTTPServer):
    """The page of one campaign at `address`, which has a new random token after each start; made, it serves at once.

    So the token of a page that stays open after the end is worthless for another program that takes the port. `port`: 0
    for any free one. `asked`: Event that is set when a browser has asked for content. `clients`: Browsers with the page.
    """

    daemon_threads = True
    request_queue_size = 128

    def __init__(self, port: int = 0) -> None:
        self.asked = Event()  # set when a browser has asked for the page
        self.clients, self.closed = list[Client](), False
        # open connections, the oldest first; True for those that have shown the token
        self._connections: dict[socket.socket, bool] = {}
        # held while connections are counted or changed, by several threads
        self._changing = Lock()
        try:
            super().__init__((HOST, port), _Handler)
        except OSError as error:
            raise InputError(
                f"--port: found {port}: {error.strerror or error}; allowed: a port that is free"
            ) from error
        self.token, self.port = secrets.token_hex(16), int(self.server_address[1])
        self.address = f"http://{HOST}:{self.port}/{self.token}/"
        Thread(target=self.serve_forever, daemon=True).start()

    def verify_request(self, request: Any, client_address: Any) -> bool:  # noqa: ARG002 (of the library)
        """Return True to admit a connection. If there are too many, end the oldest one without the token, or return False.

        So a program that opens connections and sends nothing cannot keep the user's browser out.
        """
        with self._changing:
            if len(self._connections) >= MOST_CONNECTIONS:
                without_token = [
                    key for key, has_token in self._connections.items() if not has_token
                ]
                if not without_token:
                    return False
                oldest = without_token[0]
                del self._connections[oldest]
                with suppress(OSError):
                    oldest.shutdown(socket.SHUT_RDWR)
            self._connections[request] = False
        return True

    def keep(self, connection: socket.socket) -> None:
        """Protect a connection that has shown the token from being ended when there are too many."""
        with self._changing:
            if connection in self._connections:
                self._connections[connection] = True

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer a request in a thread, and afterwards forget its connection."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            with self._changing:
                self._connections.pop(request, None)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Print no traceback if the other side ends a connection, which is usual; of any other error the library prints one."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)

    def show(self, content: Callable[[str], str], *, changed: bool) -> None:
        """Give new content to every browser, or without `changed` only to browsers that are new; their threads send it.

        `content`: Function that makes the content, html, for the query of a browser.
        """
        self.asked.clear()
        for client in list(self.clients):
            if changed or client.is_new:
                client.content, client.is_new = content(client.query), False
                client.content_ready.set()

    def close(self) -> None:
        """End the server and all connections to browsers, whose threads are woken to see it."""
        self.closed = True
        self.shutdown()
        self.server_close()
        for client in list(self.clients):
            client.content_ready.set()


class _HeadReader(io.RawIOBase):
    """Reads a connection until a deadline, which does not move when single bytes arrive.

    The library's own limit begins anew with each byte, so one byte now and then would hold a connection for ever.
    """

    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        # the deadline, by a monotonic clock; set for each request
        self.ends_at_s = 0.0

    def readable(self) -> bool:
        """Return True, as the library requires."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read the bytes that have arrived into `buffer`, and return their number; raise TimeoutError after the deadline."""
        left_s = self.ends_at_s - time.monotonic()
        if left_s <= 0:
            raise TimeoutError
        self.connection.settimeout(left_s)
        return self.connection.recv_into(buffer)


LONGEST_WAIT_S = 10.0
"""Longest time for the whole head of a request, and for which a browser may stop reading an answer, s."""

_POLICY = (
    "default-src 'none'; script-src 'nonce-{0}'; style-src 'nonce-{0}'; connect-src 'self'; img-src data:; "
    "frame-ancestors 'none'; base-uri 'none'"
)
"""What the page may load (Content-Security-Policy): its own script and style, which carry the random word {0}, and no more."""


class _Handler(BaseHTTPRequestHandler):
    """Answers the requests of one connection; the library calls its methods, in a thread for each connection."""

    server: LivePage
    timeout = LONGEST_WAIT_S
    protocol_version = "HTTP/1.1"

    def setup(self) -> None:
        """Read the connection through a reader that limits the time for the head of a request."""
        super().setup()
        self._head_reader = _HeadReader(self.connection)
        self.rfile = io.BufferedReader(self._head_reader)

    def handle_one_request(self) -> None:
        """Answer one request, whose head must arrive in time."""
        self._head_reader.ends_at_s = time.monotonic() + self.timeout
        super().handle_one_request()

    def do_GET(self) -> None:
        """Answer a request that names this host, comes from this page or from no page, and has the token; refuse any other.

        Paths are ``/TOKEN/`` for the page and ``/TOKEN/events?QUERY`` for its content.
        """
        self.connection.settimeout(self.timeout)
        page_hosts = [f"{name}:{self.server.port}" for name in (HOST, "localhost")]
        # a shorter path has empty parts at its end
        _, token, page_and_query = [*self.path.split("/", 2), "", ""][:3]
        name, _, query = page_and_query.partition("?")
        is_ours = self.headers.get("Origin") in (None, *(f"http://{host}" for host in page_hosts))
        has_token = hmac.compare_digest(token.encode(), self.server.token.encode())
        if self.headers.get("Host") not in page_hosts or not is_ours or not has_token:
            self.close_connection = True
            self._head(403)
            return
        self.server.keep(self.connection)
        if name == "":
            nonce = secrets.token_hex(8)
            template = Path(__file__).with_name("page.html").read_text(encoding="utf-8")
            page = template.replace("NONCE", nonce).encode()
            self._head(200, len(page), nonce=nonce)
            self.wfile.write(page)
        elif name == "events":
            self._send_events(query)
        else:
            self._head(404)

    def _head(
        self, status: int, size: int | None = 0, kind: str = "text/html", nonce: str = ""
    ) -> None:
        """Send the head of an answer.

        `status`: Code of HTTP. `size`: Bytes of its body, None if not known. `kind`: Type of its content. `nonce`: Random
        word that the page's own script and style carry.
        """
        self.send_response(status)
        for key, value in {
            "Content-Type": f"{kind}; charset=utf-8",
            "Content-Security-Policy": _POLICY.format(nonce),
            "Cache-Control": "no-store",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
            "Cross-Origin-Resource-Policy": "same-origin",
        }.items():
            self.send_header(key, value)
        if size is not None:
            self.send_header("Content-Length", str(size))
        self.end_headers()

    def _send_events(self, query: str) -> None:
        """Send content whenever it is new, and in between a sign that the connection is alive; ends with browser or server.

        `query`: That of the page's address.
        """
        page, client = self.server, Client(query)
        self.close_connection = True
        self._head(200, None, "text/event-stream")
        page.clients.append(client)
        page.asked.set()
        with suppress(OSError):  # the browser has gone
            self.wfile.write(b"retry: 1000\n\n")
            longest_silence_s = 10.0
            while not page.closed:
                is_new = client.content_ready.wait(longest_silence_s)
                client.content_ready.clear()  # before the content is taken, so that newer content is sent too
                message = f"data: {json.dumps(client.content)}" if is_new else ": still here"
                self.wfile.write(f"{message}\n\n".encode())
        page.clients.remove(client)

    def log_message(self, format: str, *args: object) -> None:
        """Write nothing to the terminal."""
