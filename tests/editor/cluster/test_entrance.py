"""The entrance takes what another editor of the server has sealed, once, and nothing else."""

import asyncio
import time
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import pytest
from pycrdt import Doc, Map

from action_assistant.editor.cluster.owners import Alone, Elsewhere, Owner
from action_assistant.editor.cluster.peers import Peers
from action_assistant.editor.cluster.relay_seal import RelayedFacts, RelaySeal
from action_assistant.editor.rooms.remote_room import RemoteRoom
from action_assistant.errors import BadInput, Overtaken, Unavailable
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys, Person
from editor.client import updates
from editor.cluster.conftest import Pair
from support.product import TOKEN
from support.waiting import wait_until

SEAL = RelaySeal(Keys(TOKEN).relay_key)
OWNER = RelayedFacts(Identity(Person("ann", "Ann", "owner")), "192.0.2.7", "request-1")
VIEWER = RelayedFacts(Identity(Person("vic", "Vic", "viewer")), "192.0.2.8", "request-2")
#: The facts of a request of the server itself.
OF_A_ROOM = RelayedFacts(OWNER.identity, is_inner=True)


class Inside(httpx.Client):
    """A program on the private network, which seals its requests as another editor does."""

    def sealed(
        self,
        method: str,
        path: str,
        body: bytes = b"",
        facts: RelayedFacts = OWNER,
        seal: RelaySeal = SEAL,
        to: str = "",
    ) -> dict[str, str]:
        """Return the header fields of a sealed request. `to`: the editor, if it is another one."""
        return dict(seal.headers(method, f"{to or self._inner}{path}", body, facts))

    def __init__(self, inner: str) -> None:
        super().__init__(base_url=inner, trust_env=False)
        self._inner = inner


@pytest.fixture
def inside(pair: Pair) -> Iterator[Inside]:
    """A program on the private network."""
    with Inside(pair.there.inner) as client:
        yield client


def test_a_sealed_request_is_answered_for_the_person_that_it_names(
    pair: Pair, inside: Inside
) -> None:
    path = f"/internal/api/graphs/{pair.new_graph()}"
    body = b'{"name": "new"}'
    json = {"content-type": "application/json"}
    found = inside.patch(path, content=body, headers={**json, **inside.sealed("PATCH", path, body)})
    assert (found.status_code, found.json()["name"]) == (200, "new")
    refused = inside.patch(
        path, content=body, headers={**json, **inside.sealed("PATCH", path, body, VIEWER)}
    )
    assert (refused.status_code, refused.json()["type"]) == (403, "forbidden")


def test_a_seal_is_good_once_for_one_request(pair: Pair, inside: Inside) -> None:
    path, other = (f"/internal/api/graphs/{pair.new_graph()}" for _ in range(2))
    good = inside.sealed("GET", path)
    assert inside.get(path, headers=good).status_code == 200
    wrong = {
        "once more": inside.get(path, headers=good),
        "another path": inside.get(other, headers=inside.sealed("GET", path)),
        "a query": inside.get(f"{path}?a=b", headers=inside.sealed("GET", path)),
        "another method": inside.delete(path, headers=inside.sealed("GET", path)),
        "another body": inside.put(
            f"{path}/umrf", content=b"{}", headers=inside.sealed("PUT", f"{path}/umrf")
        ),
        "another person": inside.get(
            path,
            headers=inside.sealed("GET", path, facts=VIEWER)
            | {"x-relayed": inside.sealed("GET", path)["x-relayed"]},
        ),
        "another editor": inside.get(path, headers=inside.sealed("GET", path, to=pair.here.inner)),
        "no seal": inside.get(path),
        "the token": inside.get(path, headers={"authorization": f"Bearer {TOKEN}"}),
        "another token": inside.get(
            path, headers=inside.sealed("GET", path, seal=RelaySeal(Keys("k" * 43).relay_key))
        ),
        "early": inside.get(
            path, headers=inside.sealed("GET", path, seal=RelaySeal(Keys(TOKEN).relay_key, ago(60)))
        ),
        "late": inside.get(
            path,
            headers=inside.sealed("GET", path, seal=RelaySeal(Keys(TOKEN).relay_key, ago(-60))),
        ),
        "nobody": inside.get(path, headers=inside.sealed("GET", path, facts=RelayedFacts())),
        "no time": inside.get(path, headers=good | {"authorization": "Relay //"}),
        "nonsense": inside.get(
            path, headers=good | {"authorization": "Relay \xe4".encode("latin-1")}
        ),
    }
    assert {
        why: (each.status_code, each.headers.get("www-authenticate")) for why, each in wrong.items()
    } == dict.fromkeys(wrong, (401, "Relay"))
    assert all(each.json()["type"] == "unauthenticated" for each in wrong.values())
    assert inside.get(path, headers=inside.sealed("GET", path)).status_code == 200


def ago(seconds: float) -> Callable[[], float]:
    return lambda: time.time() - seconds


def test_what_this_editor_does_not_own_is_refused_and_never_passed_on(
    pair: Pair, inside: Inside
) -> None:
    graph = pair.new_graph()
    pair.give(f"graph/{graph}", pair.here)
    room = f"/internal/rooms/graph%2F{graph}"
    for path, facts in ((f"/internal/api/graphs/{graph}", OWNER), (room, OF_A_ROOM)):
        assert inside.get(path, headers=inside.sealed("GET", path, facts=facts)).status_code == 421
    for path in ("/internal/api/people", "/internal/api/graphs", "/api/graphs/x", "/internal/"):
        assert inside.get(path, headers=inside.sealed("GET", path)).status_code == 404


