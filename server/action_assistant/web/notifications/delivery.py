"""Sends one message to one receiver. Blocks, and ends within a bounded time.

The host is resolved once for each try, and the connection goes to exactly the address that was
checked. Private addresses are refused unless the setting names them. No redirect is followed, and
nothing of an answer is read but its status.
"""

import base64
import hashlib
import hmac
import http.client
import ipaddress
import smtplib
import socket
import ssl
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Final

from action_assistant.kit.clock import utc_us
from action_assistant.public_url import Network
from action_assistant.safe_text import one_line
from action_assistant.version import VERSION
from action_assistant.web.notifications.messages import Message, mail, payload
from action_assistant.web.notifications.receivers import Mailbox, Receiver, Webhook

_CONNECT_S: Final = 5.0
_STEP_S: Final = 10.0  # for one step of a conversation
#: Seconds after which a try has failed, however slowly the receiver goes on.
TRY_S: Final = 25.0
_GONE: Final = 410
_SIGNED_IN, _FOR_EVER = 235, 500  # of SMTP
_PORTS: Final = {"http": 80, "https": 443}
_LONGEST: Final = 200  # characters of a reason

_Address = ipaddress.IPv4Address | ipaddress.IPv6Address


class NotDelivered(Exception):
    """The receiver did not take the message; the text says why, for people. `is_final`: it wants no
    message any more; `left`: the mail addresses that refused it, if others took it."""

    def __init__(self, why: str, *, is_final: bool = False, left: tuple[str, ...] = ()) -> None:
        super().__init__(why)
        self.is_final: Final = is_final
        self.left: Final = left


def deliver(receiver: Receiver, message: Message, page: str) -> None:
    """Send a message. `page`: the public URL of the page, "" if there is none. Raise NotDelivered if
    the receiver does not take it, or may not be reached."""
    try:
        if isinstance(receiver, Webhook):
            _post(receiver, message, page)
        else:
            _mail(receiver, message, page)
    except NotDelivered:
        raise
    except ssl.SSLCertVerificationError as error:
        raise NotDelivered(f"Its certificate is not trusted: {error.verify_message}.") from error
    except TimeoutError as error:
        raise NotDelivered("It did not answer in time.") from error
    except (OSError, http.client.HTTPException, smtplib.SMTPException, ValueError) as error:
        raise NotDelivered(_why(error)) from error


def signature(key: bytes, id_: str, timestamp: int, body: bytes) -> str:
    """Return the value of the header `webhook-signature` of Standard Webhooks. `timestamp`: seconds
    since 1970."""
    signed = b".".join((id_.encode(), str(timestamp).encode(), body))
    return "v1," + base64.b64encode(hmac.digest(key, signed, hashlib.sha256)).decode()


def _post(receiver: Webhook, message: Message, page: str) -> None:
    url, now = receiver.url, utc_us()
    host, port = url.hostname or "", url.port or _PORTS[url.scheme]
    body = payload(message, page, now)
    seconds = now // 1_000_000
    headers = {
        "host": url.netloc,
        "content-type": "application/json",
        "user-agent": f"action-assistant/{VERSION}",
        "webhook-id": message.id,
        "webhook-timestamp": str(seconds),
        "webhook-signature": signature(receiver.key, message.id, seconds, body),
        "connection": "close",
    }
    with _connected(host, port, receiver.allow, needs_private=url.scheme == "http") as raw:
        connection = http.client.HTTPConnection(host, port)
        # A socket that is there already is used as it is: nothing is resolved again.
        connection.sock = raw if url.scheme == "http" else _secured(raw, host, receiver.ca)
        path = f"{url.path or '/'}?{url.query}" if url.query else url.path or "/"
        try:
            connection.request("POST", path, body, headers)
            status = connection.getresponse().status
        finally:
            connection.close()
    if 200 <= status < 300:
        return
    if status == _GONE:
        raise NotDelivered("It answered 410: it wants no messages any more.", is_final=True)
    if 300 <= status < 400:
        raise NotDelivered(f"It answered {status}, and redirects are not followed.")
    raise NotDelivered(f"It answered {status}.")


class _PinnedSmtp(smtplib.SMTP):
    """Speaks SMTP over a socket that is connected already."""

    def __init__(self, host: str, port: int, connected: socket.socket) -> None:
        self._connected = connected
        super().__init__(host, port, timeout=_STEP_S)

    def _get_socket(self, host: str, port: int, timeout: float) -> socket.socket:
        del host, port, timeout
        return self._connected


