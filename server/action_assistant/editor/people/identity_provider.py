"""Asks an OpenID Connect provider who somebody is, and accepts only what it has signed for this server.

Authlib writes the questions and checks the claims, joserfc the signatures. Both, and the HTTP client,
are imported at the first sign-in, on a thread. Every answer is small, arrives within a time-out, and
comes from the address that was asked: redirects are not followed.
"""

import ssl
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final, Generic, NamedTuple, TypeVar

import anyio
import msgspec
from anyio import to_thread

from action_assistant.errors import Unauthenticated, Unavailable
from action_assistant.safe_text import one_line
from action_assistant.web.auth.provider_settings import ProviderSettings, is_safe

if TYPE_CHECKING:  # slow to load, and only a sign-in needs it
    from joserfc.jwk import KeySet

_T = TypeVar("_T")
_PATIENCE_S: Final = 5.0  # for one answer
_EXCHANGE_S: Final = 12.0  # for all answers of one sign-in
_MOST: Final = 512_000  # bytes of an answer
_ID: Final = 255  # characters of a subject
_NAME: Final = 200  # characters that are read of a name
_MOST_KEYS: Final = 50
_MOST_GROUPS: Final = 2_000
_KEPT_S: Final = 600.0  # for which what the provider says of itself is not asked again
_REST_S: Final = 3.0  # after a failure, and between two questions for new keys
_LEEWAY_S: Final = 120  # by which the clocks may differ
#: Signatures that only the provider can make. `none` and HS256, which whoever knows the client's
#: secret or a public key can make, are none of them.
_ALGORITHMS: Final = (
    *("RS256", "RS384", "RS512", "PS256", "PS384", "PS512"),
    *("ES256", "ES384", "ES512", "Ed25519", "EdDSA"),
)
_KEY_TYPES: Final = frozenset({"RSA", "EC", "OKP"})
_UNSIGNED: Final = "no key of its own has signed it"
_SCOPES: Final = ("openid", "profile", "groups")


class Metadata(msgspec.Struct, frozen=True):
    """The description that a provider gives of itself, as far as it is used here."""

    issuer: str
    authorization_endpoint: str
    token_endpoint: str
    jwks_uri: str
    userinfo_endpoint: str | None = None
    scopes_supported: tuple[str, ...] = ()
    token_endpoint_auth_methods_supported: tuple[str, ...] = ("client_secret_basic",)
    authorization_response_iss_parameter_supported: bool = False


class Question(msgspec.Struct, frozen=True):
    """The secrets of one sign-in, which tie its answer to it. `state`: comes back with the answer;
    `nonce`: stands in the signed answer; `verifier`: fetches the answer (PKCE); `redirect`: the
    address to which the provider sends the browser back. `begun`: seconds since 1970."""

    state: str
    nonce: str
    verifier: str
    redirect: str
    begun: float


class ProviderIdentity(msgspec.Struct, frozen=True):
    """The person of whom a provider has spoken. `name`, of one short line, and `groups` are written by anybody.
    `asked_s`: for how many seconds the person had been signed in at the provider when it answered;
    None if it does not say."""

    issuer: str
    subject: str
    name: str
    groups: tuple[str, ...]
    asked_s: int | None


class _Kept(NamedTuple, Generic[_T]):
    """A value, and until when it is kept (monotonic seconds)."""

    value: _T
    until: float


