"""The public URL, under which a proxy shows the product to others, and the proxies to believe."""

import ipaddress
import re
from typing import Final
from urllib.parse import urlsplit

import msgspec

from action_assistant.errors import CannotStart

Network = ipaddress.IPv4Network | ipaddress.IPv6Network

#: Below the public address, where the runner is.
RUNNER: Final = "/runner"
_PORTS: Final = {"http": 80, "https": 443}
_PATH: Final = re.compile(r"(/[A-Za-z0-9._~-]+)*")
#: What answers at the root of either process: an address below it would stand for two things.
_TAKEN: Final = frozenset(
    {
        "api",
        "assets",
        "graphs",
        "healthz",
        "metrics",
        "readyz",
        "robots",
        "runner",
        "runs",
        "schema",
    }
)
#: Names that no public authority signs for, since each network has its own.
_OF_A_NETWORK: Final = (".local", ".lan", ".internal", ".home.arpa", ".test", ".localhost")
LOOPBACK_PROXIES: Final[tuple[Network, ...]] = (
    ipaddress.ip_network("127.0.0.0/8"),
    ipaddress.ip_network("::1"),
)


class PublicUrl(msgspec.Struct, frozen=True):
    """The address of the page for people who come through the proxy. `path` is "" or, for example,
    "/temoto"."""

    scheme: str
    host: str
    port: int
    path: str

    @property
    def authority(self) -> str:
        """Return host and port as an address bar shows them: without the default port."""
        shown = f"[{self.host}]" if ":" in self.host else self.host
        return shown if self.port == _PORTS[self.scheme] else f"{shown}:{self.port}"

    @property
    def origin(self) -> str:
        """Return the origin (scheme, host and port) as browsers send it."""
        return f"{self.scheme}://{self.authority}"

    @property
    def page(self) -> str:
        """Return the URL of the page and its API, without a final slash."""
        return self.origin + self.path

    @property
    def runner(self) -> str:
        """Return the URL of the runner, without a final slash."""
        return self.page + RUNNER

    @property
    def is_signed_for(self) -> bool:
        """Return whether it is https under a name that a public authority signs for, so that browsers
        may be told never to use http there."""
        is_name = "." in self.host and ":" not in self.host and not self.host[-1].isdigit()
        return self.is_secure and is_name and not self.host.endswith(_OF_A_NETWORK)

    @property
    def is_secure(self) -> bool:
        """Return whether the way to the proxy is encrypted."""
        return self.scheme == "https"

    def is_named(self, name: str, port: int | None) -> bool:
        """Return whether a Host header with this name and port (None if there is none) names the
        address. Proxies may leave the port out."""
        return name == self.host and port in {None, self.port}


def public_url(text: str) -> PublicUrl:
    """Parse the public address in the settings, for example `https://robots.example.org/temoto/`.
    Raise CannotStart if it cannot be used."""
    try:
        parts = urlsplit(text.strip())
        port = parts.port
    except ValueError as error:
        raise CannotStart(f"The public address {text!r} cannot be read: {error}.") from error
    path = parts.path.rstrip("/")
    host = (parts.hostname or "").lower()
    if parts.scheme not in _PORTS or not host or not host.isascii():
        raise CannotStart(
            f"The public address {text!r} is none: write it as https://robots.example.org/temoto/ "
            "(names beyond ASCII as xn--…)."
        )
    if parts.username is not None or parts.query or parts.fragment or not _PATH.fullmatch(path):
        raise CannotStart(
            f"The public address {text!r} has more than a name, a port, and a path of letters, "
            "digits and . _ ~ -"
        )
    if set(path.split("/")) & {".", ".."} or (
        path.split("/")[1:2] and path.split("/")[1] in _TAKEN
    ):
        raise CannotStart(
            f"The path of the public address {text!r} means something else here; choose another, "
            "such as /temoto/."
        )
    if parts.scheme == "http" and not _is_of_a_network(host):
        raise CannotStart(
            f"The public address {text!r} is not encrypted: links, sessions and Stop would go "
            "through the internet as plain text. Use https; plain http is for names and addresses "
            "of your own network."
        )
    return PublicUrl(parts.scheme, host, port or _PORTS[parts.scheme], path)


def proxies(text: str) -> tuple[Network, ...]:
    """Parse IP addresses and networks that are separated by commas. Raise CannotStart if an entry
    is neither."""
    try:
        return tuple(ipaddress.ip_network(each.strip()) for each in text.split(",") if each.strip())
    except ValueError as error:
        raise CannotStart(
            f"Trusted proxies are addresses and networks such as 10.0.0.2, 172.16.0.0/12: {error}."
        ) from error


def _is_of_a_network(host: str) -> bool:
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return "." not in host or host.endswith(_OF_A_NETWORK)
    return address.is_private
