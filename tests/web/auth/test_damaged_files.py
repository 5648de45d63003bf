"""The small files of both processes with any content: each is kept and opens nothing, and nobody else notices."""

import asyncio
import os
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, NamedTuple

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.errors import Unauthenticated
from action_assistant.runner.runs.sight import RunGraphs, RunSight
from action_assistant.web.auth.confirmations import Confirmations
from action_assistant.web.auth.graph_rules import CLOSED
from action_assistant.web.auth.graph_seals import GraphSeals, RulesFile, Sight, statement_of
from action_assistant.web.auth.identity import Identity, Token
from action_assistant.web.auth.keys import Keys, Person, PersonRef, Session
from action_assistant.web.auth.passkeys import PasskeyFile, PasskeyFiles
from action_assistant.web.auth.people_files import PeopleFiles, PersonFile
from action_assistant.web.auth.released_versions import Release, ReleasedVersions
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.session_files import SessionFiles
from action_assistant.web.auth.standing import Standings
from action_assistant.web.auth.tokens import TokenFiles
from action_assistant.web.auth.view_links import ViewLinks

KEYS: Final = Keys("t" * 40)
NOW: Final = time.time()
DIGEST: Final = "d" * 64
MARI, ANU = Person("mari", "Mari", "owner"), Person("anu", "Anu", "operator")
SESSIONS: Final = {
    each.id: Session(f"s-{each.id}", each, NOW + 3600, personal=True, begun=NOW)
    for each in (MARI, ANU)
}
TOKEN: Final = "token of mari"
VIEW: Final = "link of mari"


class Place(NamedTuple):
    """A data folder with one file of each kind of Mari and of Anu, their secrets, and what the files
    open for each of them."""

    data: Path
    texts: dict[str, str]
    before: dict[str, dict[str, object]]

    def file(self, kind: str) -> Path:
        """Return Mari's file of a kind."""
        return self.data / self.texts[kind]


