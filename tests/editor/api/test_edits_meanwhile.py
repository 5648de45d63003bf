"""People edit a graph while the server works out an edit of its own: that removes and replaces nothing that was
acknowledged and that it does not know of, and an edit that was answered with success is there."""

import asyncio
import copy
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeAlias

import httpx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from action_assistant.commands.client import Server
from action_assistant.commands.sync.folder import Folder
from action_assistant.commands.sync.sync import SyncRound
from action_assistant.editor.catalogue import server_edits
from action_assistant.editor.documents.document import Maps
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.editor.rooms.room import Room
from action_assistant.umrf.files.writing import ENDING
from editor.in_process import URL, EditorHere, browser, editor_here
from editor.meanwhile import Page, maps_in, meanwhile
from editor.process import BEARER
from support.doses import examples

# The application is made within a loop here.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

Places: TypeAlias = set[tuple[str, str]]

#: Tries of the server, of an edit that others overtake, where the edits of others never wait.
TRIES: Final = 5
#: Tries after which they wait while the edit is computed.
FREE_TRIES: Final = 2
CLIENTS: Final = (1, 2**53 - 1)  # the least and the greatest
MARIS, EVES = "M" * 12, "E" * 12  # keys of actions


@pytest.fixture
async def here(tmp_path: Path) -> AsyncIterator[EditorHere]:
    """An editor in this process."""
    async with editor_here(tmp_path) as here:
        yield here


@pytest.fixture
async def owner(here: EditorHere) -> AsyncIterator[httpx.AsyncClient]:
    """A program with the owner's token."""
    async with browser(here.app, headers=BEARER) as owner:
        yield owner


def file(name: str, dock: str = "Dock", **parameters: Any) -> dict[str, Any]:
    """Return a graph of one action."""
    end = [{"name": dock, "instance_id": 0}]
    action = {**end[0], "type": "sync", "description": "first", "input_parameters": parameters}
    about = {"graph_name": name, "graph_description": "first", "actions": [action]}
    return {**about, "graph_entry": end, "graph_exit": end}


class Case(NamedTuple):
    """A graph that Mari has edited: after the change `first`, up to `seq`. `dock`: the key of the action
    that was there first; `at_first`: the document before."""

    owner: httpx.AsyncClient
    graph: str
    room: Room
    dock: str
    at_first: Maps
    first: int
    seq: int

    @property
    def path(self) -> str:
        return f"/api/graphs/{self.graph}"

    # Each command with what it makes of a document that holds the edits of Eve: of which keys, by
    # place; None where it has to be refused.

    async def put(self) -> httpx.Response:
        """Send a text that was edited after Mari."""
        text = (await self.owner.get(f"{self.path}/umrf", params={"at": self.seq})).json()
        text["graph_description"] = "the text's"
        return await self.owner.put(f"{self.path}/umrf", params={"seq": self.seq}, json=text)

    def after_put(self, maps: Maps, touched: Places) -> Maps | None:
        if ("meta", "description") in touched:
            return None
        maps["meta"]["description"] = "the text's"
        return maps

    async def rename(self) -> httpx.Response:
        return await self.owner.patch(self.path, json={"name": "New"})

    def after_rename(self, maps: Maps, _: Places) -> Maps | None:
        maps["meta"]["name"] = "New"
        return maps

    async def call_uses(self) -> httpx.Response:
        body = {"graphs": [self.graph], "before": "Dock", "name": "Anchor"}
        return await self.owner.post(f"{self.path}/uses", json=body)

    def after_call_uses(self, maps: Maps, _: Places) -> Maps | None:
        for key, value in maps["actions"].items():
            if "|" not in key and value == "Dock":
                maps["actions"][key] = "Anchor"
        return maps

    async def revert(self) -> httpx.Response:
        """Take back what Mari did."""
        body = {"author": "mari", "from_seq": self.first + 1, "seq": self.seq}
        return await self.owner.post(f"{self.path}/revert", json=body)

    def after_revert(self, maps: Maps, touched: Places) -> Maps | None:
        for root, key in [("meta", "description"), ("actions", f"{self.dock}|description")]:
            if (root, key) not in touched:
                maps[root][key] = self.at_first[root][key]
        if ("actions", f"{MARIS}|description") not in touched:
            del maps["actions"][MARIS]
        return maps

    async def restore(self) -> httpx.Response:
        return await self.owner.post(f"{self.path}/restore", json={"seq": self.first})

    def after_restore(self, maps: Maps, _: Places) -> Maps | None:
        return {**self.at_first, "comments": maps["comments"]}

    async def restore_one(self) -> httpx.Response:
        body = {"seq": self.first, "of": self.dock}
        return await self.owner.post(f"{self.path}/restore", json=body)

    def after_restore_one(self, maps: Maps, _: Places) -> Maps | None:
        for key in (self.dock, f"{self.dock}|description"):
            maps["actions"][key] = self.at_first["actions"][key]
        return maps


