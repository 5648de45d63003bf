"""Links that show one thing, at every route and socket of both processes: the routes are those that the
two OpenAPI documents name, and what others have is full of words that no answer may hold.
"""

import json
import os
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import httpx
import msgspec
import pytest
from pycrdt import Doc, Map
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from action_assistant.editor.crdt import messages
from action_assistant.errors import CannotStart, Refused
from action_assistant.settings import frame_origins
from action_assistant.web.auth.keys import Keys, PersonRef
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.view_links import ViewLinks
from support.product import TOKEN, Product, running
from web.auth.test_invitations import eventually
from web.auth.test_roles import PROCESSES, url_of

KEYS = Keys(TOKEN)
SITE = "https://wiki.lab.example"
#: In every name, text and id of what a link does not show.
CANARY = "canary"
#: All that a link reaches, by the process and the kind of the link.
REACHED = {
    ("editor", "graph"): {"/api/view/graph", "/api/view/graph/events"},
    ("runner", "run"): {"/api/view/run", "/api/view/run/events"},
}


class Shown(NamedTuple):
    """A server with a graph and a run that are shown by links, and much else that is not."""

    product: Product
    graph: str
    run: str
    other_graph: str
    other_run: str
    keys: dict[str, str]


def graph_of(name: str, action: str) -> dict[str, Any]:
    """A graph of one action, which waits."""
    one = {"name": action, "instance_id": 0}
    return {
        "graph_name": name,
        "entry": [one],
        "exit": [one],
        "actions": [{**one, "type": "sync"}],
    }


def started(product: Product, graph: str, who: str) -> str:
    """The id of a run in the simulator that goes on for a minute."""
    page = {
        "cookie": f"aa_{product.port}={KEYS.sealed(KEYS.new_session(who))}",
        "origin": product.url,
    }
    with product.editor() as editor, product.runner() as runner:
        version = editor.post(f"/api/graphs/{graph}/versions", json={}).json()
        start = {
            **{name: version[name] for name in ("digest", "umrf")},
            "version": version["id"],
            "graph": graph,
            "engine": "simulator",
            "request_id": f"of-{graph}",
            "script": {"behaviours": {"*": [{"after_s": 60}]}},
        }
        del runner.headers["authorization"]
        made = runner.post("/api/runs", json=start, headers=page)
        assert made.status_code == 201, made.text
        run: str = made.json()["id"]
        return run


def link(product: Product, process: str, thing: str, **more: Any) -> dict[str, Any]:
    """A link to a thing, as its owner sees it."""
    url = f"{url_of(product, process)}/api/view-links"
    headers = {"authorization": f"Bearer {TOKEN}"}
    made = httpx.post(url, json={"thing": thing, **more}, headers=headers, trust_env=False)
    assert made.status_code == 201, made.text
    found: dict[str, Any] = made.json()
    return found


def key_of(made: dict[str, Any]) -> str:
    """The key in the address of a link."""
    key: str = made["path"].split("=", 1)[1]
    return key


def bearer(key: str) -> dict[str, str]:
    return {"authorization": f"Bearer {key}"}


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shown]:
    """A running server whose owner shares one graph and one run."""
    os.environ["ACTION_ASSISTANT_FRAME_ORIGINS"] = SITE
    try:
        with running(tmp_path_factory.mktemp("views") / "data") as product:
            yield filled(product)
    finally:
        del os.environ["ACTION_ASSISTANT_FRAME_ORIGINS"]


def filled(product: Product) -> Shown:
    """Fill a server: people, folders, labels, graphs, robots, runs, tokens, versions, comments."""
    with product.editor() as editor, product.runner() as runner:
        graphs = [
            editor.post("/api/graphs", json=graph_of(*each)).json()["id"]
            for each in (("Shared task", "Wait"), (f"{CANARY} task", f"{CANARY}Act"))
        ]
        for graph, who in zip(graphs, (f"{CANARY} starter", f"{CANARY} other"), strict=True):
            started(product, graph, who)
        runs = {each["graph"]: each["id"] for each in runner.get("/api/runs").json()}
        for each in runs.values():
            noted = {"note": f"{CANARY} note", "labels": [f"{CANARY} label"], "pinned": True}
            assert runner.patch(f"/api/runs/{each}/marks", json=noted).is_success
        editor.post("/api/members", json={"name": f"{CANARY} member", "role": "viewer"})
        editor.post("/api/folders", json={"name": f"{CANARY} folder"})
        editor.post("/api/tokens", json={"name": f"{CANARY} token", "scopes": ["read"]})
        robot = {"name": f"{CANARY}bot", "domain": 191}
        assert runner.post("/api/robots", json=robot).is_success
        comment(product, graphs[0])
        told = editor.get("/api/people").text + runner.get("/api/runs").text
        assert told.count(CANARY) > 4  # there is much that could be told
    keys = {
        "graph": key_of(link(product, "editor", graphs[0], label=f"{CANARY} label")),
        "run": key_of(link(product, "runner", runs[graphs[0]], label=f"{CANARY} label")),
    }
    return Shown(product, graphs[0], runs[graphs[0]], graphs[1], runs[graphs[1]], keys)


