"""C++ packages of the actions that a graph has, as routes answer them. Runs in workers."""

import io
import zipfile
from collections.abc import Iterator, Sequence
from typing import Final

import msgspec

from action_assistant.editor.documents.contents import GraphAtSeq, first_action, read
from action_assistant.editor.log.graph_events import DocumentKind
from action_assistant.errors import NotFound
from action_assistant.safe_text import hold_names
from action_assistant.umrf.kept_values import keeper
from action_assistant.umrf.model import Action, Graph
from action_assistant.umrf.packages.choosing import disagreements, distinct_actions
from action_assistant.umrf.packages.generating import ImpossiblePackage, package_files
from action_assistant.umrf.packages.naming import check_names, snake_case

_LONG_AGO: Final = (1980, 1, 1, 0, 0, 0)  # what says no time gives the same archive each time
_MODE: Final = 0o100644 << 16


class PackageOutline(msgspec.Struct, frozen=True):
    """A package that can be made: of which action, its name, its files (with `/`)."""

    action: str
    package: str
    files: tuple[str, ...]


class PackageRefusal(msgspec.Struct, frozen=True):
    """The reason why an action has no package. `place`: the name of the action, and below it a JSON pointer."""

    action: str
    place: str
    reason: str

    def __post_init__(self) -> None:
        hold_names(self, "reason")


class PackageList(msgspec.Struct, frozen=True):
    """The packages of a graph after its change `seq`: one for each distinct name of an action."""

    seq: int
    packages: tuple[PackageOutline, ...]
    refusals: tuple[PackageRefusal, ...]


class PackageFile(msgspec.Struct, frozen=True):
    """A file of a package."""

    path: str
    text: str


class PackageContents(msgspec.Struct, frozen=True):
    """All files of the package of an action."""

    seq: int
    action: str
    package: str
    files: tuple[PackageFile, ...]


def listed(sight: GraphAtSeq, kind: DocumentKind) -> bytes:
    """Return the JSON of a `PackageList`: the C++ packages of the actions in a document at a change
    (`sight`). `kind`: a graph, or an action of the library."""
    graph = _of(sight, kind)
    refusals = tuple(dict.fromkeys(_refusals(graph, kind)))
    refused = {refusal.action for refusal in refusals}
    packages = tuple(
        PackageOutline(action.name, snake_case(action.name), tuple(package_files(action)))
        for action in _actions(graph, kind)
        if action.name not in refused
    )
    return msgspec.json.encode(PackageList(sight.seq, packages, refusals))


def contents(sight: GraphAtSeq, kind: DocumentKind, package: str) -> bytes:
    """Return the JSON of `PackageContents`: the generated files of one package of a document at a
    change (`sight`). `kind`: a graph, or an action of the library. Raise NotFound if no action has
    this package."""
    action = _chosen(sight, kind, (package,))[0]
    files = tuple(
        PackageFile(path, content.decode()) for path, content in package_files(action).items()
    )
    return msgspec.json.encode(PackageContents(sight.seq, action.name, package, files))


def archive(sight: GraphAtSeq, kind: DocumentKind, packages: Sequence[str]) -> bytes:
    """Return a ZIP file with a folder for each package in `packages`, or for every package if that
    is empty, of a document at a change (`sight`); equal actions give equal bytes. Raise NotFound if
    no action has such a package."""
    return _packed(_chosen(sight, kind, packages))


def keeper_archive() -> bytes:
    """Return a ZIP file with the package that keeps values for led runs."""
    return _packed((keeper(),))


def _packed(actions: Sequence[Action]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        for action in actions:
            for path, content in package_files(action).items():
                entry = zipfile.ZipInfo(f"{snake_case(action.name)}/{path}", _LONG_AGO)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = _MODE
                file.writestr(entry, content)
    return packed.getvalue()


def _of(sight: GraphAtSeq, kind: DocumentKind) -> Graph:
    """Return the graph of a document at a change (`sight`); for an action of the library (`kind`) a
    graph with this action alone."""
    graph = read(sight).moment.graph
    if kind == "graph":
        return graph
    action = first_action(graph)
    return Graph(name=graph.name, actions=() if action is None else (action,))


def _actions(graph: Graph, kind: DocumentKind) -> tuple[Action, ...]:
    """Return one action of each name: of a graph without values, since each use has its own; of a
    library document with them."""
    return distinct_actions(graph) if kind == "graph" else graph.actions


def _chosen(sight: GraphAtSeq, kind: DocumentKind, packages: Sequence[str]) -> tuple[Action, ...]:
    """Return one action for each of `packages`, in their order; if `packages` is empty, return all
    actions that a package can be made for, in the order of the graph.

    `kind`: whether `sight` is a graph or an action of the library. Raise NotFound if one of
    `packages` belongs to no action, or if no package can be made for any action.
    """
    graph = _of(sight, kind)
    refused = {refusal.action for refusal in _refusals(graph, kind)}
    able = {
        snake_case(action.name): action
        for action in _actions(graph, kind)
        if action.name not in refused
    }
    missing = [package for package in packages if package not in able]
    if missing:
        raise NotFound(f"No action of this graph has a package “{missing[0]}”.")
    if not able:
        raise NotFound("No action of this graph has a package.")
    return tuple(able[package] for package in dict.fromkeys(packages or able))


def _refusals(graph: Graph, kind: DocumentKind) -> Iterator[PackageRefusal]:
    actions = _actions(graph, kind)
    for about in (*check_names(action.name for action in actions), *disagreements(graph)):
        yield PackageRefusal(about.place, about.place, about.reason)
    for action in actions:
        try:
            package_files(action)
        except ImpossiblePackage as error:
            for each in error.refusals:
                yield PackageRefusal(action.name, each.place, each.reason)
