"""Passkeys against attacks: each with the real verification, by an authenticator made here."""

import hashlib
import json
import struct
from base64 import urlsafe_b64encode
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import msgspec
import pytest
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from webauthn.helpers import base64url_to_bytes, encode_cbor

from action_assistant.errors import BadInput, Conflict, Forbidden, NotFound, Refused, Unavailable
from action_assistant.web.auth.confirmations import ADDED_S
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.passkeys import CHALLENGE_S, PasskeyFile, PasskeyFiles, Passkeys
from action_assistant.web.auth.rights import unconfirmed

KEYS = Keys("k" * 43)
ORIGIN = "https://lab.example"


def text(raw: bytes) -> str:
    return urlsafe_b64encode(raw).rstrip(b"=").decode()


class Authenticator:
    """A security key with one credential, which signs as WebAuthn says."""

    def __init__(self) -> None:
        self.key = ec.generate_private_key(ec.SECP256R1())
        self.id = hashlib.sha256(str(id(self)).encode()).digest()[:16]
        self.count = 0
        self.verified = True

    def create(self, options: dict[str, Any], origin: str = ORIGIN) -> dict[str, Any]:
        numbers = self.key.public_key().public_numbers()
        x, y = numbers.x.to_bytes(32, "big"), numbers.y.to_bytes(32, "big")
        cose = encode_cbor({1: 2, 3: -7, -1: 1, -2: x, -3: y})
        attested = bytes(16) + struct.pack(">H", len(self.id)) + self.id + cose
        data = self._data(options["rp"]["id"], flags=0x40) + attested
        response = {
            "clientDataJSON": text(client("webauthn.create", options["challenge"], origin)),
            "attestationObject": text(
                encode_cbor({"fmt": "none", "attStmt": {}, "authData": data})
            ),
        }
        return self._credential(response)

    def get(self, options: dict[str, Any], origin: str = ORIGIN) -> dict[str, Any]:
        self.count += 1
        data = self._data(options["rpId"])
        said = client("webauthn.get", options["challenge"], origin)
        signed = self.key.sign(data + hashlib.sha256(said).digest(), ec.ECDSA(SHA256()))
        response = {
            "clientDataJSON": text(said),
            "authenticatorData": text(data),
            "signature": text(signed),
        }
        return self._credential(response)

    def _data(self, rp: str, flags: int = 0) -> bytes:
        flags |= 0x01 | (0x04 if self.verified else 0)
        return hashlib.sha256(rp.encode()).digest() + bytes([flags]) + struct.pack(">I", self.count)

    def _credential(self, response: dict[str, str]) -> dict[str, Any]:
        name = text(self.id)
        return {"id": name, "rawId": name, "type": "public-key", "response": response}


def client(kind: str, challenge: str, origin: str) -> bytes:
    return json.dumps({"type": kind, "challenge": challenge, "origin": origin}).encode()


class Clock:
    """A clock that stands until it is moved."""

    def __init__(self, now: float) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now


class Bench:
    """The passkeys of a server, and people who are signed in."""

    def __init__(self, data: Path) -> None:
        self.data, self.wall, self.clock = data, Clock(1e9), Clock(0.0)
        self.files = PasskeyFiles(data)
        self.passkeys = Passkeys(self.files, self.clock, self.wall)

    def person(self, name: str = "mari", *, sure: bool = True) -> Identity:
        session = KEYS.new_session(name, role="owner", person_id=name)
        confirmed = self.wall.now if sure else None
        return Identity(session.person, session=session, confirmed_at=confirmed)

    def register(
        self, by: Identity, key: Authenticator, origin: str = ORIGIN, name: str = "Key"
    ) -> Any:
        assert by.session is not None
        options = self.passkeys.begin_registration(by, by.session, origin)
        return self.passkeys.register(by, by.session, name, key.create(options, origin))

    def options(self, by: Identity, origin: str = ORIGIN) -> dict[str, Any]:
        assert by.session is not None
        return self.passkeys.begin_confirmation(by, by.session, origin)

    def verify(self, by: Identity, credential: dict[str, Any]) -> Any:
        assert by.session is not None
        return self.passkeys.verify(by, by.session, credential)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    """A server without passkeys."""
    return Bench(tmp_path)