COMMANDS: Final = ("put", "rename", "call_uses", "revert", "restore", "restore_one")


async def begun(owner: httpx.AsyncClient, graph: str, room: Room) -> Case:
    """Let Mari edit a new graph: its description, that of its action, and an action of her own."""
    at_first, first = await maps_in(room), room.seq
    (dock,) = [key for key, value in at_first["actions"].items() if value == "Dock"]
    mari = Page(room, "mari", client=7)
    for root, key, value in [
        ("meta", "description", "Mari's"),
        ("actions", f"{dock}|description", "Mari's"),
        ("actions", MARIS, "Mend"),
    ]:
        await (await mari.set(root, key, value))
    return Case(owner, graph, room, dock, at_first, first, room.seq)


def eves(dock: str) -> list[tuple[str, str, str]]:
    """Return what Eve may edit."""
    return [
        ("meta", "description", "Eve's"),
        ("meta", "name", "Eve's"),
        ("actions", f"{dock}|description", "Eve's"),
        ("actions", dock, "Eves"),
        ("actions", f"{MARIS}|description", "Eve's"),
        ("actions", EVES, "Dock"),
        ("comments", "thread/message", '"look"'),
    ]


#: Of each time that the server works out its edit: which of her edits Eve makes, and whether the last one
#: is acknowledged or still in the queue.
rounds = st.lists(
    st.tuples(st.lists(st.integers(0, 6), max_size=2), st.booleans()), max_size=TRIES + 1
)


@contextmanager
def computing(*, is_quick: bool) -> Iterator[None]:
    """Let the edits of others wait as long as they do for an edit of the server, or never."""
    with pytest.MonkeyPatch.context() as patch:
        if not is_quick:
            patch.setattr(server_edits, "HELD_S", 0)
        yield


@settings(max_examples=examples(150), suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    command=st.sampled_from(COMMANDS),
    rounds=rounds,
    client=st.sampled_from(CLIENTS),
    is_quick=st.booleans(),
)
async def test_an_edit_of_the_server_knows_every_edit_before_it(
    here: EditorHere,
    owner: httpx.AsyncClient,
    command: str,
    rounds: Sequence[tuple[Sequence[int], bool]],
    client: int,
    is_quick: bool,
) -> None:
    graph = (await owner.post("/api/graphs", json=file("Pair"))).json()["id"]
    async with here.services.rooms.enter(graph_stream(graph)) as room:
        case = await begun(owner, graph, room)
        wanted, touched = await maps_in(room), set[tuple[str, str]]()
        eve, left = Page(room, "eve", client), list(rounds)
        tries, last = 0, case.seq
        sent: list[asyncio.Task[int]] = []

        async def edit(_: Room) -> None:
            nonlocal tries
            tries += 1
            edits, is_acknowledged = left.pop(0) if left else ([], True)
            for number in edits:
                root, key, value = eves(case.dock)[number]
                sent.append(await eve.set(root, key, value))
                wanted[root][key] = value
                touched.add((root, key))
            if is_acknowledged and sent:
                await sent[-1]

        with computing(is_quick=is_quick), meanwhile(edit):
            answer = await getattr(case, command)()
        acknowledged = [await each for each in sent]
        last += len(acknowledged)
        expected = getattr(case, f"after_{command}")(copy.deepcopy(wanted), touched)
        overtakes = all(edits for edits, _ in [*rounds, ([], True)][:TRIES])
        if (overtakes and not is_quick) or expected is None:
            assert answer.status_code == 409, answer.text
            is_overtaken = tries == TRIES
            assert answer.json()["type"] == ("overtaken" if is_overtaken else "conflict")
            assert await maps_in(room) == wanted
            assert room.seq == last
        else:
            assert answer.is_success, answer.text
            assert tries <= FREE_TRIES or not is_quick
            assert await maps_in(room) == expected
            assert room.seq == last + (expected != wanted)
            if command == "put":
                found = answer.json()
                assert (found["seq"], found["merged"]) == (room.seq, bool(sent))


