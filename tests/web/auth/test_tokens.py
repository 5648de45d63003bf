"""Tokens of programs: their form, what a folder of them opens, and how they end."""

import json
import string
import time
import zlib
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.errors import (
    BadInput,
    Conflict,
    Forbidden,
    NotFound,
    Unauthenticated,
    Unavailable,
)
from action_assistant.safe_text import redacted
from action_assistant.web.auth.identity import Identity, Scope, Token
from action_assistant.web.auth.keys import Keys, Person, Session
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import Role
from action_assistant.web.auth.token_text import checksum, digest_of, new_text, proof, token_id
from action_assistant.web.auth.tokens import TokenFiles, TokenRecord, completed
from web.auth.test_ending import full

KEYS = Keys("k" * 43)
CHARACTERS = string.ascii_letters + string.digits
IDS = st.text(CHARACTERS, min_size=12, max_size=12)


def files(data: Path, keys: Keys = KEYS) -> TokenFiles:
    """The tokens of a data folder, as a process sees them that has just started."""
    return TokenFiles(data, keys, Revocations(data), most_days=365)


def maker(role: Role = "owner", *, invitation: str | None = None) -> Identity:
    person = Person("mari", "Mari", role)
    return Identity(person, session=Session("s", person, time.time() + 99, invitation))


@given(IDS)
def test_a_token_has_its_form_its_id_and_its_checksum(name: str) -> None:
    text = new_text(name)
    assert token_id(text) == name
    prefix, shown, secret, crc = text.split("_")
    assert (prefix, shown, len(secret), len(crc)) == ("aat", name, 43, 6)
    assert set(secret + crc) <= set(CHARACTERS)
    number = 0
    for character in crc:  # as a scanner for leaked secrets would compute it
        number = 62 * number + (
            string.digits + string.ascii_uppercase + string.ascii_lowercase
        ).index(character)
    assert number == zlib.crc32(text.rpartition("_")[0].encode())


@given(IDS, st.data())
def test_no_changed_character_is_taken_for_a_whole_token(name: str, data: st.DataObject) -> None:
    text = new_text(name)
    place = data.draw(st.integers(0, len(text) - 1))
    other = data.draw(st.sampled_from(CHARACTERS + "_-é\0 "))
    changed = text[:place] + other + text[place + 1 :]
    assert token_id(changed) == (name if changed == text else None)
    assert token_id(text[:place]) is None


