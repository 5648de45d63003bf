"""The list of graphs shows robots, labels and present people of each graph."""

import asyncio
import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.editor.app import open_services
from action_assistant.editor.catalogue import catalogue, graph_facts
from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.crdt import messages
from action_assistant.editor.documents.contents import labels_of
from action_assistant.editor.log.graph_events import graph_stream
from action_assistant.editor.services import EditorServices
from action_assistant.settings import EditorSettings
from action_assistant.umrf.model import Graph
from action_assistant.umrf.problem_kinds import ProblemCounts
from action_assistant.web.workers.lanes import GaveUp
from editor.api.test_api import NAV
from editor.client import Client

texts = st.one_of(st.text(max_size=8), st.none(), st.integers())


def test_robots_and_labels_are_those_of_the_file(http: httpx.Client) -> None:
    actions = [
        {**action, "actor": robot} for action, robot in zip(NAV["actions"], "ba", strict=True)
    ]
    attributes = {"labels": ["night", "night", " demo "], "zoom": 1.50}
    body = {**NAV, "actions": actions, "gui_attributes": attributes}
    made = http.post("/api/graphs", json=body).json()
    assert (made["robots"], made["labels"]) == (["a", "b"], ["night", "demo"])
    (listed,) = [each for each in http.get("/api/graphs").json() if each["id"] == made["id"]]
    assert (listed["robots"], listed["labels"]) == (["a", "b"], ["night", "demo"])
    again = http.get(f"/api/graphs/{made['id']}/umrf").json()
    assert again["gui_attributes"]["labels"] == attributes["labels"]


def counts(view: dict[str, Any]) -> tuple[int, int]:
    return view["wrong"], view["to_fill_in"]


def test_faults_and_missing_values_are_counted_apart(http: httpx.Client) -> None:
    point = {"at": {axis: {"pvf_type": "number"} for axis in "xyz"}}
    first, *others = NAV["actions"]
    made = http.post(
        "/api/graphs", json={**NAV, "actions": [{**first, "input_parameters": point}, *others]}
    ).json()
    empty = http.post("/api/graphs", json={"name": "empty"}).json()
    listed = {each["id"]: each for each in http.get("/api/graphs").json()}
    assert counts(listed[made["id"]]) == counts(made) == (1, 1)
    assert counts(listed[empty["id"]]) == (0, 1)
    found = http.get(f"/api/graphs/{made['id']}/problems").json()["problems"]
    assert [each["code"] for each in found].count("H7") == 3 < made["problems"]["error"]
    http.patch(f"/api/graphs/{empty['id']}", json={"name": "renamed", "description": "d"})
    assert counts(http.get(f"/api/graphs/{empty['id']}").json()) == (0, 1)


async def test_a_graph_that_did_not_change_is_not_checked_again(tmp_path: Path) -> None:
    settings = EditorSettings(data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}")
    asked: list[str] = []

    async def counting(work: Any, /, *values: Any) -> Any:
        asked.append(work.__name__)
        return work(*values)

    async with open_services(settings) as services:
        made, _ = await services.catalogue.bring(json.dumps(NAV).encode(), "ada")
        reader = GraphReader(services.journal, services.rooms, counting)
        checks = GraphChecks(services.journal, services.rooms, reader)
        summaries = [await checks.summary(made.id, made.seq) for _ in range(3)]
    assert asked.count("info") == 1
    assert {summary.told for summary in summaries} == {ProblemCounts(made.wrong, made.to_fill_in)}


def _watched(services: EditorServices) -> list[str]:
    """Return a list to which the name of each piece of work is added that a worker does for graphs."""
    asked: list[str] = []
    given = services.graph_reader._run_in_worker

    async def watching(work: Any, /, *values: Any) -> Any:
        asked.append(work.__name__)
        return await given(work, *values)

    services.graph_reader._run_in_worker = watching
    return asked


async def test_after_a_restart_the_list_reads_no_document(tmp_path: Path) -> None:
    settings = EditorSettings(data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}")
    async with open_services(settings) as services:
        await services.catalogue.bring(json.dumps(NAV).encode(), "ada")
        before = await services.catalogue.all()
    async with open_services(settings) as services:
        asked = _watched(services)
        assert await services.catalogue.all() == before
        assert asked == []


