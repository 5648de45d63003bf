"""States that live in memory while somebody signs in, of which one of several editors has all
(decision 178).

The owner of the stream `sign-in` has them. Other editors call it, by the way of relayed requests.
Codes and secrets are in these calls, so both they and their answers are encrypted, under a key that
follows from the token.
"""

import hmac
import inspect
import secrets
from collections.abc import Callable
from typing import Any, Concatenate, Final, ParamSpec, TypeVar, get_type_hints

import httpx
import msgspec
from cryptography.hazmat.primitives.ciphers.aead import AESGCM

from action_assistant.editor.cluster.owners import Elsewhere, Owners
from action_assistant.editor.cluster.peers import Call, Peers, refusal
from action_assistant.errors import NotFound, OutcomeUnknown
from action_assistant.web.auth.desk import Desk, Held

_S = TypeVar("_S")
_P = ParamSpec("_P")
_R = TypeVar("_R")

#: The stream whose owner has the states; nothing is stored in it.
SIGN_IN: Final = "sign-in"
#: Calls begin with this path at the listener for other editors.
CALLS: Final = "/sign-in/"
_NONCE: Final = 12  # bytes
_LOST: Final = "The answer of another editor was lost: begin again."


class SharedDesk(Desk):
    """The states of this editor, of which it uses those of the owner. `key`: the one that follows
    from the token, for what editors relay."""

    def __init__(
        self, owners: Callable[[], Owners], peers: Callable[[], Peers], key: bytes
    ) -> None:
        self._owners = owners
        self._peers = peers
        self._cipher = AESGCM(hmac.digest(key, b"sign-in", "sha256"))
        self._held: dict[str, Held[Any]] = {}

    def hold(self, store: _S, *, slow: bool = False) -> Held[_S]:
        """Return how to call a state, wherever it is. There is one of each type."""
        name = type(store).__name__
        held = self._held[name] = _HeldByOne(store, f"{CALLS}{name}/", self, slow=slow)
        return held

    async def is_here(self) -> bool:
        """Return whether this editor has the states. Raise Unavailable as `Owners` does."""
        return not isinstance(await self._owners().owner(SIGN_IN), Elsewhere)

    async def ask(self, path: str, values: dict[str, Any], answer_type: Any) -> Any:
        """Return the answer of the owner to a call, in a tuple; None if no other editor owns the
        states by now. Raise the refusal of the method, Unavailable or OutcomeUnknown."""
        nonce = secrets.token_bytes(_NONCE)
        body = nonce + self._cipher.encrypt(nonce, msgspec.json.encode(values), path.encode())
        call = Call("POST", path, body=body, is_inner=True)
        async with self._peers().answer(SIGN_IN, call) as answer:
            if answer is None:
                return None
            try:
                found = await answer.aread()
            except httpx.HTTPError as error:
                raise OutcomeUnknown(_LOST) from error
            if not answer.is_success:
                raise refusal(found)
        plain = self._cipher.decrypt(found[:_NONCE], found[_NONCE:], nonce)
        return msgspec.json.decode(plain, type=tuple[answer_type])

    async def answer(self, path: str, body: bytes) -> bytes:
        """Answer a call of another editor, whose seal was verified. Raise what the method
        raises."""
        name, _, method = path.removeprefix(CALLS).partition("/")
        held = self._held.get(name)
        function = None if held is None else getattr(type(held.store), method, None)
        if held is None or function is None or method.startswith("_"):
            raise NotFound(f"Nothing is called {path}.")
        nonce = body[:_NONCE]
        given = msgspec.json.decode(self._cipher.decrypt(nonce, body[_NONCE:], path.encode()))
        hints = get_type_hints(function)
        values = {key: msgspec.convert(value, hints[key]) for key, value in given.items()}
        result = msgspec.json.encode((await held.here(function, **values),))
        own = secrets.token_bytes(_NONCE)
        return own + self._cipher.encrypt(own, result, nonce)


class _HeldByOne(Held[_S]):
    def __init__(self, store: _S, path: str, desk: SharedDesk, *, slow: bool) -> None:
        super().__init__(store, slow=slow)
        self._path = path
        self._desk = desk

    async def call(
        self, method: Callable[Concatenate[_S, _P], _R], *args: _P.args, **kwargs: _P.kwargs
    ) -> _R:
        if not await self._desk.is_here():
            bound = inspect.signature(method).bind(self.store, *args, **kwargs)
            values = dict(list(bound.arguments.items())[1:])
            kind = get_type_hints(method)["return"]
            answer = await self._desk.ask(self._path + method.__name__, values, kind)
            if answer is not None:
                found: _R = answer[0]
                return found
        return await self.here(method, *args, **kwargs)
