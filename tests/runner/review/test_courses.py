"""Expected courses over HTTP: held against a graph, with what they cover, and proposed."""

import json
from typing import Any

import httpx
import msgspec
import pytest

from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Conditions, Graph
from runner.harness import order, sequence
from runner.process import RunnerProcess, over, started

FAST = {"behaviours": {"*": [{"after_s": 0.02}]}}


def text_of(graph: Graph) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(codec.write(graph, codec.Stamp("g1", None, None)))
    return found


def checked(client: httpx.Client, graph: Graph, of: str = "g1") -> dict[str, Any]:
    answer = client.post("/api/expectations/check", json={"graph": of, "umrf": text_of(graph)})
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def expect(client: httpx.Client, name: str, graph: Graph, script: dict[str, Any]) -> httpx.Response:
    body = {"name": name, "graph": "g1", "umrf": text_of(graph), "script": script}
    return client.post("/api/expectations", json=body)


def renamed(graph: Graph, **names: str) -> Graph:
    actions = tuple(
        msgspec.structs.replace(each, name=names.get(each.full_name, each.name))
        for each in graph.actions
    )
    return msgspec.structs.replace(graph, actions=actions)


def without_last_arrow(graph: Graph) -> Graph:
    """The second action begins no other any more."""
    last = graph.actions[-1].key
    arrows = [each for each in graph.relations if each.child != last]
    return msgspec.structs.replace(graph, relations=tuple(arrows))


@pytest.fixture
def empty(process: RunnerProcess) -> Any:
    """A client of a runner that expects nothing of the graph g1."""
    with process.client() as client:
        yield client
        for each in client.get("/api/expectations").json():
            client.delete(f"/api/expectations/{each['name']}")


def test_a_dry_run_is_expected_and_held_against_the_graph_as_it_is_now(
    empty: httpx.Client,
) -> None:
    plan = sequence()
    saved = expect(empty, "goes well", plan, FAST)
    assert saved.status_code == 201, saved.text
    assert saved.json()["run"] == ""
    (same,) = checked(empty, plan)["courses"]
    assert (same["name"], same["same"], same["why"]) == ("goes well", True, "")
    (other,) = checked(empty, without_last_arrow(plan))["courses"]
    assert other["same"] is False
    assert "Work_2" in other["why"]
    assert checked(empty, plan, of="another")["courses"] == []


def test_an_action_that_is_called_otherwise_still_does_what_it_did(empty: httpx.Client) -> None:
    plan = sequence()
    script = {"behaviours": {"Work_1": [{"after_s": 0.1, "result": "on_error"}]}}
    assert expect(empty, "the second fails", plan, script).status_code == 201
    (found,) = checked(empty, renamed(plan, Work_1="Grip"))["courses"]
    assert found["same"] is True, found["why"]


def test_a_run_is_expected_of_its_graph_like_a_dry_run(empty: httpx.Client) -> None:
    plan = sequence("measured")
    run = over(empty, started(empty, order(plan, graph="g1", script=FAST["behaviours"]))["id"])
    body = {"run": run["id"], "name": "as it ran"}
    saved = empty.post("/api/expectations", json=body)
    assert saved.status_code == 201, saved.text
    (found,) = checked(empty, plan)["courses"]
    assert (found["run"], found["same"]) == (run["id"], True)


def test_uncovered_arrows_are_listed_and_a_failing_course_covers_none(
    empty: httpx.Client,
) -> None:
    plan = sequence()
    assert checked(empty, plan)["coverage"]["taken"] == 0
    assert expect(empty, "goes well", plan, FAST).status_code == 201
    found = checked(empty, plan)["coverage"]
    untaken = {each["outcome"] for each in found["untaken"]}
    assert found["taken"] + len(found["untaken"]) == found["arrows"]
    assert "on_true" not in untaken
    assert (found["visited"], found["unvisited"]) == (found["actions"], [])
    assert checked(empty, without_last_arrow(plan))["coverage"]["taken"] == 0


def test_a_proposed_test_takes_the_arrow_that_none_took(empty: httpx.Client) -> None:
    first, *others = sequence().relations
    plan = msgspec.structs.replace(
        sequence(),
        relations=(
            first,
            *(msgspec.structs.replace(r, conditions=Conditions("run", "run")) for r in others),
        ),
    )
    assert expect(empty, "goes well", plan, FAST).status_code == 201
    untaken = checked(empty, plan)["coverage"]["untaken"]
    assert untaken
    for number, arrow in enumerate(untaken):
        body = {"umrf": text_of(plan), "arrow": arrow}
        found = empty.post("/api/expectations/proposal", json=body)
        assert found.status_code == 200, found.text
        assert found.json()["verdict"] == "reached"
        saved = expect(empty, f"proposed {number}", plan, found.json()["script"])
        assert saved.status_code == 201, saved.text
    covered = checked(empty, plan)["coverage"]
    assert covered["untaken"] == []
    assert covered["taken"] == covered["arrows"]


def test_an_arrow_that_no_script_can_take_is_unreachable(empty: httpx.Client) -> None:
    plan = without_last_arrow(sequence())
    last = plan.actions[-1].key
    arrow = {"parent": last, "child": "exit", "outcome": "on_true"}
    found = empty.post("/api/expectations/proposal", json={"umrf": text_of(plan), "arrow": arrow})
    assert found.json()["verdict"] == "unreachable"


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ({"name": " "}, "/name"),
        ({"script": {"behaviours": {"A": []}}}, "/script"),
        ({"script": 7}, "/script"),
        ({"umrf": {"graph_name": "x", "actions": 5}}, "/umrf"),
        ({"graph": 7}, "/graph"),
    ],
)
def test_an_invalid_expectation_is_refused_with_its_place(
    empty: httpx.Client, change: dict[str, Any], path: str
) -> None:
    body = {"name": "x", "graph": "g1", "umrf": text_of(sequence()), "script": FAST} | change
    answer = empty.post("/api/expectations", json=body)
    assert answer.status_code in {400, 422}, answer.text
    assert answer.json()["where"]["path"].startswith(path)
    assert empty.get("/api/expectations").json() == []


def test_an_arrow_that_is_not_there_is_refused(empty: httpx.Client) -> None:
    arrow = {"parent": "nobody", "child": "exit", "outcome": "on_true"}
    body = {"umrf": text_of(sequence()), "arrow": arrow}
    answer = empty.post("/api/expectations/proposal", json=body)
    assert (answer.status_code, answer.json()["where"]["path"]) == (400, "/arrow")


def test_the_look_before_a_start_warns_of_a_course_that_is_another_and_blocks_nothing(
    empty: httpx.Client,
) -> None:
    plan = sequence()
    assert expect(empty, "goes well", plan, FAST).status_code == 201

    def item(graph: Graph) -> dict[str, Any]:
        body = {"umrf": text_of(graph), "engines": ["simulator"], "graph": "g1"}
        (look,) = empty.post("/api/preflight", json=body).json()
        assert look["never"] is False
        (found,) = [each for each in look["items"] if each["code"] == "courses"]
        return dict(found)

    assert item(plan)["verdict"] == "passed"
    warned = item(without_last_arrow(plan))
    assert warned["verdict"] == "warned"
    assert "goes well: Step " in warned["text"]
