"""Listening: sockets bound first, so that a taken port is one clear sentence; then uvicorn."""

import errno
import os
import socket
import threading
from typing import Final

import uvicorn
from litestar.types import ASGIApp

from action_assistant.errors import CannotStart

WEBSOCKET_LIMIT: Final = 1_114_112  # bytes; an update of 1 MiB and its frame
GRACE: Final = 5  # seconds that open requests get when the process is told to end


def serve(app: ASGIApp, *, host: str, port: int) -> None:
    """Serve until told to end. Raises CannotStart when the address is taken or unknown."""
    sockets = bound(host, port)
    config = uvicorn.Config(
        app,
        lifespan="on",
        log_config=None,
        access_log=False,
        proxy_headers=False,
        server_header=False,
        ws="websockets-sansio",
        ws_max_size=WEBSOCKET_LIMIT,
        ws_per_message_deflate=False,
        ws_ping_interval=10,
        ws_ping_timeout=10,
        timeout_graceful_shutdown=GRACE,
    )
    server = uvicorn.Server(config)
    _end_with_parent(server)
    server.run(sockets=sockets)
    if not server.started:
        raise CannotStart("The process could not be set up; the log above says why.")


def bound(host: str, port: int) -> list[socket.socket]:
    """Sockets for the address; both loopback families for a loopback name, so that nobody else
    can stand in for us under `localhost`."""
    hosts = ["127.0.0.1", "::1"] if host in {"127.0.0.1", "localhost"} else [host]
    found: list[socket.socket] = []
    for name in hosts:
        family = socket.AF_INET6 if ":" in name else socket.AF_INET
        try:
            listener = socket.socket(family, socket.SOCK_STREAM)
        except OSError:  # no IPv6 on this machine
            continue
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if family == socket.AF_INET6:
            listener.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
        try:
            listener.bind((name, port))
            listener.listen(2048)
        except OSError as error:
            listener.close()
            if name == "::1" and error.errno != errno.EADDRINUSE:
                continue  # IPv6 is known to the kernel but switched off
            for other in found:
                other.close()
            raise CannotStart(_why(name, port, error)) from error
        found.append(listener)
    return found


def _why(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"Port {port} is taken on {host}; choose another with --port."
    return f"Cannot listen on {host}, port {port}: {error.strerror}."


def _end_with_parent(server: uvicorn.Server) -> None:
    """End when the process that started us dies, however it dies: its end of the pipe closes."""
    descriptor = os.environ.pop("_ACTION_ASSISTANT_PARENT", None)
    if descriptor is None:
        return

    def wait() -> None:
        with os.fdopen(int(descriptor), "rb") as pipe:
            pipe.read()
        server.should_exit = True

    threading.Thread(target=wait, name="parent", daemon=True).start()
