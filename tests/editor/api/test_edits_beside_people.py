"""People who edit a graph ten times a second, and commands of the server that take longer than that: none is refused
because of them, and nothing of theirs is lost."""

import asyncio
import os
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import httpx
import pytest
from pycrdt import Doc, Map

from editor.process import BEARER, Editor, running

PAUSE_S: Final = 0.1
ACTIONS: Final = 1000 if os.environ.get("TEST_LONG") else 300
TIMES: Final = 3  # each command
MARIS: Final = 7  # the number of the action that Mari edits


def chain(count: int) -> dict[str, Any]:
    """Return a graph of so many actions, one after the other, with two parameters each."""
    ends = [{"name": f"Act{n % 40}", "instance_id": n} for n in range(count)]
    actions = [
        {
            **end,
            "type": "sync",
            "description": "first",
            "input_parameters": {
                "speed": {"pvf_type": "number", "pvf_value": n},
                "goal": {"pvf_type": "string", "pvf_value": f"goal {n}"},
            },
            "children": [
                {**child, "conditions": {"on_true": "run"}} for child in ends[n + 1 :][:1]
            ],
        }
        for n, end in enumerate(ends)
    ]
    entry_and_exit = {"graph_entry": ends[:1], "graph_exit": ends[-1:]}
    return {"graph_name": "Chain", **entry_and_exit, "actions": actions}


class Eve:
    """Edits the descriptions of all actions but one, without a rest."""

    def __init__(self, doc: Doc[Any], keys: list[str]) -> None:
        self._doc = doc
        self._keys = keys
        self.said: dict[str, str] = {}

    async def edit(self) -> None:
        shared = self._doc.get("actions", type=Map)
        number = 0
        while True:
            key = f"{self._keys[number % len(self._keys)]}|description"
            shared[key] = self.said[key] = f"Eve's {number}"
            number += 1
            await asyncio.sleep(PAUSE_S)


class Mari:
    """A program that commands the server to edit a graph."""

    def __init__(self, http: httpx.AsyncClient, graph: str) -> None:
        self._http = http
        self._path = f"/api/graphs/{graph}"

    async def _text(self) -> tuple[int, dict[str, Any]]:
        answer = await self._http.get(f"{self._path}/umrf")
        return int(answer.headers["x-seq"]), answer.json()

    async def put(self, text: str) -> httpx.Response:
        seq, umrf = await self._text()
        umrf["actions"][MARIS]["description"] = text
        return await self._http.put(f"{self._path}/umrf", params={"seq": seq}, json=umrf)

    async def restore_one(self, key: str) -> httpx.Response:
        return await self._http.post(f"{self._path}/restore", json={"seq": 1, "of": key})

    async def rename(self, name: str) -> httpx.Response:
        return await self._http.patch(self._path, json={"name": name})

    async def restore(self) -> httpx.Response:
        return await self._http.post(f"{self._path}/restore", json={"seq": 1})

    async def revert_eve(self) -> httpx.Response:
        seq, _ = await self._text()
        body = {"author": "local", "from_seq": seq - 3, "seq": seq}
        return await self._http.post(f"{self._path}/revert", json=body)


async def _with_all(doc: Doc[Any], said: dict[str, str]) -> None:
    """Wait until a document holds these values."""
    shared = doc.get("actions", type=Map)
    async with asyncio.timeout(60):
        while any(shared.get(key) != text for key, text in said.items()):  # noqa: ASYNC110 - of them
            await asyncio.sleep(0.05)


async def _edited(editor: Editor, http: httpx.AsyncClient) -> None:
    made = await http.post("/api/graphs", json=chain(ACTIONS))
    graph = made.json()["id"]
    mari, of_eve, other = Mari(http, graph), Doc[Any](), Doc[Any]()
    async with editor.joined(graph, of_eve), editor.joined(graph, other):
        keys = [key for key in of_eve.get("actions", type=Map) if "|" not in key]
        marked = f"Act{MARIS}"
        shared = of_eve.get("actions", type=Map)
        (maris,) = [key for key in keys if shared[key] == marked][:1]
        eve = Eve(of_eve, [key for key in keys if shared[key] != marked])
        editing = asyncio.create_task(eve.edit())
        answers = []
        for n in range(TIMES):
            answers += [await mari.put(f"Mari's {n}"), await mari.restore_one(maris)]
            answers.append(await mari.rename(f"Chain {n}"))
        assert [each.text for each in answers if not each.is_success] == []
        await _with_all(other, dict(eve.said))
        assert other.get("meta", type=Map)["name"] == f"Chain {TIMES - 1}"
        for _ in range(TIMES):
            answers += [await mari.revert_eve(), await mari.restore()]
        assert [each.text for each in answers if not each.is_success] == []
        editing.cancel()
        with suppress(asyncio.CancelledError):
            await editing
        shared[maris] = "Eve is still here"  # what she did last may have come before the restore
        await _with_all(other, {maris: "Eve is still here"})


@pytest.mark.timeout(600)
async def test_commands_are_not_refused_because_people_edit_ten_times_a_second(
    tmp_path: Path,
) -> None:
    with running(tmp_path / "data") as editor:
        async with httpx.AsyncClient(
            base_url=editor.url, headers=BEARER, trust_env=False, timeout=120
        ) as http:
            await _edited(editor, http)
