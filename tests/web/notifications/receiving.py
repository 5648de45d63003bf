"""Receivers of notifications for tests: a real HTTP server and a real mail server."""

import base64
import socket
import ssl
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from email import message_from_bytes, policy
from email.message import EmailMessage
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from ipaddress import ip_network
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from aiosmtpd.controller import Controller
from aiosmtpd.smtp import AuthResult, LoginPassword
from standardwebhooks import Webhook as StandardWebhook

from action_assistant.web.network.certificate import Certificate
from action_assistant.web.notifications.messages import KINDS, Message
from action_assistant.web.notifications.receivers import Mailbox, Webhook

KEY = b"0123456789abcdef0123456789abcdef"
SECRET = "whsec_" + base64.b64encode(KEY).decode()
LOOPBACK = (ip_network("127.0.0.0/8"), ip_network("::1/128"))
NOW = 1_800_000_000_000_000


class HttpReceiver:
    """A server that verifies each message as Standard Webhooks says. `answers`: the next statuses,
    204 after them; `headers`: of the answers; `delay_s`: before each answer."""

    def __init__(self, context: ssl.SSLContext | None = None) -> None:
        self.answers: list[int] = []
        self.headers: dict[str, str] = {}
        self.drips = False
        self.got: list[tuple[Mapping[str, str], Any]] = []
        receiver = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = self.rfile.read(int(self.headers["content-length"]))
                headers = {name.lower(): value for name, value in self.headers.items()}
                # It raises where the signature or the time is wrong.
                receiver.got.append((headers, StandardWebhook(SECRET).verify(body, headers)))
                while receiver.drips:
                    self.wfile.write(b"H")
                    time.sleep(0.05)
                status = receiver.answers.pop(0) if receiver.answers else 204
                self.send_response(status)
                for name, value in receiver.headers.items():
                    self.send_header(name, value)
                self.send_header("content-length", "0")
                self.end_headers()

            def log_message(self, format: str, *args: Any) -> None:  # noqa: A002
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        if context is not None:
            self._server.socket = context.wrap_socket(self._server.socket, server_side=True)
        self.port: int = self._server.server_port
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def close(self) -> None:
        """End the server."""
        self.drips = False
        self._server.shutdown()
        self._server.server_close()


@contextmanager
def http_receiver(context: ssl.SSLContext | None = None) -> Iterator[HttpReceiver]:
    """Return a context with an HTTP receiver."""
    receiver = HttpReceiver(context)
    try:
        yield receiver
    finally:
        receiver.close()


class Mails:
    """The mails that a mail server has got. `refuses`: the answer to each mail instead; `unknown`:
    addresses that it refuses; `got`, `refused`: how often each address got or was refused a mail;
    `signed_in`: by which mechanism a password came, and whether it was right; `no_check`: the answer to
    each password instead."""

    def __init__(self) -> None:
        self.raw: list[bytes] = []
        self.refuses = ""
        self.unknown: set[str] = set()
        self.no_check = ""
        self.signed_in: list[tuple[str, bool]] = []
        self.got: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()

    async def handle_RCPT(  # noqa: N802
        self, _server: Any, _session: Any, envelope: Any, address: str, _options: list[str]
    ) -> str:
        """Take or refuse an address."""
        if address in self.unknown:
            self.refused[address] += 1
            return "550 no such user"
        envelope.rcpt_tos.append(address)
        return "250 OK"

    async def handle_DATA(self, _server: Any, _session: Any, envelope: Any) -> str:  # noqa: N802
        """Keep a mail."""
        if self.refuses:
            return self.refuses
        self.raw.append(envelope.content)
        self.got.update(envelope.rcpt_tos)
        return "250 OK"

    @property
    def read(self) -> list[EmailMessage]:
        """The mails as a mail program reads them."""
        found = [message_from_bytes(each, policy=policy.default) for each in self.raw]
        return [each for each in found if isinstance(each, EmailMessage)]


@contextmanager
def mail_server(
    context: ssl.SSLContext | None = None,
    *,
    passwords: Mapping[str, str] | None = None,
    implicit: bool = False,
) -> Iterator[tuple[Mails, int]]:
    """Return a context with the mails of a server and its port; with a TLS context it demands
    STARTTLS, or if `implicit` speaks TLS from the first byte. It takes mail from these users only."""
    mails = Mails()
    known = {each.encode(): word.encode() for each, word in (passwords or {}).items()}

    def check(
        _server: Any, _session: Any, _envelope: Any, mechanism: str, given: LoginPassword
    ) -> AuthResult:
        fits = known.get(given.login) == given.password
        mails.signed_in.append((mechanism, fits))
        success = fits and not mails.no_check
        return AuthResult(success=success, handled=False, message=mails.no_check or None)

    secured: dict[str, Any] = {"tls_context": context, "require_starttls": context is not None}
    if implicit:
        secured = {"ssl_context": context, "auth_require_tls": False}
    if passwords:
        secured |= {"auth_required": True, "authenticator": check}
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    controller = Controller(
        mails,
        hostname="127.0.0.1",
        port=port,
        **secured,
    )
    controller.start()
    try:
        yield mails, port
    finally:
        controller.stop()


def tls(folder: Path, *names: str) -> tuple[ssl.SSLContext, str]:
    """Return a server's TLS context for these host names, and the file with its authority."""
    certificate = Certificate(folder)
    certificate.renew(names)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate.chain, certificate.key)
    return context, str(certificate.authority)


def webhook(url: str, name: str = "chat", **fields: Any) -> Webhook:
    """Return a webhook for all kinds; hosts on this computer are allowed."""
    given = {"allow": LOOPBACK, "kinds": frozenset(KINDS), "key": KEY} | fields
    return Webhook(name=name, url=urlsplit(url), **given)


def mailbox(port: int, **fields: object) -> Mailbox:
    """Return two mail addresses behind a mail server on this computer."""
    given = {
        "name": "lab",
        "kinds": frozenset(KINDS),
        "host": "localhost",
        "port": port,
        "security": "starttls",
        "sender": "robots@example.org",
        "to": ("lab@example.org", "night@example.org"),
        "allow": LOOPBACK,
    }
    return Mailbox(**(given | fields))


def failed_run(at: int = NOW, **facts: Any) -> Message:
    """Return the message of a run that has failed."""
    known = {"run": "r1", "number": 12, "graph": "Fetch", "robot": "David", "state": "an error"}
    return Message(id="run/r1:7:chat", kind="run.ended", at=at, facts=known | facts)
