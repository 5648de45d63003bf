"""Writes the graphs inside of a task into the folder that a robot's engine indexes
(docs/decisions/085-written-into-the-index.md)."""

import os
from collections import defaultdict
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Final

import anyio
import msgspec

from action_assistant.errors import BadInput, Conflict, Unavailable
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.index_folders.comparison import (
    Differing,
    FileState,
    Hindered,
    Lacking,
    Present,
)
from action_assistant.runner.index_folders.scan import scanned, shown_path
from action_assistant.runner.index_folders.writing import (
    NewFile,
    WritingOutcome,
    WrittenFile,
    sha,
    write,
)
from action_assistant.runner.robots.engine import EngineIndex
from action_assistant.runner.robots.registry import Robots
from action_assistant.runner.robots.robot_events import (
    AskedGraph,
    GraphFile,
    IndexWriteAsked,
    IndexWritten,
)
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.sent_graphs import SentSubgraph, read_inside
from action_assistant.runner.start.admission import decoded
from action_assistant.runner.start.preflight import folder_state
from action_assistant.umrf.check import blocking, check, is_final
from action_assistant.umrf.facts import EngineFacts, facts_of
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.umrf.run_size import MOST_INSIDE
from action_assistant.web.workers.lanes import RunInWorker

#: Runs a function that waits for a disk in a thread, beside the event loop.
OnDisk = Callable[..., Awaitable[Any]]


class IndexWriteRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The graphs inside of a graph, as a start of it has them. `digest` is that of the graph,
    `tree_digest` that of all together. `replace`: names of graphs that may replace another file."""

    subgraphs: Annotated[tuple[SentSubgraph, ...], msgspec.Meta(min_length=1)]
    digest: str
    tree_digest: str | None = None
    replace: Annotated[tuple[str, ...], msgspec.Meta(max_length=MOST_INSIDE)] = ()


class IndexWriteAnswer(msgspec.Struct, frozen=True, kw_only=True):
    """The state of the folder after a write: files that were `written` anew, files that `replaced`
    others, and graphs that were `there` before in the same form."""

    folder: str
    written: tuple[WrittenFile, ...]
    replaced: tuple[WrittenFile, ...]
    there: tuple[str, ...]


class WritePlan(msgspec.Struct, frozen=True):
    """The files to write, and the graphs that are `there` already."""

    files: tuple[NewFile, ...]
    graphs: tuple[AskedGraph, ...]
    there: tuple[str, ...]


def folder_trouble(robot: str, folder: Path) -> str:
    """Return a sentence that says why the folder of a robot cannot be read; "" where it can."""
    try:
        with os.scandir(folder):
            return ""
    except OSError as error:
        why = error.strerror or str(error)
        return f"There is no folder {shown_path(str(folder))} that {robot} could index: {why}."


def read_index_write(body: bytes) -> IndexWriteRequest:
    """Decode the body of a write. Raises BadInput with the place."""
    request = decoded(body, IndexWriteRequest)
    sent = {each.name for each in request.subgraphs}
    if unknown := [name for name in request.replace if name not in sent]:
        raise BadInput(
            f"{unknown[0][:80]!r} is not among the graphs that were sent.",
            where={"path": f"/replace/{request.replace.index(unknown[0])}"},
        )
    return request


def planned(
    request: IndexWriteRequest, folder: Path, index: EngineIndex, facts: EngineFacts
) -> WritePlan:
    """Plan a write: all of its graphs can be written, or it is refused. For workers. Raises
    BadInput, NotUmrf, TooLarge, Conflict with the place, Unavailable."""
    recorded, graphs = read_inside(request.subgraphs, request.digest, request.tree_digest)
    for place, graph in enumerate(graphs.values()):
        _require_sound(place, graph, graphs, facts)
    digests = {each.name: each.digest for each in recorded}
    files = scanned(folder, graphs.keys())
    states = {name: folder_state(each, files, index, facts) for name, each in graphs.items()}
    _require_free(states, request.replace, folder)
    new: list[NewFile] = []
    graphs_to_write: list[AskedGraph] = []
    for name, state in states.items():
        text = codec.write(graphs[name]).encode()
        match state:
            case Lacking():
                new.append(NewFile(name, text))
                graphs_to_write.append(AskedGraph(name, digests[name]))
            case Differing(file):
                new.append(NewFile(name, text, file.path, sha(file.text)))
                graphs_to_write.append(AskedGraph(name, digests[name], file.display_path))
            case Present() | Hindered():
                continue
    there = tuple(name for name, state in states.items() if isinstance(state, Present))
    return WritePlan(tuple(new), tuple(graphs_to_write), there)


def _require_sound(
    place: int, graph: Graph, inside: Mapping[str, Graph], facts: EngineFacts
) -> None:
    """Refuse a graph that an engine must not read. Raise Conflict with its first problem; `place`
    is its number in the request."""
    wrong = blocking(check(graph, None, facts, inside))
    final = [each for each in wrong if is_final(each)]
    if final:
        raise Conflict(
            f"{graph.name} cannot be written: {final[0].message}",
            where={"path": f"/subgraphs/{place}/umrf{final[0].where.path}"},
        )


def _require_free(states: Mapping[str, FileState], replace: Sequence[str], folder: Path) -> None:
    """Raise Conflict, with all files concerned, if a graph cannot be written to its file in
    `folder`, or if a file with other contents would be replaced without its graph being named in
    `replace`. `states`: by the names of the graphs."""
    hindered = {name: each.why for name, each in states.items() if isinstance(each, Hindered)}
    others = {
        name: each.file.display_path
        for name, each in states.items()
        if isinstance(each, Differing) and name not in replace
    }
    where: dict[str, object] = {"folder": shown_path(str(folder))}
    if hindered:
        reasons = " ".join(f"{name} cannot be written. {why}" for name, why in hindered.items())
        where |= {"path": "/subgraphs", "hindered": hindered}
        raise Conflict(f"{reasons} Nothing was written.", where=where)
    if others:
        reasons = ", ".join(f"{path} ({name})" for name, path in others.items())
        where |= {"path": "/replace", "files": others}
        raise Conflict(
            f"Other files would be replaced: {reasons}. Name their graphs in `replace` to do that. "
            "Nothing was written.",
            where=where,
        )


class IndexWriter:
    """Writes into the index folders of robots that the command line of the runner names
    (`folders`), one request at a time for each folder."""

    def __init__(
        self,
        robots: Robots,
        folders: Mapping[str, Path],
        *,
        clock_us: ClockUs,
        run_in_worker: RunInWorker,
        on_disk: OnDisk,
    ) -> None:
        self._robots: Final = robots
        self._folders: Final = folders
        self._clock_us = clock_us
        self._run_in_worker = run_in_worker
        self._on_disk = on_disk
        self._locks: Final = defaultdict[str, anyio.Lock](anyio.Lock)

    async def write(
        self, robot: str, request: IndexWriteRequest, author: Author
    ) -> IndexWriteAnswer:
        """Write the graphs that are lacking or may be replaced. Raises NotFound, Conflict,
        Unavailable and what reading raises."""
        known = self._robots.registration(robot)
        folder = self._folders.get(robot)
        if folder is None:
            raise Conflict(
                f"The runner has no folder into which it could write for {robot}: whoever starts it names "
                "one with --index-folder.",
                where={"path": "/robot"},
            )
        if why := await self._run_in_worker(folder_trouble, robot, folder):
            raise Conflict(f"{why} Nothing was written.", where={"path": "/robot"})
        async with self._locks[str(folder)]:
            index = await self._robots.index(robot)
            plan: WritePlan = await self._run_in_worker(
                planned, request, folder, index, facts_of(known.profile)
            )
            outcome = WritingOutcome(())
            if plan.files:
                # A write that has begun is recorded, also when its client has gone.
                with anyio.CancelScope(shield=True):
                    outcome = await self._written(robot, folder, plan, author)
        if outcome.failed:
            done = ", ".join(each.path for each in outcome.written)
            rest = f"Written before that: {done}." if done else "Nothing was written."
            raise Unavailable(f"{outcome.failed} {rest}", where={"folder": shown_path(str(folder))})
        if outcome.written and (engine := self._robots.link(robot)) is not None:
            engine.let_index()
        return IndexWriteAnswer(
            folder=shown_path(str(folder)),
            written=tuple(each for each in outcome.written if not each.kept),
            replaced=tuple(each for each in outcome.written if each.kept),
            there=plan.there,
        )

    async def _written(
        self, robot: str, folder: Path, plan: WritePlan, author: Author
    ) -> WritingOutcome:
        """Record the request, write the files, record the outcome. Raise Unavailable, before
        anything is written, if the request cannot be recorded."""
        request_event = IndexWriteAsked(
            at=self._clock_us(), author=author, folder=shown_path(str(folder)), graphs=plan.graphs
        )
        try:
            await self._robots.robot_log.record(robot, request_event, author.id)
        except Unavailable as refused:
            raise Unavailable(f"{refused.detail} Nothing was written.") from refused
        outcome: WritingOutcome = await self._on_disk(write, folder, plan.files)
        digests = {each.name: each.digest for each in plan.graphs}
        done = IndexWritten(
            at=self._clock_us(),
            author=author,
            files=tuple(
                GraphFile(each.graph, each.path, digests[each.graph], each.kept)
                for each in outcome.written
            ),
            why=outcome.failed,
        )
        # The files are written in any case; the robot's log itself shows that it cannot record.
        with suppress(Unavailable):
            await self._robots.robot_log.record(robot, done, author.id)
        return outcome
