"""Several editors of one Postgres are one server to whoever uses them."""

import asyncio
import random
import shutil
import signal
import time
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import httpx
import httpx_ws
import pytest
from pycrdt import Doc, Map

from action_assistant.journal.events import nothing
from action_assistant.journal.journal import Journal
from editor.cluster.clients import Stubborn, closed
from editor.cluster.several import OneOfSeveral, several
from editor.process import BEARER
from journal.servers import Server
from support.waiting import wait_until

#: Longer than the others take to call an editor dead, and to own its graphs.
_FROZEN_S = 8.0


@pytest.fixture(scope="module")
def editors(tmp_path_factory: pytest.TempPathFactory, postgres: Server) -> Any:
    """Three editors that tests share."""
    folder = tmp_path_factory.mktemp("several")
    with several(folder, postgres.new_database(), 3) as found:
        yield found


def asked(editor: OneOfSeveral, method: str, path: str, **more: Any) -> Any:
    """Return the JSON of an answer. On a busy machine an editor may be late with its beats, and
    lose a graph to another one for a moment; it answers 503 then, has done nothing, and is asked
    again."""
    deadline = time.monotonic() + 60
    with editor.client() as client:
        while (answer := client.request(method, path, **more)).status_code == 503:
            assert time.monotonic() < deadline, answer.text
            time.sleep(0.2)
    assert answer.is_success, answer.text
    return answer.json() if answer.content else None


async def test_people_at_all_editors_are_in_one_room(editors: list[OneOfSeveral]) -> None:
    graph = asked(editors[0], "POST", "/api/graphs", json={"name": "task"})["id"]
    docs = [Doc[Any]() for _ in editors]
    async with (
        editors[0].joined(graph, docs[0]),
        editors[1].joined(graph, docs[1]),
        editors[2].joined(graph, docs[2]),
    ):
        for n in range(40):
            for which, doc in enumerate(docs):
                doc.get("meta", type=Map)[f"{which}-{n}"] = float(n)
        await wait_until(lambda: all(len(doc.get("meta", type=Map)) >= 120 for doc in docs))
    assert len({asked(each, "GET", f"/api/graphs/{graph}")["seq"] for each in editors}) == 1


async def test_graphs_and_people_of_one_editor_are_known_at_all(
    editors: list[OneOfSeveral],
) -> None:
    one, two, three = editors
    graph = asked(one, "POST", "/api/graphs", json={"name": "somewhere"})["id"]
    assert graph in [each["id"] for each in asked(two, "GET", "/api/graphs")]
    asked(three, "PATCH", f"/api/graphs/{graph}", json={"name": "elsewhere"})
    assert "elsewhere" in [each["name"] for each in asked(two, "GET", "/api/graphs")]
    asked(one, "POST", "/api/members", json={"name": "Mari", "role": "editor"})
    link = asked(two, "POST", "/api/invitations", json={"role": "viewer", "label": "tour"})
    await wait_until(lambda: "Mari" in str(asked(three, "GET", "/api/members")))
    await wait_until(lambda: link["id"] in str(asked(three, "GET", "/api/invitations")))
    asked(two, "DELETE", f"/api/graphs/{graph}")
    with one.client() as client:
        assert client.get(f"/api/graphs/{graph}").status_code == 404
    assert graph not in [each["id"] for each in asked(three, "GET", "/api/graphs")]


async def test_a_rule_that_is_set_at_one_editor_holds_at_all(editors: list[OneOfSeveral]) -> None:
    one, two, three = editors
    folder = asked(one, "POST", "/api/folders", json={"name": "secret"})["id"]
    graph = asked(two, "POST", "/api/graphs", json={"name": "hidden"})["id"]
    asked(one, "PUT", f"/api/graphs/{graph}/folder", json={"folder": folder})
    link = asked(three, "POST", "/api/invitations", json={"role": "viewer", "label": ""})
    async with httpx.AsyncClient(base_url=three.url, trust_env=False) as guest:
        origin = {"origin": three.url}
        await wait_until(lambda: link["id"] in str(asked(three, "GET", "/api/invitations")))
        proof = {"invitation": link["path"].partition("=")[2], "name": "Gus"}
        assert (await guest.post("/api/session", json=proof, headers=origin)).is_success
        assert (await guest.get(f"/api/graphs/{graph}")).status_code == 200
        cookie = "; ".join(f"{name}={value}" for name, value in guest.cookies.items())
        async with three.socket(graph, cookie=cookie, **origin) as socket:
            rule = {"rule": {"readers": [], "editors": []}}
            asked(one, "PUT", f"/api/folders/{folder}/rule", json=rule)
            assert await closed(socket) == 4404
        assert (await guest.get(f"/api/graphs/{graph}")).status_code == 404
        await wait_until(lambda: link["id"] in str(asked(one, "GET", "/api/invitations")))
        asked(one, "POST", f"/api/invitations/{link['id']}/revoke")
        assert (await guest.get("/api/graphs")).status_code == 401


