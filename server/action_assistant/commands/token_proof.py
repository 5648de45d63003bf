"""The token goes to nobody who has not shown to know it already."""

import secrets
from collections.abc import Generator
from typing import Final

import httpx
import msgspec

from action_assistant.errors import CannotStart
from action_assistant.web.auth.keys import Keys, ServerProof

_API: Final = "/api/"


class AfterProof(httpx.Auth):
    """Adds the token to requests, once the server at an address has answered a challenge. A
    stranger who listens at an address that we only suppose to be our server (`supposed`) might pass
    the challenge on to the real one. So the answer has to name the very address that the client is
    connected to."""

    requires_response_body = True

    def __init__(self, keys: Keys, *, supposed: bool) -> None:
        self._keys = keys
        self._supposed = supposed
        self._proven: set[str] = set()

    def auth_flow(self, request: httpx.Request) -> Generator[httpx.Request, httpx.Response, None]:
        """Add the token to a request, after a challenge if the server was not proven yet. It is a
        generator of requests, as httpx wants it. Raise CannotStart if the server does not prove
        that it holds the token."""
        base = str(request.url).partition(_API)[0]
        if base not in self._proven:
            challenge = secrets.token_urlsafe(32)
            url = f"{base}{_API}server?challenge={challenge}"
            answer = yield httpx.Request("GET", url, extensions=request.extensions)
            if not self._holds(challenge, answer):
                raise CannotStart(_why(base, supposed=self._supposed))
            self._proven.add(base)
        request.headers["authorization"] = f"Bearer {self._keys.token}"
        yield request

    def _holds(self, challenge: str, answer: httpx.Response) -> bool:
        try:
            proof = msgspec.json.decode(answer.content, type=ServerProof)
        except msgspec.DecodeError:
            return False
        at = _peer(answer) if self._supposed else None
        return self._keys.proven(challenge, proof, at=at)


def _peer(answer: httpx.Response) -> str:
    """Return the address and port to which an answer's connection leads; "" if unknown."""
    try:
        host, port, *_ = answer.extensions["network_stream"].get_extra_info("server_addr")
    except (OSError, KeyError, TypeError, ValueError):
        return ""
    return f"{host}:{port}"


def _why(base: str, *, supposed: bool) -> str:
    said = (
        f"What answers at {base} does not know the token of this data folder, so nothing was sent to "
        "it: it is another program, another server of ours, or one of before this check."
    )
    if supposed:
        said += " Name the folder with --data, or with --url the place where your server is."
    return said
