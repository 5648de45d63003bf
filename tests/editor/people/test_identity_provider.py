"""A provider that lies, is slow or changes its keys: only what it has signed for us counts."""

import json
import time
from collections.abc import Callable, Iterator
from typing import Any

import anyio
import httpx
import pytest
from joserfc.jwk import OctKey, RSAKey

from action_assistant.editor.people import identity_provider
from action_assistant.editor.people.identity_provider import IdentityProvider, Question
from action_assistant.errors import Unauthenticated, Unavailable
from action_assistant.web.auth.provider_settings import ProviderSettings
from support.provider import CLIENT, SECRET, Provider, provided


@pytest.fixture(scope="module")
def server() -> Iterator[Provider]:
    """A running provider."""
    with provided() as provider:
        yield provider


@pytest.fixture(autouse=True)
def truthful(server: Provider) -> None:
    """Each test begins with a provider that lies about nothing."""
    server.reset()


class Clock:
    """Seconds that a test lets pass."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def asking(server: Provider, clock: Callable[[], float] = time.monotonic) -> IdentityProvider:
    """Somebody who knows nothing of the provider yet."""
    settings = ProviderSettings(
        issuer=server.issuer,
        client_id=CLIENT,
        secret=SECRET,
        groups={"lab": "operator"},
        claim="groups",
        name="Lab",
    )
    return IdentityProvider(settings, clock)


def question(number: int = 0) -> Question:
    """A question of its own."""
    back = "http://127.0.0.1:1/signed-in"
    return Question(f"s{number}", f"n{number}", f"v{number}" * 20, back, time.time())


async def signed_in(
    provider: IdentityProvider, server: Provider, asked: Question | None = None, **more: str
) -> Any:
    """Go to the provider and back, and trade the answer."""
    asked = asked or question()
    answer = server.authorize(await provider.address(asked, again=False), **more)
    await provider.check_sender(answer["iss"])
    return await provider.identity(answer["code"], asked)


async def test_a_person_is_who_the_provider_has_signed(server: Provider) -> None:
    provider = asking(server)
    found = await signed_in(provider, server)
    assert (found.issuer, found.subject, found.name) == (server.issuer, "mari", "Mari")
    assert (found.groups, found.asked_s) == (("lab",), None)
    await signed_in(provider, server)
    assert server.asked.count("/keys") == 1  # kept, as its description is
    assert server.asked.count("/.well-known/openid-configuration") == 1
    server.claims = {"groups": None, "name": None}
    server.told = {"groups": "lab", "name": 7, "preferred_username": "mari@lab"}
    found = await signed_in(provider, server)
    assert (found.groups, found.name) == (("lab",), "mari@lab")
    server.told = {"sub": "ann", "groups": ["admins"]}
    with pytest.raises(Unauthenticated, match="two persons"):
        await signed_in(provider, server)


NOW = int(time.time())


@pytest.mark.parametrize(
    ("claims", "why"),
    [
        ({"nonce": "of another sign-in"}, "nonce"),
        ({"nonce": None}, "nonce"),
        ({"aud": "another-client"}, "aud"),
        ({"aud": "another-client", "azp": CLIENT}, "aud"),
        ({"aud": [CLIENT, "another-client"]}, "azp"),
        ({"aud": [CLIENT, "another-client"], "azp": "another-client"}, "azp"),
        ({"aud": None}, "aud"),
        ({"azp": "another-client"}, "azp"),
        ({"iss": "http://127.0.0.1:9/other"}, "iss"),
        ({"iss": None}, "iss"),
        ({"sub": None}, "sub"),
        ({"sub": ""}, "sub"),
        ({"sub": ["mari"]}, "sub"),
        ({"sub": 7}, "sub"),
        ({"sub": "x" * 256}, "names nobody"),
        ({"sub": "mari\u202e"}, "names nobody"),
        ({"exp": NOW - 300}, "expired"),
        ({"exp": None}, "exp"),
        ({"exp": "tomorrow"}, "exp"),
        ({"iat": NOW + 86_400}, "future"),
        ({"nbf": NOW + 86_400}, "not yet valid"),
        ({"at_hash": "of-another-access-token"}, "at_hash"),
        ({"auth_time": "now"}, "auth_time"),
        ({"exp": 10**400, "iat": -(10**400), "auth_time": [[]]}, "auth_time"),
    ],
)
async def test_a_claim_that_does_not_belong_to_the_question_signs_nobody_in(
    claims: dict[str, Any], why: str, server: Provider
) -> None:
    server.claims |= claims
    with pytest.raises(Unauthenticated, match=why):
        await signed_in(asking(server), server)


async def test_a_name_of_any_form_is_a_short_text(server: Provider) -> None:
    for name in ("Mari\0\r\nBcc: all", "Mari" * 15_000):
        server.claims["name"] = name
        found = await signed_in(asking(server), server)
        assert len(found.name) <= 200
        assert found.name.encode().startswith(b"Mari")
        assert found.name.isprintable()


async def test_clocks_may_differ_by_two_minutes(server: Provider) -> None:
    for behind in (-100, 100):
        now = int(time.time()) + behind
        server.claims |= {"exp": now + 10, "iat": now - 10, "nbf": now}
        assert (await signed_in(asking(server), server)).subject == "mari"


async def test_only_keys_of_the_provider_sign(server: Provider) -> None:
    strange = RSAKey.generate_key(2048, {"kid": "one"})
    public = server.key.as_pem(private=False)
    forged: list[tuple[dict[str, Any], Any]] = [
        ({"alg": "none"}, None),
        ({"alg": "HS256"}, public),
        ({"alg": "HS256", "kid": "one"}, public),
        ({"alg": "RS256", "kid": "one"}, strange),
        ({"alg": "RS256", "kid": "two"}, strange),
        ({"alg": "RS256", "kid": "one", "jwk": strange.as_dict(private=False)}, strange),
        ({"alg": "RS256", "kid": "one", "jku": f"{server.issuer}/mine"}, strange),
    ]
    for header, key in forged:
        server.header, server.signs = header, key
        with pytest.raises(Unauthenticated, match="is not valid"):
            await signed_in(asking(server), server)
    assert "/mine" not in server.asked
    # A symmetric key among its own is none with which only it can sign.
    server.header, server.signs = {"alg": "HS256", "kid": "s"}, b"s" * 32
    symmetric = OctKey.import_key(b"s" * 32, {"kid": "s"}).as_dict(private=True)
    server.keys = [symmetric, server.key.as_dict(private=False)]
    with pytest.raises(Unauthenticated, match="is not valid"):
        await signed_in(asking(server), server)


async def test_a_code_is_worth_nothing_in_another_sign_in(server: Provider) -> None:
    provider = asking(server)
    mine, theirs = question(1), question(2)
    answer = server.authorize(await provider.address(theirs, again=False))
    with pytest.raises(Unauthenticated, match="invalid_grant"):
        await provider.identity(answer["code"], mine)
    with pytest.raises(Unauthenticated, match="invalid_grant"):
        await provider.identity("a guess", mine)


async def test_an_answer_of_another_provider_is_none(server: Provider) -> None:
    provider = asking(server)
    for iss in (None, "", f"{server.issuer}/", "https://other.example"):
        with pytest.raises(Unauthenticated, match="another provider"):
            await provider.check_sender(iss)
    server.metadata = {"authorization_response_iss_parameter_supported": False}
    provider = asking(server)
    await provider.check_sender(None)  # an older provider does not say it
    with pytest.raises(Unauthenticated, match="another provider"):
        await provider.check_sender("https://other.example")


async def test_new_keys_are_asked_for_once_in_a_while(server: Provider) -> None:
    clock = Clock()
    provider = asking(server, clock)
    await signed_in(provider, server)
    fresh = RSAKey.generate_key(2048, {"kid": "two"})
    server.signs, server.header = fresh, {"alg": "RS256", "kid": "two"}
    server.keys = [fresh.as_dict(private=False)]
    assert (await signed_in(provider, server)).subject == "mari"
    assert server.asked.count("/keys") == 2
    server.header = {"alg": "RS256", "kid": "nobody's"}
    for _ in range(5):  # strangers do not have it asked without end
        with pytest.raises(Unauthenticated, match="no key of its own"):
            await signed_in(provider, server)
    assert server.asked.count("/keys") == 2
    clock.now += 60
    with pytest.raises(Unauthenticated):
        await signed_in(provider, server)
    assert server.asked.count("/keys") == 3


async def test_keys_of_unknown_kinds_are_passed_over(server: Provider) -> None:
    own = server.key.as_dict(private=False)
    odd = [{"kty": "ML-DSA"}, {"kty": "RSA"}, {"kty": "EC", "crv": "?"}, {}, {**own, "use": "enc"}]
    server.keys = [*odd, own]
    assert (await signed_in(asking(server), server)).subject == "mari"
    server.answers["/keys"] = 200, b'{"keys": 7}'
    with pytest.raises(Unauthenticated):
        await signed_in(asking(server), server)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"issuer": "https://other.example"}, "calls itself https://other.example"),
        ({"token_endpoint": "http://other.example/token"}, "not encrypted"),
        ({"jwks_uri": "http://127.0.0.1@other.example/"}, "not encrypted"),
        ({"userinfo_endpoint": "file:///etc/passwd"}, "not encrypted"),
        ({"authorization_endpoint": "javascript:alert(1)"}, "not encrypted"),
        ({"authorization_endpoint": None}, "incomplete"),
        ({"jwks_uri": 7}, "incomplete"),
    ],
)
async def test_a_provider_that_describes_itself_wrongly_is_not_used(
    change: dict[str, Any], why: str, server: Provider
) -> None:
    server.metadata = change
    with pytest.raises(Unavailable, match=why):
        await asking(server).address(question(), again=False)


@pytest.mark.parametrize("path", ["/.well-known/openid-configuration", "/token", "/keys", "/me"])
@pytest.mark.parametrize(
    ("status", "content"),
    [
        (200, b"x" * 600_000),
        (200, b"[" * 100_000),
        (200, b'{"a":"\xff"}'),
        (302, b"{}"),
        (500, b"{}"),
        (200, b"[]"),
    ],
)
async def test_answers_of_another_form_sign_nobody_in(
    path: str, status: int, content: bytes, server: Provider
) -> None:
    server.claims["groups"] = None
    server.answers[path] = status, content
    with pytest.raises(Unavailable, match="cannot be used"):
        await signed_in(asking(server), server)


async def test_who_is_slow_keeps_nobody_waiting_twice(
    server: Provider, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(identity_provider, "_PATIENCE_S", 1.0)
    description = "/.well-known/openid-configuration"
    server.slow[description] = 8.0
    provider, told = asking(server), []
    begun = time.monotonic()

    async def one() -> None:
        with pytest.raises(Unavailable, match="has not answered within 1"):
            await provider.address(question(), again=False)
        told.append(time.monotonic() - begun)

    async with anyio.create_task_group() as tasks:
        for _ in range(20):
            tasks.start_soon(one)
    assert len(told) == 20
    assert server.asked.count(description) == 1  # all had the answer of the one who asked
    for path in ("/token", "/keys"):
        server.reset()
        server.slow[path] = 8.0
        with pytest.raises(Unavailable, match="has not answered"):
            await signed_in(asking(server), server)
    nobody = Provider(1)
    with pytest.raises(Unavailable, match="cannot be reached"):
        await asking(nobody).metadata()


async def test_a_person_is_asked_again_and_how_long_ago_is_told(server: Provider) -> None:
    provider, asked = asking(server), question()
    url = await provider.address(asked, again=True)
    assert "prompt=login" in url
    assert "max_age=0" in url
    assert "code_challenge_method=S256" in url
    for claims, seconds in [({}, 0), ({"auth_time": NOW - 900, "iat": NOW}, 900)]:
        server.claims = claims
        answer = server.authorize(url)
        assert (await provider.identity(answer["code"], asked)).asked_s == seconds
    for odd in (True, 1.5, None):
        server.claims = {"auth_time": odd}
        answer = server.authorize(url)
        assert (await provider.identity(answer["code"], asked)).asked_s is None


async def test_secrets_stand_in_no_refusal(server: Provider) -> None:
    server.answers["/token"] = 400, json.dumps({"error": SECRET + "\x1b[2J"}).encode()
    with pytest.raises(Unauthenticated) as raised:
        await signed_in(asking(server), server)
    assert "\x1b" not in raised.value.detail


def test_without_the_setting_nothing_is_offered(http: httpx.Client) -> None:
    assert http.get("/api/session/provider").json() == {"name": None, "mine": False}
    assert http.post("/api/session/provider", json={}).status_code == 409
