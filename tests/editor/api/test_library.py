"""The action library over HTTP: actions made, brought and taken over, and their uses updated."""

import json
from itertools import count
from typing import Any

import httpx
import pytest

from action_assistant.umrf.packages.naming import snake_case


def leaf(kind: str, **more: Any) -> dict[str, Any]:
    return {"pvf_type": kind, **more}


def action(name: str, instance: int = 0, **takes: Any) -> dict[str, Any]:
    return {"name": name, "instance_id": instance, "type": "sync", "input_parameters": takes}


def graph(http: httpx.Client, name: str, *actions: dict[str, Any]) -> str:
    body = {"graph_name": name, "graph_entry": [], "graph_exit": [], "actions": list(actions)}
    made = http.post("/api/graphs", json=body)
    assert made.status_code == 201, made.text
    return str(made.json()["id"])


def brought(http: httpx.Client, file: dict[str, Any]) -> str:
    made = http.post("/api/actions", json=file)
    assert made.status_code == 201, made.text
    return str(made.json()["id"])


def listed(http: httpx.Client, name: str) -> dict[str, Any]:
    (found,) = [each for each in http.get("/api/actions").json() if each["name"] == name]
    return dict(found)


def values(http: httpx.Client, graph: str, *path: str) -> list[Any]:
    actions = http.get(f"/api/graphs/{graph}/umrf").json()["actions"]
    found = []
    for each in actions:
        at: Any = each["input_parameters"]
        for key in path:
            at = at[key]
        found.append(at.get("pvf_value"))
    return found


TAKES = {"place": leaf("string"), "pose": {"x": leaf("number", pvf_value=0.5)}}
_NUMBERS = count()


@pytest.fixture
def name() -> str:
    """The name of an action that no other test has."""
    return f"DriveTo{next(_NUMBERS)}"


def test_a_new_action_is_in_the_library_and_no_graph(http: httpx.Client, name: str) -> None:
    made = http.post("/api/actions", json={"name": name, "description": "Shuts it."})
    assert made.status_code == 201
    view = made.json()
    assert made.headers["location"] == f"/api/graphs/{view['id']}"
    assert (view["kind"], view["name"], view["actions"]) == ("action", name, 1)
    assert view["id"] not in [each["id"] for each in http.get("/api/graphs").json()]
    known = listed(http, name)
    assert (known["document"], known["description"]) == (view["id"], "Shuts it.")
    assert known["used_in"] == []


def test_the_file_of_an_action_becomes_an_action_and_comes_back_the_same(
    http: httpx.Client, name: str
) -> None:
    mine = {**action(name, **TAKES), "my_own": [1, {"two": 2.50}]}
    document = brought(http, mine)
    known = listed(http, name)
    assert {each["path"]: each["pvf_type"] for each in known["inputs"]} == {
        "place": "string",
        "pose/x": "number",
    }
    file = http.get(f"/api/actions/{document}/umrf").json()
    assert file["input_parameters"] == mine["input_parameters"]
    assert file["my_own"] == mine["my_own"]


def test_a_preview_stores_nothing(http: httpx.Client, name: str) -> None:
    told = http.post("/api/actions?preview=true", json=action(name, **TAKES))
    assert (told.status_code, told.json()["name"], told.json()["actions"]) == (200, name, 1)
    assert name not in [each["name"] for each in http.get("/api/actions").json()]


def test_each_file_is_told_the_way_where_it_belongs(http: httpx.Client, name: str) -> None:
    of_graph = {"graph_name": "g", "graph_entry": [], "graph_exit": [], "actions": []}
    refused = http.post("/api/actions", json=of_graph)
    assert (refused.status_code, refused.json()["where"]["code"]) == (422, "graph-file")
    assert (
        http.post("/api/graphs", json=action(name, **TAKES)).json()["where"]["code"]
        == "action-file"
    )


