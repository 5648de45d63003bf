"""Tokens and sealed sessions."""

import base64
import contextlib
import stat
import subprocess
import sys
import time
from pathlib import Path
from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.errors import CannotStart, Unauthenticated
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys, Person, Session
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Role
from action_assistant.web.auth.session_files import SessionFiles
from action_assistant.web.auth.tokens import TokenFiles
from action_assistant.web.auth.view_links import ViewLinks

KEYS = Keys("k" * 43)


@given(st.text(max_size=60), st.text(min_size=1, max_size=20))
def test_a_sealed_session_comes_back_as_it_was(name: str, person: str) -> None:
    session = KEYS.new_session(
        name.encode("utf-8", "ignore").decode(),
        person_id=person.encode("utf-8", "ignore").decode() or "p",
    )
    assert KEYS.session(KEYS.sealed(session)) == session


@given(st.text())
def test_text_that_was_not_sealed_here_is_no_session(cookie: str) -> None:
    assert KEYS.session(cookie) is None


@given(st.data())
def test_a_cookie_with_one_character_changed_is_no_session(data: st.DataObject) -> None:
    cookie = KEYS.sealed(Session("s", Person("p", "Ada"), 1e12))
    at = data.draw(st.integers(0, len(cookie) - 1))
    other = data.draw(st.sampled_from("Aa0_-.").filter(lambda c: c != cookie[at]))
    forged = KEYS.session(cookie[:at] + other + cookie[at + 1 :])
    # The last character of base64url carries unused bits: the same bytes are the same cookie.
    assert forged is None or forged == KEYS.session(cookie)


def test_a_session_of_another_server_is_no_session() -> None:
    assert Keys("o" * 43).session(KEYS.sealed(KEYS.new_session("Ada"))) is None


@given(st.sampled_from(get_args(Role)), st.none() | st.text(max_size=20))
def test_role_and_invitation_are_sealed_with_the_session(
    role: Role, invitation: str | None
) -> None:
    session = KEYS.new_session("Ada", role=role, invitation=invitation)
    assert KEYS.session(KEYS.sealed(session)) == session


def test_a_cookie_of_before_there_were_roles_is_an_owners() -> None:
    payload = base64.urlsafe_b64encode(b'["s","p","Ada",1e12]').rstrip(b"=").decode()
    signature = base64.urlsafe_b64encode(KEYS._sign(payload)).rstrip(b"=").decode()
    session = KEYS.session(f"{payload}.{signature}")
    assert session == Session("s", Person("p", "Ada", "owner"), 1e12)


def test_an_expired_session_is_genuine_and_says_so() -> None:
    cookie = KEYS.sealed(Session("s", Person("p", "Ada"), time.time() - 1))
    session = KEYS.session(cookie)
    assert session is not None
    assert session.expired


def test_the_token_is_made_once_and_only_its_owner_may_read_it(tmp_path: Path) -> None:
    token = Keys.of(tmp_path).token
    assert Keys.of(tmp_path).token == token
    assert len(token) >= 43  # 256 bit
    assert stat.S_IMODE((tmp_path / "token").stat().st_mode) == 0o600
    assert [path.name for path in tmp_path.iterdir()] == ["token"]


def test_processes_that_start_at_once_agree_on_one_token(tmp_path: Path) -> None:
    ask = (
        "import sys; from pathlib import Path; from action_assistant.web.auth.keys import Keys;"
        "sys.stdin.read(1); print(Keys.of(Path(sys.argv[1])).token)"
    )
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", ask, str(tmp_path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        for _ in range(4)
    ]
    for process in processes:
        assert process.stdin
        process.stdin.write(b"g")
        process.stdin.flush()
    tokens = {process.communicate()[0] for process in processes}
    assert len(tokens) == 1
    assert tokens != {b""}


def test_the_environment_may_give_the_token(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", "t" * 40)
    assert Keys.of(tmp_path).token == "t" * 40
    assert not list(tmp_path.iterdir())


def test_a_token_that_can_be_guessed_is_refused() -> None:
    with pytest.raises(CannotStart, match="at least 32"):
        Keys("secret")


def test_nothing_that_lets_in_lasts_longer_when_the_clock_is_set_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keys, revoked, now = Keys("t" * 40), Revocations(tmp_path), time.time()
    session = keys.new_session("Mari", role="operator", personal=True, seconds=3600)
    browsers = SessionFiles(tmp_path, revoked)
    browsers.note(session)
    tokens = TokenFiles(tmp_path, keys, revoked)
    text = tokens.make(Identity(session.person), "nightly", ["read"], days=1).token
    views = ViewLinks(tmp_path, keys, revoked, "run")
    link = views.make("r1", "", 1, session.person).path.partition("=")[2]

    def let_in() -> tuple[bool, bool, bool]:
        cookie, token = keys.session(keys.sealed(session)), tokens.opens(text)
        assert cookie is not None
        assert token is not None
        with contextlib.suppress(Unauthenticated):
            views.opens(link)
            return not cookie.expired, not token.expired, True
        return not cookie.expired, not token.expired, False

    assert let_in() == (True, True, True)
    monkeypatch.setattr(time, "time", lambda: now - 120)  # of another computer
    assert let_in() == (True, True, True)
    monkeypatch.setattr(time, "time", lambda: now - 7200)
    assert let_in() == (False, False, False)
    used = SessionFiles(tmp_path, revoked).used_at(session)
    assert used is not None
    assert used <= now - 7200  # so that it is idle after the same time as others
    assert list((tmp_path / "sessions").iterdir())
    browsers.every()
    monkeypatch.setattr(time, "time", lambda: now)
    assert [each.id for each in browsers.every()] == [session.id]
