"""Under which names this process may be called, and from which pages."""

from collections.abc import Iterable
from typing import Final
from urllib.parse import urlsplit

from action_assistant.settings import LOOPBACK

_ANYWHERE: Final = frozenset({"0.0.0.0", "::", ""})


def host_name(host: str) -> str:
    """The name in a Host header or URL authority, without port, lower case; "" if it is none."""
    try:
        parts = urlsplit(f"//{host.strip()}")
        parts.port  # noqa: B018 - raises on a port that is no number
    except ValueError:
        return ""
    if parts.username is not None or parts.path or parts.query or parts.fragment:
        return ""
    return parts.hostname or ""


class Addresses:
    """Host names that may be asked for, and the origins of pages that may ask.

    `page_port` is the port of the page. Where host names were given on purpose the page may stand
    behind a proxy, so for those any port and https are accepted.
    """

    def __init__(self, *, host: str, page_port: int, hosts: Iterable[str] = ()) -> None:
        self._named = frozenset(name.lower() for name in hosts)
        self._hosts = LOOPBACK | self._named | ({host.lower()} - _ANYWHERE)
        self._page_port = page_port

    def allows_host(self, header: str | None) -> bool:
        """Whether a request may name this host (DNS rebinding comes with another)."""
        return header is not None and host_name(header) in self._hosts

    def allows_origin(self, origin: str) -> bool:
        """Whether a page of this origin may talk to us."""
        try:
            parts = urlsplit(origin)
            port = parts.port
        except ValueError:
            return False
        name = (parts.hostname or "").lower()
        if origin != f"{parts.scheme}://{parts.netloc}" or "@" in parts.netloc:
            return False
        if name in self._named:
            return parts.scheme in {"http", "https"}
        return parts.scheme == "http" and name in self._hosts and (port or 80) == self._page_port