def comment(product: Product, graph: str) -> None:
    """Write a comment on the shared graph, with the name of somebody."""
    session = KEYS.new_session(f"{CANARY} commenter", role="editor")
    before = seq_of(product, graph)
    ours: Doc[Any] = Doc()
    said = {"text": f"{CANARY} said", "author": session.person.id, "name": session.person.name}
    ours.get("comments", type=Map)["t1/m1"] = json.dumps(said)
    with connect(
        f"{product.url}/api/graphs/{graph}/room".replace("http", "ws", 1),
        additional_headers={"cookie": f"aa_{product.port}={KEYS.sealed(session)}"},
        origin=product.url,
        proxy=None,
    ) as socket:
        socket.send(messages.question(Doc().get_state()))
        socket.send(messages.answer(messages.NOTHING_NEW))
        socket.send(messages.change(ours.get_update()))
        eventually(lambda: seq_of(product, graph) > before)


def seq_of(product: Product, graph: str) -> int:
    """The number of the last change of a graph."""
    with product.editor() as editor:
        return int(editor.get(f"/api/graphs/{graph}/umrf").headers["x-seq"])


def asked(client: httpx.Client, method: str, url: str, key: str) -> tuple[int, str]:
    """The status and the text of an answer; of one that does not end, its begin."""
    content = b"" if method in {"get", "delete"} else b"{}"
    with client.stream(method, url, headers=bearer(key), content=content) as answer:
        if "event-stream" in answer.headers.get("content-type", ""):
            text = next(answer.iter_text()) if "/run/" in url else ""
        else:
            text = answer.read().decode()
        return answer.status_code, f"{answer.headers}{text}"


@pytest.mark.parametrize("process", PROCESSES)
@pytest.mark.parametrize("kind", ["graph", "run"])
def test_a_link_reaches_its_own_thing_and_no_other_route(
    shown: Shown, process: str, kind: str
) -> None:
    product, key = shown.product, shown.keys[kind]
    reached = REACHED.get((process, kind), set())
    headers = {"authorization": f"Bearer {TOKEN}"}
    base = url_of(product, process)
    paths = httpx.get(f"{base}/schema/openapi.json", headers=headers, trust_env=False).json()[
        "paths"
    ]
    assert reached <= paths.keys()
    wrong, cells = [], 0
    with httpx.Client(base_url=base, trust_env=False, timeout=20) as client:
        for path, item in paths.items():
            for method in (*item, "head"):
                for ids in ((shown.graph, shown.run), (shown.other_graph, shown.other_run)):
                    names = iter([ids[0 if "graph" in path or "draft" in path else 1], "x", "y"])
                    url = re.sub(r"\{[^}]*\}", lambda _, n=names: next(n), path)
                    status, text = asked(client, method, url, key)
                    opens = path in reached and method == "get"
                    cells += 1
                    refused = {401} if not reached else {403, 404}
                    if (status != 200 if opens else status not in refused) or CANARY in text:
                        wrong.append((method, url, status, text[:300]))
        for url in ("/", "/view", "/help/", "/schema", "/metrics", "/readyz", "/api/view/", "/x"):
            assert asked(client, "get", url, key)[0] in {401, 403}, url
    assert wrong[:10] == []
    assert cells > 2 * len(paths)


@pytest.mark.parametrize("kind", ["graph", "run"])
def test_no_socket_takes_a_link(shown: Shown, kind: str) -> None:
    product, key = shown.product, shown.keys[kind]
    for url in (f"{product.url}/api/graphs/{shown.graph}/room", f"{product.runner_url}/api/live"):
        for more in ({"additional_headers": bearer(key)}, {"subprotocols": [key]}):
            with (
                pytest.raises(InvalidStatus) as refused,
                connect(url.replace("http", "ws", 1), proxy=None, open_timeout=5, **more),
            ):
                pass
            assert refused.value.response.status_code in {401, 403}


def test_a_link_shows_its_thing(shown: Shown) -> None:
    product = shown.product
    with httpx.Client(trust_env=False) as client:
        graph = client.get(f"{product.url}/api/view/graph", headers=bearer(shown.keys["graph"]))
        assert graph.json()["umrf"]["graph_name"] == "Shared task"
        run = client.get(f"{product.runner_url}/api/view/run", headers=bearer(shown.keys["run"]))
        assert run.json()["run"]["graph_name"] == "Shared task"
        assert run.json()["run"]["actions"].keys() == {"Wait_0"}
        assert client.get(f"{product.url}/api/view").json() == {
            "runner_url": product.runner_url,
            "frame_origins": [SITE],
        }


