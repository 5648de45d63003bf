"""Notes on a version are kept with it."""

import json
from typing import Any

import httpx
import msgspec
import pytest

from action_assistant.errors import TooLarge
from action_assistant.runner.runs.sent_graphs import SentSubgraph
from action_assistant.runner.start.admission import Admitted, StartRequest, admit
from action_assistant.umrf.facts import facts_of
from action_assistant.umrf.run_size import MOST_BYTES


def test_a_version_has_a_name_and_a_note_of_its_author(http: httpx.Client) -> None:
    graph = http.post("/api/graphs", json={"name": "valves"}).json()["id"]
    body = {"label": "gentle", "note": "  Slower at the seal.\nFor atlas only.  "}
    version = http.post(f"/api/graphs/{graph}/versions", json=body).json()
    assert version["note"] == "Slower at the seal.\nFor atlas only."
    assert http.get(f"/api/versions/{version['id']}").json() == version
    (listed,) = http.get(f"/api/graphs/{graph}/versions").json()
    assert (listed["label"], listed["note"]) == ("gentle", version["note"])
    # A note makes another version of a moment; without a note the newest version is answered.
    noted = http.post(f"/api/graphs/{graph}/versions", json={"note": "tried on Monday"})
    assert noted.status_code == 201
    again = http.post(f"/api/graphs/{graph}/versions", json={})
    assert (again.status_code, again.json()["id"]) == (200, noted.json()["id"])
    refused = http.post(f"/api/graphs/{graph}/versions", json={"note": "x" * 4001})
    assert (refused.status_code, refused.json()["where"]["path"]) == (400, "/note")


def described(characters: int, actions: int = 40) -> bytes:
    """A file of a chain whose actions say so much together."""
    names = [{"name": f"Act{n}", "instance_id": 0} for n in range(actions)]
    made = [
        {
            **each,
            "type": "sync",
            "description": "x" * (characters // actions),
            "parents": names[max(0, n - 1) : n],
            "children": names[n + 1 : n + 2],
        }
        for n, each in enumerate(names)
    ]
    graph = {"graph_name": f"Said{characters}", "actions": made}
    return json.dumps({**graph, "graph_entry": [names[0]], "graph_exit": [names[-1]]}).encode()


def admitted_by_runner(version: dict[str, Any]) -> Admitted:
    """Return the runner's verdict on a version as the page sends it."""
    inside = tuple(
        SentSubgraph(
            name=each["name"],
            digest=each["digest"],
            umrf=msgspec.Raw(json.dumps(each["umrf"]).encode()),
        )
        for each in version["subgraphs"]
    )
    asked = StartRequest(
        version=version["id"],
        digest=version["digest"],
        umrf=msgspec.Raw(json.dumps(version["umrf"]).encode()),
        engine="simulator",
        request_id="r",
        subgraphs=inside,
        tree_digest=version["tree_digest"],
    )
    return admit(asked, facts_of({}), approved=version["digest"] != "")


@pytest.mark.parametrize("beyond", [False, True])
def test_the_editor_publishes_exactly_the_sizes_that_the_runner_starts(
    http: httpx.Client, beyond: bool
) -> None:
    characters = 100_000 + MOST_BYTES if beyond else MOST_BYTES - 100_000
    made = http.post("/api/graphs", content=described(characters)).json()["id"]
    answer = http.post(f"/api/graphs/{made}/versions", json={"label": "large"})
    if not beyond:
        assert answer.status_code == 201, answer.text
        assert admitted_by_runner(answer.json()).graph.actions
        return
    assert answer.status_code == 413
    told = answer.json()["detail"]
    assert told.startswith("Not published, since it could not be started: The UMRF text")
    assert " MB; at most 2 MB are run" in told
    assert http.get(f"/api/graphs/{made}/versions").json() == []
    # A version of before there was such a limit is refused at the start by the same sentence.
    umrf = http.get(f"/api/graphs/{made}/umrf").text
    old = {"id": "v", "digest": "", "umrf": json.loads(umrf), "subgraphs": [], "tree_digest": None}
    with pytest.raises(TooLarge, match="2 MB"):
        admitted_by_runner(old)


def test_graphs_inside_count_with_the_one_around_them(http: httpx.Client) -> None:
    half = MOST_BYTES // 2
    inner = json.loads(described(half))
    http.post("/api/graphs", json={**inner, "graph_name": "Inside1"})
    outer = json.loads(described(half + 50_000))
    text = json.dumps(outer).replace('"Act3"', '"Inside1"')
    made = http.post("/api/graphs", content=text.encode()).json()["id"]
    answer = http.post(f"/api/graphs/{made}/versions", json={})
    assert answer.status_code == 413
    assert "the graph and the graph inside of it have" in answer.json()["detail"]