async def test_a_personal_link_lets_one_browser_in_at_whichever_editor(
    editors: list[OneOfSeveral],
) -> None:
    for n in range(3):
        made = asked(
            editors[n], "POST", "/api/members", json={"name": f"Mari {n}", "role": "editor"}
        )
        proof = made["links"][0]["path"].partition("=")[2]
        await wait_until(
            lambda made=made: all(
                made["id"] in str(asked(each, "GET", "/api/members")) for each in editors
            )
        )

        def come(editor: OneOfSeveral, proof: str = proof) -> int:
            body = {"invitation": proof, "name": "Mari"}
            with httpx.Client(base_url=editor.url, trust_env=False) as browser:
                return browser.post(
                    "/api/session", json=body, headers={"origin": editor.url}
                ).status_code

        came = await asyncio.gather(
            *(asyncio.to_thread(come, each) for each in editors for _ in range(2))
        )
        assert len([status for status in came if status < 300]) == 1, came


def test_edits_of_the_server_reach_graphs_that_other_editors_have_open(
    editors: list[OneOfSeveral],
) -> None:
    one, two, three = editors
    graph = asked(two, "POST", "/api/graphs", json={"name": "uses it"})["id"]
    seq = asked(two, "GET", f"/api/graphs/{graph}")["seq"]
    asked(two, "PATCH", f"/api/graphs/{graph}", json={"description": "open there"})
    renamed = asked(three, "POST", f"/api/graphs/{graph}/restore", json={"seq": seq})
    assert renamed["seq"] == seq + 2
    draft = asked(one, "POST", f"/api/graphs/{graph}/drafts", json={"name": "try"})["id"]
    asked(three, "PATCH", f"/api/graphs/{draft}", json={"description": "of the draft"})
    sides = asked(two, "POST", f"/api/drafts/{draft}/preview", json={})
    merged = asked(
        one,
        "POST",
        f"/api/drafts/{draft}/merge",
        json={"seq": sides["seq"], "draft_seq": sides["draft_seq"]},
    )
    assert merged["changed"]
    for each in editors:
        assert asked(each, "GET", f"/api/graphs/{graph}")["description"] == "of the draft"
        assert asked(each, "GET", f"/api/graphs/{graph}/history")


async def test_every_editor_lists_who_is_in_a_graph_wherever_it_is_open(
    editors: list[OneOfSeveral],
) -> None:
    graph = asked(editors[0], "POST", "/api/graphs", json={"name": "crowded"})["id"]

    def listed(**wanted: Any) -> list[list[str]]:
        """Return the names of the people whom each list shows in the graph."""
        return [
            [person["name"] for person in each.get("people", ())]
            for editor in editors
            for each in asked(editor, "GET", "/api/graphs", params=wanted)
            if each["id"] == graph
        ]

    def found() -> int:
        """Return how many editors find the graph by the name of somebody who is in it."""
        return len(listed(q="kadri", limit=5))

    link = asked(editors[2], "POST", "/api/members", json={"name": "Kadri", "role": "viewer"})
    await wait_until(lambda: "Kadri" in str(asked(editors[1], "GET", "/api/members")))
    assert (listed(), found()) == ([[], [], []], 0)
    async with httpx.AsyncClient(base_url=editors[1].url, trust_env=False) as browser:
        proof = {"invitation": link["links"][0]["path"].partition("=")[2]}
        origin = {"origin": editors[1].url}
        assert (await browser.post("/api/session", json=proof, headers=origin)).is_success
        cookie = "; ".join(f"{name}={value}" for name, value in browser.cookies.items())
        async with editors[1].socket(graph, cookie=cookie, **origin) as socket:
            await socket.send_bytes(bytes([1, 6, 1, 7, 1, 2]) + b"{}")  # presence: client 7, {}
            await wait_until(lambda: listed() == [["Kadri"], ["Kadri"], ["Kadri"]])
            assert found() == 3
    await wait_until(lambda: listed() == [[], [], []])


async def test_asking_for_graphs_that_do_not_exist_leaves_nothing(
    editors: list[OneOfSeveral], postgres: Server
) -> None:
    def rows() -> list[str]:
        name = editors[0].database.rpartition("/")[2]
        made_up = "stream LIKE 'graph/made-up-%'"
        return [
            postgres.ask(f"SELECT count(*) FROM {table} WHERE {made_up}", name)
            for table in ("head", "room", "event")
        ]

    for n in range(6):
        editor, path = editors[n % 3], f"/api/graphs/made-up-{n}"
        with editor.client() as client:
            assert client.get(path).status_code == 404
            assert client.patch(path, json={"name": "new"}).status_code == 404
            assert client.get(f"/api/actions/made-up-{n}/umrf").status_code == 404
        with pytest.raises(httpx_ws.WebSocketUpgradeError) as refused:
            async with editor.socket(f"made-up-{n}"):
                pass
        assert refused.value.response.status_code == 404
    assert rows() == ["0", "0", "0"]


