"""A server that people have lived in: graphs, edits of several, links, versions, runs of every end,
archives. And what it answers about all of that, so that it can be asked again later."""

import contextlib
import time
from collections.abc import AsyncIterator, Callable, Iterator
from functools import partial
from typing import Any, Final, Self

import httpx
import httpx_ws
from pycrdt import Doc, Map, Provider
from pycrdt.websocket.websocket import HttpxWebsocket

from support.product import Product

_LONG_AGO: Final = 0  # days: everything that is over
_NOTED: Final = ("pinned", "slow")
_PATROL: Final[dict[str, Any]] = {
    "graph_name": "patrol",
    "graph_description": "there and back",
    "graph_entry": [{"name": "Go", "instance_id": 0}],
    "graph_exit": [{"name": "Back", "instance_id": 0}],
    "actions": [
        {
            "name": "Go",
            "instance_id": 0,
            "type": "sync",
            "children": [{"name": "Back", "instance_id": 0}],
        },
        {
            "name": "Back",
            "instance_id": 0,
            "type": "sync",
            "parents": [
                {
                    "name": "Go",
                    "instance_id": 0,
                    "required": True,
                    "conditions": ["on_true -> run", "on_false -> run"],
                }
            ],
        },
    ],
}


class Guest:
    """A browser that came in by a link, or, without one, by the token."""

    def __init__(self, product: Product, name: str, body: dict[str, Any]) -> None:
        self.product = product
        self.http = httpx.Client(
            base_url=product.url, headers={"origin": product.url}, trust_env=False, timeout=20
        )
        answer = self.http.post("/api/session", json={**body, "name": name})
        self.person: dict[str, Any] = answer.json().get("person", {})

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.http.close()

    @property
    def headers(self) -> dict[str, str]:
        """The headers of the person's requests."""
        cookies = "; ".join(f"{name}={value}" for name, value in self.http.cookies.items())
        return {"cookie": cookies, "origin": self.product.url}

    @contextlib.asynccontextmanager
    async def drawing(self, graph: str) -> AsyncIterator[Doc[Any]]:
        """The document of a graph, in sync, as long as it is open."""
        doc: Doc[Any] = Doc()
        url = f"{self.product.url.replace('http', 'ws')}/api/graphs/{graph}/room"
        async with (
            httpx.AsyncClient(trust_env=False) as client,
            httpx_ws.aconnect_ws(url, client, headers=self.headers) as session,
            Provider(doc, HttpxWebsocket(session, graph)) as provider,
        ):
            await provider.synced.wait()
            yield doc


async def live(product: Product, token: str) -> list[str]:
    """Use a new server as people do, and return the links that stay open, as `ID.SECRET`."""
    with _owner(product.url, token) as editor, _owner(product.runner_url, token) as runner:
        links = {
            label: editor.post("/api/invitations", json={"role": role, "label": label}).json()
            for label, role in (("team", "editor"), ("visitors", "viewer"), ("gone", "operator"))
        }
        proofs = {label: link["path"].removeprefix("/#i=") for label, link in links.items()}
        with (
            Guest(product, "Ann", {"token": token}) as ann,
            Guest(product, "Ben", {"invitation": proofs["team"]}) as ben,
            Guest(product, "Eve", {"invitation": proofs["gone"]}),
        ):
            editor.post(f"/api/invitations/{links['gone']['id']}/revoke").raise_for_status()
            graphs = made(editor)
            await draw(editor, graphs, ann, ben)
            published(editor, graphs, ann, ben)
        _run(editor, runner)
    return [proofs["team"], proofs["visitors"]]


def made(editor: httpx.Client) -> list[str]:
    """Three graphs."""
    bodies: tuple[dict[str, Any], ...] = (_PATROL, {"name": "dock 🤖"}, {"name": "forgotten"})
    return [editor.post("/api/graphs", json=body).json()["id"] for body in bodies]


async def draw(editor: httpx.Client, graphs: list[str], ann: Guest, ben: Guest) -> None:
    for number, (guest, graph) in enumerate(((ann, graphs[0]), (ben, graphs[0]), (ben, graphs[1]))):
        async with guest.drawing(graph) as doc:
            actions = doc.get("actions", type=Map)
            for n in range(4):
                aid = f"aid{number}{n}".ljust(12, "x")
                actions[aid] = f"Work{number}"
                doc.get("comments", type=Map)[f"t{number}/m{n}"] = f'"comment {n} of {number}"'
        eventually(partial(_has, editor, graph, f"Work{number}"))


def published(editor: httpx.Client, graphs: list[str], ann: Guest, ben: Guest) -> None:
    """Two versions, another name, and one graph less."""
    ann.http.post(f"/api/graphs/{graphs[0]}/versions", json={"label": "first"}).raise_for_status()
    editor.patch(f"/api/graphs/{graphs[0]}", json={"name": "patrol north"}).raise_for_status()
    ben.http.post(f"/api/graphs/{graphs[0]}/versions", json={"label": "second"}).raise_for_status()
    editor.delete(f"/api/graphs/{graphs[2]}").raise_for_status()