@given(st.text())
def test_any_text_is_no_token_or_a_token_of_nobody(
    tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    tokens = files(tmp_path_factory.getbasetemp())
    if text.startswith("aat_"):
        with pytest.raises(Unauthenticated):
            tokens.opens(text)
    else:
        assert tokens.opens(text) is None


def test_a_token_opens_in_each_process_and_its_secret_is_kept_nowhere(tmp_path: Path) -> None:
    made = files(tmp_path).make(maker("editor"), "  nightly \n tests ", ["edit"], 2)
    found = files(tmp_path).opens(made.token)
    assert isinstance(found, Token)
    assert (found.id, found.name, found.person) == (
        made.record.id,
        "nightly tests",
        Person("mari", "Mari", "editor"),
    )
    assert found.scopes == {"edit", "read"}
    assert found.expires == pytest.approx(time.time() + 2 * 86_400, abs=60)
    secret = made.token.split("_")[2]
    (file,) = (tmp_path / "tokens").iterdir()
    assert secret not in file.read_text()
    assert json.loads(file.read_text())["sha256"] == digest_of(made.token)
    assert file.stat().st_mode & 0o077 == 0
    assert secret not in repr(found)


def test_the_secret_counts_and_not_only_the_id(tmp_path: Path) -> None:
    tokens = files(tmp_path)
    made = tokens.make(maker(), "nightly", ["read"])
    other = new_text(made.record.id)
    with pytest.raises(Unauthenticated, match="revoked, or it is of another server"):
        tokens.opens(other)


def test_another_token_of_the_server_ends_all_tokens(tmp_path: Path) -> None:
    made = files(tmp_path).make(maker(), "nightly", ["read"])
    other = files(tmp_path, Keys("o" * 43))
    with pytest.raises(Unauthenticated):
        other.opens(made.token)
    with pytest.raises(BadInput, match="did not make"):
        other.adopt(made.record)


@pytest.mark.parametrize("change", [{"role": "owner"}, {"expires": 1e12}, {"scopes": ("operate",)}])
def test_a_record_that_was_changed_opens_nothing(tmp_path: Path, change: dict[str, object]) -> None:
    made = files(tmp_path).make(maker("editor"), "nightly", ["read"])
    file = tmp_path / "tokens" / f"{made.record.id}.json"
    file.write_bytes(msgspec.json.encode(msgspec.structs.replace(made.record, **change)))
    with pytest.raises(Unauthenticated):
        files(tmp_path).opens(made.token)


def test_a_runner_elsewhere_takes_the_record_and_never_a_revoked_one(tmp_path: Path) -> None:
    made = files(tmp_path / "editor").make(maker(), "nightly", ["read"])
    runner = files(tmp_path / "runner")
    with pytest.raises(Unauthenticated):
        runner.opens(made.token)
    wire = msgspec.json.decode(msgspec.json.encode(made.record), type=TokenRecord)
    for _ in range(2):
        runner.adopt(wire)
    assert runner.opens(made.token) is not None
    runner.revoke(made.record.id)
    with pytest.raises(Conflict, match="revoked"):
        runner.adopt(wire)
    with pytest.raises(Unauthenticated):
        runner.opens(made.token)


def test_a_revoked_token_is_out_in_the_other_process_too(tmp_path: Path) -> None:
    one, other = files(tmp_path), files(tmp_path)
    made = one.make(maker(), "nightly", ["read"])
    assert other.opens(made.token) is not None
    one.revoke(made.record.id)
    with pytest.raises(Unauthenticated):
        other.opens(made.token)
    assert other.every() == []
    with pytest.raises(NotFound):
        other.revoke(made.record.id)


def test_a_token_ends_with_the_link_by_which_its_maker_came(tmp_path: Path) -> None:
    tokens, revoked = files(tmp_path), Revocations(tmp_path)
    made = tokens.make(maker("editor", invitation="link1"), "nightly", ["read"])
    assert tokens.opens(made.token) is not None
    revoked.add("link1")
    with pytest.raises(Unauthenticated, match="link by which its maker came"):
        tokens.opens(made.token)
    assert tokens.every() == []


def test_who_was_removed_has_no_tokens_in_the_list(tmp_path: Path) -> None:
    tokens = files(tmp_path)
    tokens.make(maker("editor"), "nightly", ["read"])
    assert len(tokens.every("mari")) == 1
    assert tokens.every("somebody else") == []
    Revocations(tmp_path).end_person("mari")
    assert tokens.every() == []


def test_a_token_is_revoked_on_a_full_disk(small_disk: Callable[[str], Path]) -> None:
    disk = small_disk("1m")
    one, other = files(disk), files(disk)
    made, kept = (one.make(maker(), name, ["read"]) for name in ("lost", "kept"))
    with full(disk):
        with pytest.raises(Unavailable):
            one.make(maker(), "new", ["read"])
        one.revoke(made.record.id)
        for tokens in (one, other):
            with pytest.raises(Unauthenticated):
                tokens.opens(made.token)
            assert tokens.opens(kept.token) is not None
    assert [each.record.name for each in one.every()] == ["kept"]


def test_a_folder_that_is_gone_puts_out_nobody_who_was_in(tmp_path: Path) -> None:
    tokens = files(tmp_path)
    made = tokens.make(maker(), "nightly", ["read"])
    assert tokens.opens(made.token) is not None
    (tmp_path / "tokens").rename(tmp_path / "away")
    assert tokens.opens(made.token) is not None


@pytest.mark.parametrize("role", ["viewer", "editor", "operator", "owner"])
def test_nobody_gives_more_than_they_have(tmp_path: Path, role: Role) -> None:
    least: dict[Scope, set[Role]] = {
        "read": {"viewer", "editor", "operator", "owner"},
        "scrape": {"viewer", "editor", "operator", "owner"},
        "edit": {"editor", "operator", "owner"},
        "simulate": {"editor", "operator", "owner"},
        "operate": {"operator", "owner"},
    }
    tokens = files(tmp_path)
    for scope, roles in least.items():
        if role in roles:
            assert scope in tokens.make(maker(role), "program", [scope]).record.scopes
        else:
            with pytest.raises(Forbidden, match=f"cannot give the scope {scope}"):
                tokens.make(maker(role), "program", [scope])
    with pytest.raises(BadInput, match="reserved"):
        tokens.make(maker(role), "program", ["hooks"])


def test_a_token_makes_no_token(tmp_path: Path) -> None:
    tokens = files(tmp_path)
    made = tokens.make(maker(), "nightly", ["read"])
    token = tokens.opens(made.token)
    assert token is not None
    with pytest.raises(Forbidden, match="takes a person"):
        tokens.make(Identity(token.person, token=token), "child", ["read"])


@pytest.mark.parametrize(
    ("name", "days"),
    [
        ("", None),
        (" \n", None),
        ("n" * 61, None),
        ("n", 0.0),
        ("n", -1.0),
        ("n", 366.0),
        ("n", float("nan")),
    ],
)
def test_a_name_and_an_end_are_asked_for(tmp_path: Path, name: str, days: float | None) -> None:
    with pytest.raises(BadInput):
        files(tmp_path).make(maker(), name, ["read"], days)


@given(st.sets(st.sampled_from(["read", "edit", "simulate", "operate", "scrape", "hooks"])))
def test_scopes_include_what_they_need_and_nothing_else(scopes: set[Scope]) -> None:
    found = completed(scopes)
    assert found >= scopes
    assert completed(found) == found
    assert found - scopes <= {"read", "simulate"}
    assert ("read" in found) == bool(scopes & {"read", "edit", "simulate", "operate"})


@given(IDS, st.text(max_size=80))
@settings(max_examples=50)
def test_a_proof_is_of_one_token_one_challenge_and_one_address(name: str, challenge: str) -> None:
    text = new_text(name)
    right = proof(digest_of(text), challenge, "127.0.0.1:8000")
    assert right != proof(digest_of(new_text(name)), challenge, "127.0.0.1:8000")
    assert right != proof(digest_of(text), challenge + "x", "127.0.0.1:8000")
    assert right != proof(digest_of(text), challenge, "127.0.0.1:8001")


@given(IDS, st.sampled_from(["Bearer {}", "token={}", "{}", "/x/{}?y", '"{}"', "a {}, b"]))
def test_no_log_line_shows_the_secret_of_a_token(name: str, around: str) -> None:
    text = new_text(name)
    shown = redacted(around.format(text))
    secret, crc = text.split("_")[2:]
    assert secret not in shown
    assert crc not in shown


def test_a_checksum_is_of_the_whole_body() -> None:
    assert checksum("aat_a_b") != checksum("aat_a_c")
