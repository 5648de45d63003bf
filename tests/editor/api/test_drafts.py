"""Drafts over HTTP: made, listed under their graph, looked at, merged, and refused in words."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import httpx
import pytest

from editor.api.test_history import PAIR
from support.product import TOKEN


def _draft(http: httpx.Client, graph: str, **new: object) -> dict[str, Any]:
    answer = http.post(f"/api/graphs/{graph}/drafts", json=new)
    assert answer.status_code == 201, answer.text
    made: dict[str, Any] = answer.json()
    assert answer.headers["location"] == f"/api/drafts/{made['id']}"
    return made


def _imported(http: httpx.Client) -> str:
    made: str = http.post("/api/graphs", content=json.dumps(PAIR)).json()["id"]
    return made


def _merge(http: httpx.Client, draft: str, **body: object) -> httpx.Response:
    seen = http.post(f"/api/drafts/{draft}/preview", json={}).json()
    moments = {"seq": seen["seq"], "draft_seq": seen["draft_seq"]}
    return http.post(f"/api/drafts/{draft}/merge", json=moments | body)


def test_a_draft_is_a_graph_that_stands_under_another(http: httpx.Client) -> None:
    graph = _imported(http)
    made = _draft(http, graph, name="gentler grip")
    assert [each["id"] for each in http.get(f"/api/graphs/{graph}/drafts").json()] == [made["id"]]
    listed = {each["id"]: each for each in http.get("/api/graphs").json()}
    assert made["id"] not in listed
    assert listed[graph]["drafts"] == 1
    of = http.get(f"/api/graphs/{made['id']}").json()["draft_of"]
    assert of == {"graph": graph, "seq": 1, "name": "gentler grip"}
    both = [http.get(f"/api/graphs/{each}/umrf").json() for each in (graph, made["id"])]
    assert both[0] == both[1]
    early = http.post(f"/api/graphs/{graph}/drafts", json={"seq": 9})
    assert (early.status_code, early.json()["where"]) == (409, {"path": "/seq"})


def test_a_draft_is_merged_told_of_and_taken_back(http: httpx.Client) -> None:
    graph = _imported(http)
    draft = _draft(http, graph, name="later")["id"]
    http.patch(f"/api/graphs/{draft}", json={"name": "pair, later"})
    seen = http.get(f"/api/drafts/{draft}").json()
    assert (seen["ahead"], seen["behind"], seen["state"]) == (1, 0, "open")
    answer = _merge(http, draft)
    assert answer.json() == {"graph": graph, "seq": 2, "changed": True}
    assert http.get(f"/api/graphs/{graph}/umrf").json()["graph_name"] == "pair, later"
    entry = http.get(f"/api/graphs/{graph}/history").json()[0]
    assert (entry["kind"], entry["merged"]["name"]) == ("merged", "later")
    assert entry["changes"]["fields"][0]["after"] == "pair, later"
    undo = {"author": entry["author"]["id"], "from_seq": 2, "seq": 2}
    assert http.post(f"/api/graphs/{graph}/revert", json=undo).json() == {"seq": 3, "left": []}
    assert http.get(f"/api/graphs/{graph}/umrf").json()["graph_name"] == "pair"


def test_a_key_that_both_sides_changed_needs_a_choice(http: httpx.Client) -> None:
    graph = _imported(http)
    draft = _draft(http, graph)["id"]
    http.patch(f"/api/graphs/{draft}", json={"name": "one"})
    http.patch(f"/api/graphs/{graph}", json={"name": "other"})
    refused = _merge(http, draft)
    assert (refused.status_code, refused.json()["where"]) == (409, {"places": ["meta/name"]})
    assert refused.json()["detail"].endswith("name of the graph.")
    assert _merge(http, draft, choices={"meta/name": "draft"}).status_code == 200
    assert http.get(f"/api/graphs/{graph}/umrf").json()["graph_name"] == "one"
    late = {"seq": 2, "draft_seq": 2}
    assert http.post(f"/api/drafts/{draft}/merge", json=late).status_code == 409


def test_a_draft_takes_over_what_its_graph_has_meanwhile(http: httpx.Client) -> None:
    graph = _imported(http)
    draft = _draft(http, graph)["id"]
    http.patch(f"/api/graphs/{graph}", json={"description": "to the dock"})
    assert _merge(http, draft, into="draft").json()["graph"] == draft
    assert http.get(f"/api/graphs/{draft}").json()["description"] == "to the dock"
    assert http.get(f"/api/drafts/{draft}").json()["behind"] == 0


@contextmanager
def browser(http: httpx.Client, name: str) -> Iterator[httpx.Client]:
    """A browser in which somebody has signed in."""
    url = str(http.base_url).rstrip("/")
    with httpx.Client(base_url=url, headers={"origin": url}, trust_env=False) as made:
        assert made.post("/api/session", json={"token": TOKEN, "name": name}).is_success
        yield made


def test_a_proposal_is_made_answered_by_a_second_person_and_taken_back(http: httpx.Client) -> None:
    draft = _draft(http, _imported(http))["id"]
    proposed = http.post(f"/api/drafts/{draft}/proposal", json={"note": "please"}).json()
    assert (proposed["state"], proposed["proposal"]["note"]) == ("proposed", "please")
    said = {"yes": True, "seq": 1, "note": "fine"}
    with browser(http, "Ben") as ben:
        answered = ben.post(f"/api/drafts/{draft}/answers", json=said).json()
    assert [each["yes"] for each in answered["proposal"]["answers"]] == [True]
    assert http.delete(f"/api/drafts/{draft}/proposal").json()["state"] == "open"
    assert http.post(f"/api/drafts/{draft}/answers", json=said).status_code == 409


@pytest.mark.parametrize("yes", [True, False])
def test_ones_own_answer_to_a_proposal_does_not_count(http: httpx.Client, yes: bool) -> None:
    draft = _draft(http, _imported(http))["id"]
    said = {"yes": yes, "seq": 1}
    with browser(http, "Ann") as ann:
        ann.post(f"/api/drafts/{draft}/proposal", json={})
        refused = ann.post(f"/api/drafts/{draft}/answers", json=said)
        assert (refused.status_code, refused.json()["where"]) == (409, {"path": "/yes"})
        # A browser under another name is no second person.
        assert ann.delete("/api/session").is_success
        again = ann.post("/api/session", json={"token": TOKEN, "name": "Eve"}).json()
        assert again["person"]["name"] == "Eve"
        refused = ann.post(f"/api/drafts/{draft}/answers", json=said)
        assert (refused.status_code, refused.json()["where"]) == (409, {"path": "/yes"})
        assert "in your browser" in refused.json()["detail"]
    assert "answers" not in http.get(f"/api/drafts/{draft}").json()["proposal"]


@pytest.mark.parametrize(
    ("seq", "status"), [(-5, 400), (0, 400), (1, 409), (3, 400), (999_999, 400), (2**63, 400)]
)
def test_an_answer_is_to_the_change_that_is_there_and_to_no_other(
    http: httpx.Client, seq: int, status: int
) -> None:
    draft = _draft(http, _imported(http))["id"]
    http.post(f"/api/drafts/{draft}/proposal", json={})
    http.patch(f"/api/graphs/{draft}", json={"description": "changed since"})
    with browser(http, "Ben") as ben:
        refused = ben.post(f"/api/drafts/{draft}/answers", json={"yes": True, "seq": seq})
        assert refused.status_code == status, refused.text
        assert refused.json()["where"]["path"] == "/seq"
        assert "answers" not in http.get(f"/api/drafts/{draft}").json()["proposal"]
        assert ben.post(f"/api/drafts/{draft}/answers", json={"yes": True, "seq": 2}).is_success
    http.patch(f"/api/graphs/{draft}", json={"description": "and again"})
    (answer,) = http.get(f"/api/drafts/{draft}").json()["proposal"]["answers"]
    assert answer["seq"] == 2


def test_a_graph_that_is_no_draft_is_not_found(http: httpx.Client) -> None:
    graph = _imported(http)
    assert http.get(f"/api/drafts/{graph}").status_code == 404
    assert http.post(f"/api/drafts/{graph}/preview", json={}).status_code == 404
    assert http.post("/api/graphs/nobody/drafts", json={}).status_code == 404
