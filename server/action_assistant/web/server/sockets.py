"""The sockets at which a process is reached; a taken port is one clear sentence."""

import errno
import socket
from typing import Final

from action_assistant.errors import CannotStart
from action_assistant.settings import EVERYWHERE

UNHEARD: Final = 20  # seconds after which a peer that takes nothing of what it was sent is gone


def bound(host: str, port: int, option: str = "--port") -> list[socket.socket]:
    """Return listening sockets for the address: for a loopback name in both IP families, so that no
    other process can answer under `localhost`; for EVERYWHERE in both families, too. Raise
    CannotStart if the address is taken or unknown; it names the `option` that chooses it."""
    hosts = [host]
    if host in {"127.0.0.1", "localhost"}:
        hosts = ["127.0.0.1", "::1"]
    elif host == EVERYWHERE:
        hosts = ["0.0.0.0", "::"]
    found: list[socket.socket] = []
    for name in hosts:
        family = socket.AF_INET6 if ":" in name else socket.AF_INET
        try:
            listener = socket.socket(family, socket.SOCK_STREAM)
        except OSError:  # no IPv6 on this machine
            continue
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        _forget_silent_peers(listener)
        if family == socket.AF_INET6:
            listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        try:
            listener.bind((name, port))
            listener.listen(2048)
        except OSError as error:
            listener.close()
            if name in {"::1", "::"} and found and error.errno != errno.EADDRINUSE:
                continue  # IPv6 is known to the kernel but switched off
            for other in found:
                other.close()
            raise CannotStart(_why(name, port, error, option)) from error
        found.append(listener)
    return found


def _forget_silent_peers(listener: socket.socket) -> None:
    """Have the kernel drop a connection whose peer has vanished or reads nothing, since data for it
    would wait for ever. The connections that the listener accepts inherit this."""
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    options = {"TCP_USER_TIMEOUT": UNHEARD * 1000, "TCP_KEEPIDLE": UNHEARD, "TCP_KEEPINTVL": 5}
    for name, value in options.items():
        number = getattr(socket, name, None)  # not every system has them
        if number is not None:
            listener.setsockopt(socket.IPPROTO_TCP, number, value)


def _why(host: str, port: int, error: OSError, option: str) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"Port {port} is taken on {host}; choose another with {option}."
    return f"Cannot listen on {host}, port {port}: {error.strerror}."
