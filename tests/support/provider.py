"""An OpenID Connect provider that lies as a test tells it to: a small application on a free port."""

import base64
import hashlib
import hmac
import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread
from typing import Any
from urllib.parse import parse_qs, parse_qsl, urlsplit

import anyio
import uvicorn
from joserfc import jwt
from joserfc.jwk import RSAKey
from joserfc.jws import JWSRegistry
from litestar.types import Receive, Scope, Send

from action_assistant.web.server.listen import bound

CLIENT, SECRET = "action-assistant", "the-secret-of-the-client+%/"


class Provider:
    """A provider that signs everybody in as `subject` at once. Tests set what it says: `claims` and
    `header` of ID tokens, fields of its `metadata`, `keys` that it shows, seconds of silence `slow`
    by path, whole `answers` by path."""

    def __init__(self, port: int) -> None:
        self.port = port
        self.key = RSAKey.generate_key(2048, {"kid": "one", "use": "sig"})
        self.asked: list[str] = []  # paths
        self.reset()

    def reset(self) -> None:
        """Speak the truth again."""
        self.subject = "mari"
        self.claims: dict[str, Any] = {"name": "Mari", "groups": ["lab"]}
        self.header: dict[str, Any] = {"alg": "RS256", "kid": self.key.kid}
        self.signs: Any = self.key
        self.keys: list[dict[str, Any]] | None = None
        self.metadata: dict[str, Any] = {}
        self.slow: dict[str, float] = {}
        self.answers: dict[str, tuple[int, bytes]] = {}
        self.told: dict[str, Any] = {}
        self.codes: dict[str, dict[str, str]] = {}
        self.asked.clear()

    @property
    def issuer(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def authorize(self, url: str, **more: str) -> dict[str, str]:
        """Ask at the address to which a browser is sent; the answer that the browser takes back."""
        asked = dict(parse_qsl(urlsplit(url).query))
        code = f"code-{len(self.codes)}-{time.monotonic_ns()}"
        self.codes[code] = asked
        return {"code": code, "state": asked["state"], "iss": self.issuer, **more}

    def token(self, asked: dict[str, str]) -> str:
        """The ID token for a question."""
        now = int(time.time())
        claims = {
            "iss": self.issuer,
            "sub": self.subject,
            "aud": CLIENT,
            "exp": now + 300,
            "iat": now,
            "nonce": asked.get("nonce"),
            **({"auth_time": now} if "max_age" in asked else {}),
            **self.claims,
        }
        kept = {name: value for name, value in claims.items() if value is not None}
        if self.header["alg"] == "none":
            return f"{_part(self.header)}.{_part(kept)}."
        if self.header["alg"] == "HS256":  # the library refuses to forge with a public key
            forged = f"{_part(self.header)}.{_part(kept)}"
            return f"{forged}.{_text(hmac.digest(self.signs, forged.encode(), 'sha256'))}"
        registry = JWSRegistry(algorithms=["RS256"], strict_check_header=False)
        return jwt.encode(self.header, kept, self.signs, registry=registry)

    def answer(self, path: str, body: dict[str, str], headers: dict[str, str]) -> tuple[int, Any]:
        """The status and JSON for a request."""
        if path == "/.well-known/openid-configuration":
            return 200, {
                "issuer": self.issuer,
                "authorization_endpoint": f"{self.issuer}/auth",
                "token_endpoint": f"{self.issuer}/token",
                "jwks_uri": f"{self.issuer}/keys",
                "userinfo_endpoint": f"{self.issuer}/me",
                "scopes_supported": ["openid", "profile", "groups"],
                "token_endpoint_auth_methods_supported": ["client_secret_post"],
                "authorization_response_iss_parameter_supported": True,
                **self.metadata,
            }
        if path == "/keys":
            return 200, {"keys": self.keys or [self.key.as_dict(private=False)]}
        if path == "/me":
            assert headers["authorization"].startswith("Bearer ")
            return 200, {"sub": self.subject, **self.told}
        asked = self.codes.pop(body["code"], None)
        verifier = hashlib.sha256(body["code_verifier"].encode()).digest()
        known = (body["client_id"], body["client_secret"]) == (CLIENT, SECRET)
        if asked is None or asked["code_challenge"] != _text(verifier) or not known:
            return 400, {"error": "invalid_grant"}
        assert asked["redirect_uri"] == body["redirect_uri"]
        return 200, {"id_token": self.token(asked), "access_token": "a", "token_type": "Bearer"}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        assert scope["type"] == "http"
        path, body = scope["path"], b""
        while True:
            message: Any = await receive()
            body += message.get("body", b"")
            if not message.get("more_body"):
                break
        self.asked.append(path)
        await anyio.sleep(self.slow.get(path, 0.0))
        fields = {name: values[0] for name, values in parse_qs(body.decode()).items()}
        headers = {name.decode(): value.decode() for name, value in scope["headers"]}
        if path in self.answers:
            status, content = self.answers[path]
        else:
            status, said = self.answer(path, fields, headers)
            content = json.dumps(said).encode()
        start: Any = {"type": "http.response.start", "status": status, "headers": []}
        await send(start)
        end: Any = {"type": "http.response.body", "body": content, "more_body": False}
        await send(end)


def _part(value: dict[str, Any]) -> str:
    return _text(json.dumps(value).encode())


def _text(content: bytes) -> str:
    return base64.urlsafe_b64encode(content).decode().rstrip("=")


@contextmanager
def provided() -> Iterator[Provider]:
    """A provider that runs inside the block."""
    listener, *others = bound("127.0.0.1", 0)
    for other in others:
        other.close()
    provider = Provider(listener.getsockname()[1])
    server = uvicorn.Server(uvicorn.Config(provider, log_config=None, lifespan="off"))
    thread = Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    while not server.started:
        time.sleep(0.01)
    try:
        yield provider
    finally:
        server.should_exit = server.force_exit = True
        thread.join()
