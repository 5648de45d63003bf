"""A run is repeated with another version of its graph, and its parameters are told as they were."""

import json
from typing import Any

import msgspec
import pytest

from action_assistant.runner.analysis.expected_runs import Recorded, fitted, recorded
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph, Parameter
from runner.analysis.test_compare import PLAN, went
from runner.execution.test_opened_levels import MIXED, opened
from runner.harness import order, sequence
from runner.process import RunnerProcess, over, started

RUN, _ = went(1, ("Work_0", "false"), ("Work_1", "error"), said="gripper jammed")


def renamed(graph: Graph, **names: str) -> Graph:
    actions = tuple(
        msgspec.structs.replace(each, name=names.get(each.full_name, each.name))
        for each in graph.actions
    )
    return msgspec.structs.replace(graph, actions=actions)


def outcomes(found: Recorded) -> dict[str, Any]:
    return {name: [call["result"] for call in calls] for name, calls in found.behaviours.items()}


def test_an_action_of_the_newest_version_does_what_it_did_under_its_old_name() -> None:
    found = fitted(recorded(RUN), RUN, renamed(PLAN, Work_1="Grip"))
    assert outcomes(found) == {"Work_0": ["on_false"], "Grip_1": ["on_error"]}
    assert found.doubts == []


def test_doubts_of_a_script_for_the_newest_version_are_listed() -> None:
    newest = sequence(actions=3)
    fewer = msgspec.structs.replace(newest, actions=newest.actions[1:])
    found = fitted(recorded(RUN), RUN, fewer)
    assert outcomes(found) == {"Work_1": ["on_error"]}
    assert [doubt.action for doubt in found.doubts] == ["Work_2", "Work_0"]


def test_what_is_inside_of_a_renamed_action_does_in_the_newest_version_what_it_did() -> None:
    inner = msgspec.structs.replace(RUN.actions["Work_1"], aid=None)
    named = f"{RUN.graph_name}__Work__0/Grip_3"
    deeper = f"{RUN.graph_name}__Work__0__Grip__3/Close_1"
    actions = RUN.actions | {named: inner, deeper: inner}
    run = msgspec.structs.replace(RUN, actions=actions)
    newest = msgspec.structs.replace(renamed(PLAN, Work_0="Reach"), name="other")
    found = fitted(recorded(run), run, newest)
    assert outcomes(found) == {
        "Reach_0": ["on_false"],
        "Work_1": ["on_error"],
        "other__Reach__0/Grip_3": ["on_error"],
        "other__Reach__0__Grip__3/Close_1": ["on_error"],
    }
    assert found.doubts == []
    fewer = msgspec.structs.replace(newest, actions=newest.actions[1:])
    found = fitted(recorded(run), run, fewer)
    assert outcomes(found) == {"Work_1": ["on_error"]}
    assert [doubt.action for doubt in found.doubts] == ["Work_0", named, deeper]


def with_speed(value: str) -> Graph:
    plan = sequence("measured", actions=2)
    leaf = f'{{"pvf_type": "number", "pvf_value": {value}}}'
    first = msgspec.structs.replace(plan.actions[0], inputs=(Parameter("arm/speed", leaf),))
    return msgspec.structs.replace(plan, actions=(first, plan.actions[1]))


@pytest.mark.parametrize("value", ["5", "5.0", "0.5e1"])
def test_parameters_are_told_as_sent_and_as_executed(process: RunnerProcess, value: str) -> None:
    with process.client() as client:
        script = {"*": [{"after_s": 0.2}]}  # long enough to be seen while it runs, also under load
        run = over(client, started(client, order(with_speed(value), script=script))["id"])
        whole = client.get(f"/api/runs/{run['id']}").json()
        assert whole["sent"] == {"Work_0": {"arm::speed": "5"}}
        executed = {
            name: [visit["inputs"] for visit in action["visits"]]
            for name, action in whole["actions"].items()
        }
        assert executed == {"Work_0": [{"arm::speed": "5"}], "Work_1": [{}]}
        replay = client.get(f"/api/runs/{run['id']}/film").json()
        told = [
            visit["inputs"]
            for frame in replay["frames"]
            for visit in frame.get("actions", {}).get("Work_0", {}).get("visits", [])
        ]
        assert told
        assert all(each == {"arm::speed": "5"} for each in told)


def test_a_script_for_another_version_is_asked_for_over_http(process: RunnerProcess) -> None:
    with process.client() as client:
        script = {"Work_0": [{"after_s": 0.02, "result": "on_false"}], "*": [{"after_s": 0.02}]}
        run = over(client, started(client, order(sequence(actions=2), script=script))["id"])
        path = f"/api/runs/{run['id']}/script"
        newest = json.loads(
            codec.write(renamed(sequence(actions=2), Work_0="Look"), codec.Stamp("g1", "v2", None))
        )
        found = client.post(path, json={"umrf": newest, "action": "Work_1", "fault": "hang"})
        assert found.status_code == 200, found.text
        told = found.json()["behaviours"]
        assert told["Look_0"][0]["result"] == "on_false"
        assert told["Work_1"] == [{"never": True, "ignores_stop": True}]
        assert client.post(path, json={"umrf": 5}).status_code == 422
        assert client.post(path, json={"umrf": newest, "action": "Work_1"}).status_code == 400
        assert client.post(path, json={}).status_code == 400


def test_a_run_that_had_opened_its_sub_graphs_fits_the_newest_version_opened_again(
    process: RunnerProcess,
) -> None:
    robots = {"Scout": "simulator", "Carrier": "simulator"}
    script = {"*": [{"after_s": 0.1}]}
    behaviours = msgspec.Raw(msgspec.json.encode({"behaviours": script}))
    request = msgspec.structs.replace(opened(MIXED), script=behaviours, robots=robots)
    with process.client() as client:
        run = over(client, started(client, request)["id"])
        inside = [name for name, each in run["actions"].items() if each.get("levels")]
        assert len(inside) == 2
        path = f"/api/runs/{run['id']}/script"
        body = {"umrf": request.umrf, "subgraphs": request.subgraphs}
        answer = client.post(path, content=msgspec.json.encode(body))
        assert answer.is_success, answer.text
        found = answer.json()
        assert set(found["behaviours"]) >= set(inside)
        assert not any("not have" in each["text"] for each in found["doubts"])
        body = {"umrf": request.umrf}
        closed = client.post(path, content=msgspec.json.encode(body)).json()
        assert any("That run did not have it" in each["text"] for each in closed["doubts"])