@pytest.mark.parametrize("body", [b"", b"{", b"[]", b'"x"', b"\xff", b"{}", b'{"name": 5}'])
def test_a_file_that_is_no_action_is_refused_with_a_reason(http: httpx.Client, body: bytes) -> None:
    refused = http.post("/api/actions", content=body)
    assert refused.status_code in {400, 422}, refused.text
    assert refused.json()["detail"]


def test_a_second_action_of_one_name_is_refused_and_names_the_first(
    http: httpx.Client, name: str
) -> None:
    first = brought(http, action(name, **TAKES))
    refused = http.post("/api/actions", json={"name": name})
    assert (refused.status_code, refused.json()["where"]) == (409, {"graph": first})
    http.delete(f"/api/graphs/{first}").raise_for_status()
    assert name not in [each["name"] for each in http.get("/api/actions").json()]
    assert [each["id"] for each in http.get("/api/actions/deleted").json()] == [first]
    second = brought(http, action(name, **TAKES))
    assert listed(http, name)["document"] == second
    http.post(f"/api/graphs/{first}/recover").raise_for_status()
    both = [each["document"] for each in http.get("/api/actions").json()]
    assert {first, second} <= set(both)


def test_an_action_of_a_graph_can_be_taken_into_the_library(http: httpx.Client, name: str) -> None:
    graph(http, "one", action(name, at=leaf("string", pvf_value="door")))
    graph(http, "two", action(name, at=leaf("string"), long=leaf("number", pvf_value=3)))
    made = http.post("/api/actions", json={"name": name, "from_graphs": True})
    assert made.status_code == 201, made.text
    file = http.get(f"/api/actions/{made.json()['id']}/umrf").json()
    assert file["input_parameters"] == {"at": leaf("string"), "long": leaf("number")}
    unknown = http.post("/api/actions", json={"name": "Nobody", "from_graphs": True})
    assert unknown.status_code == 404


def test_a_rename_renames_the_action_itself(http: httpx.Client, name: str) -> None:
    document = brought(http, action(name, **TAKES))
    told = http.patch(
        f"/api/graphs/{document}", json={"name": f"{name}Now", "description": "Goes."}
    )
    assert (told.json()["name"], told.json()["description"]) == (f"{name}Now", "Goes.")
    assert listed(http, f"{name}Now")["document"] == document
    assert http.get(f"/api/actions/{document}/umrf").json()["name"] == f"{name}Now"


def test_uses_that_differ_are_told_with_what_an_update_would_change(
    http: httpx.Client, name: str
) -> None:
    same = graph(http, "same", action(name, **TAKES))
    other = graph(
        http,
        "other",
        action(name, goal=leaf("string", pvf_value="dock")),
        action(name, 1, goal=leaf("string", pvf_value="door")),
        action("Wait"),
    )
    document = brought(http, action(name, **TAKES))
    assert listed(http, name)["differs_in"] == [other]

    told = http.get(f"/api/actions/{document}/uses").json()
    uses = {each["graph"]: each for each in told["uses"]}
    assert set(uses) == {same, other}
    assert (uses[same]["changed"], uses[other]["changed"]) == (False, True)
    assert uses[other]["count"] == 2
    assert uses[other]["suggested"]["inputs"] == [["goal", "place"]]
    assert {each["name"] for each in uses[other]["difference"]["actions"]} == {
        f"{name}_0",
        f"{name}_1",
    }


def test_uses_are_updated_with_the_renames_that_were_asked_for(
    http: httpx.Client, name: str
) -> None:
    goals = [leaf("string", pvf_value=place) for place in ("dock", "door")]
    uses = [action(name, i, goal=goal) for i, goal in enumerate(goals)]
    other = graph(http, "other", *uses, action("Wait"))
    document = brought(http, action(name, **TAKES))
    updated = http.post(
        f"/api/actions/{document}/uses",
        json={
            "seq": 1,
            "graphs": [{"graph": other, "seq": 1}],
            "renames": {"inputs": [["goal", "place"]], "outputs": []},
        },
    )
    assert updated.status_code == 200, updated.text
    assert updated.json() == [{"graph": other, "seq": 2, "changed": True, "refused": ""}]
    assert listed(http, name)["differs_in"] == []
    actions = http.get(f"/api/graphs/{other}/umrf").json()["actions"]
    assert [each.get("input_parameters", {}).get("place") for each in actions] == [*goals, None]


