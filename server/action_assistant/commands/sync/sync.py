"""The command `sync`: round after round, what has changed here goes there, and the other way."""

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from msgspec.structs import replace

from action_assistant.commands.client import No, Server, add_server, running
from action_assistant.commands.sync.folder import Folder, SyncedFile, sha
from action_assistant.errors import CannotStart
from action_assistant.safe_text import one_line

_JSON: Final = {"content-type": "application/json"}
_CONFLICT: Final = 409
_TODAY: Final = "D3"


def _add_sync(sync: argparse.ArgumentParser) -> None:
    add_server(sync, "~/graphs --watch")
    sync.add_argument(
        "folder",
        type=Path,
        metavar="DIR",
        help="of files *.umrf.graph.json: new ones become graphs, graphs become files, changes of either "
        "go to the other; nothing is deleted, and where both changed the same, both stay",
    )
    sync.add_argument("--watch", action="store_true", help="go on until Ctrl-C")
    sync.add_argument(
        "--every",
        type=float,
        default=2.0,
        metavar="SECONDS",
        help="with --watch: default %(default)s",
    )
    sync.set_defaults(handler=_sync)


COMMANDS: Final = {"sync": _add_sync}


def _sync(options: argparse.Namespace) -> int:
    """Exit code 1: something is not in step, and was named."""
    if not options.folder.is_dir():
        raise CannotStart(f"{options.folder} is no folder.")
    told: set[str] = set()

    def tell(line: str) -> None:
        if line not in told:
            print(one_line(line), flush=True)

    with running(options) as server:
        while True:
            syncing = SyncRound(server, Folder(options.folder), tell)
            syncing.run()
            told = set(syncing.left)
            if not options.watch:
                return 1 if syncing.left else 0
            time.sleep(max(options.every, 0.1))


class SyncRound:
    """One round. `left`: what is not in step after it, in words."""

    def __init__(self, server: Server, folder: Folder, tell: Callable[[str], None]) -> None:
        self.left: list[str] = []
        self._server = server
        self._folder = folder
        self._tell = tell

    def run(self) -> None:
        """Bring everything into step that can be."""
        for name, kept in self._folder.late_writings().items():
            self._tell(f"{name}: was written while it was exchanged; that text is in {kept}")
        graphs = {each["id"]: each for each in self._server.editor("GET", "/api/graphs").json()}
        for name, file in list(self._folder.known.items()):
            try:
                self._one(name, file, graphs.get(file.graph))
            except No as error:
                self._leave(f"{name}: {error}")
        for name in self._folder.names():
            if name not in self._folder.known:
                self._bring(name)
        here = {file.graph for file in self._folder.known.values()}
        for graph in sorted(graphs.values(), key=lambda each: str(each["name"])):
            if graph["id"] not in here:
                self._fetch_new(graph)

    def _one(self, name: str, file: SyncedFile, graph: dict[str, Any] | None) -> None:
        if file.conflict is not None:
            if self._folder.has_copy(name):
                self._leave(self._conflict_words(name))
                return
            file = replace(file, seq=file.conflict, conflict=None)  # somebody has seen to it
        text = self._folder.read(name)
        if graph is None:
            if text is not None:
                self._leave(
                    f"{name}: its graph was deleted, or is on another server; the file stays"
                )
        elif text is None:
            if file.sha is not None:
                self._tell(f"{name}: was deleted here; the graph {graph['name']} stays")
                self._folder.remember(name, replace(file, sha=None))
        elif sha(text) != file.sha:
            self._send(name, file, text)
        elif graph["seq"] != file.seq:
            self._fetch(name, file)

    def _send(self, name: str, file: SyncedFile, text: bytes) -> None:
        """The file has changed: merge it into the graph."""
        try:
            path = f"/api/graphs/{file.graph}/umrf"
            asked = {"params": {"seq": file.seq}, "content": text, "headers": _JSON}
            merged = self._server.editor("PUT", path, **asked).json()
        except No as error:
            if error.status != _CONFLICT:
                raise
            seq, now = self._text(file.graph)
            self._folder.put_copy(name, now)
            self._folder.remember(name, replace(file, conflict=seq))
            self._leave(self._conflict_words(name))
            return
        for problem in merged["problems"]:
            self._tell(f"{name}: {problem['message']}")
        self._tell(f"{name}: sent")
        sent = SyncedFile(file.graph, merged["seq"], sha(text))
        if merged["merged"]:
            self._fetch(name, sent)
        else:
            self._folder.remember(name, sent)

    def _fetch(self, name: str, file: SyncedFile) -> None:
        """The graph has changed: give the file its text."""
        seq, now = self._text(file.graph)
        assert file.sha is not None
        if sha(now) != file.sha:
            if not self._folder.exchange(name, file.sha, now):
                return  # the next round sees what somebody has written
            self._tell(f"{name}: fetched")
        self._folder.remember(name, SyncedFile(file.graph, seq, sha(now)))

    def _bring(self, name: str) -> None:
        """A file that is new becomes a graph."""
        text = self._folder.read(name)
        if text is None:
            return
        try:
            made = self._server.editor("POST", "/api/graphs", content=text, headers=_JSON).json()
        except No as error:
            self._leave(f"{name}: {error}")
            return
        self._tell(f"{name}: is the graph {made['name']} now")
        file = SyncedFile(made["id"], made["seq"], sha(text))
        self._folder.remember(name, file)
        if made["reading"]["dialect"] != _TODAY:  # an edit of an older form could not be told apart
            self._tell(f"{name}: was an older form of UMRF; it has today's now")
            self._fetch(name, file)

    def _fetch_new(self, graph: dict[str, Any]) -> None:
        """A graph that is new becomes a file."""
        seq, now = self._text(graph["id"])
        name = self._folder.free_name(graph["name"])
        if self._folder.make(name, now):
            self._tell(f"{name}: is the file of the graph {graph['name']} now")
            self._folder.remember(name, SyncedFile(graph["id"], seq, sha(now)))

    def _text(self, graph: str) -> tuple[int, bytes]:
        answer = self._server.editor("GET", f"/api/graphs/{graph}/umrf")
        return int(answer.headers["x-seq"]), answer.content

    def _conflict_words(self, name: str) -> str:
        return (
            f"{name}: here and on the server the same was changed. The server's text is in {name}.server: "
            f"bring over what you want of it and delete that copy; then {name} counts."
        )

    def _leave(self, line: str) -> None:
        self.left.append(line)
        self._tell(line)