def filled(data: Path) -> Place:
    """Write the files by the code that writes them."""
    data.mkdir(exist_ok=True)
    revoked = Revocations(data)
    texts: dict[str, str] = {}
    for person in (MARI, ANU):
        session, ref = SESSIONS[person.id], PersonRef(person.id, person.name)
        PeopleFiles(data).write(PersonFile(person.id, person.name, person.role, ("g1",)))
        SessionFiles(data, revoked).note(session)
        Confirmations(data, KEYS).confirm(session.id, "passkey")
        PasskeyFiles(data).write(person.id, PasskeyFile())
        made = TokenFiles(data, KEYS, revoked).make(Identity(person), person.name, ["read"])
        link = ViewLinks(data, KEYS, revoked, "run").make("run1", person.name, 1, ref)
        texts |= {f"token of {person.id}": made.token, f"link of {person.id}": link.path}
        if person is MARI:
            texts |= {"tokens": f"tokens/{made.record.id}.json", "views": f"views/{link.id}.json"}
        (data / "tokens" / f"{made.record.id}.used").write_text('{"at":1.0,"address":""}')
        (data / "views" / f"{link.id}.used").write_text('{"count":1}')
    for digest in (DIGEST, "e" * 64):
        ReleasedVersions(data).add(
            Release(
                version="v1",
                digest=digest,
                by=PersonRef("mari", "Mari"),
                at=datetime.fromtimestamp(NOW, UTC),
            )
        )
    PeopleFiles(data).write_groups({"g1": "Group"})
    seals = GraphSeals(KEYS)
    RulesFile(data, KEYS).store(seals.sealed(statement_of({"graph1": CLOSED}, None)))
    sight = Sight("v1", DIGEST, ("graph2",), (CLOSED,), (time.time_ns() // 1000) + 10**6)
    asyncio.run(RunSight(data, KEYS).accept(seals.sealed(sight), "v1", (DIGEST,), Identity(MARI)))
    texts |= {
        "people": "people/mari.json",
        "groups": "people/groups.json",
        "sessions": "sessions/s-mari.json",
        "confirmed": "confirmed/s-mari.json",
        "passkeys": "passkeys/mari.json",
        "released": f"released/{DIGEST}-v1.json",
        "rules": "graph-rules.json",
        "sights": "graph-sights.json",
        "token uses": texts["tokens"].replace(".json", ".used"),
        "view uses": texts["views"].replace(".json", ".used"),
    }
    place = Place(data, texts, {})
    return place._replace(before={each: opens(place, each) for each in SESSIONS})


def opens(place: Place, person: str) -> dict[str, object]:
    """Return what the files open for a person, as a process reads them that has just begun."""
    data = place.data
    revoked = Revocations(data)
    people, browsers = PeopleFiles(data), SessionFiles(data, revoked)
    confirmations, passkeys = Confirmations(data, KEYS), PasskeyFiles(data)
    standings = Standings(people, browsers, confirmations=confirmations, passkeys=passkeys)
    session = SESSIONS[person]
    standing = standings.of(session)
    tokens, views = TokenFiles(data, KEYS, revoked), ViewLinks(data, KEYS, revoked, "run")
    token = _of(tokens.opens, place.texts[f"token of {person}"])
    sight = RunSight(data, KEYS)
    viewer = Identity(Person(person, person, "editor"))
    digest = DIGEST if person == "mari" else "e" * 64
    return {
        "is out": revoked.ends(session),
        "may": not standing.expired and (standing.person.role, sorted(standing.groups)),
        "confirmed": standing.confirmed_at is not None,
        "asked again": standing.ask_again,
        "token": isinstance(token, Token) and not standings.of(token).expired,
        "view": _of(views.opens, place.texts[f"link of {person}"].partition("=")[2]) is not None,
        "released": ReleasedVersions(data).of(digest) is not None,
        "run of graph1": not sight.hides(RunGraphs("else", ("graph1",)), viewer),
        "run of graph3": not sight.hides(RunGraphs("else", ("graph3",)), viewer),
        "run of graph2": not sight.hides(RunGraphs("else", ("graph2",)), viewer),
        "tokens": len(msgspec.json.encode(tokens.every(person))) > 2,
        "views": {each.label for each in _wired(views.every())} >= {person.capitalize()},
        "sessions": {each.person.id for each in _wired(browsers.every())} >= {person},
        "groups": people.groups().get("g1"),
    }


def _of(call: Callable[[str], object], text: str) -> object:
    try:
        return call(text)
    except Unauthenticated:
        return None


def _wired(values: list[Any]) -> list[Any]:
    msgspec.json.encode(values)  # as a route answers with them
    return values


#: What a file of a kind that cannot be read opens for its person, where that is less than before.
CLOSED_BY: Final[dict[str, dict[str, object]]] = {
    "people": {"may": ("viewer", [])},
    "groups": {"groups": None},
    "sessions": {"sessions": False},
    "confirmed": {"confirmed": False},
    "passkeys": {"asked again": 15},
    "tokens": {"token": False, "tokens": False},
    "token uses": {},
    "views": {"view": False, "views": False},
    "view uses": {},
    "released": {"released": False},
    "rules": {"run of graph3": False},
    "sights": {"run of graph3": False},
}
#: Of these there is one for all.
_SHARED: Final = {"groups", "rules", "sights"}


@st.composite
def broken(draw: st.DrawFn, whole: bytes) -> bytes:
    """Return what a disk may have left of a file: no value of its form any more."""
    content = draw(
        st.one_of(
            st.binary(max_size=200),
            st.integers(0, len(whole) - 1).map(lambda end: whole[:end]),
            st.just(b"\0" * len(whole)),
            st.just(whole.replace(b'":"', b'":"\xff', 1) if b'":"' in whole else b'"\xff"'),
            st.just(b'{"x":' + b"[" * 100_000),
            st.just(whole + whole),
            st.tuples(st.integers(0, len(whole) - 1), st.integers(128, 255)).map(
                lambda at: whole[: at[0]] + bytes([at[1]]) + whole[at[0] + 1 :]
            ),
        )
    )
    try:
        msgspec.json.decode(content)
        content.decode()
    except (ValueError, RecursionError):
        return content
    return b"\xff"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Place:
    return filled(tmp_path_factory.mktemp("small") / "data")


@pytest.mark.parametrize("kind", CLOSED_BY)
@given(data=st.data())
@settings(max_examples=12, deadline=None)
def test_a_small_file_with_any_content_opens_nothing_and_is_kept(
    place: Place, kind: str, data: st.DataObject
) -> None:
    path = place.file(kind)
    whole = path.read_bytes()
    content = data.draw(broken(whole))
    times = path.stat()
    try:
        path.write_bytes(content)
        assert opens(place, "mari") == place.before["mari"] | CLOSED_BY[kind]
        less = CLOSED_BY[kind] if kind in _SHARED else {}
        assert opens(place, "anu") == place.before["anu"] | less
        assert path.read_bytes() == content
    finally:
        path.write_bytes(whole)
        os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
