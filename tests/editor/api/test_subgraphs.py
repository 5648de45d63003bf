"""Graphs inside of graphs over HTTP: told, played, and pinned by versions."""

import io
import json
import zipfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path
from typing import Any

import httpx
import pytest

from action_assistant.umrf.digest import digest, tree_digest
from action_assistant.umrf.files import codec
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


def graph_file(name: str, *actions: str, exits: bool = True) -> dict[str, Any]:
    """Actions that stand beside each other."""
    ends = [{"name": each, "instance_id": 0} for each in actions]
    return {
        "graph_name": name,
        "graph_entry": ends,
        "graph_exit": ends if exits else [],
        "actions": [{"name": each, "type": "sync", "instance_id": 0} for each in actions],
    }


def made(http: httpx.Client, *names: str, **more: Any) -> str:
    answer = http.post("/api/graphs", json=graph_file(*names, **more))
    assert answer.status_code == 201, answer.text
    found: str = answer.json()["id"]
    return found


def codes(http: httpx.Client, graph: str) -> list[str]:
    found = http.get(f"/api/graphs/{graph}/problems").json()["problems"]
    return sorted(each["code"] for each in found)


def published(http: httpx.Client, graph: str, **body: Any) -> httpx.Response:
    return http.post(f"/api/graphs/{graph}/versions", json=body)


def rewritten(http: httpx.Client, graph: str, text: dict[str, Any]) -> httpx.Response:
    seq = http.get(f"/api/graphs/{graph}").json()["seq"]
    return http.put(f"/api/graphs/{graph}/umrf", params={"seq": seq}, json=text)


def test_a_graph_inside_is_told_played_and_pinned(client: httpx.Client) -> None:
    inner = made(client, "Inner", "Step", exits=False)
    outer = made(client, "Outer", "Inner")
    assert codes(client, outer) == ["H8"]
    listed = {each["id"]: each for each in client.get("/api/graphs").json()}
    assert (listed[outer]["problems"], listed[outer]["wrong"]) == ({"error": 1, "warning": 0}, 1)
    preview = client.post(
        "/api/graphs", params={"preview": True}, json=graph_file("Other", "Inner")
    ).json()
    assert [each["code"] for each in preview["problems"]] == ["H8"]

    changed = rewritten(client, inner, graph_file("Inner", "Step"))
    assert (changed.status_code, changed.json()["problems"]) == (200, [])
    assert codes(client, outer) == []
    listed = {each["id"]: each for each in client.get("/api/graphs").json()}
    assert listed[outer]["problems"] == {"error": 0, "warning": 0}

    played = client.post(f"/api/graphs/{outer}/rehearsal", json={}).json()["trace"]
    inside = [each for each in played if each["graph"] == "Outer__Inner__0"]
    assert [each["node"] for each in inside if each["kind"] == "node_result"] == ["Step_0"]

    inside = client.get(f"/api/graphs/{outer}/subgraphs").json()
    assert [(each["name"], each["graph"]) for each in inside["subgraphs"]] == [("Inner", inner)]
    answer = published(client, outer)
    assert answer.status_code == 201
    assert answer.json()["tree_digest"] == inside["tree_digest"]
    version = answer.json()
    (pinned,) = version["subgraphs"]
    reading = codec.read(json.dumps(pinned["umrf"]).encode())
    assert (pinned["name"], pinned["graph"], pinned["version"]) == ("Inner", inner, None)
    assert pinned["digest"] == pinned["current_digest"] == digest(reading.graph)
    assert version["tree_digest"] == tree_digest(version["digest"], [("Inner", pinned["digest"])])
    assert client.get(f"/api/versions/{version['id']}").json() == version
    (shown,) = client.get(f"/api/graphs/{outer}/versions").json()
    assert (shown["tree_digest"], "subgraphs" in shown) == (version["tree_digest"], False)
    assert published(client, outer).status_code == 200


