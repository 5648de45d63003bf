"""Each route that changes something leaves a row in the audit, or says here why it does not.

The routes are those that both OpenAPI documents name, so a new one has to be added here.
"""

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import httpx
import pytest

from support.openapi import documents
from support.product import TOKEN, Product, running
from support.waiting import until
from test_audit import GRAPH, start_of

#: Requests that store nothing: they look, check, compute or make a proposal for the caller.
LOOKS: Final = {
    *("editor post /api/session/invitation", "editor post /api/graphs/{graph_id}/rewriting"),
    *("editor post /api/graphs/{graph_id}/since", "editor post /api/graphs/{graph_id}/extraction"),
    *("editor post /api/graphs/{graph_id}/unpacking", "editor post /api/drafts/{draft_id}/preview"),
    *("editor post /api/pieces", "editor post /api/graphs/{graph_id}/rehearsal"),
    *("editor post /api/actions/{action_id}/umrf", "editor post /api/logins/look"),
    *("runner post /api/preflight", "runner post /api/queue/{entry}/look"),
    "runner post /api/repeats/{repeat}/look",
    "runner post /api/expectations/check",
    *("runner post /api/expectations/proposal", "runner post /api/runs/{run}/script"),
    "runner post /api/asked_inputs",
}
#: Other exceptions, and why.
EXCEPT: Final = {
    "editor post /api/session/device": "a code waits in memory; the row is that of the added device",
    "editor post /api/devices/codes": "a code waits in memory, and lets nobody in by itself",
    "editor delete /api/devices/codes/{code}": "a code that let nobody in is given up",
    "editor post /api/devices/codes/{code}/answer": "the row is that of the added device",
    "editor post /api/logins": "a code waits in memory, and lets nobody in by itself",
    "editor post /api/logins/cancel": "a code that let nobody in is given up",
    "editor post /api/logins/refuse": "a code that let nobody in is given up",
    "editor post /api/logins/confirm": "the row is that of the token, when the program fetches it",
    "editor post /api/logins/claim": "token.made, in tests/commands/test_logins.py",
    "editor post /api/drafts/{draft_id}/answers": "by another person; in the random week",
    "editor post /api/session/provider": "leads to the identity provider, and lets nobody in",
    "editor post /api/session/provider/answer": "signs in, in tests/editor/api/test_provider.py",
    "runner post /api/groups": "run.requested of each run, in tests/runner/start/test_groups.py",
    "editor post /api/confirmations/records": "the row is that of the confirmation; its seal proves it",
    "runner post /api/confirmations/records": "the row is that of the confirmation; its seal proves it",
    "runner post /api/confirmations": "a request waits in memory, and confirms nobody by itself",
    "runner delete /api/confirmations/{request_id}": "a request that confirmed nobody is given up",
    "runner post /api/confirmations/{request_id}/answer": "in tests of confirmations on devices",
    "runner post /api/approvals/asked": "a message to others; the yes itself is an event",
    "runner post /api/runs/{run}/questions/{question}/answer": "run.question_answered, in tests/runner/api/test_questions.py",
    "runner post /api/runs/{run}/questions/{question}/photo": "the row is that of the answer with it",
    "editor post /api/mentions/read": "a mark of what one has read oneself",
    "editor post /api/notifications/{name}/test": "audit.owner_did, where a receiver is set",
    "runner post /api/notifications/{name}/test": "audit.owner_did, where a receiver is set",
    "runner post /api/tokens/records": "the editor's log has the token with its maker; the seal proves it",
    "runner post /api/examples": "an example robot run of the program, asked for by a test dialog",
    "runner post /api/archive": "runs are moved into archives; each move is an event of its own",
    "editor post /api/passkeys/challenge": "a challenge waits in memory; the row is that of the passkey",
    "editor post /api/passkeys": "passkey_changed, in tests/web/auth/test_passkeys.py",
    "editor patch /api/passkeys/{passkey}": "a word for oneself; it changes nothing that a key may do",
    "editor delete /api/passkeys/{passkey}": "passkey_changed, in tests/web/auth/test_passkeys.py",
    "editor post /api/passkeys/confirm/challenge": "a challenge waits in memory",
    "editor post /api/passkeys/confirm": "confirmed, in tests/web/auth/test_passkeys.py",
    "editor put /api/passkeys/ask-again": "passkey_changed, in tests/web/auth/test_passkeys.py",
    "runner post /api/sessions/ended": "in tests/web/auth/test_changed_rights.py",
    "runner post /api/practice": "the row is that of the registered robot, in tests/ros/test_practice_robot.py",
    "runner post /api/robots/{name}/index": "index_write_asked, in tests/runner/api/test_index.py",
    "runner post /api/robots/{name}/baton/hand": "in tests/runner/start/test_rights_registry.py",
    "runner post /api/robots/{name}/drills": "robot.drilled, in tests/runner/robots/test_drills.py",
    "runner post /api/runs/{run}/hand_over": "in tests/runner/execution/test_led_rights.py",
    "runner post /api/runs/{run}/at_rest": "in tests/runner/execution/test_truth.py",
    "runner post /api/runs/{run}/go_on": "in tests/runner/execution/test_led_presses.py",
    "runner post /api/runs/{run}/step": "in tests/runner/execution/test_led_steps.py",
    "runner put /api/runs/{run}/breakpoints": "in tests/runner/execution/test_led_breakpoints.py",
    "runner post /api/runs/{run}/wait": "in tests/runner/execution/test_led_steps.py",
    "runner post /api/runs/{run}/outcome": "in tests/runner/execution/test_led_presses.py",
}