def overtaking(eve: Page, *, times: int = 1, is_acknowledged: bool = True) -> Any:
    """Return what lets Eve edit the description so many times, each time that it is called."""

    async def edit(_: Room) -> None:
        nonlocal times
        if times:
            times -= 1
            sent = await eve.set("meta", "description", f"Eve's {times}")
            if is_acknowledged:
                await sent

    return edit


@pytest.mark.parametrize("is_acknowledged", [True, False])
async def test_a_draft_is_not_merged_into_a_graph_that_was_changed_since_the_preview(
    here: EditorHere, owner: httpx.AsyncClient, is_acknowledged: bool
) -> None:
    graph = (await owner.post("/api/graphs", json=file("Origin"))).json()["id"]
    draft = (await owner.post(f"/api/graphs/{graph}/drafts", json={})).json()["id"]
    await owner.patch(f"/api/graphs/{draft}", json={"description": "the draft's"})
    async with here.services.rooms.enter(graph_stream(graph)) as room:
        eve = overtaking(Page(room, "eve", 1), is_acknowledged=is_acknowledged)
        wanted = {"seq": room.seq, "draft_seq": 2}
        with meanwhile(eve):
            refused = await owner.post(f"/api/drafts/{draft}/merge", json=wanted)
        assert (refused.status_code, refused.json()["where"]) == (409, {"side": "origin"})
        assert (await maps_in(room))["meta"]["description"] == "Eve's 0"
        assert room.seq == 2


LIMIT: Final = {"pvf_type": "number", "pvf_value": 2}


async def library(owner: httpx.AsyncClient, *graphs: str) -> tuple[str, list[str]]:
    """Return the ids of an action of the library that takes a speed, and of graphs that use it with
    a limit of their own."""
    takes = {"speed": {"pvf_type": "number", "pvf_value": 1}}
    action = {"name": "Drive", "type": "sync", "input_parameters": takes}
    made = (await owner.post("/api/actions", json=action)).json()["id"]
    uses = [
        (await owner.post("/api/graphs", json=file(name, "Drive", limit=LIMIT))).json()["id"]
        for name in graphs
    ]
    return made, uses


@pytest.mark.parametrize("client", CLIENTS)
@pytest.mark.parametrize("is_acknowledged", [True, False])
async def test_an_action_of_the_library_is_changed_with_what_others_did_meanwhile(
    here: EditorHere, owner: httpx.AsyncClient, client: int, is_acknowledged: bool
) -> None:
    action, (graph,) = await library(owner, "Way")
    async with here.services.rooms.enter(graph_stream(action)) as room:
        (key,) = [key for key in (await maps_in(room))["actions"] if "|" not in key]
        eve, before = Page(room, "eve", client), room.seq

        async def set_limit(_: Room) -> None:
            if room.seq == before:
                sent = await eve.set("actions", f"{key}|in/limit", '{"pvf_type":"string"}')
                await eve.set("actions", f"{key}|description", "Eve's")
                if is_acknowledged:
                    await sent

        with meanwhile(set_limit):
            taken = await owner.post(f"/api/actions/{action}/take", json={"graph": graph})
        assert taken.is_success, taken.text
        text = (await owner.get(f"/api/actions/{action}/umrf")).json()
        assert list(text["input_parameters"]) == ["limit"]
        assert text["input_parameters"]["limit"]["pvf_type"] == "number"
        assert text["description"] == "Eve's"