def test_what_a_client_sent_reaches_no_room_and_what_is_for_a_room_no_route(
    pair: Pair, inside: Inside
) -> None:
    graph = pair.new_graph()
    room, route = f"/internal/rooms/graph%2F{graph}", f"/internal/api/graphs/{graph}"
    for path, facts, status in (
        *((room, OF_A_ROOM, 200), (room, OWNER, 404)),
        *((route, OWNER, 200), (route, OF_A_ROOM, 404)),
    ):
        found = inside.get(path, headers=inside.sealed("GET", path, facts=facts))
        assert found.status_code == status, (path, facts)


def test_the_public_port_knows_no_seals(pair: Pair, inside: Inside) -> None:
    graph = pair.new_graph()
    with httpx.Client(base_url=pair.there.url, trust_env=False) as stranger:
        for path in (f"/internal/api/graphs/{graph}", f"/api/graphs/{graph}"):
            assert stranger.get(path, headers=inside.sealed("GET", path)).status_code == 401
    with pair.there.client() as person:
        path = f"/internal/api/graphs/{graph}"
        assert (
            person.get(
                path, headers={"x-relayed": inside.sealed("GET", path)["x-relayed"]}
            ).status_code
            == 404
        )
    for editor in (
        pair.here,
        pair.there,
    ):  # whoever says that they are somebody else stays who they are
        with editor.client() as person:
            claimed = {
                name: value
                for name, value in inside.sealed("GET", "/x").items()
                if name != "authorization"
            }
            made = person.post(f"/api/graphs/{graph}/versions", json={}, headers=claimed)
            assert made.json()["author"]["id"] == "local"


class OwnsNothing(Alone):
    """Owners of an editor that owns nothing; all streams are another editor's."""

    def __init__(self, url: str) -> None:
        self._url = url

    async def owner(self, stream: str) -> Owner:
        """Return the other editor."""
        del stream
        return Elsewhere(self._url)


async def test_a_remote_room_takes_edits_of_the_server_as_the_room_would(pair: Pair) -> None:
    graph = pair.new_graph()
    peers = Peers(OwnsNothing(pair.there.inner), SEAL)
    room = RemoteRoom(f"graph/{graph}", peers)
    before, _ = await room.now()
    one, two = updates(("a", "1"), ("b", "2"))
    assert await room.submit(one, "ann", before) == before + 1
    assert await room.submit(one, "ann", before + 1) == before + 1  # it changed nothing
    with pytest.raises(Overtaken):
        await room.submit(two, "ann", before)
    assert await room.submit(two, "ann") == before + 2
    seq, state = await room.now()
    assert (seq, b"things" in state) == (before + 2, True)
    with pair.there.client() as there:
        changes = there.get(f"/api/graphs/{graph}/history").json()
        assert changes
    pair.give(f"graph/{graph}", pair.here)
    with pytest.raises(Unavailable):
        await room.now()
    await peers.aclose()


async def test_edits_of_people_wait_for_a_turn_in_a_remote_room(pair: Pair) -> None:
    graph = pair.new_graph()
    peers = Peers(OwnsNothing(pair.there.inner), SEAL)
    room = RemoteRoom(f"graph/{graph}", peers)
    mine: Doc[Any] = Doc()
    things = mine.get("meta", type=Map)
    async with pair.here.joined(graph, mine):
        before, _ = await room.now()
        keys = iter(["one", "two", "three"])

        async def compute(state: bytes, seq: int) -> bytes:
            """Let somebody edit meanwhile, as far as they can."""
            assert seq == before
            things[next(keys)] = 1.0
            await asyncio.sleep(0.5)  # nothing tells that an edit waits
            doc: Doc[Any] = Doc()
            doc.apply_update(state)
            known = doc.get_state()
            doc.get("meta", type=Map)["seen"] = float("one" in doc.get("meta", type=Map))
            update: bytes = doc.get_update(known)
            return update

        assert await room.submit_in_turn("ann", compute) == before + 1
        await wait_until(lambda: things.get("seen") == 0.0)
        while room.seq < before + 2:  # the edit that waited is stored
            await room.now()
        before = room.seq

        async def compute_badly(_: bytes, __: int) -> bytes:
            things[next(keys)] = 1.0
            raise BadInput("mine")

        with pytest.raises(BadInput, match="mine"):
            await room.submit_in_turn("ann", compute_badly)
        things[next(keys)] = 1.0
        while room.seq < before + 2:  # what waited is stored, and what came after it
            await room.now()
    await peers.aclose()


async def test_a_turn_that_takes_too_long_is_over_and_people_go_on(pair: Pair) -> None:
    graph = pair.new_graph()
    peers = Peers(OwnsNothing(pair.there.inner), SEAL)
    room = RemoteRoom(f"graph/{graph}", peers)
    mine: Doc[Any] = Doc()
    things = mine.get("meta", type=Map)
    (update,) = updates(("a", "1"))
    async with pair.here.joined(graph, mine):
        before, _ = await room.now()

        async def compute(_: bytes, __: int) -> bytes:
            things["meanwhile"] = 1.0
            while (await room.now())[0] == before:  # answered when the turn is over
                pass
            return update

        with pytest.raises(Overtaken):
            await room.submit_in_turn("ann", compute)
    await peers.aclose()
    for _ in range(30):  # so that Python finds what nobody holds any more
        with pair.there.client() as there:
            there.get("/api/graphs")
    assert "never retrieved" not in pair.there.log.read_text()