def _once(method: str, url: str, **more: Any) -> httpx.Response:
    return httpx.request(method, url, trust_env=False, timeout=30, **more)


class Walk:
    """Requests of an owner, and what each of them left in the audit."""

    def __init__(self, product: Product, clients: contextlib.ExitStack) -> None:
        headers = {"authorization": f"Bearer {TOKEN}"}
        self.http = {
            name: clients.enter_context(
                httpx.Client(base_url=url, headers=headers, trust_env=False, timeout=30)
            )
            for name, url in (("editor", product.url), ("runner", product.runner_url))
        }
        self.done: set[str] = set()
        self.silent: list[str] = []
        self.cookie = ""  # of the last answer
        self._seen = {name: self._newest(name) for name in self.http}

    def _newest(self, process: str) -> int:
        rows = self.http[process].get("/api/audit?limit=1").json()["rows"]
        return rows[0]["position"] if rows else 0

    def __call__(
        self,
        process: str,
        method: str,
        path: str,
        body: Any = None,
        by: dict[str, str] | None = None,
        **ids: Any,
    ) -> Any:
        """Send a request of the owner's program, or with the headers `by`, and return what it answers.
        `ids` are those of the path; others are its query."""
        url = path.format(**ids)
        query = {k: v for k, v in ids.items() if f"{{{k}}}" not in path}
        url = str(self.http[process].base_url.join(url))
        send = self.http[process].request if by is None else _once
        answer = send(method, url, params=query, json=body, headers=by)
        self.cookie = answer.headers.get("set-cookie", "").partition(";")[0]
        assert answer.is_success, (method, url, answer.status_code, answer.text)
        name = f"{process} {method} {path}"
        self.done.add(name)
        deadline = time.monotonic() + 5
        while (newest := self._newest(process)) <= self._seen[process]:
            if time.monotonic() > deadline:
                self.silent.append(name)
                break
            time.sleep(0.01)
        self._seen[process] = newest
        has_json = "json" in answer.headers.get("content-type", "")
        return answer.json() if answer.content and has_json else None


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    """A server for the module."""
    with running(tmp_path_factory.mktemp("routes") / "data") as found:
        yield found


def changing(data: Path) -> set[str]:
    """Return all routes that may change something: `PROCESS METHOD PATH`."""
    return {
        f"{process} {method} {path}"
        for process, document in documents(data).items()
        for path, item in document["paths"].items()
        for method in item
        if method != "get"
    }


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_each_route_that_changes_something_leaves_a_row(product: Product, tmp_path: Path) -> None:
    with contextlib.ExitStack() as clients:
        walk = Walk(product, clients)
        _walk_everywhere(walk, product)
    assert walk.silent == []
    asked = walk.done | LOOKS | set(EXCEPT)
    assert (changing(tmp_path) - asked, (LOOKS | set(EXCEPT)) & walk.done) == (set(), set())
    assert asked - changing(tmp_path) == set()


def _walk_everywhere(walk: Walk, product: Product) -> None:
    _people(walk)
    _graphs(walk)
    _library(walk)
    _robots(walk)
    _runs(walk)
    _ends(walk, product)


