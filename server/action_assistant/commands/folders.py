"""`folders`: folders of graphs, named by their paths or ids."""

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from action_assistant.commands.answers import decoded
from action_assistant.commands.client import Server, command, print_json, running
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line

if TYPE_CHECKING:  # slow to load, and most calls do not need it
    from action_assistant.editor.catalogue.folders import Folder

TOP: Final = "/"  # the path of no folder


def _add_folders(folders: argparse.ArgumentParser) -> None:
    folders.description = (
        "Folders of graphs. A path is the names of folders with slashes between them, as in "
        "'Lab/Night'; / is no folder. An id of a folder also does."
    )
    folders.epilog = "example: action-assistant folders put patrol --into Lab/Night"
    words = folders.add_subparsers(dest="word", required=True, metavar="WORD")

    listed = command(words, "list", "all folders, and how many graphs lie in each", "")
    listed.add_argument("--json", action="store_true", help="as JSON, for programs")
    listed.set_defaults(handler=_list)

    new = command(words, "new", "make a folder, and those around it that are missing", "Lab/Night")
    new.add_argument("path", metavar="PATH")
    new.set_defaults(handler=_new)

    rename = command(words, "rename", "give a folder another name", "Lab/Night Day")
    rename.add_argument("folder", metavar="FOLDER", help="path or id")
    rename.add_argument("name", metavar="NAME")
    rename.set_defaults(handler=_rename)

    move = command(words, "move", "move a folder with its contents", "Lab/Night --into Archive")
    move.add_argument("folder", metavar="FOLDER", help="path or id")
    move.add_argument("--into", required=True, metavar="FOLDER", help="path or id; / for none")
    move.set_defaults(handler=_move)

    remove = command(
        words,
        "remove",
        "remove a folder; its graphs and folders go into the folder around it, none is deleted",
        "Lab/Night",
    )
    remove.add_argument("folder", metavar="FOLDER", help="path or id")
    remove.set_defaults(handler=_remove)

    put = command(words, "put", "move graphs into a folder", "patrol --into Lab/Night")
    put.add_argument("graphs", nargs="+", metavar="GRAPH", help="id or name")
    put.add_argument("--into", required=True, metavar="FOLDER", help="path or id; / for none")
    put.set_defaults(handler=_put)


COMMANDS: Final = {"folders": _add_folders}


def known_folders(server: Server) -> "list[Folder]":
    """Return all folders of a server, sorted by name."""
    from action_assistant.editor.catalogue.folders import Folder

    return decoded(server.editor("GET", "/api/folders"), list[Folder])


def folder_id(folders: "Sequence[Folder]", asked: str) -> str | None:
    """Return the id of the folder with this path or id; None for `/`. Raise RequestRefused unless
    exactly one matches."""
    if any(each.id == asked for each in folders):
        return asked
    names = _names(asked)
    if not names:
        return None
    found: list[str | None] = [None]
    for name in names:
        found = [each.id for each in folders if each.parent in found and each.name == name]
    if len(found) != 1:
        raise RequestRefused(
            f"There is no folder {asked!r}."
            if not found
            else f"{len(found)} folders are at {asked!r}; name one by id: "
            f"{', '.join(map(str, found))}."
        )
    return found[0]


def paths_of(folders: "Sequence[Folder]") -> dict[str, str]:
    """Return the path of each folder, by its id."""
    known = {each.id: each for each in folders}
    paths = {}
    for each in folders:
        names, above = [each.name], each.parent
        while above is not None:
            names.insert(0, known[above].name)
            above = known[above].parent
        paths[each.id] = "/".join(names)
    return paths


def _names(path: str) -> list[str]:
    return [name for name in path.split("/") if name.strip()]


def tell_runner_rules(server: Server) -> None:
    """Bring the rules of who may see graphs to a runner that may have a data folder of its own, if
    there was ever one and this client is an owner's. Only owners change who may see a graph.
    Raise RequestRefused if that fails."""
    try:
        rules = server.editor("GET", "/api/graph-rules").json()
    except RequestRefused as refused:
        if refused.status != 403:
            raise
        return
    if rules["at"] == 0:
        return
    try:
        server.runners.tell("PUT", "/api/graph-rules", json=rules)
    except (RequestRefused, CannotStart) as error:
        raise RequestRefused(
            f"Done, but a runner with a data folder of its own has not been told: {error}"
        ) from error


def _list(options: argparse.Namespace) -> int:
    with running(options) as server:
        folders = known_folders(server)
    if options.json:
        print_json(folders)
        return 0
    paths = paths_of(folders)
    for each in sorted(folders, key=lambda each: paths[each.id].casefold()):
        graphs = f"{each.graphs} graph" + ("" if each.graphs == 1 else "s")
        print(one_line(f"{each.id}  {paths[each.id]}  {graphs}"))
    return 0


def _new(options: argparse.Namespace) -> int:
    """Make the folders of a path that are missing, print the id of the last one, and return the
    exit code."""
    names = _names(options.path)
    if not names:
        raise RequestRefused("A path names at least one folder.")
    with running(options) as server:
        folders = known_folders(server)
        parent: str | None = None
        for name in names:
            there = [each.id for each in folders if (each.parent, each.name) == (parent, name)]
            parent = there[0] if there else _made(server, name, parent)
    print(parent)
    return 0


def _made(server: Server, name: str, parent: str | None) -> str:
    wanted: dict[str, Any] = {"name": name, "parent": parent}
    made: str = server.editor("POST", "/api/folders", json=wanted).json()["id"]
    return made


def _chosen(server: Server, asked: str) -> str:
    """Return the id of the folder whose path or id is `asked`. Raise RequestRefused for `/`, which
    is the list of all graphs and no folder."""
    folder = folder_id(known_folders(server), asked)
    if folder is None:
        raise RequestRefused("Name a folder; / stands for none.")
    return folder


def _rename(options: argparse.Namespace) -> int:
    with running(options) as server:
        folder = _chosen(server, options.folder)
        server.editor("PATCH", f"/api/folders/{folder}", json={"name": options.name})
    return 0


def _move(options: argparse.Namespace) -> int:
    with running(options) as server:
        folder = _chosen(server, options.folder)
        into = folder_id(known_folders(server), options.into)
        server.editor("PUT", f"/api/folders/{folder}/parent", json={"parent": into})
        tell_runner_rules(server)
    return 0


def _remove(options: argparse.Namespace) -> int:
    with running(options) as server:
        server.editor("DELETE", f"/api/folders/{_chosen(server, options.folder)}")
        tell_runner_rules(server)
    return 0


def _put(options: argparse.Namespace) -> int:
    with running(options) as server:
        into = folder_id(known_folders(server), options.into)
        graphs = [server.graph_id(graph) for graph in options.graphs]
        for graph in graphs:
            server.editor("PUT", f"/api/graphs/{graph}/folder", json={"folder": into})
        tell_runner_rules(server)
    return 0