async def lived_through(
    editors: list[OneOfSeveral],
    fault: Callable[[], Coroutine[Any, Any, None]],
    database: str,
) -> None:
    """Let people at all editors write into three graphs before, during and after a fault, and check
    that everybody has everything, once, and that each room is what its log says."""
    graphs = [
        asked(each, "POST", "/api/graphs", json={"name": f"g{n}"})["id"]
        for n, each in enumerate(editors)
    ]
    people = {
        graph: [Stubborn(f"{at}", editors, at, graph) for at in range(len(editors))]
        for graph in graphs
    }
    everybody = [each for some in people.values() for each in some]

    async def write(seconds: float, meanwhile: "asyncio.Task[None] | None" = None) -> None:
        until_then = asyncio.get_running_loop().time() + seconds
        while asyncio.get_running_loop().time() < until_then or (
            meanwhile and not meanwhile.done()
        ):
            random.choice(everybody).write()
            await asyncio.sleep(0.03)

    await write(2)
    happening = asyncio.create_task(fault())
    await write(8, happening)
    await happening
    await write(2)
    try:
        for graph, some in people.items():
            keys = set().union(*(each.written for each in some))
            await wait_until(lambda some=some, keys=keys: all(each.has(keys) for each in some), 90)
            contents = [dict(each.doc.get("meta", type=Map)) for each in some]
            assert contents[0] == contents[1] == contents[2]
            assert await replayed(database, graph) == contents[0]
    finally:
        for each in everybody:
            await each.aclose()
    journal = await Journal.open(database, branch="editor", fold=nothing, several=True)
    try:
        assert await journal.verify() == []
    finally:
        await journal.close()


async def replayed(database: str, graph: str) -> dict[str, Any]:
    """Return what the log says of a graph, each of whose updates has to be in it once."""
    journal = await Journal.open(database, branch="editor", fold=nothing, several=True)
    try:
        doc = Doc[Any]()
        seen: list[bytes] = []
        after = 0
        while page := await journal.read(f"graph/{graph}", after=after):
            after = page[-1].seq
            seen += [each.body for each in page]
        for body in seen:
            doc.apply_update(body)
        assert len(seen) == len(set(seen))
        return dict(doc.get("meta", type=Map))
    finally:
        await journal.close()


@pytest.mark.parametrize("fault", ["killed", "frozen", "ended"])
async def test_nothing_is_lost_or_doubled_when_an_editor_is(
    fault: str, tmp_path: Path, postgres: Server
) -> None:
    database = postgres.new_database()
    with several(tmp_path, database, 3) as editors:

        async def happen() -> None:
            victim = editors[0]
            match fault:
                case "killed":
                    victim.kill()
                    await asyncio.sleep(2)
                    victim.begin()
                    await asyncio.to_thread(victim.wait)
                case "frozen":
                    victim.process.send_signal(signal.SIGSTOP)
                    await asyncio.sleep(_FROZEN_S)
                    victim.process.send_signal(signal.SIGCONT)
                case _:
                    assert await asyncio.to_thread(victim.end) in {0, -signal.SIGTERM}
                    victim.begin()
                    await asyncio.to_thread(victim.wait)

        await lived_through(editors, happen, database)


def test_an_editor_with_another_token_is_refused(
    editors: list[OneOfSeveral], tmp_path: Path
) -> None:
    stranger = OneOfSeveral(tmp_path / "data", editors[0].database, 9)
    stranger.begin(ACTION_ASSISTANT_TOKEN="another-token-" + "0123456789abcdef" * 2)
    assert stranger.process.wait(60) == 2
    assert (
        "has another token. All editors of one database need the same token"
        in stranger.log.read_text()
    )


@pytest.mark.parametrize("is_copied", [False, True])
def test_an_editor_with_another_data_folder_is_refused(
    editors: list[OneOfSeveral], tmp_path: Path, is_copied: bool
) -> None:
    data = tmp_path / "data"
    if is_copied:
        shutil.copytree(editors[0].data, data)
    stranger = OneOfSeveral(data, editors[0].database, 9)
    stranger.begin()
    assert stranger.process.wait(60) == 2
    (said,) = stranger.log.read_text().strip().splitlines()
    assert f"does not find {data}/" in said
    assert "All editors of one database need the same data folder" in said
    assert all(each.process.poll() is None for each in editors)


async def test_an_ended_session_is_out_at_every_editor_also_without_the_database(
    editors: list[OneOfSeveral], postgres: Server
) -> None:
    one = editors[0]
    sent = {"token": BEARER["authorization"][7:], "name": "Ada"}
    async with httpx.AsyncClient(base_url=one.url, trust_env=False, timeout=30) as browser:
        origin = {"origin": one.url}
        assert (await browser.post("/api/session", json=sent, headers=origin)).is_success
        value = browser.cookies[f"aa_{one.port}"]

        async def statuses() -> set[int]:
            """Return what all editors say to this session."""
            found = set()
            for each in editors:
                cookie = {"cookie": f"aa_{each.port}={value}"}
                async with httpx.AsyncClient(base_url=each.url, trust_env=False) as other:
                    found.add((await other.get("/api/session", headers=cookie)).status_code)
            return found

        assert await statuses() == {200}
        postgres.stop()
        try:
            left = await browser.delete("/api/session", headers=origin)
            assert left.status_code == 204
            assert await statuses() == {401}
        finally:
            postgres.start()
    for each in editors:
        await asyncio.to_thread(each.wait)
