"""The text that `serve --share` prints: a link and a QR code for each role."""

import io
import ipaddress
import secrets
import ssl
import urllib.request
from http.client import HTTPException
from typing import Any, Final

import msgspec
import segno

from action_assistant.web.auth.keys import Keys, ServerProof
from action_assistant.web.auth.roles import role_words

_ROLES: Final = ("viewer", "editor", "operator")
_PATIENCE_S: Final = 10.0
_PROOF: Final = 10_000  # bytes


class ShareLink(msgspec.Struct, frozen=True):
    """An invitation, with the fields that are printed."""

    role: str
    path: str | None = None
    label: str = ""


class Links(msgspec.Struct, frozen=True):
    """The origins and invitations that the editor reports."""

    origins: list[str]
    invitations: list[ShareLink]


def invitations_as_text(
    base: str, keys: Keys, trust: ssl.SSLContext | None = None, *, secret: bool = False
) -> str:
    """Return the links by which others may join, as text for people, or a sentence that says why
    there are none. An invitation is made for each role without one. `base`: the URL of the running
    editor, which is asked with `keys`; `trust`: its TLS. With `secret`, the text says only how to
    list the links."""
    try:
        links = msgspec.json.decode(_ask(base, keys, trust, "GET"), type=Links)
        if not links.origins:
            return (
                "others cannot reach this computer: it has no address on a network. "
                "Name one in ACTION_ASSISTANT_HOSTS, or share again once it is connected."
            )
        open_ = [link for link in reversed(links.invitations) if link.path and not link.label]
        found = {link.role: link for link in open_}
        for role in _ROLES:
            if role not in found:
                made = _ask(base, keys, trust, "POST", {"role": role})
                found[role] = msgspec.json.decode(made, type=ShareLink)
    except (OSError, ValueError, RecursionError, HTTPException) as error:
        return f"the links for others could not be made: {error}"
    if secret:
        return (
            f"others come in at {links.origins[0]} by the links of `action-assistant people list`."
        )
    return "\n".join(
        [
            "others on this network come in by these links; whoever has one may use it:",
            *(_text(links.origins, found[role]) for role in _ROLES),
            "Revoke a link under Share in the page, or with `action-assistant people revoke`.",
            *_warning(links.origins[0]),
        ]
    )


def is_ours(base: str, keys: Keys, trust: ssl.SSLContext | None = None) -> bool:
    """Return whether the server at the URL `base` proves that it knows the token of `keys`, so that
    the token may be sent there. Wait for at most a second."""
    challenge = secrets.token_urlsafe(32)
    url = f"{base}/api/server?challenge={challenge}"
    try:
        with _opener(trust).open(url, timeout=1) as answer:
            proof = msgspec.json.decode(answer.read(_PROOF), type=ServerProof)
    except (OSError, ValueError, RecursionError, HTTPException):
        return False
    host, _, port = base.partition("://")[2].rpartition(":")
    at = f"{host.strip('[]')}:{port}"
    return keys.proven(challenge, proof, at=at if _is_address(host.strip("[]")) else None)


def is_alive(base: str, trust: ssl.SSLContext | None, seconds: float) -> bool:
    """Return whether the process at the URL `base` answers anything within some seconds."""
    try:
        with _opener(trust).open(f"{base}/healthz", timeout=seconds):
            return True
    except urllib.error.HTTPError as refusal:
        refusal.close()
        return True
    except (OSError, HTTPException):
        return False


def _is_address(host: str) -> bool:
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True


def _warning(origin: str) -> list[str]:
    if origin.startswith("https:"):
        return []
    return ["What is sent is not encrypted: on a network with strangers, use --tls.", ""]


def _text(origins: list[str], link: ShareLink) -> str:
    first, *others = (f"{origin}{link.path}" for origin in origins)
    lines = [f"\n  {link.role}: may {may_of(link.role)}", f"\n    {first}\n", _qr_code(first)]
    if others:
        lines.append("    also: " + ", ".join(origin for origin in origins[1:]))
    return "\n".join(lines)


def may_of(role: str) -> str:
    """Return in words what a role may do; for an unknown role, that only a newer version knows it."""
    match role:
        case "viewer" | "editor" | "operator" | "owner":
            return role_words(role)
        case _:
            return "do what a newer version knows"


def _qr_code(link: str) -> str:
    """Return a QR code of a link as text of half blocks, readable on dark and light terminals."""
    out = io.StringIO()
    segno.make(link, error="l", micro=False).terminal(out, compact=True, border=2)
    return "".join(f"    {line}\n" for line in out.getvalue().splitlines())


def _opener(trust: ssl.SSLContext | None) -> urllib.request.OpenerDirector:
    """Return an opener for the URLs of this program's own processes; `trust` is the TLS context. It
    uses no proxy, since a proxy would see the token."""
    return urllib.request.build_opener(
        urllib.request.ProxyHandler({}), urllib.request.HTTPSHandler(context=trust)
    )


def _ask(
    base: str, keys: Keys, trust: ssl.SSLContext | None, method: str, body: object = None
) -> bytes:
    data = msgspec.json.encode(body) if body is not None else None
    headers = {"authorization": f"Bearer {keys.token}", "content-type": "application/json"}
    request = urllib.request.Request(
        f"{base}/api/invitations", data=data, headers=headers, method=method
    )
    with _opener(trust).open(request, timeout=_PATIENCE_S) as answer:
        found: Any = answer.read()
        return bytes(found)