def _has(editor: httpx.Client, graph: str, name: str) -> bool:
    found = editor.get(f"/api/graphs/{graph}/umrf").json()["actions"]
    return any(each["name"] == name for each in found)


def _run(editor: httpx.Client, runner: httpx.Client) -> None:
    scripts: dict[str, dict[str, Any]] = {
        "well": {"*": [{"after_s": 0.05}]},
        "failed": {"*": [{"after_s": 0.05, "result": "on_error", "message": "gripper jammed"}]},
        "pinned": {"*": [{"after_s": 0.05, "result": "on_false"}]},
        "slow": {"*": [{"after_s": 60, "stop_s": 0.05}]},
    }
    graph = next(g for g in editor.get("/api/graphs").json() if g["name"].startswith("patrol"))
    version = editor.post(f"/api/graphs/{graph['id']}/versions", json={}).json()
    runs = {}
    for name, behaviours in scripts.items():
        start = {
            "version": version["id"],
            "digest": version["digest"],
            "umrf": version["umrf"],
            "engine": "simulator",
            "request_id": f"request-{name}",
            "graph": graph["id"],
            "script": {"behaviours": behaviours},
        }
        started = runner.post("/api/runs", json=start)
        assert started.status_code == 201, started.text
        run = runs[name] = started.json()["id"]
        if name == "slow":
            eventually(partial(says, runner, run, "started_at"))
            runner.post(f"/api/runs/{run}/stop").raise_for_status()
        eventually(partial(says, runner, run, "ended_at"))
    marks = {"pinned": True, "note": "look here", "labels": ["demo"]}
    for name in _NOTED:
        runner.patch(f"/api/runs/{runs[name]}/marks", json=marks).raise_for_status()
    kept = {"run": runs["pinned"], "name": "patrol goes"}
    runner.post("/api/expectations", json=kept).raise_for_status()
    robot = {"name": "Marian", "domain": 139}
    runner.post("/api/robots", json=robot).raise_for_status()
    eventually(lambda: runner.post("/api/archive", json={"runs": _LONG_AGO}).json()["runs"] >= 2)


def says(runner: httpx.Client, run: str, what: str) -> bool:
    return runner.get(f"/api/runs/{run}").json()[what] is not None


def answers(product: Product, token: str) -> dict[str, Any]:
    """Return the server's answers about all that it holds, by path."""
    with _owner(product.url, token) as editor, _owner(product.runner_url, token) as runner:
        return {path: _plain(path, body) for path, body in _asked(editor, runner)}


def _asked(editor: httpx.Client, runner: httpx.Client) -> Iterator[tuple[str, Any]]:
    def ask(client: httpx.Client, path: str) -> tuple[str, Any]:
        answer = client.get(path)
        assert answer.status_code == 200, (path, answer.text)
        return path, answer.json()

    path, graphs = ask(editor, "/api/graphs")
    yield path, graphs
    for path in ("/api/people", "/api/invitations"):
        yield ask(editor, path)
    for graph in graphs:
        for what in ("umrf", "history", "versions"):
            yield ask(editor, f"/api/graphs/{graph['id']}/{what}")
        for version in editor.get(f"/api/graphs/{graph['id']}/versions").json():
            yield ask(editor, f"/api/versions/{version['id']}")
    path, runs = ask(runner, "/api/runs")
    yield path, runs
    for run in runs:
        for what in ("", "/marks", "/film"):
            yield ask(runner, f"/api/runs/{run['id']}{what}")
    for path in ("/api/expectations", "/api/labels"):
        yield ask(runner, path)


def _plain(path: str, body: Any) -> Any:
    """Return a body without the parts that depend on the server's address and on who has been
    there."""
    if path == "/api/invitations":
        return body["invitations"]
    if path == "/api/people":
        return [{key: each[key] for key in each.keys() - {"color"}} for each in body]
    return body


def differences(old: Any, new: Any, where: str = "") -> Iterator[str]:
    """Return the places where the new answer lacks or changes a value; additions are no
    difference."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in old:
            if key not in new:
                yield f"{where}/{key}: {old[key]!r} is missing"
            else:
                yield from differences(old[key], new[key], f"{where}/{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for number, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from differences(one, other, f"{where}/{number}")
    elif old != new:
        yield f"{where}: {old!r} became {new!r}"


@contextlib.contextmanager
def _owner(url: str, token: str) -> Iterator[httpx.Client]:
    headers = {"authorization": f"Bearer {token}"}
    with httpx.Client(base_url=url, headers=headers, trust_env=False, timeout=30) as client:
        yield client


def eventually(holds: Callable[[], Any], patience: float = 30.0) -> None:
    deadline = time.monotonic() + patience
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.05)
