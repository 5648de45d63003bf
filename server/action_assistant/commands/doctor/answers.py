"""Asks what listens at an address, without showing it anything secret."""

import socket
import ssl
import time
from email.utils import parsedate_to_datetime
from typing import Final

import httpx
import msgspec

_PATIENCE_S: Final = 3.0


class ProcessAnswer(msgspec.Struct, frozen=True, kw_only=True):
    """What came back from `/healthz`. `base` is with its scheme; `version` is "" for other programs;
    `clock_s`: by how many seconds its clock is ahead of ours, if it says so."""

    base: str
    status: int
    text: str = ""
    version: str = ""
    clock_s: float | None = None


class _Health(msgspec.Struct):
    """The part of the answer that says who it is."""

    version: str


def listens(host: str, port: int) -> bool:
    """Whether anything takes connections there."""
    try:
        socket.create_connection((_reached(host), port), _PATIENCE_S).close()
    except OSError:
        return False
    return True


def at_port(host: str, port: int) -> ProcessAnswer | None:
    """What answers at a port, by http or https; None when nothing answers as a web server does."""
    shown = _reached(host)
    shown = f"[{shown}]" if ":" in shown else shown
    for scheme in ("http", "https"):
        try:
            # A certificate that is wrong is told by itself; nothing secret is sent.
            with client(verify=False) as asking:
                return health(asking, f"{scheme}://{shown}:{port}")
        except httpx.HTTPError:
            continue
    return None


def client(verify: ssl.SSLContext | bool) -> httpx.Client:
    """One that asks directly, and not for long."""
    return httpx.Client(verify=verify, timeout=_PATIENCE_S, trust_env=False)


def health(asking: httpx.Client, base: str) -> ProcessAnswer:
    """What `/healthz` answers. Raises httpx.HTTPError."""
    answer = asking.get(f"{base}/healthz")
    now = time.time()
    try:
        version = msgspec.json.decode(answer.content, type=_Health).version
    except msgspec.DecodeError:
        version = ""
    return ProcessAnswer(
        base=base,
        status=answer.status_code,
        text=answer.text[:2000],
        version=version if answer.status_code == 200 else "",
        clock_s=_ahead(answer.headers.get("date", ""), now),
    )


def _ahead(date: str, now: float) -> float | None:
    try:
        return parsedate_to_datetime(date).timestamp() - now
    except ValueError:
        return None


def _reached(host: str) -> str:
    """Where a process that listens everywhere is reached from here."""
    return "127.0.0.1" if host in {"*", "0.0.0.0", "::", "localhost"} else host
