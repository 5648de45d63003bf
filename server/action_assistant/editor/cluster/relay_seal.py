"""The seal of what one editor relays to another (decision 175).

A relayed request has three header fields:

- `X-Relayed`: who asks and from where, as the editor at which the request came in has verified it.
  A JSON object (`RelayedFacts`) in base64url.
- `X-Relayed-Body`: the SHA-256 of the body, as 64 hexadecimal digits.
- `Authorization: Relay TIME/NONCE/MAC`. TIME: when it was sealed, in seconds since 1970 with three
  decimals. NONCE: 16 random bytes, as 32 hexadecimal digits. MAC: an HMAC-SHA256, as 64 hexadecimal
  digits, under a key that follows from the server's token, over these texts with a zero byte
  between: method, URL at the editor that is asked, X-Relayed-Body, X-Relayed, TIME, NONCE.

A seal counts once, and for 30 seconds before and after its TIME.
"""

import base64
import hashlib
import hmac
import secrets
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Final

import msgspec

from action_assistant.errors import Unauthenticated
from action_assistant.web.auth.identity import Identity

SCHEME: Final = "Relay"
FACTS: Final = "x-relayed"
DIGEST: Final = "x-relayed-body"
#: Seconds by which the clocks of two editors may differ, with the time under way.
_SKEW_S: Final = 30.0
_REFUSED: Final = "This is no request of another editor of this server."


class RelayedFacts(msgspec.Struct, frozen=True, omit_defaults=True):
    """The facts of a request that the editor at which it came in has verified. `identity`: who
    asks; None for work of the server itself. `client`: the address of the client, as limits count
    it. `request`: the request id. `is_inner`: the editor itself asks a room, and passes on no
    request of a client."""

    identity: Identity | None = None
    client: str = ""
    request: str = ""
    is_inner: bool = False


class RelaySeal:
    """Seals relayed requests, and verifies those of other editors. `key`: the same in all
    editors."""

    def __init__(self, key: bytes, clock: Callable[[], float] = time.time) -> None:
        self._key = key
        self._clock = clock
        self._seen: set[str] = set()
        self._in_order: deque[tuple[float, str]] = deque()

    def headers(
        self, method: str, url: str, body: bytes, facts: RelayedFacts
    ) -> list[tuple[str, str]]:
        """Return the header fields with which a request may be relayed once. `url`: where it goes,
        with path and query."""
        said = base64.urlsafe_b64encode(msgspec.json.encode(facts)).decode()
        digest = hashlib.sha256(body).hexdigest()
        at, nonce = f"{self._clock():.3f}", secrets.token_hex(16)
        mac = self._mac(method, url, digest, said, at, nonce)
        return [
            ("authorization", f"{SCHEME} {at}/{nonce}/{mac}"),
            (FACTS, said),
            (DIGEST, digest),
        ]

    def verified(self, method: str, url: str, headers: Mapping[str, str]) -> RelayedFacts:
        """Return the facts of a relayed request, whose nonce is used up by that. The caller has to
        compare the body with the digest. Raise Unauthenticated unless another editor has sealed it
        just now."""
        scheme, _, proof = headers.get("authorization", "").partition(" ")
        at, _, rest = proof.partition("/")
        nonce, _, mac = rest.partition("/")
        said, digest = headers.get(FACTS, ""), headers.get(DIGEST, "")
        expected = self._mac(method, url, digest, said, at, nonce)
        is_ours = hmac.compare_digest(expected.encode(), mac.encode(errors="replace"))
        if scheme != SCHEME or not is_ours:
            raise Unauthenticated(_REFUSED)
        # Sealed by an editor, so the time is a number and the nonce is short.
        now = self._clock()
        self._forget_until(now - 2 * _SKEW_S)
        if abs(now - float(at)) > _SKEW_S:
            raise Unauthenticated(f"{_REFUSED} It is of another time: the clocks differ.")
        if nonce in self._seen:
            raise Unauthenticated(f"{_REFUSED} It has been here before.")
        self._seen.add(nonce)
        self._in_order.append((now, nonce))
        return msgspec.json.decode(base64.urlsafe_b64decode(said), type=RelayedFacts)

    def _forget_until(self, moment: float) -> None:
        while self._in_order and self._in_order[0][0] < moment:
            self._seen.discard(self._in_order.popleft()[1])

    def _mac(self, *parts: str) -> str:
        text = "\0".join(parts).encode(errors="replace")
        return hmac.digest(self._key, text, "sha256").hex()
