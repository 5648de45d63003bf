"""The command `import`: files of graphs, and of actions for the library, one by one or of a folder."""

import argparse
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from action_assistant.commands.client import Server, add_server, refused, running
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.action_files import ACTION_DIALECTS, read_action, write_action

_JSON: Final = {"content-type": "application/json"}
#: The ending by which engines find files of actions below the folders of packages.
_ENDING: Final = "umrf.json"
#: Below a folder that has one of them, colcon looks for no packages.
_IGNORED: Final = frozenset({"COLCON_IGNORE", "AMENT_IGNORE"})


def _add_import(bring: argparse.ArgumentParser) -> None:
    add_server(bring, "patrol.umrf.graph.json open_gripper.umrf.json ~/ws/src")
    bring.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="of a graph, or of an action, which goes into the library; of a folder, such as the "
        "source folder of a ROS workspace, all actions do",
    )
    bring.add_argument(
        "--update",
        action="store_true",
        help="make actions that the library has already what their files say",
    )
    bring.set_defaults(handler=_import)


COMMANDS: Final = {"import": _add_import}


def _import(options: argparse.Namespace) -> int:
    with running(options) as server:
        bringing = _Bringing(server, update=options.update)
        for path in options.files:
            if path.is_dir():
                bringing.folder(path)
            else:
                bringing.file(path)
        return bringing.code


class _Bringing:
    """One call of the command: the files imported so far, and whether any was refused."""

    def __init__(self, server: Server, *, update: bool) -> None:
        self.code = 0
        self._server = server
        self._update = update
        self._documents: dict[str, str] | None = None
        self._brought: dict[str, Path] = {}

    def folder(self, folder: Path) -> None:
        found = False
        for path in _action_files(folder):
            found = True
            self.file(path, of_folder=True)
        if not found:
            self.code = refused(f"{folder}: has no file of an action (*{_ENDING}).")

    def file(self, path: Path, *, of_folder: bool = False) -> None:
        """Import one file: an action into the library, anything else as a graph."""
        body = _bytes(path)
        try:
            is_action = codec.read(body).dialect in ACTION_DIALECTS
        except codec.Unreadable:
            is_action = of_folder  # the server says why, and where
        try:
            if is_action:
                self._action(path, body)
            elif of_folder:
                print(one_line(f"{path}: is a graph, and was left alone."), file=sys.stderr)
            else:
                made = self._server.editor("POST", "/api/graphs", content=body, headers=_JSON)
                _tell(made.json()["id"], made.json()["name"])
        except RequestRefused as error:
            self.code = refused(f"{path}: {error}")

    def _action(self, path: Path, body: bytes) -> None:
        documents = self._known()
        try:
            action = read_action(body).action
        except codec.Unreadable:
            # Refused by the server, in its words.
            self._server.editor("POST", "/api/actions", content=body, headers=_JSON)
            return
        if action.name in self._brought:
            raise RequestRefused(
                f"{action.name} was read from {self._brought[action.name]} already."
            )
        self._brought[action.name] = path
        document = documents.get(action.name)
        if document is None:
            made = self._server.editor("POST", "/api/actions", content=body, headers=_JSON).json()
            documents[action.name] = made["id"]
            _tell(made["id"], action.name)
            return
        there = self._server.editor("GET", f"/api/actions/{document}/umrf").text
        if there == write_action(action):
            _tell(document, f"{action.name}  (is in the library)")
        elif self._update:
            path_of = f"/api/actions/{document}/umrf"
            self._server.editor("PUT", path_of, content=body, headers=_JSON)
            _tell(document, f"{action.name}  (updated)")
        else:
            raise RequestRefused(
                f"{action.name} is in the library, and differs. --update makes it what this file says."
            )

    def _known(self) -> dict[str, str]:
        """Return the documents of the library's actions by name."""
        if self._documents is None:
            listed = self._server.editor("GET", "/api/actions").json()
            self._documents = {}
            for each in listed:
                if each["document"] is not None:
                    self._documents.setdefault(each["name"], each["document"])
        return self._documents


def _action_files(folder: Path) -> Iterator[Path]:
    """Yield the files of actions below a folder, sorted by path. Folders that colcon ignores are
    skipped."""
    for at, folders, files in os.walk(folder):
        if not _IGNORED.isdisjoint(files):
            folders.clear()
            continue
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        yield from (Path(at, name) for name in sorted(files) if name.endswith(_ENDING))


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise CannotStart(f"Cannot read {path}: {error.strerror}.") from error


def _tell(document: str, what: str) -> None:
    print(one_line(f"{document}  {what}"))