def test_a_passkey_confirms_again_and_again(bench: Bench) -> None:
    mari, key = bench.person(), Authenticator()
    made = bench.register(mari, key)
    for _ in range(3):
        assert bench.verify(mari, key.get(bench.options(mari))).id == made.id
    assert bench.files.of("mari").passkeys[0].sign_count == 3
    assert bench.passkeys.rename("mari", made.id, "Blue  key").name == "Blue key"
    with pytest.raises(BadInput):
        bench.passkeys.rename("mari", made.id, "\u202ekey")
    with pytest.raises(NotFound):
        bench.passkeys.remove("ann", made.id)
    bench.passkeys.remove("mari", made.id)
    with pytest.raises(NotFound):
        bench.options(mari)


def test_an_answer_counts_once_for_its_challenge_session_and_origin(bench: Bench) -> None:
    mari, other, key = bench.person(), bench.person(), Authenticator()
    bench.register(mari, key)
    answer = key.get(bench.options(mari))
    with pytest.raises(Forbidden, match="took too long"):
        bench.verify(other, answer)  # another session of the same person
    bench.verify(mari, answer)
    with pytest.raises(Forbidden, match="answered already"):
        bench.verify(mari, answer)
    bench.options(mari)
    with pytest.raises(Forbidden, match="could not be verified"):
        bench.verify(mari, answer)  # replayed for a new challenge
    late = key.get(bench.options(mari))
    bench.clock.now += CHALLENGE_S
    with pytest.raises(Forbidden, match="took too long"):
        bench.verify(mari, late)
    for origin in ("https://evil.example", "http://lab.example", "https://lab.example:8443"):
        with pytest.raises(Forbidden, match="could not be verified"):
            bench.verify(mari, key.get(bench.options(mari), origin))
    wrong_rp = {**bench.options(mari), "rpId": "evil.example"}
    with pytest.raises(Forbidden, match="could not be verified"):
        bench.verify(mari, key.get(wrong_rp))
    key.verified = False
    with pytest.raises(Forbidden, match="could not be verified"):
        bench.verify(mari, key.get(bench.options(mari)))


def test_the_passkey_of_another_person_confirms_nobody_else(bench: Bench) -> None:
    mari, eve, hers, evil = bench.person(), bench.person("eve"), Authenticator(), Authenticator()
    bench.register(mari, hers)
    bench.register(eve, evil)
    with pytest.raises(Forbidden, match="none of your passkeys"):
        bench.verify(mari, evil.get(bench.options(mari)))
    evil.id = hers.id  # under the name of the other one
    with pytest.raises(Forbidden, match="could not be verified"):
        bench.verify(mari, evil.get(bench.options(mari)))


def test_a_copy_whose_counter_does_not_go_on_is_refused(bench: Bench) -> None:
    mari, key = bench.person(), Authenticator()
    bench.register(mari, key)
    bench.verify(mari, key.get(bench.options(mari)))
    key.count = 0
    with pytest.raises(Forbidden, match="copy"):
        bench.verify(mari, key.get(bench.options(mari)))


def test_one_answer_that_is_sent_by_several_at_once_counts_once(bench: Bench) -> None:
    mari, key = bench.person(), Authenticator()
    bench.register(mari, key)
    answer = key.get(bench.options(mari))

    def sent(_: int) -> bool:
        try:
            bench.verify(mari, answer)
        except Forbidden:
            return False
        return True

    with ThreadPoolExecutor(8) as threads:
        assert sum(threads.map(sent, range(8))) == 1


def test_a_passkey_that_was_registered_without_a_confirmation_counts_after_a_day(
    bench: Bench,
) -> None:
    thief, key = bench.person(sure=False), Authenticator()
    bench.register(thief, key)
    with pytest.raises(NotFound, match="counts already"):
        bench.options(thief)
    bench.wall.now += ADDED_S
    bench.verify(thief, key.get(bench.options(thief)))


