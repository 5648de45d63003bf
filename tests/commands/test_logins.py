"""`login`, `logout` and `tokens` against a server that really runs, with a person who confirms."""

import os
import re
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import msgspec
import pytest

from action_assistant.commands.stored_tokens import StoredToken
from action_assistant.commands.token_proof import AfterProof
from action_assistant.errors import CannotStart
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.tokens import TokenFiles
from commands.test_client import listening
from support.command_line import ran
from support.product import COMMAND, TOKEN, Product, running

KEYS = Keys(TOKEN)


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A running editor and runner."""
    with running(tmp_path_factory.mktemp("logins") / "data") as found:
        yield found


class Elsewhere:
    """A person at another computer: no data folder and no token of the server."""

    def __init__(self, product: Product, home: Path) -> None:
        self.product = product
        self.home = home
        self.tokens = home / "config" / "temoto-action-assistant" / "tokens"

    @property
    def environment(self) -> dict[str, str]:
        kept = {name: each for name, each in os.environ.items() if "ACTION_ASSISTANT" not in name}
        return {
            **kept,
            "XDG_CONFIG_HOME": str(self.home / "config"),
            "XDG_DATA_HOME": str(self.home / "data"),
            "ACTION_ASSISTANT_URL": self.product.url,
        }

    def run(self, *words: str) -> subprocess.CompletedProcess[str]:
        return ran(*words, environ=self.environment)

    def begin(self, *words: str) -> "subprocess.Popen[str]":
        """A login that waits for a person."""
        return subprocess.Popen(
            [*COMMAND, "login", self.product.url, *words],
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            # A shell that starts the tests in the background has it ignored.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )

    def sign_in(self, *words: str, scopes: list[str] | None = None) -> str:
        """Return what a login prints after a person has confirmed it."""
        waiting = self.begin(*words)
        code = code_of(waiting)
        confirm(self.product, code, scopes)
        out, err = waiting.communicate(timeout=40)
        assert waiting.returncode == 0, err
        return out


def code_of(waiting: "subprocess.Popen[str]") -> str:
    assert waiting.stdout is not None
    found = re.fullmatch(r"Code: ([A-Z]{4}-[A-Z]{4})\n", waiting.stdout.readline())
    assert found is not None
    assert f"/programs#code={found[1]}" in waiting.stdout.readline()
    return found[1]


def confirm(product: Product, code: str, scopes: list[str] | None = None) -> None:
    """Confirm a code as a page does, by an operator called Mari."""
    session = KEYS.new_session("Mari", role="operator", person_id="mari")
    page = {"cookie": f"aa_{product.port}={KEYS.sealed(session)}", "origin": product.url}
    with httpx.Client(base_url=product.url, trust_env=False, headers=page) as client:
        asked = client.post("/api/logins/look", json={"code": code}).json()
        body = {"code": code, "name": asked["name"], "scopes": scopes or asked["scopes"]}
        answer = client.post("/api/logins/confirm", json=body)
        assert answer.status_code == 204, answer.text


@pytest.fixture
def elsewhere(product: Product, tmp_path: Path) -> Elsewhere:
    return Elsewhere(product, tmp_path)


def test_a_person_signs_the_command_line_in_and_out(elsewhere: Elsewhere) -> None:
    refused = elsewhere.run("graphs")
    assert refused.returncode == 2
    assert f"action-assistant login {elsewhere.product.url}" in refused.stderr
    out = elsewhere.sign_in("--name", "laptop")
    assert "Signed in as Mari, by program laptop: edit read simulate" in out
    (file,) = elsewhere.tokens.iterdir()
    assert file.stat().st_mode & 0o077 == 0
    assert file.parent.stat().st_mode & 0o077 == 0
    assert elsewhere.run("graphs").returncode == 0
    assert "laptop" in elsewhere.run("tokens", "stored").stdout
    finished = elsewhere.run("run", "valve_inspection", "--no-wait")
    assert finished.returncode == 0, finished.stderr
    with elsewhere.product.runner() as runner:
        started = runner.get(f"/api/runs/{finished.stdout.strip()}").json()["author"]
        assert (started["id"], started["name"]) == ("mari", "Mari")
        assert (started["by"], started["program"]) == ("program", "laptop")
    assert elsewhere.run("stop", "--all").returncode == 0
    forbidden = elsewhere.run("people", "list")
    assert forbidden.returncode == 1
    assert "Not allowed" in forbidden.stderr
    assert "takes a person" in elsewhere.run("tokens", "list").stderr
    assert elsewhere.run("logout", elsewhere.product.url).returncode == 0
    assert list(elsewhere.tokens.iterdir()) == []
    assert elsewhere.run("graphs").returncode == 2
    with elsewhere.product.editor() as editor:
        names = [each["record"]["name"] for each in editor.get("/api/tokens").json()["tokens"]]
        assert "laptop" not in names


def test_only_what_the_person_ticks_is_given(elsewhere: Elsewhere) -> None:
    out = elsewhere.sign_in("--scope", "operate", "--scope", "edit", scopes=["read"])
    assert ": read, until" in out
    refused = elsewhere.run("run", "valve_inspection", "--no-wait")
    assert refused.returncode == 1
    assert "has the scopes read; this needs edit" in refused.stderr


def test_a_second_login_ends_the_token_of_the_first(elsewhere: Elsewhere) -> None:
    elsewhere.sign_in("--name", "one")
    elsewhere.sign_in("--name", "two")
    assert len(list(elsewhere.tokens.iterdir())) == 1
    with elsewhere.product.editor() as editor:
        names = [each["record"]["name"] for each in editor.get("/api/tokens").json()["tokens"]]
    assert ("one" in names, "two" in names) == (False, True)


def test_a_login_is_refused_on_the_page(elsewhere: Elsewhere) -> None:
    waiting = elsewhere.begin()
    with elsewhere.product.editor() as owner:
        owner.post("/api/logins/refuse", json={"code": code_of(waiting)}).raise_for_status()
    _, err = waiting.communicate(timeout=40)
    assert (waiting.returncode, "refused on the page" in err) == (1, True)
    assert not elsewhere.tokens.exists()


def test_a_login_that_is_given_up_lets_nobody_in(elsewhere: Elsewhere) -> None:
    waiting = elsewhere.begin()
    code = code_of(waiting)
    waiting.send_signal(signal.SIGINT)
    waiting.communicate(timeout=40)
    assert waiting.returncode == 130
    with elsewhere.product.editor() as owner:
        assert owner.post("/api/logins/look", json={"code": code}).status_code == 404


def test_a_revoked_token_is_said_to_be(elsewhere: Elsewhere) -> None:
    elsewhere.sign_in("--name", "lost")
    with elsewhere.product.editor() as owner:
        (mine,) = [
            each["record"]["id"]
            for each in owner.get("/api/tokens").json()["tokens"]
            if each["record"]["name"] == "lost"
        ]
        owner.post(f"/api/tokens/{mine}/revoke").raise_for_status()
    answer = elsewhere.run("graphs")
    assert answer.returncode == 2
    assert "was revoked" in answer.stderr
    assert "sign in again" in answer.stderr


def test_an_expired_token_still_stops_and_says_what_it_cannot_see(elsewhere: Elsewhere) -> None:
    elsewhere.sign_in()
    script = elsewhere.home / "endless.json"
    script.write_text('{"behaviours": {"*": [{"never": true}]}}')
    started = elsewhere.run("run", "valve_inspection", "--script", str(script), "--no-wait")
    run = started.stdout.strip()
    (file,) = elsewhere.tokens.iterdir()
    kept = msgspec.json.decode(file.read_bytes(), type=StoredToken)
    expire(elsewhere.product, kept.token)
    assert "has expired" in elsewhere.run("graphs").stderr
    answer = elsewhere.run("stop", run)
    assert answer.returncode == 1
    assert "Stop was sent; what became of it is not known here" in answer.stderr
    with elsewhere.product.runner() as runner:
        assert runner.get(f"/api/runs/{run}").json()["desired"] == "stopped"


def expire(product: Product, text: str) -> None:
    """Let a token expire now, as if it had been made for a shorter time."""
    tokens = TokenFiles(product.data, KEYS, Revocations(product.data))
    record = msgspec.structs.replace(tokens.get(text.split("_")[1]), expires=time.time() - 1)
    record = msgspec.structs.replace(record, seal=tokens._seal(record))
    tokens._write(record)


def test_a_stranger_at_the_address_gets_no_stored_token(elsewhere: Elsewhere) -> None:
    elsewhere.sign_in()
    (file,) = elsewhere.tokens.iterdir()
    kept = msgspec.json.decode(file.read_bytes(), type=StoredToken)
    for to, supposed in ((None, False), (None, True), (elsewhere.product.url, True)):
        with (
            listening(to) as stranger,
            httpx.Client(
                base_url=stranger.url,
                auth=AfterProof(None, kept, supposed=supposed),
                trust_env=False,
            ) as client,
            pytest.raises(CannotStart, match="does not know the token"),
        ):
            client.get("/api/graphs")
        assert kept.token.split("_")[2] not in str(stranger.heard)


def test_a_file_that_others_can_read_is_not_used(elsewhere: Elsewhere) -> None:
    elsewhere.sign_in()
    (file,) = elsewhere.tokens.iterdir()
    file.chmod(0o644)
    answer = elsewhere.run("graphs")
    assert answer.returncode == 2
    assert "chmod 600" in answer.stderr


def test_the_owner_makes_lists_and_revokes_tokens(product: Product, tmp_path: Path) -> None:
    made = product.cli("tokens", "make", "nightly", "--scope", "simulate", "--days", "2")
    assert made.returncode == 0, made.stderr
    text = made.stdout.strip()
    assert text.startswith("aat_")
    listed = product.cli("tokens", "list").stdout
    assert re.search(rf"{text.split('_')[1]}  nightly  read simulate  by .*never used", listed)
    headers = {"authorization": f"Bearer {text}"}
    for url in (f"{product.url}/api/graphs", f"{product.runner_url}/api/runs"):
        assert httpx.get(url, headers=headers, trust_env=False).status_code == 200
    given = {**product.environment, "ACTION_ASSISTANT_TOKEN": text}
    assert ran("graphs", environ=given).returncode == 0
    assert product.cli("tokens", "revoke", text.split("_")[1]).returncode == 0
    for url in (f"{product.url}/api/graphs", f"{product.runner_url}/api/runs"):
        assert httpx.get(url, headers=headers, trust_env=False).status_code == 401
    assert text.split("_")[2] not in product.log.read_text()
