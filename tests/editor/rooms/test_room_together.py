"""Several people at once, messages late, twice, lost or out of order: everyone sees the same."""

import itertools
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pycrdt import Doc, Map

from action_assistant.editor.crdt.loading import load
from action_assistant.editor.crdt.replica import Replica, UpdateEffect, clocks
from action_assistant.editor.log.graph_events import DEFERRED, UPDATED
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.journal.journal import Journal
from editor.client import Client, settle
from support.doses import examples

who = st.integers(0, 2)
key = st.sampled_from(["a", "b", "c", "d"])
steps = st.one_of(
    st.tuples(st.just("write"), who, key, st.integers(0, 99)),
    st.tuples(st.just("scramble"), who, key, st.integers(0, 99), st.permutations(range(4))),
    st.tuples(st.just("erase"), who, key),
    st.tuples(st.just("speak"), who, st.integers(1, 3)),
    st.tuples(st.just("listen"), who),
    st.tuples(st.just("lose"), who),
    st.tuples(st.just("swap"), who),
    st.tuples(st.just("repeat"), who),
    st.tuples(st.just("reconnect"), who),
    st.tuples(st.just("leave"), who),
    st.tuples(
        st.just("empty"),
    ),
    st.tuples(
        st.just("settle"),
    ),
    st.tuples(
        st.just("check"),
    ),
)
streams = itertools.count()


def shown(doc: Doc[Any]) -> tuple[Any, dict[int, int]]:
    """Contents, and which structs they came from."""
    return doc.get("things", type=Map).to_py(), clocks(doc.get_state())


@settings(max_examples=examples(150), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(plan=st.lists(steps, min_size=4, max_size=40))
async def test_replay_equals_room_equals_every_client(
    journal: Journal, rooms: Rooms, plan: list[tuple[Any, ...]]
) -> None:
    stream = f"graph/{next(streams)}"
    clients = [Client("ada"), Client("bob"), Client("cyd")]
    await come_together(rooms, stream, clients)
    for step in plan:
        await act(rooms, stream, clients, step)
        await agree_on_log(journal, rooms, stream)
    await come_together(rooms, stream, clients)
    await agree_on_log(journal, rooms, stream)
    async with rooms.enter(stream) as room:
        replica = await room.quiet()
        for client in clients:
            assert client.things == (replica.doc.get("things", type=Map).to_py() or {})
            assert clocks(client.doc.get_state()) == clocks(replica.doc.get_state())
            assert client.seq == room.seq == await journal.newest(stream)
            assert client.durable == client.sent
        assert not replica.waiting
    for client in clients:
        client.leave()


async def act(rooms: Rooms, stream: str, clients: list[Client], step: tuple[Any, ...]) -> None:
    """Do one step of the plan."""
    match step:
        case ("write", n, name, value):
            clients[n].map[name] = f"{clients[n].person.id}{value}"
        case ("scramble", n, name, value, order) if clients[n].room is not None:
            clients[n].speak()
            for more in range(3):
                clients[n].map[name] = f"{clients[n].person.id}{value}{more}"
            del clients[n].map[name]
            clients[n].out = [clients[n].out[place] for place in order]
        case ("erase", n, name):
            if name in clients[n].things:
                del clients[n].map[name]
        case ("speak", n, count) if clients[n].room is not None:
            clients[n].speak(count)
        case ("listen", n):
            await clients[n].listen()
        case ("lose", n) if clients[n].out:
            clients[n].out.pop(0)
        case ("swap", n) if len(clients[n].out) > 1:
            first, second, *rest = clients[n].out
            clients[n].out = [second, first, *rest]
        case ("repeat", n) if clients[n].out:
            clients[n].out.insert(0, clients[n].out[0])
        case ("reconnect", n):
            async with rooms.enter(stream) as room:
                clients[n].join(room)
        case ("leave", n):
            clients[n].leave()
        case ("empty",):
            for client in clients:
                client.leave()
            room_ = rooms.open_room(stream)
            if room_ is not None:
                await room_.close_if_unused(lambda: False)
        case ("settle",):
            await those_here_know_all(rooms, stream, clients)
        case ("check",):
            await come_together(rooms, stream, clients)
            assert clients[0].things == clients[1].things == clients[2].things


async def come_together(rooms: Rooms, stream: str, clients: list[Client]) -> None:
    """Everyone connects anew, and everything is delivered."""
    async with rooms.enter(stream) as room:
        for client in clients:
            client.join(room)
        await settle(*clients)


async def agree_on_log(journal: Journal, rooms: Rooms, stream: str) -> None:
    """Replay from nothing = snapshot and tail = the room's memory, when nothing is on its way."""
    room = rooms.open_room(stream)
    replica = await room.quiet() if room is not None else None
    plain = Replica()
    for event in await journal.read(stream):
        brought = plain.take(event.body, event.author)
        assert (brought, event.kind) in {
            (UpdateEffect.NEWS, UPDATED),
            (UpdateEffect.WAITS, DEFERRED),
        }
    loaded = await load(journal, stream)
    for other in (loaded.replica, replica):
        if other is not None:
            assert shown(other.doc) == shown(plain.doc)
            assert sorted(other.waiting) == sorted(plain.waiting)


async def those_here_know_all(rooms: Rooms, stream: str, clients: list[Client]) -> None:
    """Whoever is connected lacks nothing that the room has, even if some of theirs was lost."""
    here = [client for client in clients if client.room is not None]
    await settle(*here)
    room = rooms.open_room(stream)
    if room is None:
        return
    replica = await room.quiet()
    for client in here:
        if client.member is None or not client.member.synced:
            continue  # its question was lost
        both: Doc[Any] = Doc()
        both.apply_update(client.doc.get_update())
        both.apply_update(replica.doc.get_update())
        assert shown(both) == shown(client.doc)