async def test_an_action_is_not_replaced_by_a_file_that_does_not_know_its_last_change(
    here: EditorHere, owner: httpx.AsyncClient
) -> None:
    action, _ = await library(owner)
    text = (await owner.get(f"/api/actions/{action}/umrf")).json()
    async with here.services.rooms.enter(graph_stream(action)) as room:
        eve = overtaking(Page(room, "eve", 1), is_acknowledged=False)
        with meanwhile(eve):
            refused = await owner.put(
                f"/api/actions/{action}/umrf",
                params={"seq": room.seq},
                json={**text, "description": "the file's"},
            )
        assert (refused.status_code, refused.json()["type"]) == (409, "conflict")
        assert (await maps_in(room))["meta"]["description"] == "Eve's 0"


@pytest.mark.parametrize("edited", [0, 1])
async def test_uses_are_updated_in_no_graph_or_in_all_of_them(
    here: EditorHere, owner: httpx.AsyncClient, edited: int
) -> None:
    action, graphs = await library(owner, "One", "Two")
    rooms = here.services.rooms
    async with (
        rooms.enter(graph_stream(graphs[0])) as one,
        rooms.enter(graph_stream(graphs[1])) as two,
    ):
        room = (one, two)[edited]
        eve = overtaking(Page(room, "eve", 1), is_acknowledged=False)

        async def edit(at: Room) -> None:
            if at is room:  # of the second one when the first was written
                await eve(at)

        seqs = [one.seq, two.seq]
        moments = [{"graph": g, "seq": n} for g, n in zip(graphs, seqs, strict=True)]
        with meanwhile(edit):
            answer = await owner.post(
                f"/api/actions/{action}/uses", json={"seq": 1, "graphs": moments}
            )
        assert (await maps_in(room))["meta"]["description"] == "Eve's 0", answer.text
        if edited == 0:
            assert (answer.status_code, answer.json()["where"]) == (409, {"graph": graphs[0]})
            assert [one.seq, two.seq] == [seqs[0] + 1, seqs[1]]
        else:
            assert [each["changed"] for each in answer.json()] == [True, True]
            assert [one.seq, two.seq] == [seqs[0] + 1, seqs[1] + 2]
            for graph in graphs:
                text = (await owner.get(f"/api/graphs/{graph}/umrf")).json()
                assert list(text["actions"][0]["input_parameters"]) == ["speed"]


@pytest.mark.parametrize("overtaken", [0, 1])
async def test_of_uses_in_several_graphs_each_that_was_not_updated_says_why(
    here: EditorHere, owner: httpx.AsyncClient, overtaken: int
) -> None:
    action, graphs = await library(owner, "One", "Two", "Three")
    async with here.services.rooms.enter(graph_stream(graphs[overtaken])) as room:
        edit = overtaking(Page(room, "eve", 1), times=2 * TRIES)

        async def overtake(at: Room) -> None:
            if at is room:
                await edit(at)

        moments = [{"graph": graph, "seq": 1} for graph in graphs]
        path, body = f"/api/actions/{action}/uses", {"seq": 1, "graphs": moments}
        with computing(is_quick=False), meanwhile(overtake):
            answer = await owner.post(path, json=body)
            if overtaken == 0:
                assert (answer.status_code, answer.json()["type"]) == (409, "conflict")
            else:
                one, two, three = answer.json()
                assert [each["changed"] for each in (one, two, three)] == [True, False, True]
                assert two["refused"].startswith("Others have changed this 5 times")
                assert one["refused"] == three["refused"] == ""
        texts = [(await owner.get(f"/api/graphs/{graph}/umrf")).json() for graph in graphs]
        found = [list(text["actions"][0]["input_parameters"]) for text in texts]
        is_updated = [each == ["speed"] for each in found]
        assert is_updated == [overtaken == 1, False, overtaken == 1]


