"""Under which names this process may be called, and from which pages."""

import ipaddress
import socket
import time
from collections.abc import Callable, Iterable
from typing import Final
from urllib.parse import urlsplit

import ifaddr

from action_assistant.settings import EVERYWHERE, LOOPBACK

_ANYWHERE: Final = frozenset({"0.0.0.0", "::", EVERYWHERE})
_LOOK_AGAIN_S: Final = 5.0
#: Interfaces to containers and virtual machines of this computer: nobody comes by them.
_INNER: Final = ("docker", "br-", "veth", "virbr", "cni", "podman", "lxc", "lxd")


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


def lan_names() -> tuple[str, ...]:
    """What others on the network can call this computer, the likeliest first: its addresses, and
    its name as multicast DNS knows it."""
    found: list[ipaddress.IPv4Address | ipaddress.IPv6Address] = []
    for adapter in ifaddr.get_adapters():
        if adapter.name.startswith(_INNER):
            continue
        for each in adapter.ips:
            text = each.ip if isinstance(each.ip, str) else each.ip[0]
            address = ipaddress.ip_address(text)
            if not (address.is_loopback or address.is_link_local or address in found):
                found.append(address)
    found.sort(key=lambda address: address.version)
    name = socket.gethostname().lower()
    names = [name] if "." in name else [f"{name}.local", name]
    old, new = (
        [str(address) for address in found if address.version == version] for version in (4, 6)
    )
    return (*old, *(name for name in names if name not in LOOPBACK), *new)


class Addresses:
    """Host names that may be asked for, and the origins of pages that may ask.

    `page_port` is the port of the page. Where host names were given on purpose the page may stand
    behind a proxy, so for those any port and scheme are accepted. With `lan`, exactly the names that
    it gives now are accepted too: it is asked again when an unknown one comes.
    """

    def __init__(
        self,
        *,
        host: str,
        page_port: int,
        hosts: Iterable[str] = (),
        secure: bool = False,
        lan: Callable[[], tuple[str, ...]] | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._named = tuple(name.lower() for name in hosts)
        self._hosts = LOOPBACK | set(self._named) | ({host.lower()} - _ANYWHERE)
        self._host = host.lower()
        self._page_port = page_port
        self.secure: Final = secure
        self._scheme: Final = "https" if secure else "http"
        self._lan = lan
        self._found: tuple[str, ...] = lan() if lan is not None else ()
        self._clock = clock
        self._looked = clock()

    def allows_host(self, header: str | None) -> bool:
        """Whether a request may name this host (DNS rebinding comes with another)."""
        return header is not None and self._knows(host_name(header))

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
        if parts.scheme != self._scheme or not self._knows(name):
            return False
        return (port or (443 if parts.scheme == "https" else 80)) == self._page_port

    def names(self) -> tuple[str, ...]:
        """By which others reach this computer, the likeliest first; empty when they cannot."""
        own = {self._host} - _ANYWHERE - LOOPBACK
        return tuple(dict.fromkeys((*self._named, *own, *self._found)))

    def certified(self) -> tuple[str, ...]:
        """Every name that a certificate has to carry."""
        if self._lan is not None:
            self._found = self._lan()
        return tuple(dict.fromkeys((*sorted(LOOPBACK), *self.names())))

    def origins(self) -> tuple[str, ...]:
        """Of the page, as others have to call it."""
        return tuple(f"{self._scheme}://{_shown(name)}:{self._page_port}" for name in self.names())

    def _knows(self, name: str) -> bool:
        if name in self._hosts or name in self._found:
            return True
        now = self._clock()
        if not name or self._lan is None or now - self._looked < _LOOK_AGAIN_S:
            return False
        self._looked = now  # the network may be another by now
        self._found = self._lan()
        return name in self._found


def _shown(name: str) -> str:
    return f"[{name}]" if ":" in name else name


def addresses_of(
    *, host: str, page_port: int, hosts: tuple[str, ...], share: bool, secure: bool
) -> Addresses:
    """What the settings of a process come to."""
    listens_everywhere = share and host in _ANYWHERE
    lan = lan_names if listens_everywhere else None
    return Addresses(host=host, page_port=page_port, hosts=hosts, secure=secure, lan=lan)