def test_a_version_stays_and_tells_that_a_graph_inside_has_moved_on(client: httpx.Client) -> None:
    inner = made(client, "Inner", "Step")
    outer = made(client, "Outer", "Inner")
    of_inner = published(client, inner).json()
    assert (of_inner["subgraphs"], of_inner["tree_digest"]) == ([], of_inner["digest"])
    first = published(client, outer).json()
    assert [each["version"] for each in first["subgraphs"]] == [of_inner["id"]]
    rewritten(client, inner, graph_file("Inner", "Step", "Turn"))
    again = client.get(f"/api/versions/{first['id']}").json()
    (before,), (now,) = first["subgraphs"], again["subgraphs"]
    assert now["current_digest"] != now["digest"] == before["digest"]
    assert now["umrf"] == before["umrf"]
    second = published(client, outer)
    assert second.status_code == 201  # the outer graph is as it was, what is inside of it is not
    assert second.json()["digest"] == first["digest"]
    assert second.json()["tree_digest"] != first["tree_digest"]
    client.delete(f"/api/graphs/{inner}")
    (gone,) = client.get(f"/api/versions/{first['id']}").json()["subgraphs"]
    assert (gone["umrf"], gone["current_digest"]) == (before["umrf"], None)


def test_a_version_pins_all_levels(client: httpx.Client) -> None:
    made(client, "Grip", "Close")
    made(client, "Fetch", "Grip", "Lift")
    outer = made(client, "Task", "Fetch")
    version = published(client, outer).json()
    assert [each["name"] for each in version["subgraphs"]] == ["Fetch", "Grip"]


def test_a_graph_with_those_inside_is_made_one_that_does_the_same(client: httpx.Client) -> None:
    inner = made(client, "Inner", "Step")
    outer = made(client, "Outer", "Inner")
    flat = client.get(f"/api/graphs/{outer}/flat").json()
    assert [each["name"] for each in flat["umrf"]["actions"]] == ["Step"]
    assert flat["umrf"]["graph_name"] == "Outer"
    (origin,) = flat["origins"]
    assert [each["graph"] for each in origin["levels"]] == ["Outer", "Inner"]
    wanted = {"seq": flat["seq"], "name": "Flat"}
    copy = client.post(f"/api/graphs/{outer}/flat", json=wanted)
    assert copy.status_code == 201, copy.text
    umrf = client.get(f"/api/graphs/{copy.json()['id']}/umrf").json()
    assert (umrf["graph_name"], len(umrf["actions"])) == ("Flat", 1)
    assert "Made of Outer" in umrf["graph_description"]
    assert codes(client, copy.json()["id"]) == []

    rewritten(client, inner, graph_file("Inner", "Step", exits=False))
    refused = client.get(f"/api/graphs/{outer}/flat").json()
    assert refused["umrf"] is None
    (reason,) = refused["reasons"]
    assert (reason["code"], [each["action"] for each in reason["at"]]) == (
        "never-ends",
        ["Inner_0"],
    )
    assert client.post(f"/api/graphs/{outer}/flat", json=wanted).status_code == 409
    assert client.get("/api/graphs/nowhere/flat").status_code == 404


def line(name: str, *actions: str) -> dict[str, Any]:
    """Actions one after another."""
    ends = [{"name": each, "instance_id": 0} for each in actions]
    pairs = list(pairwise(ends))
    return {
        "graph_name": name,
        "graph_entry": ends[:1],
        "graph_exit": ends[-1:],
        "gui_attributes": {"labels": ["night"]},
        "actions": [
            {
                **end,
                "type": "sync",
                "parents": [one for one, two in pairs if two is end],
                "children": [two for one, two in pairs if one is end],
            }
            for end in ends
        ],
    }