def _people(walk: Walk) -> None:
    link = walk("editor", "post", "/api/invitations", {"role": "viewer", "label": "x"})
    walk("editor", "post", "/api/invitations/{invitation}/revoke", invitation=link["id"])
    mari = walk("editor", "post", "/api/members", {"name": "Mari", "role": "editor"})["id"]
    walk("editor", "patch", "/api/members/{person}", {"name": "Mary"}, person=mari)
    walk("editor", "post", "/api/members/{person}/link", {}, person=mari)
    group = walk("editor", "post", "/api/groups", {"name": "night"})["id"]
    walk("editor", "patch", "/api/groups/{group}", {"name": "day"}, group=group)
    walk("editor", "delete", "/api/groups/{group}", group=group)
    walk("editor", "post", "/api/members/{person}/end", person=mari)
    body = {"id": "someone", "name": "Someone", "role": "viewer"}
    walk("runner", "put", "/api/members/{person}", body, person="someone")
    for what in ("invitation", "session", "person", "token"):
        walk("runner", "post", "/api/revocations", {what: f"some{what}"})
    wanted = {"name": "nightly", "scopes": ["read"]}
    for process in ("editor", "runner"):
        token = walk("editor", "post", "/api/tokens", wanted)["record"]["id"]
        walk(process, "post", "/api/tokens/{token}/revoke", token=token)


def _file(name: str, *actions: str) -> dict[str, Any]:
    ends = [{"name": each, "instance_id": 0} for each in actions]
    return {
        "graph_name": name,
        "graph_entry": ends,
        "graph_exit": ends,
        "actions": [_action(each) for each in actions],
    }


def _action(name: str) -> dict[str, Any]:
    return {"name": name, "type": "sync", "instance_id": 0}


def _queue(walk: Walk, start_of: Any) -> None:
    for name in ("queued", "queued too"):
        queue = walk("runner", "post", "/api/queue", {"start": start_of(name, "simulator")})
    first, second = (each["id"] for each in queue["entries"])
    walk("runner", "post", "/api/queue/{entry}/move", {"before": first}, entry=second)
    walk("runner", "post", "/api/queue/{entry}/remove", entry=first)
    queue = walk("runner", "post", "/api/queue/robots/{name}/close", name="simulator")
    asked = {"closing": queue["robots"][0]["closed"]["closing"]}
    walk("runner", "post", "/api/queue/robots/{name}/open", asked, name="simulator")
    look = walk.http["runner"].post(f"/api/queue/{second}/look", json={}).json()
    walk("runner", "post", "/api/queue/{entry}/start", {"look": look["look"]}, entry=second)


def _view_link(walk: Walk, process: str, thing: str) -> None:
    link = walk(process, "post", "/api/view-links", {"thing": thing})["id"]
    walk(process, "post", "/api/view-links/{link}/revoke", link=link)