@pytest.mark.parametrize("overtaken", [0, 1])
async def test_of_actions_renamed_in_several_graphs_each_that_was_not_says_why(
    here: EditorHere, owner: httpx.AsyncClient, overtaken: int
) -> None:
    graphs = [
        (await owner.post("/api/graphs", json=file(name))).json()["id"]
        for name in ("One", "Two", "Three")
    ]
    async with here.services.rooms.enter(graph_stream(graphs[overtaken])) as room:
        edit = overtaking(Page(room, "eve", 1), times=TRIES)

        async def overtake(at: Room) -> None:
            if at is room:
                await edit(at)

        body = {"graphs": graphs, "before": "Dock", "name": "Anchor"}
        with computing(is_quick=False), meanwhile(overtake):
            answer = await owner.post(f"/api/graphs/{graphs[0]}/uses", json=body)
        if overtaken == 0:
            assert (answer.status_code, answer.json()["type"]) == (409, "overtaken")
        else:
            (refused,) = answer.json()["refused"]
            assert answer.json()["changed"] == [graphs[0], graphs[2]]
            assert refused["graph"] == graphs[1]
            assert refused["why"].startswith("Others have changed this 5 times")
        names = [
            (await owner.get(f"/api/graphs/{graph}/umrf")).json()["actions"][0]["name"]
            for graph in graphs
        ]
        assert [name == "Anchor" for name in names] == [overtaken == 1, False, overtaken == 1]


class Bridge(httpx.BaseTransport):
    """Lets a command on a thread ask an editor of this process."""

    def __init__(self, http: httpx.AsyncClient) -> None:
        self._http = http
        self._loop = asyncio.get_running_loop()

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        asked = httpx.Request(
            request.method, request.url, headers=request.headers, content=request.read()
        )
        sent = asyncio.run_coroutine_threadsafe(self._http.send(asked), self._loop)
        answer = sent.result(60)
        return httpx.Response(answer.status_code, headers=answer.headers, content=answer.content)


async def test_a_file_whose_change_others_overtook_is_sent_in_the_next_round_and_is_no_conflict(
    here: EditorHere, owner: httpx.AsyncClient, tmp_path: Path
) -> None:
    for each in (await owner.get("/api/graphs")).json():
        await owner.delete(f"/api/graphs/{each['id']}")
    graph = (await owner.post("/api/graphs", json=file("Pair"))).json()["id"]
    folder = tmp_path / "folder"
    folder.mkdir()
    http = httpx.Client(transport=Bridge(owner), base_url=URL, headers=BEARER)

    async def synced() -> list[str]:
        syncing = SyncRound(Server(http, ""), Folder(folder), lambda _: None)
        await asyncio.to_thread(syncing.run)
        return syncing.left

    assert await synced() == []
    (path,) = [each for each in folder.glob(f"*{ENDING}") if each.name[0] != "."]
    path.write_text(path.read_text().replace('"Pair"', '"Couple"'))
    async with here.services.rooms.enter(graph_stream(graph)) as room:
        eve = overtaking(Page(room, "eve", 1), times=TRIES)
        with computing(is_quick=False), meanwhile(eve):
            (left,) = await synced()
        assert "it was not made here; try again" in left
        assert [each.name for each in folder.glob(f"*{ENDING}*") if each.name[0] != "."] == [
            path.name
        ]
        assert await synced() == []
        meta = (await maps_in(room))["meta"]
        assert (meta["name"], meta["description"]) == ("Couple", "Eve's 0")
    assert "Eve's 0" in path.read_text()