def keys(http: httpx.Client, graph: str) -> dict[str, str]:
    """The keys of a graph's actions, by name."""
    seq = http.get(f"/api/graphs/{graph}").json()["seq"]
    document = http.get(f"/api/graphs/{graph}/document", params={"at": seq}).json()
    actions = document["actions"] if "actions" in document else document["maps"]["actions"]
    return {name: key for key, name in actions.items() if "|" not in key}


def changed(http: httpx.Client, graph: str, look: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The root maps of a graph once a page has made these changes."""
    answer = http.get(f"/api/graphs/{graph}/document", params={"at": look["seq"]}).json()
    maps: dict[str, dict[str, Any]] = answer.get("maps", answer)
    for change in look["changes"]:
        assert maps[change["root"]].get(change["key"]) == change.get("before")
        if "after" in change:
            maps[change["root"]][change["key"]] = change["after"]
        else:
            del maps[change["root"]][change["key"]]
    return maps


def test_actions_become_a_graph_of_their_own_and_are_unpacked_again(client: httpx.Client) -> None:
    outer = client.post("/api/graphs", json=line("Task", "A", "B", "C", "D")).json()["id"]
    known = keys(client, outer)
    wanted = {"actions": [known["B"], known["C"]], "name": " Middle "}
    look = client.post(f"/api/graphs/{outer}/extraction", json=wanted).json()
    assert (look["differences"], look["reasons"]) == ([], [])
    assert [each["name"] for each in look["umrf"]["actions"]] == ["B", "C"]
    answer = client.post(f"/api/graphs/{outer}/subgraphs", json=wanted | {"seq": look["seq"]})
    assert answer.status_code == 201, answer.text
    made_graph = answer.json()["graph"]
    assert (made_graph["name"], made_graph["labels"]) == ("Middle", ["night"])
    assert keys(client, outer) == known  # the page makes these changes
    maps = changed(client, outer, answer.json() | {"seq": look["seq"]})
    names = {value for key, value in maps["actions"].items() if "|" not in key}
    assert names == {"A", "Middle", "D"}
    assert not any(known["B"] in key for fields in maps.values() for key in fields)

    client.post("/api/graphs", json=line("Round", "A", "Middle", "D"))
    again = client.post("/api/graphs", json=line("Again", "A", "Middle", "D")).json()["id"]
    key = keys(client, again)["Middle"]
    back = client.post(f"/api/graphs/{again}/unpacking", json={"action": key}).json()
    assert (back["inside"], back["differences"], back["reasons"]) == (made_graph["id"], [], [])
    maps = changed(client, again, back)
    names = {value for key, value in maps["actions"].items() if "|" not in key}
    assert names == {"A", "B", "C", "D"}
    assert {maps["actions"][key]: key for key in back["actions"]} == {
        name: known[name] for name in "BC"
    }
    assert keys(client, made_graph["id"]) == {name: known[name] for name in "BC"}


def test_actions_that_use_a_renamed_graph_follow_by_one_edit_for_each_graph(
    client: httpx.Client,
) -> None:
    inner = made(client, "Lift", "A")
    uses = [made(client, "Round", "Lift", "B"), made(client, "Other", "Lift")]
    stranger = made(client, "Stranger", "C")
    before = [keys(client, graph) for graph in uses]
    assert client.patch(f"/api/graphs/{inner}", json={"name": "LiftSafely"}).status_code == 200
    seqs = [client.get(f"/api/graphs/{graph}").json()["seq"] for graph in uses]
    body = {"before": "Lift", "name": "LiftSafely", "graphs": [*uses, stranger]}
    answer = client.post(f"/api/graphs/{inner}/uses", json=body)
    assert (answer.status_code, answer.json()) == (200, {"changed": uses})
    for graph, was, seq in zip(uses, before, seqs, strict=True):
        assert keys(client, graph)["LiftSafely"] == was["Lift"]
        assert client.get(f"/api/graphs/{graph}").json()["seq"] == seq + 1
        inside = client.get(f"/api/graphs/{graph}/subgraphs").json()["subgraphs"]
        assert [each["graph"] for each in inside] == [inner]
    again = client.post(f"/api/graphs/{inner}/uses", json=body)
    assert again.json() == {"changed": []}
    gone = client.post(f"/api/graphs/{inner}/uses", json=body | {"graphs": [uses[0], "nowhere"]})
    assert gone.status_code == 404


def test_one_of_several_people_who_make_a_graph_of_one_name_at_once_succeeds(
    client: httpx.Client,
) -> None:
    tasks = [
        client.post("/api/graphs", json=line(f"T{i}", "A", "B", "C")).json()["id"] for i in range(4)
    ]

    def make(task: str) -> int:
        body = {"actions": [keys(client, task)["B"]], "name": "Same"}
        return client.post(f"/api/graphs/{task}/subgraphs", json=body).status_code

    with ThreadPoolExecutor() as people:
        assert sorted(people.map(make, tasks)) == [201, 409, 409, 409]


def test_an_impossible_selection_or_a_used_name_is_refused(client: httpx.Client) -> None:
    made(client, "Inner", "Step")
    outer = client.post("/api/graphs", json=line("Task", "A", "B", "C")).json()["id"]
    known = keys(client, outer)

    def asked(route: str, *actions: str, **more: Any) -> httpx.Response:
        body = {"actions": [known.get(each, each) for each in actions], "name": "New", **more}
        return client.post(f"/api/graphs/{outer}/{route}", json=body)

    assert [r["code"] for r in asked("extraction", "B", name="Inner").json()["reasons"]] == ["name"]
    assert asked("subgraphs", "B", name="Inner").status_code == 409
    assert asked("subgraphs", "nobody").status_code == 409
    assert asked("extraction", "B", name="").status_code == 400
    spontaneous = line("Odd", "A", "B", "C")
    spontaneous["actions"][1]["type"] = "spontaneous"
    outer = client.post("/api/graphs", json=spontaneous).json()["id"]
    known = keys(client, outer)
    assert asked("extraction", "B").json()["differences"][0]["code"] == "spontaneous"
    assert asked("subgraphs", "B").status_code == 409
    assert asked("subgraphs", "B", otherwise=True).status_code == 201
    for key, status in ((known["A"], 404), ("nobody", 404)):
        body = {"action": key}
        assert client.post(f"/api/graphs/{outer}/unpacking", json=body).status_code == status


def test_the_graphs_inside_come_as_files_that_an_engine_indexes(client: httpx.Client) -> None:
    made(client, "Grip it", "Step")
    made(client, "grip_it", "Step", "Stride")
    made(client, "Fetch", "Grip it", "grip_it")
    outer = made(client, "Outer", "Fetch")
    answer = client.get(f"/api/graphs/{outer}/subgraphs.zip")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "application/zip")
    told = client.get(f"/api/graphs/{outer}/subgraphs").json()
    with zipfile.ZipFile(io.BytesIO(answer.content)) as file:
        texts = {name: file.read(name) for name in file.namelist()}
    assert sorted(texts) == [
        "Fetch.umrf.graph.json", "Grip_it.umrf.graph.json", "grip_it-2.umrf.graph.json"
    ]  # fmt: skip
    # Files that an engine takes for actions have another ending.
    assert all("graph.json" in name and "umrf.json" not in name for name in texts)
    graphs = [codec.read(text).graph for text in texts.values()]
    assert {each.name: digest(each) for each in graphs} == {
        each["name"]: each["digest"] for each in told["subgraphs"]
    }
    assert client.get(f"/api/graphs/{outer}/subgraphs.zip").content == answer.content
    leaf = made(client, "Leaf", "Step")
    with zipfile.ZipFile(
        io.BytesIO(client.get(f"/api/graphs/{leaf}/subgraphs.zip").content)
    ) as file:
        assert file.namelist() == []
    assert client.get("/api/graphs/none/subgraphs.zip").status_code == 404
