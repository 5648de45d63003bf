"""The one function that decides what an identity may do, and that says why not."""

from collections.abc import Mapping
from typing import Final, Protocol, TypeAlias

import msgspec

from action_assistant.web.auth.identity import Identity, Scope
from action_assistant.web.auth.roles import Permission, allowed, role_words

#: The scopes of a token that include a permission. Tokens never register, share or restore.
SCOPES_FOR: Final[Mapping[Permission, frozenset[Scope]]] = {
    "see": frozenset({"read", "edit", "simulate", "operate"}),
    "stop": frozenset({"read", "edit", "simulate", "operate"}),
    "edit": frozenset({"edit"}),
    "simulate": frozenset({"simulate", "operate"}),
    "operate": frozenset({"operate"}),
    "register": frozenset(),
    "share": frozenset(),
    "restore": frozenset(),
    "scrape": frozenset({"scrape", "read"}),
}


_OF_OWNERS: Final = frozenset({"share", "restore"})


class Allowed(msgspec.Struct, frozen=True):
    """The identity may do it."""


class Denied(msgspec.Struct, frozen=True):
    """The identity may not do it. `reason`: a sentence for the person."""

    reason: str


Decision: TypeAlias = Allowed | Denied


class Thing(Protocol):
    """A thing with rights of its own, such as a robot: a frozen value of one process."""

    def refusal(self, identity: Identity, permission: Permission, now: float) -> str | None:
        """Return the sentence that says why the identity may not do this here; None if it may.
        `now`: seconds since 1970. Never asked about Stop."""


def may(
    identity: Identity, permission: Permission, thing: Thing | None = None, *, now: float
) -> Decision:
    """Return whether an identity has a permission, for a thing if one is given. `now`: seconds
    since 1970.

    Stop depends on no thing: everybody who is signed in may stop everything, and so may each token
    that sees runs.
    """
    role = identity.person.role
    if not allowed(role, permission):
        return Denied(f"You are here as {role}: you may {role_words(role)}.")
    token = identity.token
    if token is not None and not token.scopes & SCOPES_FOR[permission]:
        return Denied(_out_of_scope(token.name, permission, sorted(token.scopes)))
    if thing is None or permission == "stop":
        return Allowed()
    reason = thing.refusal(identity, permission, now)
    return Allowed() if reason is None else Denied(reason)


def unconfirmed(identity: Identity, permission: Permission) -> str:
    """Return why an owner has to confirm first that it is they; "" if they need not. Only for what
    owners alone may change, and only where this owner wants to be asked."""
    if permission not in _OF_OWNERS or not identity.ask_again or identity.session is None:
        return ""
    at, last = identity.asked_at or 0.0, identity.confirmed_at
    if last is not None and last >= at - identity.ask_again * 60:
        return ""
    return f"You want to be asked again after {identity.ask_again} min: confirm that it is you."


def _out_of_scope(name: str, permission: Permission, scopes: list[Scope]) -> str:
    has = ", ".join(scopes) or "none"
    needed = " or ".join(sorted(SCOPES_FOR[permission]))
    if not needed:
        return f"The token {name!r} may not do this: it takes a person who is signed in."
    return f"The token {name!r} has the scopes {has}; this needs {needed}."
