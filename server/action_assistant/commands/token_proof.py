"""A token goes to nobody who has not shown to know it already."""

import hmac
import secrets
from collections.abc import Generator
from typing import Final

import httpx
import msgspec

from action_assistant.commands.stored_tokens import StoredToken
from action_assistant.errors import CannotStart
from action_assistant.web.auth.keys import Keys, ServerProof
from action_assistant.web.auth.token_text import digest_of, proof, token_id

_API: Final = "/api/"


class AfterProof(httpx.Auth):
    """Adds a token to requests, once the server at an address has answered a challenge.

    `keys` are those of a data folder or of the environment, `stored` is what `login` has kept for
    the server; the first one that the server knows is sent. A stranger who listens at an address
    that we only suppose to be our server (`supposed`) might pass the challenge on to the real one.
    So the answer has to name the very address that we are connected to.
    """

    requires_response_body = True

    def __init__(
        self, keys: Keys | None, stored: StoredToken | None = None, *, supposed: bool
    ) -> None:
        self._keys = keys
        self._stored = stored
        self._supposed = supposed
        self._proven: dict[str, str] = {}
        #: Addresses that our server or its owner has named, such as those behind a proxy.
        self.named: set[str] = set()

    def auth_flow(self, request: httpx.Request) -> Generator[httpx.Request, httpx.Response, None]:
        """Yield a request with a token added, as httpx demands. Before the first request to a
        server, yield a challenge, by which the server proves that it knows the token. Raise
        CannotStart if it proves this for none of the tokens."""
        base = str(request.url).partition(_API)[0]
        if base not in self._proven:
            challenge = secrets.token_urlsafe(32)
            url = f"{base}{_API}server?challenge={challenge}{self._named()}"
            answer = yield httpx.Request("GET", url, extensions=request.extensions)
            known = self._known_to(
                challenge, answer, supposed=self._supposed and base not in self.named
            )
            if known is None:
                raise CannotStart(_why(base, self._stored, supposed=self._supposed))
            self._proven[base] = known
        request.headers["authorization"] = f"Bearer {self._proven[base]}"
        yield request

    def _named(self) -> str:
        """Return the part of the query that asks for a proof of the stored token."""
        return "" if self._stored is None else f"&token={token_id(self._stored.token)}"

    def _known_to(self, challenge: str, answer: httpx.Response, *, supposed: bool) -> str | None:
        """Return the token that the server has proven to know; None if there is none."""
        try:
            given = msgspec.json.decode(answer.content, type=ServerProof)
        except (ValueError, RecursionError):
            return None
        at = _peer(answer) if supposed else None
        if self._keys is not None and self._keys.proven(challenge, given, at=at):
            return self._keys.token
        stored = self._stored
        if stored is None or (at is not None and given.address != at):
            return None
        expected = proof(digest_of(stored.token), challenge, given.address)
        known = hmac.compare_digest(expected.encode(), given.token_proof.encode(errors="replace"))
        return stored.token if known else None


def _peer(answer: httpx.Response) -> str:
    """Return the address and port to which an answer's connection leads; "" if unknown."""
    try:
        host, port, *_ = answer.extensions["network_stream"].get_extra_info("server_addr")
    except (OSError, KeyError, TypeError, ValueError):
        return ""
    return f"{host}:{port}"


def _why(base: str, stored: StoredToken | None, *, supposed: bool) -> str:
    if stored is not None:
        return (
            f"What answers at {base} does not know the token {stored.name!r} that is stored for it, so "
            "nothing was sent to it. The token was revoked, or it is another program: sign in again "
            f"with `action-assistant login {stored.url}`."
        )
    said = (
        f"What answers at {base} does not know the token of this data folder, so nothing was sent to "
        "it: it is another program, another server of ours, or one of before this check."
    )
    if supposed:
        said += " Name the folder with --data, or with --url the place where your server is."
    else:
        said += f" To sign in there: `action-assistant login {base}`."
    return said
