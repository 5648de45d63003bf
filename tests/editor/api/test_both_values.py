"""Two people set one field while one of them is offline: the history shows both values, and which one stayed."""

import json
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

import anyio
import httpx
from httpx_ws import aconnect_ws
from pycrdt import Doc, Map, Provider
from pycrdt.websocket.websocket import HttpxWebsocket

from editor.process import BEARER, TOKEN, Editor

_GRAPH = {
    "graph_name": "pair",
    "actions": [{"name": "Look", "instance_id": 0, "type": "sync"}],
}


async def _person(editor: Editor, name: str) -> dict[str, str]:
    headers = {"origin": editor.url}
    async with httpx.AsyncClient(base_url=editor.url, headers=headers, trust_env=False) as http:
        answer = await http.post("/api/session", json={"token": TOKEN, "name": name})
        assert answer.is_success
        cookies = "; ".join(f"{key}={value}" for key, value in http.cookies.items())
        return {"cookie": cookies, **headers}


@asynccontextmanager
async def _online(
    editor: Editor, graph: str, who: dict[str, str], doc: Doc[Any]
) -> AsyncIterator[None]:
    async with (
        httpx.AsyncClient(trust_env=False) as client,
        aconnect_ws(editor.room(graph), client, headers=who) as session,
        Provider(doc, HttpxWebsocket(session, graph)) as provider,
    ):
        await provider.synced.wait()
        yield


async def _until(holds: Callable[[], Awaitable[bool]]) -> None:
    for _ in range(1000):
        if await holds():
            return
        await anyio.sleep(0.02)
    raise AssertionError("it never came")


def _map(doc: Doc[Any], root: str) -> "Map[Any]":
    found: Map[Any] = doc.get(root, type=Map)
    return found


async def test_the_history_shows_both_values_whichever_person_was_offline(editor: Editor) -> None:
    async with httpx.AsyncClient(base_url=editor.url, headers=BEARER, trust_env=False) as http:

        async def ask(path: str, **params: Any) -> Any:
            answer = await http.get(f"/api/graphs/{graph}{path}", params=params)
            assert answer.is_success, answer.text
            return answer.json()

        async def stored(value: str) -> bool:
            description = (await ask("/umrf"))["actions"][0].get("description")
            return bool(description == value)

        async def is_after(seq: int) -> bool:
            return bool((await ask(""))["seq"] > seq)

        graph = (await http.post("/api/graphs", content=json.dumps(_GRAPH))).json()["id"]
        ada, mari = await _person(editor, "Ada"), await _person(editor, "Mari")
        # Yjs keeps the value of the higher client.
        mine: Doc[Any] = Doc(client_id=1)
        theirs: Doc[Any] = Doc(client_id=2)
        async with _online(editor, graph, ada, mine):
            (aid,) = [key for key in [*_map(mine, "actions")] if "|" not in key]
            _map(mine, "actions")[f"{aid}|description"] = "before"
            await _until(partial(stored, "before"))
        _map(mine, "actions")[f"{aid}|description"] = "by Ada"
        async with _online(editor, graph, mari, theirs):
            _map(theirs, "actions")[f"{aid}|description"] = "by Mari"
            await _until(partial(stored, "by Mari"))
        newest = (await ask(""))["seq"]
        async with _online(editor, graph, ada, mine):
            await _until(partial(is_after, newest))
        assert await stored("by Mari")

        values = await ask("/blame/values", of=aid, field="description")
        told = [(v["author"]["name"], v["value"], v.get("overwritten", False)) for v in values]
        assert told == [
            ("Mari", "by Mari", False),  # programs take the first one for the value that stands
            ("Ada", "by Ada", True),
            ("Ada", "before", False),
        ]
        assert values[1]["before"] == "by Mari"

        entry = (await ask("/history"))[0]
        assert entry["author"]["name"] == "Ada"
        (action,) = entry["changes"]["overwritten"]["actions"]
        assert (action["aid"], action["name"], action["change"]) == (aid, "Look_0", "changed")
        lost = {"field": "description", "before": "by Ada", "after": "by Mari"}
        assert action["fields"] == [lost]

        (step,) = await ask("/changes", after=newest, upto=99)
        assert (step["before"], step["after"]) == ("by Mari", "by Mari")
        assert step["overwritten"] == "by Ada"
        # The author of the value that stands is still its author.
        (field,) = (f for f in await ask("/blame", of=aid) if f["field"] == "description")
        assert (field["author"]["name"], field["value"]) == ("Mari", "by Mari")