def test_an_update_is_told_in_the_history_and_can_be_taken_back(
    http: httpx.Client, name: str
) -> None:
    before = graph(http, "task", action(name, place=leaf("number", pvf_value=3)))
    document = brought(http, action(name, **TAKES))
    body = {"seq": 1, "graphs": [{"graph": before, "seq": 1}]}
    http.post(f"/api/actions/{document}/uses", json=body).raise_for_status()
    newest = http.get(f"/api/graphs/{before}/history").json()[0]
    assert (newest["kind"], newest["seq"]) == ("adapted", 2)
    assert newest["adapted"] == {"document": document, "seq": 1, "action": name}
    http.post(f"/api/graphs/{before}/restore", json={"seq": 1}).raise_for_status()
    assert values(http, before, "place") == [3]


def test_a_graph_that_somebody_changed_meanwhile_stops_the_whole_update(
    http: httpx.Client, name: str
) -> None:
    one = graph(http, "one", action(name))
    two = graph(http, "two", action(name))
    document = brought(http, action(name, **TAKES))
    http.patch(f"/api/graphs/{two}", json={"name": "renamed"}).raise_for_status()
    body = {"seq": 1, "graphs": [{"graph": one, "seq": 1}, {"graph": two, "seq": 1}]}
    refused = http.post(f"/api/actions/{document}/uses", json=body)
    assert (refused.status_code, refused.json()["where"]) == (409, {"graph": two})
    assert http.get(f"/api/graphs/{one}").json()["seq"] == 1


def test_the_library_takes_over_what_a_graph_has_and_keeps_its_own_values(
    http: httpx.Client, name: str
) -> None:
    other = graph(
        http,
        "other",
        action(name, pose={"x": leaf("number", pvf_value=9)}, fast=leaf("bool", pvf_value=True)),
    )
    document = brought(http, action(name, **TAKES))
    taken = http.post(f"/api/actions/{document}/take", json={"graph": other})
    assert taken.status_code == 200, taken.text
    file = http.get(f"/api/actions/{document}/umrf").json()
    assert file["input_parameters"] == {
        "pose": {"x": leaf("number", pvf_value=0.5)},
        "fast": leaf("bool"),
    }
    assert listed(http, name)["differs_in"] == []
    newest = http.get(f"/api/graphs/{document}/history").json()[0]
    assert newest["adapted"]["document"] == other


def test_an_action_can_be_made_what_a_file_says_and_back(http: httpx.Client, name: str) -> None:
    document = brought(http, action(name, **TAKES))
    newer = {**action(name, place=leaf("string", pvf_value="dock")), "mine": 1}
    assert http.put(f"/api/actions/{document}/umrf", json=newer).status_code == 200
    file = http.get(f"/api/actions/{document}/umrf").json()
    assert file["input_parameters"] == {"place": leaf("string", pvf_value="dock")}
    assert file["mine"] == 1
    newest = http.get(f"/api/graphs/{document}/history").json()[0]
    assert (newest["kind"], newest["adapted"]["document"]) == ("adapted", "")
    http.post(f"/api/graphs/{document}/restore", json={"seq": 1}).raise_for_status()
    file = http.get(f"/api/actions/{document}/umrf").json()
    assert file["input_parameters"] == TAKES
    of_another = http.put(f"/api/actions/{document}/umrf", json=action("Another"))
    assert of_another.status_code == 409
    assert http.put(f"/api/actions/{document}/umrf", content=b"{").status_code == 400


