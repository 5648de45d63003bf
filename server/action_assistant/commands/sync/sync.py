"""The command `sync`: round after round, what has changed here goes there, and the other way."""

import argparse
import os
import re
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from msgspec.structs import replace

from action_assistant.commands.answers import decoded
from action_assistant.commands.client import Server, add_server, running
from action_assistant.commands.directories import why
from action_assistant.commands.sync.folder import Folder, SyncedFile, sha
from action_assistant.errors import CannotStart, Overtaken, RequestRefused
from action_assistant.safe_text import one_line
from action_assistant.system.posix import fcntl
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files import codec

if TYPE_CHECKING:  # slow to load, and needed only once there is a server
    from action_assistant.editor.catalogue.catalogue import GraphView

_JSON: Final = {"content-type": "application/json"}
_CONFLICT: Final = 409
_OVERTAKEN: Final = Overtaken("").type
_TODAY: Final = "D3"
_FIRST: Final = 1  # the change by which a graph is made
_ID: Final = re.compile(r"[A-Za-z0-9_-]+")


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
    """Run the command with these options; return the exit code, 1 if a file or graph is not in
    sync, which was printed. Raise CannotStart if the folder does not exist."""
    if not options.folder.is_dir():
        raise CannotStart(f"{options.folder} is no folder.")
    told: set[str] = set()

    def tell(line: str) -> None:
        if line not in told:
            print(one_line(line), flush=True)

    with running(options) as server, _alone(options.folder):
        while True:
            with closing(Folder(options.folder)) as folder:
                syncing = SyncRound(server, folder, tell)
                syncing.run()
            told = set(syncing.left)
            if not options.watch:
                return 1 if syncing.left else 0
            time.sleep(max(options.every, 0.1))


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Return a context during which no second `sync` works in the folder, where the file system has
    locks. Raise CannotStart if another `sync` does."""
    with ExitStack() as held:
        if fcntl is not None:
            at = os.open(folder, os.O_RDONLY)
            held.callback(os.close, at)
            try:
                fcntl.flock(at, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise CannotStart(f"Another `sync` is at work in {folder}.") from error
            except OSError:  # not on this file system
                pass
        yield


class SyncRound:
    """One round of synchronisation of a folder with a server. `left`: what is not in sync after it,
    in words."""

    def __init__(self, server: Server, folder: Folder, tell: Callable[[str], None]) -> None:
        self.left: list[str] = []
        self._server = server
        self._folder = folder
        self._tell = tell

    def run(self) -> None:
        """Synchronise all files and graphs. Raise CannotStart if the server is not reached or the
        folder cannot be used."""
        try:
            found, names = self._folder.recover(), self._folder.names()
        except OSError as error:
            raise CannotStart(f"Cannot use the folder: {why(error)}.") from error
        barred: set[str] = set()
        for trouble in found:
            barred.add(trouble.name)
            (self._leave if trouble.is_open else self._tell)(trouble.text)
        graphs = self._graphs()
        for name, file in list(self._folder.known.items()):
            if name not in barred and file.graph:
                self._try(name, self._one, name, file, graphs.get(file.graph))
        here = {file.graph for file in self._folder.known.values()}
        for name in names:
            known = self._folder.known.get(name)
            if name not in barred and (known is None or not known.graph):
                self._try(name, self._bring, name, graphs.keys() - here)
        here = {file.graph for file in self._folder.known.values()}
        for graph in sorted(graphs.values(), key=lambda each: each.name):
            if graph.id not in here:
                self._try(graph.name, self._fetch_new, graph)

    def _try(self, name: str, step: Callable[..., None], *given: Any) -> None:
        """Synchronise one file or graph, called `name`, by `step`; a refusal or error is reported
        and does not stop the others."""
        try:
            step(*given)
        except RequestRefused as error:
            self._leave(f"{name}: {error}")
        except OSError as error:
            self._leave(f"{name}: cannot be kept in step: {why(error)}")

    def _graphs(self) -> "dict[str, GraphView]":
        """Return the graphs of the server by id. Ids become parts of paths, so others than plain
        ones are dropped."""
        from action_assistant.editor.catalogue.catalogue import GraphView

        found = decoded(self._server.editor("GET", "/api/graphs"), list[GraphView])
        return {each.id: each for each in found if _ID.fullmatch(each.id)}

    def _one(self, name: str, file: SyncedFile, graph: "GraphView | None") -> None:
        if file.conflict is not None:
            if copy := self._folder.copy_of(name, file):
                self._leave(_conflict_words(name, copy))
                return
            file = replace(
                file, seq=file.conflict, conflict=None, copy=1
            )  # a person has resolved it
        text = self._folder.read(name)
        if graph is None:
            if text is not None:
                self._leave(
                    f"{name}: its graph was deleted, or is on another server; the file stays"
                )
        elif text is None:
            if file.sha is not None:
                self._tell(f"{name}: was deleted here; the graph {graph.name} stays")
                self._folder.remember(name, replace(file, sha=None))
        elif sha(text) != file.sha:
            self._send(name, file, text)
        elif graph.seq != file.seq:
            self._fetch(name, file)

    def _send(self, name: str, file: SyncedFile, text: bytes) -> None:
        """Merge the changed text of a file into its graph; for a conflict, put the server's text
        beside the file."""
        from action_assistant.editor.api.graphs import MergedGraph

        try:
            path = f"/api/graphs/{file.graph}/umrf"
            asked = {"params": {"seq": file.seq}, "content": text, "headers": _JSON}
            merged = decoded(self._server.editor("PUT", path, **asked), MergedGraph)
        except RequestRefused as error:
            if error.status != _CONFLICT or error.kind == _OVERTAKEN:
                raise  # the next round sends it again
            seq, now = self._text(file.graph)
            number = self._folder.put_copy(name, now)
            held = replace(file, conflict=seq, copy=number)
            self._folder.remember(name, held)
            self._leave(_conflict_words(name, self._folder.copy_of(name, held) or ""))
            return
        for problem in merged.problems:
            self._tell(f"{name}: {problem.message}")
        self._tell(f"{name}: sent")
        sent = SyncedFile(file.graph, merged.seq, sha(text))
        if merged.merged:
            self._fetch(name, sent)
        else:
            self._folder.remember(name, sent)

    def _fetch(self, name: str, file: SyncedFile) -> None:
        """Write the changed text of a graph into its file, unless the file has it already or was
        changed meanwhile."""
        seq, now = self._text(file.graph)
        assert file.sha is not None
        if sha(now) == file.sha:
            self._folder.remember(name, SyncedFile(file.graph, seq, file.sha))
        elif self._folder.exchange(name, file.sha, seq, now):
            self._tell(f"{name}: fetched")
        # Otherwise the next round finds the changes of people.

    def _bring(self, name: str, others: Collection[str]) -> None:
        """Make a graph of the new file `name`. `others`: the ids of graphs that have no file."""
        text = self._folder.read(name)
        if text is None:
            return
        begun = self._folder.known.get(name)
        if begun is not None and begun.sha == sha(text):
            wanted = _digest(text)
            for graph in others:  # an interrupted round may have made it
                if wanted is not None and _digest(self._first_text(graph)) == wanted:
                    self._brought(name, SyncedFile(graph, _FIRST, sha(text)), text)
                    return
        self._folder.remember(name, SyncedFile("", 0, sha(text)))
        try:
            answer = self._server.editor("POST", "/api/graphs", content=text, headers=_JSON)
        except RequestRefused:
            self._folder.forget(name)
            raise
        from action_assistant.editor.api.graphs import MadeGraph

        made = decoded(answer, MadeGraph)
        self._tell(f"{name}: is the graph {made.name} now")
        self._brought(name, SyncedFile(made.id, made.seq, sha(text)), text)

    def _brought(self, name: str, file: SyncedFile, text: bytes) -> None:
        """Record that the file `name` has become a graph; fetch the graph's text if the file was an
        older form of UMRF."""
        self._folder.remember(name, file)
        if codec.read(text).dialect != _TODAY:  # an edit of an older form could not be told apart
            self._tell(f"{name}: was an older form of UMRF; it has today's now")
            self._fetch(name, file)

    def _first_text(self, graph: str) -> bytes:
        """Return the UMRF of a graph at its first change."""
        path = f"/api/graphs/{graph}/umrf"
        return self._server.editor("GET", path, params={"at": _FIRST}).content

    def _fetch_new(self, graph: "GraphView") -> None:
        """Make a file for a graph that has none."""
        seq, now = self._text(graph.id)
        name = self._folder.free_name(graph.name)
        if self._folder.make(name, graph.id, seq, now):
            self._tell(f"{name}: is the file of the graph {graph.name} now")

    def _text(self, graph: str) -> tuple[int, bytes]:
        answer = self._server.editor("GET", f"/api/graphs/{graph}/umrf")
        return int(answer.headers["x-seq"]), answer.content

    def _leave(self, line: str) -> None:
        self.left.append(line)
        self._tell(line)


def _digest(text: bytes) -> str | None:
    """Return the digest of the graph in a text; None if it cannot be read."""
    try:
        return digest(codec.read(text).graph)
    except codec.Unreadable:
        return None


def _conflict_words(name: str, copy: str) -> str:
    return (
        f"{name}: here and on the server the same was changed. The server's text is in {copy}: "
        f"bring over what you want of it and delete that copy; then {name} counts."
    )