def _graphs(walk: Walk) -> None:
    def made(name: str, *actions: str) -> str:
        graph: str = walk("editor", "post", "/api/graphs", _file(name, *actions or "AB"))["id"]
        return graph

    graph = made("one")
    walk("editor", "patch", "/api/graphs/{graph_id}", {"name": "two"}, graph_id=graph)
    path = "/api/graphs/{graph_id}/versions"
    version = walk("editor", "post", path, {"label": "v"}, graph_id=graph)["id"]
    walk("editor", "put", "/api/versions/{version_id}/release", version_id=version)
    walk("editor", "delete", "/api/versions/{version_id}/release", version_id=version)
    walk("editor", "post", "/api/graphs/{graph_id}/restore", {"seq": 1}, graph_id=graph)
    _view_link(walk, "editor", graph)
    other = made("other")
    walk("editor", "patch", "/api/graphs/{graph_id}", {"name": "new"}, graph_id=other)
    undo = {"author": "local", "from_seq": 2, "seq": 2}
    walk("editor", "post", "/api/graphs/{graph_id}/revert", undo, graph_id=other)
    path = "/api/graphs/{graph_id}/umrf"
    walk("editor", "put", path, _file("three", "C"), graph_id=made("x"), seq=1)
    walk(
        "editor",
        "post",
        "/api/graphs/{graph_id}/flat",
        {"name": "flat", "seq": 1},
        graph_id=made("y"),
    )
    outer = made("outer", "A", "B", "C")
    path = f"/api/graphs/{outer}/document"
    actions = walk.http["editor"].get(path, params={"at": 1}).json()["actions"]
    keys = [key for key, name in actions.items() if name in {"A", "B"}]
    cut = {"actions": keys, "name": "Middle", "seq": 1, "otherwise": True}
    walk("editor", "post", "/api/graphs/{graph_id}/subgraphs", cut, graph_id=outer)
    inner, user = made("Lift"), made("user", "Lift")
    walk("editor", "patch", "/api/graphs/{graph_id}", {"name": "Hoist"}, graph_id=inner)
    calls = {"before": "Lift", "name": "Hoist", "graphs": [user]}
    walk("editor", "post", "/api/graphs/{graph_id}/uses", calls, graph_id=inner)
    _drafts(walk, graph)
    walk("editor", "delete", "/api/graphs/{graph_id}", graph_id=graph)
    walk("editor", "post", "/api/graphs/{graph_id}/recover", graph_id=graph)
    folder = walk("editor", "post", "/api/folders", {"name": "Lab"})["id"]
    walk("editor", "patch", "/api/folders/{folder_id}", {"name": "Labor"}, folder_id=folder)
    inner = walk("editor", "post", "/api/folders", {"name": "In"})["id"]
    walk("editor", "put", "/api/folders/{folder_id}/parent", {"parent": folder}, folder_id=inner)
    walk("editor", "put", "/api/graphs/{graph_id}/folder", {"folder": folder}, graph_id=graph)
    walk("editor", "delete", "/api/folders/{folder_id}", folder_id=inner)
    rule = {"rule": {"readers": "all", "editors": []}}
    walk("editor", "put", "/api/graphs/{graph_id}/rule", rule, graph_id=graph)
    walk("editor", "put", "/api/folders/{folder_id}/rule", rule, folder_id=folder)
    _view_link(walk, "editor", graph)


def _drafts(walk: Walk, graph: str) -> None:
    made = walk("editor", "post", "/api/graphs/{graph_id}/drafts", {"name": "d"}, graph_id=graph)
    draft = made["id"]
    walk("editor", "patch", "/api/graphs/{graph_id}", {"description": "d"}, graph_id=draft)
    walk("editor", "post", "/api/drafts/{draft_id}/proposal", {}, draft_id=draft)
    walk("editor", "delete", "/api/drafts/{draft_id}/proposal", draft_id=draft)
    seen = walk.http["editor"].post(f"/api/drafts/{draft}/preview", json={}).json()
    moments = {"seq": seen["seq"], "draft_seq": seen["draft_seq"]}
    walk("editor", "post", "/api/drafts/{draft_id}/merge", moments, draft_id=draft)


def _library(walk: Walk) -> None:
    uses = walk("editor", "post", "/api/graphs", _file("uses", "Look"))["id"]
    document = walk("editor", "post", "/api/actions", _action("Look"))["id"]
    leaf = {"place": {"pvf_type": "string"}}
    newer = _action("Look") | {"input_parameters": leaf}
    walk("editor", "put", "/api/actions/{action_id}/umrf", newer, action_id=document)
    wanted = {"seq": 2, "graphs": [{"graph": uses, "seq": 1}]}
    walk("editor", "post", "/api/actions/{action_id}/uses", wanted, action_id=document)
    other = walk("editor", "post", "/api/actions", _action("Take"))["id"]
    taking = _file("taking", "Take")
    taking["actions"][0]["input_parameters"] = leaf
    graph = walk("editor", "post", "/api/graphs", taking)["id"]
    walk("editor", "post", "/api/actions/{action_id}/take", {"graph": graph}, action_id=other)
    built = {"package": "look", "ended_well": True, "at": "2026-11-28T10:00:00Z", "errors": []}
    walk("editor", "put", "/api/actions/{action_id}/build", built, action_id=document)


