"""Folders of graphs: a graph lies in at most one, and no change of folders loses a graph."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from action_assistant.editor.app import open_services
from action_assistant.editor.catalogue.folders import DEPTH_LIMIT, Folder
from action_assistant.errors import Conflict, NotFound
from action_assistant.settings import EditorSettings
from editor.api.test_subgraphs import keys, line, made
from editor.process import running
from journal.servers import Server


@pytest.fixture(params=["sqlite", pytest.param("postgres", marks=pytest.mark.long)])
def client(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[httpx.Client]:
    """A program at an editor of its own, on either database."""
    server: Server | None = None
    if request.param == "postgres":
        server = request.getfixturevalue("postgres")
    database = server.new_database() if server is not None else None
    with running(tmp_path / "data", database) as editor, editor.client() as client:
        yield client


def folder(http: httpx.Client, name: str, parent: str | None = None) -> str:
    answer = http.post("/api/folders", json={"name": name, "parent": parent})
    assert answer.status_code == 201, answer.text
    found: str = answer.json()["id"]
    assert answer.headers["location"] == f"/api/folders/{found}"
    return found


def tree(http: httpx.Client) -> dict[str, tuple[str | None, int]]:
    """Return the parent of each folder and how many graphs it has, by its name."""
    folders = http.get("/api/folders").json()
    return {each["name"]: (each.get("parent"), each.get("graphs", 0)) for each in folders}


def place(http: httpx.Client, graph: str) -> str | None:
    listed = {each["id"]: each for each in http.get("/api/graphs").json()}
    found: str | None = http.get(f"/api/graphs/{graph}").json().get("folder")
    assert listed[graph].get("folder") == found
    return found


def test_folders_are_made_renamed_moved_and_removed_and_no_graph_is_lost(
    client: httpx.Client,
) -> None:
    graph = made(client, "Patrol", "Step")
    assert place(client, graph) is None
    assert client.get("/api/folders").json() == []
    lab = folder(client, "  The   lab ")
    night = folder(client, "Night", lab)
    filed = client.put(f"/api/graphs/{graph}/folder", json={"folder": night})
    assert (filed.status_code, filed.json()["folder"]) == (200, night)
    assert place(client, graph) == night
    assert tree(client) == {"The lab": (None, 0), "Night": (lab, 1)}

    assert client.patch(f"/api/folders/{lab}", json={"name": "Lab 2"}).json()["name"] == "Lab 2"
    away = folder(client, "Away")
    moved = client.put(f"/api/folders/{night}/parent", json={"parent": away})
    assert moved.json() == {"id": night, "name": "Night", "parent": away, "graphs": 1}
    assert tree(client) == {"Lab 2": (None, 0), "Away": (None, 0), "Night": (away, 1)}

    inner = folder(client, "Inner", night)
    assert client.delete(f"/api/folders/{night}").status_code == 204
    assert place(client, graph) == away
    assert tree(client)["Inner"] == (away, 0)
    assert client.delete(f"/api/folders/{away}").status_code == 204
    assert place(client, graph) is None
    assert tree(client) == {"Lab 2": (None, 0), "Inner": (None, 0)}
    assert client.put(f"/api/graphs/{graph}/folder", json={"folder": inner}).status_code == 200
    assert client.put(f"/api/graphs/{graph}/folder", json={"folder": None}).status_code == 200
    assert place(client, graph) is None


def test_a_deleted_graph_comes_back_where_its_folder_has_gone_meanwhile(
    client: httpx.Client,
) -> None:
    outer = folder(client, "Outer")
    inner = folder(client, "Inner", outer)
    answer = client.post("/api/graphs", params={"folder": inner}, json={"name": "task"})
    graph = answer.json()["id"]
    assert (answer.json()["folder"], tree(client)["Inner"]) == (inner, (outer, 1))
    client.delete(f"/api/graphs/{graph}")
    assert tree(client)["Inner"] == (outer, 0)
    (gone,) = client.get("/api/graphs", params={"deleted": True}).json()
    assert gone["folder"] == inner
    client.delete(f"/api/folders/{inner}")
    assert client.post(f"/api/graphs/{graph}/recover").json()["folder"] == outer


@pytest.mark.long
def test_what_is_refused_says_why_and_changes_nothing(client: httpx.Client) -> None:
    lab, other = folder(client, "Lab"), folder(client, "Other")
    graph = made(client, "Patrol", "Step")
    draft = client.post(f"/api/graphs/{graph}/drafts", json={"name": "try"}).json()["id"]
    action = client.post(
        "/api/actions", json={"name": "Look", "type": "sync", "instance_id": 0}
    ).json()["id"]
    before = client.get("/api/folders").json(), client.get("/api/graphs").json()

    def refused(method: str, path: str, body: Any, status: int, words: str) -> None:
        answer = client.request(method, path, json=body)
        assert (answer.status_code, words in answer.text) == (status, True), answer.text

    taken = "A folder of this name is there already."
    refused("POST", "/api/folders", {"name": "lAB"}, 409, taken)
    refused("PATCH", f"/api/folders/{other}", {"name": "Lab"}, 409, taken)
    refused("POST", "/api/folders", {"name": "  "}, 400, "1 to 100 characters")
    refused("POST", "/api/folders", {"name": "x" * 101}, 400, "1 to 100 characters")
    refused("POST", "/api/folders", {"name": "a/b"}, 400, "no slash")
    refused("POST", "/api/folders", {"name": "a\u202eb"}, 400, "no control characters")
    refused("POST", "/api/folders", {"name": "\u200b"}, 400, "no control characters")
    refused("POST", "/api/folders", {"name": "a", "parent": "nope"}, 404, "no folder 'nope'")
    refused("PUT", f"/api/folders/{lab}/parent", {"parent": lab}, 409, "cannot lie in itself")
    refused("PUT", f"/api/folders/{lab}/parent", {"parent": "nope"}, 404, "no folder 'nope'")
    refused("PUT", f"/api/folders/{lab}/parent", {}, 400, "parent")
    refused("PATCH", "/api/folders/nope", {"name": "a"}, 404, "no folder 'nope'")
    refused("DELETE", "/api/folders/nope", None, 404, "no folder 'nope'")
    refused("PUT", f"/api/graphs/{graph}/folder", {"folder": "nope"}, 404, "no folder 'nope'")
    refused("PUT", "/api/graphs/nope/folder", {"folder": lab}, 404, "no graph 'nope'")
    refused("PUT", f"/api/graphs/{draft}/folder", {"folder": lab}, 409, "A draft stays")
    refused("PUT", f"/api/graphs/{action}/folder", {"folder": lab}, 409, "lie in no folder")
    refused("POST", "/api/graphs?folder=nope", {"name": "a"}, 404, "no folder 'nope'")
    assert (client.get("/api/folders").json(), client.get("/api/graphs").json()) == before

    deepest = lab
    for number in range(DEPTH_LIMIT - 1):
        deepest = folder(client, f"{number}", deepest)
    refused("POST", "/api/folders", {"name": "a", "parent": deepest}, 409, "At most 8")
    refused("PUT", f"/api/folders/{lab}/parent", {"parent": deepest}, 409, "in itself")
    refused("PUT", f"/api/folders/{lab}/parent", {"parent": other}, 409, "At most 8")


def test_a_graph_made_of_another_lies_in_the_same_folder(client: httpx.Client) -> None:
    lab = folder(client, "Lab")
    graph = client.post("/api/graphs", json=line("Outer", "A", "B", "C")).json()["id"]
    client.put(f"/api/graphs/{graph}/folder", json={"folder": lab})
    wanted = {"actions": [keys(client, graph)["B"]], "name": "Inner"}
    inner = client.post(f"/api/graphs/{graph}/subgraphs", json=wanted)
    assert (inner.status_code, inner.json()["graph"]["folder"]) == (201, lab), inner.text
    draft = client.post(f"/api/graphs/{graph}/drafts", json={"name": "try"}).json()["id"]
    for each in (graph, draft):
        at = client.get(f"/api/graphs/{each}").json()["seq"]
        flat = client.post(f"/api/graphs/{each}/flat", json={"seq": at, "name": "Flat"})
        assert (flat.status_code, flat.json()["folder"]) == (201, lab), flat.text


class Moves:
    """Any changes of folders, asked by several people at once."""

    names = st.sampled_from(["a", "b", "c"])
    places = st.integers(-1, 5)
    one = st.one_of(
        st.tuples(st.just("make"), names, places),
        st.tuples(st.just("rename"), names, places),
        st.tuples(st.just("move"), places, places),
        st.tuples(st.just("remove"), places),
        st.tuples(st.just("file"), st.integers(0, 2), places),
    )
    some = st.lists(st.lists(one, min_size=1, max_size=4), max_size=6)


@settings(deadline=None, max_examples=40)
@given(batches=Moves.some)
def test_folders_stay_a_tree_with_every_graph_whoever_changes_them_at_once(
    tmp_path_factory: pytest.TempPathFactory, batches: list[list[tuple[Any, ...]]]
) -> None:
    asyncio.run(_changed_at_once(tmp_path_factory.mktemp("folders"), batches))


async def _changed_at_once(data: Path, batches: list[list[tuple[Any, ...]]]) -> None:
    options = EditorSettings(data=data, database=f"sqlite:///{data / 'editor.db'}")
    async with open_services(options) as services:
        folders = services.folders
        graphs = [(await services.catalogue.create(b'{"name":"g"}', "ada"))[0].id for _ in "abc"]
        made: list[str] = []

        def at(number: int) -> str | None:
            return made[number % len(made)] if made and number >= 0 else None

        async def one(step: tuple[Any, ...]) -> None:
            try:
                match step:
                    case ("make", name, parent):
                        made.append((await folders.make(name, at(parent), "ada")).id)
                    case ("rename", name, folder):
                        await folders.rename(at(folder) or "", name, "ada")
                    case ("move", folder, parent):
                        await folders.move(at(folder) or "", at(parent), "ada")
                    case ("remove", folder):
                        await folders.remove(at(folder) or "", "ada")
                    case ("file", graph, folder):
                        await folders.file(graphs[graph], at(folder), "ada")
            except (NotFound, Conflict):
                pass

        removed = False
        for batch in [*batches, []]:
            await asyncio.gather(*map(one, batch))
            removed = removed or any(step[0] == "remove" for step in batch)
            known = {each.id: each for each in await folders.all()}
            assert all(_is_tree(known, each) for each in known.values())
            views = [await services.catalogue.get(graph) for graph in graphs]
            assert all(view.folder is None or view.folder in known for view in views)
            filed = sum(view.folder is not None for view in views)
            assert sum(each.graphs for each in known.values()) == filed
            beside = {(each.parent, each.name) for each in known.values()}
            assert removed or len(beside) == len(known)  # a removal may bring two together
        await services.journal.rebuild()
        assert {each.id: each for each in await folders.all()} == known
        assert [await services.catalogue.get(graph) for graph in graphs] == views


def _is_tree(known: dict[str, Folder], folder: Folder) -> bool:
    """Return whether the way from a folder upwards ends."""
    for _ in range(DEPTH_LIMIT):
        if folder.parent is None:
            return True
        folder = known[folder.parent]
    return False