async def test_facts_that_another_version_computed_give_names_and_no_problems(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = EditorSettings(data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}")
    async with open_services(settings) as services:
        made, _ = await services.catalogue.bring(json.dumps(NAV).encode(), "ada")
        now = await services.catalogue.all()
    monkeypatch.setattr(graph_facts, "form", lambda: b"another")
    async with open_services(settings) as services:
        asked = _watched(services)
        await services.graph_checks.names.refresh()
        assert services.graph_checks.names.called(made.name) == [made.id]
        assert asked == []
        assert await services.catalogue.all() == now
        assert "info" in asked


async def test_a_list_of_many_unknown_graphs_comes_at_once_and_is_completed_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = EditorSettings(data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}")
    async with open_services(settings) as services:
        for number in range(3):
            body = json.dumps({**NAV, "graph_name": f"graph {number}"}).encode()
            await services.catalogue.bring(body, "ada")
        now = await services.catalogue.all()
    monkeypatch.setattr(graph_facts, "form", lambda: b"another")
    monkeypatch.setattr(catalogue, "READ_FOR_A_LIST", 1)
    async with open_services(settings) as services:
        first = await services.catalogue.all()
        assert [view.name for view in first] == [view.name for view in now]
        assert sum(view.problems is not None for view in first) <= 1
        await services.graph_checks.computed()
        assert await services.catalogue.all() == now


@given(st.one_of(st.lists(texts), texts, st.dictionaries(st.text(max_size=3), texts)))
def test_labels_that_are_none_are_left_out(value: object) -> None:
    attributes = json.dumps({"labels": value})
    labels = labels_of(Graph(name="g", extra=(("gui_attributes", attributes),)))
    assert all(label.strip() == label and label for label in labels)
    assert len(set(labels)) == len(labels) <= 20


async def test_the_list_says_who_is_in_a_graph_now(tmp_path: Path) -> None:
    settings = EditorSettings(data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}")
    async with open_services(settings) as services:
        made, _ = await services.catalogue.bring(json.dumps(NAV).encode(), "ada")
        async with services.rooms.enter(graph_stream(made.id)) as room:
            here = [Client("mari"), Client("ada"), Client("ada")]
            for number, client in enumerate(here, start=1):
                client.join(room)
                client.deliver(messages.presence([messages.PresenceEntry(number, 1, b"{}")]))
            await asyncio.sleep(0)
            view = await services.catalogue.get(made.id)
            assert [person.name for person in view.people] == ["Ada", "Mari"]
            here[0].leave()
            view = await services.catalogue.get(made.id)
            assert [person.name for person in view.people] == ["Ada"]
            for client in here[1:]:
                client.leave()
        assert (await services.catalogue.get(made.id)).people == ()


@pytest.mark.parametrize(
    "fault", [GaveUp("This took longer than it may."), RecursionError("too deep"), KeyError("name")]
)
async def test_a_graph_of_which_nothing_can_be_found_out_stays_in_the_list_with_the_others(
    tmp_path: Path, fault: Exception
) -> None:
    settings = EditorSettings(data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}")
    async with open_services(settings) as services:
        made, _ = await services.catalogue.bring(json.dumps(NAV).encode(), "ada")
        others = {view.id for view in await services.catalogue.all()} - {made.id}
    with closing(sqlite3.connect(tmp_path / "editor.db")) as database, database:
        database.execute("DELETE FROM graph_facts")
    async with open_services(settings) as services:
        asked = services.graph_reader._run_in_worker

        async def ask(work: Any, *values: Any) -> Any:
            if getattr(values[0], "graph", "") == made.id:
                raise fault
            return await asked(work, *values)

        services.graph_reader._run_in_worker = ask
        views = {view.id: view for view in await services.catalogue.all()}
        assert views.keys() == others | {made.id}
        assert (views[made.id].name, views[made.id].problems) == (made.name, None)
        assert all(views[other].problems is not None for other in others)
        assert made.id.encode() not in await services.library.all()
        await services.graph_checks.names.refresh()
        assert not services.graph_checks.names.is_taken(made.name)
        assert services.graph_checks.names.of_graphs(views[other].name for other in others)