def _robots(walk: Walk) -> None:
    walk("runner", "post", "/api/robots", {"name": "Rover"})
    walk("runner", "patch", "/api/robots/{name}", {"domain": 77}, name="Rover")
    rights = {"operators": "all", "baton": True}
    walk("runner", "put", "/api/robots/{name}/rights", rights, name="Rover")
    walk("runner", "post", "/api/robots/{name}/baton/take", {}, name="Rover")
    walk("runner", "post", "/api/robots/{name}/baton/drop", name="Rover")
    walk("runner", "post", "/api/robots/{name}/lock", {"reason": "repair"}, name="Rover")
    walk("runner", "post", "/api/robots/{name}/unlock", {}, name="Rover")
    walk("runner", "post", "/api/robots/{name}/stop", name="Rover")
    walk("runner", "delete", "/api/robots/{name}", name="Rover")
    rules = walk.http["editor"].get("/api/graph-rules").json()
    walk("runner", "put", "/api/graph-rules", rules)
    walk("runner", "post", "/api/approvals", {"digest": "0" * 64})
    by = {"id": "local", "name": ""}
    release = {"version": "v", "digest": "0" * 64, "by": by, "at": "2026-11-28T10:00:00Z"}
    walk("runner", "put", "/api/releases/{version}", release, version="v")
    walk("runner", "delete", "/api/releases/{version}", version="v")


def _runs(walk: Walk) -> None:
    def started(name: str) -> str:
        run: str = walk("runner", "post", "/api/runs", start_of(name, "simulator"))["id"]
        return run

    run = started("one")
    _view_link(walk, "runner", run)
    walk("runner", "post", "/api/runs/{run}/pause", run=run)
    walk("runner", "post", "/api/runs/{run}/resume", run=run)
    changed = {"version": "v2", "digest": start_of("", "")["digest"], "umrf": GRAPH}
    walk("runner", "post", "/api/runs/{run}/modify", changed, run=run)
    walk("runner", "post", "/api/runs/{run}/stop", run=run)
    client = walk.http["runner"]
    until("the run is over", lambda: client.get(f"/api/runs/{run}").json()["ended_at"])
    walk("runner", "patch", "/api/runs/{run}/marks", {"note": "odd"}, run=run)
    walk("runner", "post", "/api/runs/{run}/notes", {"text": "odd"}, run=run)
    walk("runner", "post", "/api/runs/{run}/incident", {"reason": "odd"}, run=run)
    around = {"since": "2026-11-28T10:00:00Z", "until": "2026-11-28T12:00:00Z"}
    walk("editor", "post", "/api/audit/kept", {"run": run, **around})
    walk("runner", "post", "/api/expectations", {"name": "as before", "run": run})
    walk("runner", "delete", "/api/expectations/{name}", name="as before")
    repeated = {"start": start_of("repeated", "simulator")}
    repeat = walk("runner", "post", "/api/repeats", repeated)["id"]
    walk("runner", "post", "/api/repeats/{repeat}/close", repeat=repeat)
    walk("runner", "post", "/api/repeats/{repeat}/open", {"closings": 1}, repeat=repeat)
    walk("runner", "post", "/api/repeats/{repeat}/start", {"cell": 1}, repeat=repeat)
    _queue(walk, start_of)
    walk("runner", "post", "/api/stop")
    _view_link(walk, "runner", run)


def _view_link(walk: Walk, process: str, thing: str) -> None:
    wanted = {"thing": thing, "label": "for all", "days": 1}
    made = walk(process, "post", "/api/view-links", wanted)["id"]
    walk(process, "post", "/api/view-links/{link}/revoke", link=made)


def _ends(walk: Walk, product: Product) -> None:
    """Sign in and out as a browser does."""

    def browser() -> dict[str, str]:
        walk("editor", "post", "/api/session", {"token": TOKEN, "name": "Ann"}, by=origin)
        return origin | {"cookie": walk.cookie}

    origin = {"origin": product.url}
    session = "/api/session"
    for process in ("editor", "runner"):
        walk(process, "delete", session, by=browser())
    for path in ("/api/devices/{session}/end", "/api/sessions/{session}/end"):
        page = browser()
        listed = httpx.get(f"{product.url}/api/devices", headers=page, trust_env=False).json()
        by = page if "devices" in path else None
        walk("editor", "post", path, session=listed["this"], by=by)
    page = browser()
    url = product.url
    code = _once("post", f"{url}/api/devices/codes", headers=page).json()
    sent = _once("post", f"{url}/api/session/device", json={"code": code["code"]}, headers=origin)
    path = f"{url}/api/devices/codes/{code['id']}/answer"
    assert _once("post", path, json={"yes": True}, headers=page).is_success
    claim = {"claim": sent.json()["claim"]}
    added = walk("editor", "post", "/api/session/device/answer", claim, by=origin)
    walk("editor", "post", "/api/devices/end", by=page)
    person = added["signed_in"]["person"]["id"]
    walk("editor", "post", "/api/people/{person}/sessions/end", person=person)