def test_a_stream_of_a_run_goes_on_until_the_run_is_over(shown: Shown) -> None:
    product = shown.product
    with product.editor() as editor:
        graph = editor.post("/api/graphs", json=graph_of("Followed", "Wait")).json()["id"]
    run = started(product, graph, f"{CANARY} starter")
    url = f"{product.runner_url}/api/view/run/events"
    headers = bearer(key_of(link(product, "runner", run)))
    beats, states = 0, []
    with (
        product.runner() as runner,
        httpx.Client(trust_env=False, timeout=20) as client,
        client.stream("get", url, headers=headers) as follows,
    ):
        for line in follows.iter_lines():
            if not line.startswith("data: "):
                continue
            said = json.loads(line.removeprefix("data: "))
            if said["type"] == "run":
                states.append(said["run"]["state"])
            elif (beats := beats + 1) == 2:  # the next state comes long after this one was encoded
                assert runner.post(f"/api/runs/{run}/stop").is_success
    assert len(states) > 1


def test_persons_and_programs_do_not_use_the_routes_of_links(shown: Shown) -> None:
    product = shown.product
    session = KEYS.sealed(KEYS.new_session("Ada"))
    for (process, _), paths in REACHED.items():
        for path in paths:
            url = f"{url_of(product, process)}{path}"
            cookie = {"cookie": f"aa_{product.port}={session}"}
            for headers, status in (({}, 401), (bearer(TOKEN), 403), (cookie, 403)):
                assert httpx.get(url, headers=headers, trust_env=False).status_code == status


def test_a_link_counts_before_the_session_of_the_browser_and_changes_nothing_of_it(
    shown: Shown,
) -> None:
    cookie = f"aa_{shown.product.port}={KEYS.sealed(KEYS.new_session('Ada'))}"
    headers = {**bearer(shown.keys["graph"]), "cookie": cookie}
    with httpx.Client(base_url=shown.product.url, trust_env=False) as client:
        assert client.get("/api/graphs", headers=headers).status_code == 403
        seen = client.get("/api/view/graph", headers=headers)
        assert (seen.status_code, "set-cookie" in seen.headers) == (200, False)
        assert client.get("/api/session", headers={"cookie": cookie}).status_code == 200


def test_no_address_and_no_cookie_holds_the_key(shown: Shown) -> None:
    product, key = shown.product, shown.keys["graph"]
    url = f"{product.url}/api/view/graph"
    for name in ("key", "token", "graph", "authorization"):
        assert httpx.get(url, params={name: key}, trust_env=False).status_code == 401
    cookie = {"cookie": f"aa_{product.port}={key}"}
    assert httpx.get(url, headers=cookie, trust_env=False).status_code == 401
    assert key.split("_", 2)[2] not in product.log.read_text()


@pytest.mark.parametrize(("process", "kind"), list(REACHED))
@pytest.mark.parametrize("end", ["revoked", "marked", "expired", "file"])
def test_an_ended_link_is_refused_and_what_it_had_open_is_closed(
    shown: Shown, process: str, kind: str, end: str
) -> None:
    product = shown.product
    days = 2 / 86_400 if end == "expired" else 7
    made = link(product, process, getattr(shown, kind), days=days)
    base, headers = f"{url_of(product, process)}/api/view/{kind}", bearer(key_of(made))
    with (
        httpx.Client(trust_env=False, timeout=20) as client,
        client.stream("get", f"{base}/events", headers=headers) as follows,
    ):
        assert follows.status_code == 200
        match end:
            case "revoked":
                revoke = f"{url_of(product, process)}/api/view-links/{made['id']}/revoke"
                assert client.post(revoke, headers=bearer(TOKEN)).status_code == 204
            case "marked":
                Revocations(product.data).end_view(made["id"])
            case "file":
                (product.data / "views" / f"{made['id']}.json").unlink()
        if end == "file":  # no new request; a mark or the end cuts what is open
            assert client.get(base, headers=headers).status_code == 401
            return
        began = time.monotonic()
        for _ in follows.iter_bytes():
            assert time.monotonic() - began < 15
        refused = client.get(base, headers=headers)
        word = "expired" if end == "expired" else "revoked"
        assert (refused.status_code, word in refused.json()["detail"]) == (401, True)
    with product.editor() as editor, product.runner() as runner:
        owner = editor if process == "editor" else runner
        assert made["id"] not in {each["id"] for each in owner.get("/api/view-links").json()}