def test_a_preview_of_a_file_lists_its_changes_and_stores_nothing(
    http: httpx.Client, name: str
) -> None:
    document = brought(http, action(name, **TAKES))
    newer = action(name, place=leaf("number"), pose=TAKES["pose"])
    told = http.post(f"/api/actions/{document}/umrf", json=newer)
    assert told.status_code == 200, told.text
    (change,) = told.json()["actions"]
    assert [each["field"] for each in change["fields"]] == ["in/place"]
    assert http.get(f"/api/graphs/{document}").json()["seq"] == 1
    same = http.post(f"/api/actions/{document}/umrf", json=action(name, **TAKES)).json()
    assert (same["actions"], same["relations"], same["fields"]) == ([], [], [])
    of_another = http.post(f"/api/actions/{document}/umrf", json=action("Another"))
    assert of_another.status_code == 409


def test_an_action_that_somebody_changed_since_the_look_stays_as_it_is(
    http: httpx.Client, name: str
) -> None:
    document = brought(http, action(name, **TAKES))
    http.patch(f"/api/graphs/{document}", json={"description": "Goes."}).raise_for_status()
    newer = action(name, place=leaf("number"))
    refused = http.put(f"/api/actions/{document}/umrf?seq=1", json=newer)
    assert (refused.status_code, refused.json()["where"]) == (409, {"graph": document})
    file = http.get(f"/api/actions/{document}/umrf").json()
    assert file["input_parameters"] == TAKES
    assert http.put(f"/api/actions/{document}/umrf?seq=2", json=newer).status_code == 200


def test_a_graph_is_told_as_the_action_that_stands_for_it(http: httpx.Client, name: str) -> None:
    first = action(name, goal=leaf("string"), speed=leaf("number", pvf_value=2))
    first["children"] = [{"name": "Last", "instance_id": 0}]
    last = {
        **action("Last", hidden=leaf("bool")),
        "output_parameters": {"at": leaf("number", pvf_value=1)},
        "parents": [{"name": name, "instance_id": 0}],
    }
    whole = {
        "graph_name": f"{name}_round",
        "graph_description": "Goes round.",
        "graph_entry": [{"name": name, "instance_id": 0}],
        "graph_exit": [{"name": "Last", "instance_id": 0}],
        "actions": [first, last],
    }
    made = http.post("/api/graphs", json=whole).json()["id"]
    document = brought(http, action(f"{name}Alone"))

    known = {each["graph"]: each for each in http.get("/api/actions/graphs").json()}
    assert document not in known
    mine = known[made]
    assert (mine["name"], mine["description"]) == (f"{name}_round", "Goes round.")
    assert [(each["path"], json.loads(each["text"])) for each in mine["inputs"]] == [
        ("goal", leaf("string"))
    ]
    assert [(each["path"], json.loads(each["text"])) for each in mine["outputs"]] == [
        ("at", leaf("number"))
    ]
    http.delete(f"/api/graphs/{made}").raise_for_status()
    assert made not in [each["graph"] for each in http.get("/api/actions/graphs").json()]


def test_the_oldest_of_several_graphs_of_one_name_is_listed_first(
    http: httpx.Client, name: str
) -> None:
    made = [graph(http, f"{name}_twice", action(f"{name}{n}")) for n in range(4)]
    listed = http.get("/api/actions/graphs").json()
    assert [each["graph"] for each in listed if each["name"] == f"{name}_twice"] == made


def test_a_graph_is_no_action_and_an_action_no_graph_to_update(
    http: httpx.Client, name: str
) -> None:
    some = graph(http, "task", action(name))
    document = brought(http, action(name, **TAKES))
    assert http.get(f"/api/actions/{some}/uses").status_code == 404
    assert http.get(f"/api/actions/{some}/umrf").status_code == 404
    body = {"seq": 1, "graphs": [{"graph": document, "seq": 1}]}
    assert http.post(f"/api/actions/{document}/uses", json=body).status_code == 404


def test_packages_of_an_action_of_the_library_have_its_values(
    http: httpx.Client, name: str
) -> None:
    document = brought(http, action(name, **TAKES))
    files = http.get(f"/api/graphs/{document}/packages/{snake_case(name)}").json()["files"]
    (umrf,) = [each["text"] for each in files if each["path"].endswith(".umrf.json")]
    assert json.loads(umrf)["input_parameters"]["pose"]["x"]["pvf_value"] == 0.5
