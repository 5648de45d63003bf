"""Commands show the token to nobody but a server that knows it."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import httpx
import pytest

from action_assistant.commands.token_proof import AfterProof
from action_assistant.errors import CannotStart
from action_assistant.web.auth.keys import Keys
from support.product import TOKEN, Product
from web.auth.test_access import KEYS, served


class Stranger:
    """A foreign program that listens, and passes challenges on to the server `to`, if one is
    given."""

    def __init__(self, to: str | None = None) -> None:
        self.heard: list[dict[str, str]] = []
        stranger = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                stranger.heard.append(dict(self.headers))
                body = b'{"address":"127.0.0.1:8000","proof":"x"}'
                if to is not None:
                    body = httpx.get(to + self.path, trust_env=False).content
                self.send_response(200)
                self.send_header("content-length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_: Any) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}"

    @property
    def learned(self) -> bool:
        """Return whether the foreign program saw the token or a key."""
        return any(KEYS.token in str(each) or TOKEN in str(each) for each in self.heard)


@contextmanager
def listening(to: str | None = None) -> Iterator[Stranger]:
    stranger = Stranger(to)
    thread = threading.Thread(target=stranger.server.serve_forever)
    thread.start()
    try:
        yield stranger
    finally:
        stranger.server.shutdown()
        stranger.server.server_close()
        thread.join()


@contextmanager
def client(
    url: str, *, supposed: bool, keys: Keys = KEYS
) -> Iterator[Callable[[], httpx.Response]]:
    with httpx.Client(
        base_url=url, auth=AfterProof(keys, supposed=supposed), trust_env=False
    ) as http:
        yield lambda: http.get("/api/me")


@pytest.mark.parametrize("supposed", [True, False])
def test_a_program_that_merely_listens_gets_no_token(supposed: bool) -> None:
    with listening() as stranger, client(stranger.url, supposed=supposed) as ask:
        with pytest.raises(CannotStart, match="does not know the token"):
            ask()
        assert len(stranger.heard) == 1
        assert not stranger.learned


def test_a_server_of_ours_proves_itself_once(tmp_path: Path) -> None:
    with served(tmp_path) as port:
        with client(f"http://127.0.0.1:{port}", supposed=True) as ask:
            assert [ask().status_code for _ in range(2)] == [200, 200]
        with (
            client(f"http://127.0.0.1:{port}", supposed=True, keys=Keys("o" * 43)) as ask,
            pytest.raises(CannotStart),
        ):
            ask()


def test_a_program_that_passes_the_challenge_on_gets_no_token(
    tmp_path: Path,
) -> None:
    with (
        served(tmp_path) as port,
        listening(f"http://127.0.0.1:{port}") as between,
        client(between.url, supposed=True) as ask,
    ):
        with pytest.raises(CannotStart, match="another server of ours"):
            ask()
        assert not between.learned


def test_a_command_says_what_is_wrong_and_sends_nothing(tmp_path: Path) -> None:
    with listening() as stranger:
        answer = Product(tmp_path).cli("graphs", "--url", stranger.url)
        assert answer.returncode == 2
        assert "does not know the token" in answer.stderr
        assert "Traceback" not in answer.stderr
        assert not stranger.learned


@pytest.mark.parametrize("text", ["", "\n", "short"])
def test_a_token_file_without_a_token_is_named(
    tmp_path: Path, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "token"
    file.write_text(text)
    for keys_of in (Keys.of, Keys.known):
        with pytest.raises(CannotStart, match="at least 32") as refused:
            keys_of(tmp_path)
        assert str(file) in str(refused.value)
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", "short")
    with pytest.raises(CannotStart, match="ACTION_ASSISTANT_TOKEN has 5 characters"):
        Keys.known(tmp_path)