def test_a_link_to_a_graph_ends_with_the_graph(shown: Shown) -> None:
    with shown.product.editor() as editor:
        graph = editor.post("/api/graphs", json=graph_of("Short", "Wait")).json()["id"]
        headers = bearer(key_of(link(shown.product, "editor", graph)))
        url = f"{shown.product.url}/api/view/graph"
        assert httpx.get(url, headers=headers, trust_env=False).status_code == 200
        editor.delete(f"/api/graphs/{graph}")
        for path in (url, f"{url}/events"):
            assert httpx.get(path, headers=headers, trust_env=False).status_code == 404
        nowhere = editor.post("/api/view-links", json={"thing": "nowhere"})
        assert nowhere.status_code == 404


def test_owners_alone_make_list_and_revoke_links_and_see_how_often_they_were_opened(
    shown: Shown,
) -> None:
    product = shown.product
    made = link(product, "editor", shown.graph, label="the wiki")
    key = bearer(key_of(made))
    with httpx.Client(base_url=product.url, trust_env=False) as client:
        client.get("/api/view/graph", headers=key)
        client.get("/api/view/graph", headers=key)
        client.get("/api/view/graph", params={"again": True}, headers=key)
        found = client.get("/api/view-links", params={"thing": shown.graph}, headers=bearer(TOKEN))
        (listed,) = [each for each in found.json() if each["id"] == made["id"]]
        assert (listed["label"], listed["opened"]) == ("the wiki", 2)
        assert listed["path"] == made["path"]
        for days in (0, -1, 366, 1e300):
            bad = {"thing": shown.graph, "days": days}
            answer = client.post("/api/view-links", json=bad, headers=bearer(TOKEN))
            assert answer.status_code == 400, days
    with product.editor() as editor:
        editor.post(f"/api/view-links/{made['id']}/revoke")
        again = editor.post(f"/api/view-links/{made['id']}/revoke")
        assert again.status_code == 404
        rows = editor.get("/api/audit").json()["rows"]
        texts = [each["text"] for each in rows if made["id"] in each["text"]]
        assert [each.split()[0] for each in texts] == ["revoked", "made"]


def test_only_the_page_of_links_may_stand_in_a_frame_and_only_on_named_sites(
    shown: Shown,
) -> None:
    html = {"accept": "text/html"}
    with httpx.Client(base_url=shown.product.url, trust_env=False, headers=html) as client:
        view = client.get("/view").headers
        assert f"frame-ancestors {SITE}" in view["content-security-policy"]
        assert "x-frame-options" not in view
        for path in ("/", "/graphs/x", "/view/x", "/viewer", "/api/view", "/help/", "/healthz"):
            other = client.get(path).headers
            assert "frame-ancestors 'none'" in other["content-security-policy"], path
            assert other["x-frame-options"] == "DENY", path


def test_sites_that_may_show_links_are_origins_by_name() -> None:
    name = "ACTION_ASSISTANT_FRAME_ORIGINS"
    assert frame_origins({}) == ()
    good = "https://wiki.lab.example, http://10.0.0.2:8080 https://*.lab.example"
    assert len(frame_origins({name: good})) == 3
    for bad in ("*", "https://*", "wiki", "https://a/b", "https://a;script-src", "'self'"):
        with pytest.raises(CannotStart):
            frame_origins({name: bad})


def test_a_key_is_for_one_thing_under_one_token_until_one_end(tmp_path: Path) -> None:
    """The key of a link seals what its file says: it opens nothing else, nor for longer."""
    revoked = Revocations(tmp_path)
    links = ViewLinks(tmp_path, KEYS, revoked, "graph")
    made = links.make("mine", "", 1, PersonRef("p", "P"))
    key = made.path.split("=", 1)[1]
    found = links.opens(key)
    assert found is not None
    assert (found.kind, found.thing) == ("graph", "mine")
    file = tmp_path / "views" / f"{made.id}.json"
    sealed = file.read_bytes()
    changes: list[dict[str, object]] = [
        {"thing": "other"},
        {"kind": "run"},
        {"expires": "2099-01-01T00:00:00Z"},
        {"id": "abcdefghijkl"},
    ]
    for change in changes:
        file.write_bytes(msgspec.json.encode({**json.loads(sealed), **change}))
        for process in (links, ViewLinks(tmp_path, KEYS, revoked, "run")):
            with pytest.raises(Refused):
                process.opens(key)
    file.write_bytes(sealed)
    assert links.opens(key) is not None
    for bad in (
        key[:-1],
        key + "a",
        key[:-1] + ("a" if key[-1] != "a" else "b"),
        "view_",
        "view_x",
    ):
        with pytest.raises(Refused):
            links.opens(bad)
    with pytest.raises(Refused):
        ViewLinks(tmp_path, Keys("o" * 43), revoked, "graph").opens(key)
    assert links.opens(TOKEN) is None
