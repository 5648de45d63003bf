"""The names under which this process may be called, and the origins that may call it."""

import ipaddress
import socket
import time
from collections.abc import Callable, Iterable
from typing import Final
from urllib.parse import urlsplit

import ifaddr

from action_assistant.public_url import PublicUrl
from action_assistant.settings import EVERYWHERE, LOOPBACK, Site
from action_assistant.sites import port_of

_ANYWHERE: Final = frozenset({"0.0.0.0", "::", EVERYWHERE})
_LOOK_AGAIN_S: Final = 5.0
#: Interfaces to containers and virtual machines of this computer: no person uses them.
_INNER: Final = ("docker", "br-", "veth", "virbr", "cni", "podman", "lxc", "lxd")


def host_name(host: str) -> str:
    """Return the host name in a Host header or URL authority, in lower case and without the port;
    "" if the text cannot be parsed."""
    return _host_and_port(host)[0]


def _host_and_port(host: str) -> tuple[str, int | None]:
    try:
        parts = urlsplit(f"//{host.strip()}")
        port = parts.port
    except ValueError:
        return "", None
    if parts.username is not None or parts.path or parts.query or parts.fragment:
        return "", None
    return parts.hostname or "", port


def lan_names() -> tuple[str, ...]:
    """Return the names of this computer on the network, the likeliest first: addresses, and its
    mDNS name."""
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
    """Knows the host names by which this server may be addressed, and the origins of pages that may
    call it.

    `page_port`: the port of the page. For host names that were configured any port and scheme are
    accepted, since a proxy may stand before the page. `lan`: returns further names; it is called
    again when an unknown name comes. `public`: the address at which a proxy serves the page; only
    requests that name it are answered as at that address.
    """

    def __init__(
        self,
        *,
        host: str,
        page_port: int,
        hosts: Iterable[str] = (),
        secure: bool = False,
        lan: Callable[[], tuple[str, ...]] | None = None,
        public: PublicUrl | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._public = public
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

    @property
    def is_proxied(self) -> bool:
        """Return whether a proxy shows the page at a public address."""
        return self._public is not None

    @property
    def is_encrypted(self) -> bool:
        """Return whether the first address that others use is encrypted."""
        return self.secure if self._public is None else self._public.is_secure

    def allows_host(self, header: str | None) -> bool:
        """Return whether a request with this Host header may be answered; None stands for a missing
        header, which may not. A request after DNS rebinding names another host."""
        if header is None:
            return False
        return self.public_at(header) is not None or self._knows(host_name(header))

    def allows_origin(self, origin: str) -> bool:
        """Return whether a page of this origin may send requests."""
        if self._public is not None and origin == self._public.origin:
            return True
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

    def public_at(self, header: str) -> PublicUrl | None:
        """Return the public address if the Host header `header` names it, else None."""
        public = self._public
        return public if public is not None and public.is_named(*_host_and_port(header)) else None

    def replaced_host(self, header: str | None, origin: str) -> str | None:
        """Return a sentence if a proxy replaced the Host header of a request from the public page,
        else None. `origin`: the origin of the page that sent the request. Such a request would seem
        to come from a page of this computer."""
        public = self._public
        if public is None or origin != public.origin or self.public_at(header or ""):
            return None
        return (
            f"The page is at {public.page}, and the proxy before it asked for {header or ''!r}: it has "
            "to pass on the Host header (nginx: proxy_set_header Host $http_host)."
        )

    def runner_at(self, header: str, port: int) -> str:
        """Return the URL of the runner, without a final slash, for a client that sent this Host
        header. `port`: the port of the runner, if no proxy stands between."""
        public = self.public_at(header)
        return public.runner if public is not None else self.direct(header, port)

    def sites_at(self, header: str, sites: Iterable[Site]) -> tuple[Site, ...]:
        """Return the sites with their URLs for a client that sent this Host header."""
        return tuple(
            site if (port := port_of(site)) is None else Site(site.name, self.direct(header, port))
            for site in sites
        )

    def direct(self, header: str, port: int) -> str:
        """Return the URL of a port of this computer under the host name of a Host header, without a
        slash at the end."""
        return f"{self._scheme}://{_shown(host_name(header) or '127.0.0.1')}:{port}"

    def jar(self, header: str) -> tuple[bool, str]:
        """Return whether cookies are `Secure` for a client that sent this Host header, and the path
        of the cookies."""
        public = self.public_at(header)
        return (self.secure, "/") if public is None else (public.is_secure, f"{public.path}/")

    def is_page(self, url: str) -> bool:
        """Return whether the page can be found at a URL."""
        return self.allows_origin(url) or (self._public is not None and url == self._public.page)

    def names(self) -> tuple[str, ...]:
        """Return the names by which others reach this computer, the likeliest first; empty if they
        cannot reach it."""
        own = {self._host} - _ANYWHERE - LOOPBACK
        return tuple(dict.fromkeys((*self._named, *own, *self._found)))

    def certified(self) -> tuple[str, ...]:
        """Return every host name for which the certificate has to be valid."""
        if self._lan is not None:
            self._found = self._lan()
        return tuple(dict.fromkeys((*sorted(LOOPBACK), *self.names())))

    def origins(self) -> tuple[str, ...]:
        """Return the origins of the page as others have to use them; a public one includes its
        path."""
        public = () if self._public is None else (self._public.page,)
        direct = (f"{self._scheme}://{_shown(name)}:{self._page_port}" for name in self.names())
        return (*public, *direct)

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
    *,
    host: str,
    page_port: int,
    hosts: tuple[str, ...],
    share: bool,
    secure: bool,
    public: PublicUrl | None = None,
) -> Addresses:
    """Return the addresses that follow from the settings of a process. `host`: where it listens;
    `hosts`: further names; `share`: it is open to the network; `secure`: it serves TLS."""
    listens_everywhere = share and host in _ANYWHERE
    lan = lan_names if listens_everywhere else None
    return Addresses(
        host=host, page_port=page_port, hosts=hosts, secure=secure, lan=lan, public=public
    )