class IdentityProvider:
    """One OpenID Connect provider. `clock`: monotonic seconds."""

    def __init__(
        self, settings: ProviderSettings, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.settings: Final = settings
        self._clock = clock
        self._turn = anyio.Lock()  # of whoever asks for the description or the keys
        self._tls: ssl.SSLContext | None = None
        self._metadata: _Kept[Metadata] | None = None
        self._keys: _Kept[KeySet] | None = None
        self._asked_for_keys = -_REST_S
        self._failed: tuple[str, float] | None = None

    async def metadata(self) -> Metadata:
        """Return the description that the provider gives of itself (OpenID Connect discovery), from
        a cache while it is fresh. Raise Unavailable, with the reason, if it cannot be fetched or
        used."""
        kept = self._metadata
        if kept is not None and self._clock() < kept.until:
            return kept.value
        async with self._turn:
            if self._metadata is not kept and self._metadata is not None:
                return self._metadata.value
            if self._failed is not None and self._clock() < self._failed[1]:
                raise Unavailable(self._failed[0])  # whoever waited is not kept waiting again
            try:
                found = await self._described()
            except Unavailable as error:
                self._failed = error.detail, self._clock() + _REST_S
                raise
            self._metadata = _Kept(found, self._clock() + _KEPT_S)
            return found

    async def address(self, question: Question, *, again: bool) -> str:
        """Return the address at which the provider asks the person. `again`: it has to ask also
        somebody who is signed in there. Raise Unavailable."""
        metadata = await self.metadata()
        offered = metadata.scopes_supported
        scopes = [each for each in _SCOPES if each != "groups" or each in offered]
        more = {"prompt": "login", "max_age": "0"} if again else {}

        def written() -> str:
            """Return the address at the provider where a person signs in."""
            from authlib.oauth2.client import OAuth2Client

            client = OAuth2Client(
                None,
                client_id=self.settings.client_id,
                redirect_uri=question.redirect,
                scope=" ".join(scopes),
                code_challenge_method="S256",
            )
            url, _ = client.create_authorization_url(
                metadata.authorization_endpoint,
                state=question.state,
                nonce=question.nonce,
                code_verifier=question.verifier,
                **more,
            )
            return str(url)

        return await to_thread.run_sync(written)

    async def check_sender(self, issuer: str | None) -> None:
        """Raise Unauthenticated if another provider has sent the browser back (RFC 9207). `issuer`: of
        whom the answer claims to be; None if it does not say. Raise Unavailable."""
        metadata = await self.metadata()
        wanted = metadata.authorization_response_iss_parameter_supported
        if issuer != metadata.issuer and (wanted or issuer is not None):
            raise self._wrong("another provider has sent it")

    async def identity(self, code: str, question: Question) -> ProviderIdentity:
        """Trade the code of an answer for the person. Raise Unauthenticated if the answer does not
        belong to the question or is not signed by the provider, Unavailable if it does not answer."""
        with anyio.move_on_after(_EXCHANGE_S):
            return await self._exchanged(code, question)
        raise self._silent(_EXCHANGE_S)

    async def _exchanged(self, code: str, question: Question) -> ProviderIdentity:
        metadata = await self.metadata()
        token = await self._token(metadata, code, question)
        id_token, access = token.get("id_token"), token.get("access_token")
        if not isinstance(id_token, str):
            raise self._wrong("it does not say who it is")
        access = access if isinstance(access, str) else None
        try:
            claims = await self._claims(metadata, id_token, access, question.nonce)
        except _UnknownKey:
            # A provider changes its keys now and then: they are asked for once more.
            if not await self._new_keys(metadata):
                raise self._wrong(_UNSIGNED) from None
            try:
                claims = await self._claims(metadata, id_token, access, question.nonce)
            except _UnknownKey:
                raise self._wrong(_UNSIGNED) from None
        if self.settings.claim not in claims and access and metadata.userinfo_endpoint:
            more = await self._told_of(metadata.userinfo_endpoint, access)
            if more.get("sub") != claims["sub"]:  # OpenID Connect Core, 5.3.2
                raise self._wrong("it speaks of two persons")
            claims = more | claims
        return self._person(claims)

    async def _described(self) -> Metadata:
        issuer = self.settings.issuer
        found = await self._json("GET", issuer.rstrip("/") + "/.well-known/openid-configuration")
        try:
            metadata = msgspec.convert(found, Metadata)
        except msgspec.ValidationError as error:
            raise self._unusable(f"its description is incomplete ({error})") from error
        if metadata.issuer != issuer:
            raise self._unusable(
                f"it calls itself {one_line(metadata.issuer[:200])}, and "
                f"ACTION_ASSISTANT_OIDC_ISSUER says {issuer}"
            )
        named = metadata.authorization_endpoint, metadata.token_endpoint, metadata.jwks_uri
        for each in (*named, metadata.userinfo_endpoint):
            if each is not None and not is_safe(each, query=True):
                raise self._unusable(f"it names {one_line(each[:200])}, which is not encrypted")
        return metadata

    async def _token(self, metadata: Metadata, code: str, question: Question) -> dict[str, Any]:
        """Return the answer of the token endpoint. Raise Unauthenticated if it refuses the code."""
        settings = self.settings
        methods = metadata.token_endpoint_auth_methods_supported
        method = "client_secret_post" if "client_secret_post" in methods else "client_secret_basic"

        def prepared() -> tuple[str, dict[str, str], str]:
            """Return address, headers and body of the request for the tokens."""
            from authlib.oauth2.auth import ClientAuth
            from authlib.oauth2.rfc6749.parameters import prepare_token_request

            body = prepare_token_request(
                "authorization_code",
                redirect_uri=question.redirect,
                code=code,
                code_verifier=question.verifier,
            )
            auth = ClientAuth(
                settings.client_id, settings.secret, method if settings.secret else "none"
            )
            headers = {"content-type": "application/x-www-form-urlencoded"}
            prepared: tuple[str, dict[str, str], str] = auth.prepare(
                "POST", metadata.token_endpoint, headers, body
            )
            return prepared

        url, headers, body = await to_thread.run_sync(prepared)
        return await self._json("POST", url, headers=headers, content=body.encode())

    async def _claims(
        self, metadata: Metadata, id_token: str, access: str | None, nonce: str
    ) -> dict[str, Any]:
        """Return the claims of a valid ID token. Raise _UnknownKey if no key fits, Unauthenticated if
        the token is not valid."""
        keys = await self._key_set(metadata)
        client = self.settings.client_id

        def checked() -> dict[str, Any]:
            """Return the claims of the ID token. Raises `_UnknownKey` where the keys at hand do not fit its
            signature."""
            from authlib.oidc.core import CodeIDToken
            from joserfc import jwt
            from joserfc.errors import BadSignatureError, InvalidKeyIdError, JoseError
            from joserfc.jws import JWSRegistry

            registry = JWSRegistry(algorithms=_ALGORITHMS, strict_check_header=False)
            options = {
                "iss": {"essential": True, "value": metadata.issuer},
                "aud": {"essential": True, "value": client},
                "sub": {"essential": True},
                "nonce": {"essential": True, "value": nonce},
            }
            params = {"nonce": nonce, "client_id": client, "access_token": access}
            try:
                token = jwt.decode(id_token, keys, registry=registry)
                claims = CodeIDToken(token.claims, token.header, options, params)
                claims.validate(leeway=_LEEWAY_S)
            except (InvalidKeyIdError, BadSignatureError) as error:
                raise _UnknownKey from error
            except (JoseError, ValueError, TypeError, KeyError, RecursionError) as error:
                raise self._wrong(_reason(error)) from error
            return dict(claims)

        return await to_thread.run_sync(checked)

    async def _key_set(self, metadata: Metadata) -> Any:
        kept = self._keys
        if kept is None or self._clock() >= kept.until:
            async with self._turn:
                if self._keys is kept:
                    await self._fetch_keys(metadata)
            kept = self._keys
        assert kept is not None
        return kept.value

    async def _new_keys(self, metadata: Metadata) -> bool:
        """Ask for the keys once more, and return whether it was done: not too often."""
        kept = self._keys
        async with self._turn:
            if self._keys is not kept:
                return True  # somebody else has asked meanwhile
            if self._clock() - self._asked_for_keys < _REST_S:
                return False
            self._asked_for_keys = self._clock()
            await self._fetch_keys(metadata)
        return True

    async def _fetch_keys(self, metadata: Metadata) -> None:
        """Fetch the keys with which the provider signs, and keep those that can be used."""
        given = (await self._json("GET", metadata.jwks_uri)).get("keys")
        keys = [each for each in given if isinstance(each, dict)] if isinstance(given, list) else []

        def read() -> Any:
            """Return the keys that can check a signature; those of unknown kinds are skipped."""
            from joserfc.errors import JoseError
            from joserfc.jwk import JWKRegistry, KeySet

            found = []
            for each in keys[:_MOST_KEYS]:
                if each.get("kty") not in _KEY_TYPES or each.get("use", "sig") != "sig":
                    continue
                try:
                    found.append(JWKRegistry.import_key(each))
                except (
                    JoseError,
                    ValueError,
                    TypeError,
                    KeyError,
                ):  # of no kind that is known here
                    continue
            return KeySet(found)

        self._keys = _Kept(await to_thread.run_sync(read), self._clock() + _KEPT_S)

    async def _told_of(self, url: str, access: str) -> dict[str, Any]:
        """Return what the provider tells of the person whom the access token stands for."""
        return await self._json("GET", url, headers={"authorization": f"Bearer {access}"})

    def _person(self, claims: Mapping[str, Any]) -> ProviderIdentity:
        at, subject = claims.get("auth_time"), claims["sub"]
        is_id = isinstance(subject, str) and len(subject) <= _ID and subject.isprintable()
        if not is_id:  # OpenID Connect Core, 2
            raise self._wrong("it names nobody")
        named = (claims.get(each) for each in ("name", "preferred_username", "email"))
        return ProviderIdentity(
            self.settings.issuer,
            subject,
            next((_shown(each) for each in named if isinstance(each, str) and each.strip()), ""),
            _texts(claims.get(self.settings.claim)),
            int(claims["iat"]) - at if isinstance(at, int) and not isinstance(at, bool) else None,
        )

    async def _json(self, method: str, url: str, **more: Any) -> dict[str, Any]:
        """Return the JSON object with which the provider answers. Raise Unauthenticated if it refuses
        (status 4xx), Unavailable if it does not answer in time, or with something else."""
        with anyio.move_on_after(_PATIENCE_S):
            status, content = await self._answer(method, url, **more)
            try:
                found = msgspec.json.decode(content)
            except (ValueError, RecursionError):  # no JSON, no text, or too deep
                found = None
            if 400 <= status < 500 and method == "POST" and isinstance(found, dict):
                raise Unauthenticated(
                    f"Nobody was signed in: {self.settings.name} says "
                    f"{one_line(str(found.get('error'))[:100])}."
                )
            if status != 200 or not isinstance(found, dict):
                raise self._unusable(f"{url} answers with status {status} and no JSON object")
            return found
        raise self._silent(_PATIENCE_S)

    async def _answer(self, method: str, url: str, **more: Any) -> tuple[int, bytes]:
        import httpx

        if self._tls is None:
            self._tls = await to_thread.run_sync(httpx.create_ssl_context)
        headers = {
            "accept": "application/json",
            "accept-encoding": "identity",  # what is small stays small
            **more.pop("headers", {}),
        }
        content = b""
        try:
            async with (
                httpx.AsyncClient(verify=self._tls, timeout=_PATIENCE_S) as client,
                client.stream(method, url, headers=headers, **more) as answer,
            ):
                async for piece in answer.aiter_raw():
                    content += piece
                    if len(content) > _MOST:
                        raise self._unusable(f"{url} answers with more than {_MOST} bytes")
                return answer.status_code, content
        except httpx.TimeoutException as error:
            raise self._silent(_PATIENCE_S) from error
        except httpx.HTTPError as error:
            why = one_line(str(error)[:200]) or type(error).__name__
            raise Unavailable(f"{self.settings.name} cannot be reached: {why}.") from error

    def _silent(self, seconds: float) -> Unavailable:
        return Unavailable(f"{self.settings.name} has not answered within {seconds:g} s.")

    def _unusable(self, why: str) -> Unavailable:
        return Unavailable(f"{self.settings.name} cannot be used: {why}.")

    def _wrong(self, why: str) -> Unauthenticated:
        return Unauthenticated(
            f"Nobody was signed in: the answer of {self.settings.name} is not valid ({why})."
        )


class _UnknownKey(Exception):
    """No key of the provider fits to a signature."""


def _texts(claim: object) -> tuple[str, ...]:
    """Return the texts of a claim that is a list, or one text."""
    given: Sequence[object] = [claim] if isinstance(claim, str) else ()
    if isinstance(claim, list):
        given = claim[:_MOST_GROUPS]
    return tuple(each for each in given if isinstance(each, str))


def _shown(name: str) -> str:
    """Return the begin of a name, with blanks for what cannot be printed or written."""
    return "".join(each if each.isprintable() else " " for each in name[:_NAME])


def _reason(error: Exception) -> str:
    """Return the reason why a token is not valid, in words of Authlib that hold nothing of the token."""
    return one_line(str(error)[:200]) or type(error).__name__
