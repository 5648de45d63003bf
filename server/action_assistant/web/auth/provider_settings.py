"""The settings of the OpenID Connect provider by which people may sign in."""

from collections.abc import Iterable, Mapping
from typing import Final, get_args
from urllib.parse import urlsplit

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.settings import LOOPBACK
from action_assistant.web.auth.roles import Role, rank

_NAME: Final = 60  # characters
_OIDC: Final = "ACTION_ASSISTANT_OIDC_"
#: Stands for everybody whom the provider knows.
EVERYBODY: Final = "*"


class ProviderSettings(msgspec.Struct, frozen=True, kw_only=True):
    """A provider and this program's account there. `secret`: "" for a public client. `groups`: the
    role of each group of the provider, `*` for everybody. `claim`: the claim with the groups of a
    person. `name`: stands on the button."""

    issuer: str
    client_id: str
    secret: str
    groups: Mapping[str, Role]
    claim: str
    name: str

    def role(self, groups: Iterable[str]) -> Role | None:
        """Return the highest role that the groups of a person give; None if they give none."""
        given = [self.groups[each] for each in (*groups, EVERYBODY) if each in self.groups]
        return max(given, key=rank, default=None)


def provider_of(given: Mapping[str, str]) -> ProviderSettings | None:
    """Return the provider from the values of ACTION_ASSISTANT_OIDC_…, by the ends of these names; None
    if nothing is set. Raise CannotStart if a value is missing or malformed."""
    if not given:
        return None
    for name in ("ISSUER", "CLIENT_ID", "GROUPS"):
        if not given.get(name):
            raise CannotStart(f"{_OIDC}{name} is missing: sign-in by a provider needs it.")
    issuer = issuer_of(given["ISSUER"])
    return ProviderSettings(
        issuer=issuer,
        client_id=given["CLIENT_ID"],
        secret=given.get("CLIENT_SECRET", ""),
        groups=groups_of(given["GROUPS"]),
        claim=given.get("GROUPS_CLAIM", "groups"),
        name=name_of(given.get("NAME") or urlsplit(issuer).netloc),
    )


def issuer_of(text: str) -> str:
    """Return the address of a provider as it is written. Raise CannotStart unless it is https, or http
    on this computer."""
    if not is_safe(text):
        raise CannotStart(
            f"{_OIDC}ISSUER is an address such as https://login.example.org/realms/lab, not {text!r}."
        )
    return text


def is_safe(url: str, *, query: bool = False) -> bool:
    """Return whether a URL of a provider is encrypted, or leads to this computer. `query`: it may have
    a query."""
    try:
        parts = urlsplit(url)
        host, _ = parts.hostname or "", parts.port
    except ValueError:
        return False
    encrypted = parts.scheme == "https" or (parts.scheme == "http" and host in LOOPBACK)
    plain = parts.username is None and not parts.fragment and (query or not parts.query)
    return bool(host) and encrypted and plain and url.isascii() and url.isprintable()


def groups_of(text: str) -> dict[str, Role]:
    """Return the roles of the groups of a provider from a text such as `admins=owner,*=viewer`. Names
    with commas, as in LDAP, are separated by semicolons. Raise CannotStart if it is malformed."""
    found: dict[str, Role] = {}
    for each in filter(str.strip, text.split(";" if ";" in text else ",")):
        group, _, word = (part.strip() for part in each.rpartition("="))
        roles = [role for role in get_args(Role) if role == word.lower()]
        if not (group and roles) or group in found:
            raise CannotStart(
                f"{_OIDC}GROUPS is a list of GROUP=ROLE, each group once, with the roles "
                f"{', '.join(get_args(Role))}; {each.strip()!r} is none."
            )
        found[group] = roles[0]
    return found


def name_of(text: str) -> str:
    """Return the name under which people see a provider: the text of the setting with single
    spaces. Raise CannotStart if it has more than 60 characters."""
    name = " ".join(text.split())
    if len(name) > _NAME:
        raise CannotStart(f"{_OIDC}NAME has up to {_NAME} characters.")
    return name