def _mail(receiver: Mailbox, message: Message, page: str) -> None:
    to = tuple(each for each in receiver.to if not message.left or each in message.left)
    if not to:  # the setting does not name those any more who are left
        return
    text = mail(message, page, utc_us(), sender=receiver.sender, to=receiver.to)
    host, port = receiver.host, receiver.port
    needs_private = receiver.security == "none"
    with _connected(host, port, receiver.allow, needs_private=needs_private) as raw:
        wrapped = _secured(raw, host, receiver.ca) if receiver.security == "tls" else raw
        with _PinnedSmtp(host, port, wrapped) as connection:
            if receiver.security == "starttls":
                connection.starttls(context=_context(receiver.ca))
            if receiver.user:
                _sign_in(connection, receiver.user, receiver.password)
            refused = connection.sendmail(receiver.sender, to, text)
    if refused:
        raise NotDelivered(f"It refused {', '.join(refused)}.", left=tuple(refused))


def _sign_in(connection: smtplib.SMTP, user: str, password: str) -> None:
    """Send the password to a mail server. smtplib sends ASCII alone; other characters go as UTF-8,
    as RFC 4616 has it."""
    if (user + password).isascii():
        connection.login(user, password)
        return
    connection.ehlo_or_helo_if_needed()
    if "PLAIN" not in connection.esmtp_features.get("auth", "").split():
        raise NotDelivered("It takes no password with characters beyond ASCII.")
    words = base64.b64encode(f"\0{user}\0{password}".encode()).decode()
    code, answer = connection.docmd("AUTH", f"PLAIN {words}")
    if code != _SIGNED_IN:
        raise smtplib.SMTPAuthenticationError(code, answer)


@contextmanager
def _connected(
    host: str, port: int, allow: tuple[Network, ...], *, needs_private: bool
) -> Iterator[socket.socket]:
    """Return a context with a socket that is connected to an allowed address of a host; at its end,
    or after `TRY_S`, it is closed."""
    address = _allowed(host, port, allow, needs_private=needs_private)
    with socket.create_connection((str(address), port), _CONNECT_S) as found:
        found.settimeout(_STEP_S)
        duplicate = found.dup()  # TLS takes the other one over
        watchdog = threading.Timer(TRY_S, _shut, (duplicate,))
        watchdog.daemon = True
        watchdog.start()
        try:
            yield found
        finally:
            watchdog.cancel()
            duplicate.close()


def _shut(duplicate: socket.socket) -> None:
    with suppress(OSError):
        duplicate.shutdown(socket.SHUT_RDWR)


def _allowed(host: str, port: int, allow: tuple[Network, ...], *, needs_private: bool) -> _Address:
    """Return the first address of a host to which a message may go. Raise NotDelivered if there is
    none. `needs_private`: only addresses in `allow` count, since nothing is encrypted."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as error:
        raise NotDelivered("Its host is not found.") from error
    addresses = [_plain(ipaddress.ip_address(str(each[4][0]).partition("%")[0])) for each in found]
    for each in addresses:
        listed = any(each in network for network in allow if network.version == each.version)
        if listed or (is_public(each) and not needs_private):
            return each
    where = ", ".join(dict.fromkeys(map(str, addresses[:3])))
    raise NotDelivered(f"Its host is at {where}, which the setting does not allow.")


def _plain(address: _Address) -> _Address:
    """Return the IPv4 address that an IPv6 address stands for, if it stands for one."""
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return mapped or address


_TUNNELS: Final = tuple(
    ipaddress.ip_network(each) for each in ("2002::/16", "2001::/32", "64:ff9b::/96")
)


def is_public(address: _Address) -> bool:
    """Return whether an address is one of the internet; none that only leads to another one is."""
    if any(address in each for each in _TUNNELS if each.version == address.version):
        return False
    return address.is_global and not address.is_multicast


def _context(ca: str | None) -> ssl.SSLContext:
    return ssl.create_default_context(cafile=ca)


def _secured(raw: socket.socket, host: str, ca: str | None) -> ssl.SSLSocket:
    return _context(ca).wrap_socket(raw, server_hostname=host)


def _why(error: Exception) -> str:
    """Return the reason of a failure, for people. Of what a receiver has sent only the number of an
    SMTP answer is shown."""
    match error:
        case smtplib.SMTPAuthenticationError() if error.smtp_code < _FOR_EVER:
            return f"It cannot check the password now ({error.smtp_code})."
        case smtplib.SMTPAuthenticationError():
            return f"It does not take the user or the password ({error.smtp_code})."
        case smtplib.SMTPNotSupportedError():
            return "It does not encrypt (no STARTTLS), or takes no password."
        case smtplib.SMTPRecipientsRefused():
            return f"It refused {', '.join(error.recipients)}."
        case smtplib.SMTPResponseException():
            return f"It answered {error.smtp_code}."
        case smtplib.SMTPException() | http.client.HTTPException():
            return "Its answer cannot be understood."
        case OSError() if error.strerror:
            return f"It cannot be reached: {one_line(error.strerror)[:_LONGEST]}."
        case _:
            return "It cannot be reached."
