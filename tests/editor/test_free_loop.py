"""No route and no background task does work on the editor's event loop that grows with a graph.

Counted, not timed: the calls of Python functions on the loop's thread, the values in what workers are sent and send
back, and the rows that this process reads, while the same thing is done with a small graph and with one twelve times
as large. A document as bytes is one value, however long it is.
"""

import json
import pickletools
import re
import sys
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import contextmanager
from functools import partialmethod
from pathlib import Path
from types import FrameType
from typing import Any, Final

import httpx
import msgspec
import pytest

from action_assistant.editor.app import create_app
from action_assistant.editor.crdt import replica
from action_assistant.editor.crdt.updates.update_pieces import PIECE_BYTES
from action_assistant.editor.history import change_index
from action_assistant.editor.rooms import open_rooms
from action_assistant.journal.journal import Journal
from action_assistant.settings import EditorSettings
from action_assistant.web.monitoring import monitoring
from action_assistant.web.workers import lanes
from editor.in_process import URL, browser, lifespan
from editor.process import BEARER
from support.openapi import documents
from support.product import TOKEN

# The application is made within a loop here.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

SMALL: Final = 20  # actions
LARGE: Final = 240
#: A difference by chance: a task that happens to run meanwhile, another turn of a loop.
SLACK: Final = 1_000
#: Files of the event loop itself: how often it turns grows with the time that workers take.
TURNS: Final = re.compile(r"[/\\](asyncio|anyio|sniffio|selectors\.py)\b")
#: The loop knows the names of a graph's actions, to find the graphs inside; a key or an arrow would be many times this.
VALUES: Final = 5 * (LARGE - SMALL)


class Work(msgspec.Struct):
    """The amount of work. `calls`: on the loop's thread; `values`: in what workers were sent and
    sent back; `rows`: read or written by this process in one statement, at most; `applied`:
    bytes that the CRDT library was given in one call, at most."""

    calls: int = 0
    values: int = 0
    rows: int = 0
    applied: int = 0


def file_of(actions: int, name: str) -> bytes:
    """A UMRF file: a chain of actions."""
    names = [{"name": f"Act{n}", "instance_id": 0} for n in range(actions)]
    made = [
        {
            **each,
            "type": "sync",
            # One stands for a graph that takes nothing.
            "input_parameters": {"speed": {"pvf_type": "number", "pvf_value": n}} if n != 5 else {},
            "parents": names[max(0, n - 1) : n],
            "children": names[n + 1 : n + 2],
        }
        for n, each in enumerate(names)
    ]
    graph = {"graph_name": name, "actions": made}
    ends = {"graph_entry": [names[0]], "graph_exit": [names[-1]]}
    return json.dumps({**graph, **ends}).encode()


class Served:
    """An editor in this process, and what it does meanwhile. `second`: another person, in another browser."""

    def __init__(self, http: httpx.AsyncClient, second: httpx.AsyncClient) -> None:
        self.http = http
        self.second = second
        self.work = Work()

    async def ask(self, method: str, path: str, body: Any = None) -> Any:
        content = body if isinstance(body, bytes) else json.dumps(body).encode()
        person = self.second if path.endswith("/answers") else self.http
        answer = await person.request(method, path, content=None if body is None else content)
        assert answer.is_success, (method, path, answer.status_code, answer.text[:500])
        is_json = answer.headers.get("content-type", "").startswith("application/json")
        return answer.json() if is_json and answer.content else None

    async def bring(self, actions: int, name: str) -> str:
        made: str = (await self.ask("POST", "/api/graphs", file_of(actions, name)))["id"]
        return made

    async def during(self, work: Callable[[], Awaitable[object]]) -> Work:
        """Count what is done while something goes on."""
        self.work = Work()

        def count(frame: FrameType, event: str, _: object) -> None:
            if event == "call" and not TURNS.search(frame.f_code.co_filename):
                self.work.calls += 1

        sys.setprofile(count)
        try:
            await work()
        finally:
            sys.setprofile(None)
        return self.work