def test_registering_keeps_to_its_challenge_and_takes_no_key_twice(bench: Bench) -> None:
    mari, key = bench.person(), Authenticator()
    assert mari.session is not None
    bench.register(mari, key)
    with pytest.raises(Conflict):
        bench.register(mari, key)
    for origin in ("http://lab.example", "https://192.168.1.4", "https://[::1]", "http://10.0.0.1"):
        with pytest.raises(BadInput, match="Browsers allow passkeys only"):
            bench.passkeys.begin_registration(mari, mari.session, origin)
    assert bench.passkeys.begin_registration(mari, mari.session, "http://localhost:8000")
    options = bench.passkeys.begin_registration(mari, mari.session, ORIGIN)
    with pytest.raises(Forbidden):
        bench.passkeys.register(
            mari, mari.session, "K", Authenticator().create(options, "https://evil.example")
        )
    for hostile in ({}, {"id": 3}, {"id": "x", "response": None}):
        bench.passkeys.begin_registration(mari, mari.session, ORIGIN)
        with pytest.raises(Refused):
            bench.passkeys.register(mari, mari.session, "K", hostile)
        bench.options(mari)
        with pytest.raises(Refused):
            bench.verify(mari, hostile)


def test_a_full_disk_registers_nothing_and_confirms_all_the_same(
    bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mari, key, second = bench.person(), Authenticator(), Authenticator()
    bench.register(mari, key)

    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("action_assistant.private_files.replace_file", full)
        with pytest.raises(Unavailable, match="No space left"):
            bench.register(mari, second)
        bench.verify(mari, key.get(bench.options(mari)))
        key.count -= 1
        with pytest.raises(Forbidden, match="copy"):  # what the disk did not take counts here
            bench.verify(mari, key.get(bench.options(mari)))
    assert len(bench.files.of("mari").passkeys) == 1


def test_an_owner_is_asked_again_for_what_only_owners_change(bench: Bench) -> None:
    mari, key = bench.person(), Authenticator()
    with pytest.raises(Conflict, match="register one first"):
        bench.passkeys.set_ask_again(mari, 10)
    bench.register(mari, key)
    with pytest.raises(Forbidden, match="Confirm that it is you first"):
        bench.passkeys.set_ask_again(bench.person(sure=False), 10)
    bench.passkeys.set_ask_again(mari, 10)
    now = bench.wall.now
    asked = msgspec.structs.replace(mari, ask_again=bench.files.of("mari").ask_again, asked_at=now)
    old = msgspec.structs.replace(asked, confirmed_at=now - 601)
    never = msgspec.structs.replace(asked, confirmed_at=None)
    assert unconfirmed(asked, "share") == ""
    for each in (old, never):
        assert "confirm that it is you" in unconfirmed(each, "share")
        assert "confirm that it is you" in unconfirmed(each, "restore")
        assert unconfirmed(each, "operate") == unconfirmed(each, "stop") == ""
    with pytest.raises(Forbidden):  # nobody who finds the page open switches it off
        bench.passkeys.set_ask_again(bench.person(sure=False), 0)
    assert base64url_to_bytes(bench.files.of("mari").passkeys[0].credential) == key.id


@pytest.mark.parametrize("content", [b"", b"[1]", b'{"passkeys": 3}'])
def test_a_damaged_file_asks_an_owner_again_after_a_restart(bench: Bench, content: bytes) -> None:
    mari = bench.person()
    bench.register(mari, Authenticator())
    bench.passkeys.set_ask_again(mari, 10)
    assert bench.files.of("mari").ask_again == 10
    (path,) = (bench.data / "passkeys").iterdir()
    path.write_bytes(content)
    assert bench.files.of("mari").ask_again == 10
    restarted = PasskeyFiles(bench.data)
    assert restarted.of("mari").passkeys == ()
    assert restarted.of("mari").ask_again > 0
    with pytest.raises(Unavailable, match="so it is not changed"):
        restarted.write("mari", PasskeyFile())
    assert path.read_bytes() == content
