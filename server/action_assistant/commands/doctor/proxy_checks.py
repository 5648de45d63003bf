"""The public address: whether the proxy leads to both processes, with Host, paths and WebSockets."""

from collections.abc import Iterator
from typing import Final

import httpx

from action_assistant.commands.doctor.answers import client, health
from action_assistant.commands.doctor.certificate_checks import certificate_fits
from action_assistant.commands.doctor.installation import Installation
from action_assistant.errors import CannotStart
from action_assistant.settings import reached
from action_assistant.system.diagnostics import Diagnostic, fine, found
from action_assistant.web.auth.access import REFUSED_SOCKET
from action_assistant.web.network.certificate import Certificate

_FILES: Final = "docs/proxy has the files for nginx and Caddy."
_REPLACED: Final = "wrong-host"
_UPGRADE: Final = {
    "connection": "Upgrade",
    "upgrade": "websocket",
    "sec-websocket-version": "13",
    "sec-websocket-key": "dGhlIHNhbXBsZSBub25jZQ==",
}


def proxy_leads_here(place: Installation) -> Iterator[Diagnostic]:
    """What the public address shows. Nothing secret is sent."""
    try:
        public = reached(place.public_url, None).public
    except CannotStart as error:
        if place.public_url is not None:  # that of the environment is told with the settings
            yield found("setting-wrong", "--public-url", str(error), "Correct it.")
        return
    if public is None:
        return
    trust = Certificate(place.data).trusting_too()
    if public.is_secure:
        problems = [*certificate_fits(public.page, public.origin, trust)]
        yield from problems
        if problems:
            return
    # As a browser comes: by the page's origin.
    headers = {**_UPGRADE, "origin": public.origin}
    with client(verify=trust) as asking:
        yield _shown(asking, "page", public.page, headers)
        yield _shown(asking, "runner", public.runner, headers)


def _shown(asking: httpx.Client, name: str, url: str, headers: dict[str, str]) -> Diagnostic:
    try:
        answer = health(asking, url)
        live = asking.get(f"{url}/api/live", headers=headers) if answer.version else None
    except httpx.HTTPError as error:
        return found(
            "proxy-unreachable",
            url,
            f"The public address does not answer: {error}.",
            f"Start the proxy, or correct the address or its name's entry. {_FILES}",
        )
    if live is None or _REPLACED in live.text:
        return _led_astray(name, url, answer.text if live is None else live.text, answer.status)
    if REFUSED_SOCKET[0].decode() not in live.headers:
        return found(
            "proxy-sockets",
            url,
            f"The proxy passes no WebSockets on to the {name}: nobody sees what others do, and Stop "
            "takes its slower way.",
            f"nginx: pass on the headers Upgrade and Connection, with HTTP/1.1. {_FILES}",
        )
    return fine(url, f"The public address leads to the {name}, and passes WebSockets on.")


def _led_astray(name: str, url: str, said: str, status: int) -> Diagnostic:
    if _REPLACED in said:
        return found(
            "proxy-host",
            url,
            f"The {name} is asked by a name that it does not have: the proxy replaces the Host header.",
            "nginx: `proxy_set_header Host $http_host`; Apache: `ProxyPreserveHost On`; and the server "
            f"needs the same --public-url. {_FILES}",
        )
    if name == "runner" and ("misrouted" in said or status == 401):
        return found(
            "proxy-path",
            url,
            "The proxy leads what is below runner/ to the editor: Stop would not reach the runner.",
            f"Lead it to the runner's port, before the rest goes to the editor's. {_FILES}",
        )
    return found(
        "proxy-target",
        url,
        f"What answers there is not the {name} (status {status}).",
        f"Start the {name}, and lead the address to its port, with the path as it is. {_FILES}",
    )