@pytest.fixture
async def served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Served]:
    """An editor that counts, with real workers and a real database."""
    monkeypatch.setenv("ACTION_ASSISTANT_TOKEN", TOKEN)
    # No periodic work runs, or the counts would grow with the time that workers take.
    monkeypatch.setattr(change_index, "_PERIOD", 3600.0)
    monkeypatch.setattr(monitoring, "_TICK_S", 3600.0)
    monkeypatch.setattr(open_rooms, "_SILENCE", 3600.0)
    monkeypatch.setattr(
        open_rooms.Rooms, "__init__", partialmethod(open_rooms.Rooms.__init__, linger=3600.0)
    )
    settings = EditorSettings(
        data=tmp_path, database=f"sqlite:///{tmp_path / 'editor.db'}", port=8000, limits=False
    )
    app = create_app(settings)
    async with (
        lifespan(app),
        browser(app, headers=BEARER) as http,
        browser(app, headers={"origin": URL}) as second,
    ):
        signed_in = await second.post("/api/session", json={"token": TOKEN, "name": "Ben"})
        assert signed_in.is_success
        editor = Served(http, second)
        with counted(editor, monkeypatch):
            yield editor


@contextmanager
def counted(editor: Served, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Count what goes to workers and comes back, and what the database is asked, in the work of an editor."""
    done, asked, derived = lanes.Lane._done, Journal._ask, Journal.derive

    async def _done(lane: lanes.Lane, request: bytes) -> bytes:
        reply = await done(lane, request)
        editor.work.values += sum(values_in(each) for each in (request, reply[1:]))
        return reply

    async def _ask(journal: Journal, question: Callable[[Any], Any]) -> Any:
        found = await asked(journal, question)
        if isinstance(found, list | tuple):
            editor.work.rows = max(editor.work.rows, len(found))
        return found

    async def derive(journal: Journal, work: Callable[[Any], Any]) -> Any:
        rows = Counter[str]()

        def watched(connection: Any) -> Any:
            execute = connection.execute

            def executed(statement: Any, values: Any = None) -> Any:
                result = execute(statement, values)
                stored = len(values) if isinstance(values, list) else result.rowcount
                rows["most"] = max(rows["most"], stored)
                return result

            with monkeypatch.context() as patch:
                patch.setattr(connection, "execute", executed)
                return work(connection)

        found = await derived(journal, watched)
        editor.work.rows = max(editor.work.rows, rows["most"])
        return found

    applied = replica.Replica._applied, replica.Replica._apply

    def apply_ready(self: Any, update: bytes, read: Any, *, is_applied: bool = False) -> bool:
        if not is_applied:
            editor.work.applied = max(editor.work.applied, len(update))
        return applied[0](self, update, read, is_applied=is_applied)

    def apply(self: Any, *updates: bytes) -> None:
        editor.work.applied = max(editor.work.applied, sum(map(len, updates)))
        applied[1](self, *updates)

    with monkeypatch.context() as patch:
        patch.setattr(replica.Replica, "_applied", apply_ready)
        patch.setattr(replica.Replica, "_apply", apply)
        patch.setattr(lanes.Lane, "_done", _done)
        patch.setattr(Journal, "_ask", _ask)
        patch.setattr(Journal, "derive", derive)
        yield


def values_in(pickled: bytes) -> int:
    """Return how many values a pickle holds; a long text or many bytes count as one."""
    counting = sys.getprofile()
    sys.setprofile(None)  # this work is the test's own
    try:
        return sum(1 for _ in pickletools.genops(pickled))
    finally:
        sys.setprofile(counting)


#: The request of each operation that takes a graph, by its id. `{g}`: the graph, `{d}`: a draft of
#: it, `{v}`: a version, `{a}`: the key of one action. None: not asked here, and why.
ASKED: Final[dict[str, tuple[str, str, Any] | None]] = {
    "getGraph": ("GET", "/api/graphs/{g}", None),
    "getGraphRule": ("GET", "/api/graphs/{g}/rule", None),
    "putGraphRule": ("PUT", "/api/graphs/{g}/rule", {"rule": None}),
    "fileGraph": ("PUT", "/api/graphs/{g}/folder", {"folder": None}),
    "describeGraph": ("PATCH", "/api/graphs/{g}", {"description": "new"}),
    "deleteGraph": None,  # the last thing that is done to a graph; below
    "recoverGraph": ("POST", "/api/graphs/{g}/recover", None),
    "getUmrf": ("GET", "/api/graphs/{g}/umrf?at=1", None),
    "getBreakpoints": ("GET", "/api/graphs/{g}/breakpoints?at=1", None),
    "getProblems": ("GET", "/api/graphs/{g}/problems?seq=1", None),
    "getRewriting": ("POST", "/api/graphs/{g}/rewriting?seq=1", b"file"),
    "putUmrf": ("PUT", "/api/graphs/{g}/umrf?seq=1", b"file"),
    "getHistory": ("GET", "/api/graphs/{g}/history", None),
    "getDocument": ("GET", "/api/graphs/{g}/document?at=2", None),
    "getChanges": ("GET", "/api/graphs/{g}/changes?after=0&upto=2", None),
    "getDifference": ("GET", "/api/graphs/{g}/diff?from=1", None),
    "getBlame": ("GET", "/api/graphs/{g}/blame?of={a}", None),
    "getValues": ("GET", "/api/graphs/{g}/blame/values?of={a}&field=in/speed", None),
    "getSince": ("POST", "/api/graphs/{g}/since", {"good": 1, "script": {"behaviours": {}}}),
    "restoreGraph": ("POST", "/api/graphs/{g}/restore", {"seq": 1}),
    "revertGraph": ("POST", "/api/graphs/{g}/revert", {"author": "owner", "from_seq": 2, "seq": 9}),
    "listVersions": ("GET", "/api/graphs/{g}/versions", None),
    "publishVersion": ("POST", "/api/graphs/{g}/versions", {"label": "one"}),
    "getVersion": ("GET", "/api/versions/{v}", None),
    "getVersionBreakpoints": ("GET", "/api/versions/{v}/breakpoints", None),
    "getSight": ("GET", "/api/versions/{v}/sight", None),
    "releaseVersion": ("PUT", "/api/versions/{v}/release", None),
    "withdrawRelease": ("DELETE", "/api/versions/{v}/release", None),
    "getSubgraphs": ("GET", "/api/graphs/{g}/subgraphs", None),
    "downloadSubgraphs": ("GET", "/api/graphs/{g}/subgraphs.zip", None),
    "getFlatGraph": ("GET", "/api/graphs/{g}/flat", None),
    "makeFlatGraph": ("POST", "/api/graphs/{g}/flat", {"seq": 1, "name": "Flat{g}"}),
    "rehearse": ("POST", "/api/graphs/{g}/rehearsal", {"script": {"behaviours": {}}}),
    "lookAtExtraction": (
        "POST",
        "/api/graphs/{g}/extraction",
        {"actions": ["{a}"], "name": "P{g}"},
    ),
    "makeSubGraph": (
        "POST",
        "/api/graphs/{g}/subgraphs",
        {"actions": ["{a}"], "name": "Part{g}", "otherwise": True},
    ),
    "callUses": (
        "POST",
        "/api/graphs/{g}/uses",
        {"before": "Act7", "name": "Act7 again", "graphs": ["{g}"]},
    ),
    "lookAtUnpacking": ("POST", "/api/graphs/{g}/unpacking", {"action": "{i}"}),
    "listPackages": ("GET", "/api/graphs/{g}/packages", None),
    "getPackage": ("GET", "/api/graphs/{g}/packages/{p}", None),
    "downloadPackages": ("GET", "/api/graphs/{g}/packages.zip", None),
    "listDrafts": ("GET", "/api/graphs/{g}/drafts", None),
    "makeDraft": ("POST", "/api/graphs/{g}/drafts", {"name": "again"}),
    "getDraft": ("GET", "/api/drafts/{d}", None),
    "proposeDraft": ("POST", "/api/drafts/{d}/proposal", {}),
    "answerProposal": ("POST", "/api/drafts/{d}/answers", {"yes": True, "seq": 2}),
    "withdrawProposal": ("DELETE", "/api/drafts/{d}/proposal", None),
    "previewMerge": ("POST", "/api/drafts/{d}/preview", {}),
    "mergeDraft": None,  # needs the moments of both; below
}


class Named(msgspec.Struct):
    """A graph with all that routes may ask about."""

    actions: int
    graph: str
    draft: str
    version: str
    key: str
    inner: str
    package: str
    me: str

    def fill(self, wanted: tuple[str, str, Any]) -> tuple[str, str, Any]:
        """A request with the names of this graph in it."""
        method, path, body = wanted
        names = {"{g}": self.graph, "{d}": self.draft, "{v}": self.version, "{a}": self.key}
        names |= {"{i}": self.inner, "{p}": self.package, '"owner"': f'"{self.me}"'}
        if body == b"file":
            return method, _filled(path, names), file_of(self.actions, f"T{self.actions}")
        text = None if body is None else _filled(json.dumps(body), names).encode()
        return method, _filled(path, names), text


def _filled(text: str, names: dict[str, str]) -> str:
    for word, name in names.items():
        text = text.replace(word, name)
    return text


async def prepared(served: Served, actions: int) -> Named:
    """Bring a graph of this size, and everything that belongs to it, with a little past."""
    graph = await served.bring(actions, f"T{actions}")
    await served.ask("PATCH", f"/api/graphs/{graph}", {"description": "old"})
    document = await served.ask("GET", f"/api/graphs/{graph}/document?at=2")
    keys = {name: key for key, name in document["actions"].items() if "|" not in key}
    draft = (await served.ask("POST", f"/api/graphs/{graph}/drafts", {"name": "d"}))["id"]
    await served.ask("PATCH", f"/api/graphs/{draft}", {"description": "of the draft"})
    version = (await served.ask("POST", f"/api/graphs/{graph}/versions", {"note": "n"}))["id"]
    packages = (await served.ask("GET", f"/api/graphs/{graph}/packages"))["packages"]
    history = await served.ask("GET", f"/api/graphs/{graph}/history")
    edited = next(entry for entry in history if entry["kind"] == "edited")
    return Named(
        actions, graph, draft, version, keys["Act1"], keys["Act5"], packages[0]["package"],
        edited["author"]["id"],
    )  # fmt: skip


@pytest.mark.long
async def test_no_route_works_on_the_loop_as_long_as_its_graph_is_large(served: Served) -> None:
    await served.bring(3, "Act5")
    small, large = [await prepared(served, actions) for actions in (SMALL, LARGE)]
    grown: dict[str, tuple[Work, Work]] = {}

    async def compare(name: str, of: Callable[[Named], tuple[str, str, Any]]) -> None:
        found = [
            await served.during(lambda: served.ask(*of(each)))  # noqa: B023
            for each in (small, large)
        ]
        if not is_free(*found):
            grown[name] = found[0], found[1]

    for name, wanted in ASKED.items():
        if wanted is not None:
            await compare(name, lambda each: each.fill(wanted))  # noqa: B023
    merges = {}
    for each in (small, large):
        seen = await served.ask("POST", f"/api/drafts/{each.draft}/preview", {})
        moments = {"seq": seen["seq"], "draft_seq": seen["draft_seq"]}
        choices = {conflict["place"]: "draft" for conflict in seen["conflicts"]}
        merges[each.graph] = {**moments, "choices": choices}
    await compare(
        "mergeDraft", lambda each: ("POST", f"/api/drafts/{each.draft}/merge", merges[each.graph])
    )
    await compare("deleteGraph", lambda each: ("DELETE", f"/api/graphs/{each.graph}", None))
    assert not grown, "\n".join(f"{name}: {of}" for name, of in grown.items())


def is_free(small: Work, large: Work) -> bool:
    """Return whether the work for twelve times as many actions was done elsewhere."""
    return (
        large.calls <= small.calls + SLACK
        and large.values <= small.values + VALUES
        and large.rows <= max(small.rows, change_index.ROWS)
        and large.applied <= 2 * PIECE_BYTES
    )


#: Routes that take the file of a graph.
BROUGHT: Final = ("/api/graphs", "/api/graphs?preview=true", "/api/pieces")


async def test_no_import_works_on_the_loop_as_long_as_its_file_is_large(served: Served) -> None:
    grown: dict[str, tuple[Work, Work]] = {}
    for path in BROUGHT:
        small, large = [
            await served.during(
                lambda: served.ask("POST", path, file_of(actions, f"B{actions}"))  # noqa: B023
            )
            for actions in (SMALL, LARGE)
        ]
        if not is_free(small, large):
            grown[path] = small, large
    assert not grown, "\n".join(f"{name}: {of}" for name, of in grown.items())


async def test_the_index_of_an_imported_graph_is_made_elsewhere_and_stored_in_slices(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    for actions in (SMALL, LARGE):
        graph = await served.bring(actions, f"T{actions}")
        found.append(
            await served.during(lambda: served.ask("GET", f"/api/graphs/{graph}/document?at=1"))  # noqa: B023
        )
    small, large = found
    slices = LARGE * 30 // change_index.ROWS
    assert large.rows <= change_index.ROWS
    assert large.values <= small.values + VALUES
    assert large.calls <= small.calls + SLACK * slices


def test_every_route_that_takes_a_graph_is_asked(tmp_path: Path) -> None:
    editor = documents(tmp_path)["editor"]
    takes = {
        operation["operationId"]
        for path, item in editor["paths"].items()
        for operation in item.values()
        if any(word in path for word in ("{graph_id}", "{draft_id}", "{version_id}"))
    }
    assert takes == ASKED.keys()
