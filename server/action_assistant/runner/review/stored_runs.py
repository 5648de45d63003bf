"""Answers questions about stored runs: sums, causes, comparisons, exports, expected courses. Runs in workers."""

from collections.abc import Awaitable, Callable, Mapping, Sequence
from datetime import datetime
from typing import Any, Final, Literal, TypeAlias

import msgspec
from sqlalchemy import ColumnElement, Row, Select, select

from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.journal.chain import NOTHING, Head
from action_assistant.journal.events import Event
from action_assistant.runner.analysis import annotations, expected_runs, exports, statistics
from action_assistant.runner.analysis.cause_texts import cause_sentence
from action_assistant.runner.analysis.causes import OPERATOR, causes
from action_assistant.runner.analysis.comparison import RunComparison, SentTree, compare
from action_assistant.runner.analysis.course_checks import CheckedCourses, check_courses
from action_assistant.runner.analysis.keyframes import KeyframeStore
from action_assistant.runner.analysis.replay import RunReplay, run_replay
from action_assistant.runner.archives.archive_store import Archived, ArchiveStore
from action_assistant.runner.archives.raw_messages import (
    RawArchived,
    RawMessages,
    raw_of,
    stream_of_raw,
)
from action_assistant.runner.review import incident
from action_assistant.runner.review.incident import IncidentRequest
from action_assistant.runner.robots.recordings import Recording, hours
from action_assistant.runner.robots.robot_events import stream_of_robot
from action_assistant.runner.runs import queries, views, word_index
from action_assistant.runner.runs.events import Author, Observed, decode, said_in
from action_assistant.runner.runs.history import RunHistory, whole_of
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sent_graphs import (
    Sent,
    SentSubgraph,
    read_inside,
    read_sent,
    sent_of,
)
from action_assistant.runner.runs.shared_view import SharedRun, shared_run
from action_assistant.runner.runs.sight import RunGraphs, Unseen, graphs_requested
from action_assistant.schema.runner_tables import (
    expectation,
    robot,
    run,
    runner_event,
    runner_head,
    runner_written_by,
)
from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy.opening import CannotOpen, opened
from action_assistant.umrf.model import Graph
from action_assistant.web.auth.caller import without_origin

_LAST: Final = 1_000  # runs in one statistics
_NEAR: Final = 20_000  # events of a robot in the file of an incident
_CAUSES: Final = 10  # in one answer
_ROWS: Final = 400  # parameters of one query
_PAGE: Final = 500  # events read at once
_SAYING: Final = 2_000  # events of a run whose texts are searched

Format: TypeAlias = Literal["jsonl", "csv", "mcap"]


class CauseShown(msgspec.Struct, frozen=True, kw_only=True):
    """One cause in a sentence, with its evidence: the time, the event `seq` by which it was seen,
    the action, a quoted text, and the person at this runner who caused it (`author`). The sentence
    begins with the name that the person had then, or with *Somebody*."""

    kind: str
    text: str
    at: datetime
    seq: int
    action: str | None
    aid: str | None
    quote: str
    author: Author | None


class RunNote(msgspec.Struct, frozen=True):
    """A note that a person wrote for a moment of a run. `at`: when it was written."""

    moment: datetime
    text: str
    author: Author
    at: datetime


class HistoryEvent(msgspec.Struct, frozen=True):
    """One stored event, for programs that follow a run."""

    seq: int
    kind: str
    author: str
    at: datetime
    body: msgspec.Raw


async def numbers_with(
    text: str, rows: Callable[[Select[Any]], Awaitable[Sequence[Row[Any]]]]
) -> set[int] | None:
    """Return the numbers of all runs that may contain a text, by the index of words; None if there
    may be too many, or if only reading all runs can answer. `rows`: executes a SELECT and returns
    its rows."""
    pieces = word_index.pieces(text)
    late = await rows(word_index.unindexed()) if pieces else []
    for piece in pieces if len(late) <= word_index.MOST else []:
        found = await rows(word_index.holding(piece))
        if len(found) <= word_index.MOST:
            # a run is also found by its whole number
            own = {int(text)} if text.isascii() and text.isdecimal() and len(text) < 19 else set()
            return {row.number for row in (*found, *late)} | own
    return None


def _event_json(event: Event) -> bytes:
    at, body = views.time(event.at), msgspec.Raw(without_origin(event.body))
    return msgspec.json.encode(HistoryEvent(event.seq, event.kind, event.author, at, body))


class StoredRuns:
    """Answers questions about the runs in a journal and its archive, in one thread of its own. Its
    methods raise Unavailable while the journal or a file of the archive cannot be read."""

    def __init__(self, journal: ArchiveStore) -> None:
        self.keyframe_store = KeyframeStore(journal)
        self._journal = journal
        self._history = RunHistory(journal)
        self._old_runs: dict[str, RunGraphs] = {}

    async def made_keyframes(self, run_id: str) -> int:
        """Make the keyframes of a run, and return the seq of its last keyframe. Raise NotFound if
        there is no such run."""
        return (await self.keyframe_store.keyframes(run_id)).keys[-1].seq

    async def summed(self, run_id: str, now: int) -> annotations.SummedUp:
        """Return the event with the totals of a run that is over. `now` is the present time in
        microseconds UTC. Raise NotFound if there is no such run."""
        found = (await self.keyframe_store.keyframes(run_id)).keys[-1].run
        good = found.end == "finished" and found.result == "on_true"
        graph = None if good else await self._graph(run_id)  # only a run that went badly has causes
        said = await self._said(run_id)
        return annotations.sum_of(found, graph, now, said)

    async def run_graphs(self, run_id: str) -> RunGraphs | None:
        """Return the facts that decide who may see a run, those of the whole run for a piece; None if
        there is no such run. Raise Unavailable if the journal cannot be read."""
        columns = (run.c.id, run.c.author_id, run.c.graph, run.c.summary)
        whole = whole_of(run_id) or run_id
        rows = await self.rows(select(*columns).where(run.c.id.in_([run_id, whole])))
        return await self._graphs_of(rows[0]) if rows else None

    async def _graphs_of(self, row: Row[Any]) -> RunGraphs:
        """Return the same facts by the row of a run. Rows of earlier versions do not have the graphs
        inside, which then stand in the first event."""
        if "inside" in row.summary:
            graphs = dict.fromkeys([row.graph, *row.summary["inside"]])
            of = tuple(each for each in graphs if each)
            return RunGraphs(row.author_id, of, row.summary.get("unsighted", False))
        if row.id not in self._old_runs:
            try:
                self._old_runs[row.id] = graphs_requested(await self._history.requested(row.id))
            except (Archived, NotFound, msgspec.DecodeError):  # its contents cannot be read either
                return RunGraphs(row.author_id, (row.graph,) if row.graph else ())
        return self._old_runs[row.id]

    async def _hidden(self, unseen: Unseen | None, rows: Sequence[Row[Any]]) -> set[str]:
        """Return the ids of those of these runs that a person may not see."""
        if unseen is None:
            return set()
        return {row.id for row in rows if unseen.hides(await self._graphs_of(row))}

    async def _said(self, run_id: str) -> list[str]:
        """Return the texts in the first events of a run that people may search for, in the order of
        the events. A text that occurs several times is returned once. Raise Unavailable if the
        journal cannot be read."""
        event = runner_event.c
        chosen = select(event.kind, event.body).where(
            event.stream == stream_of(run_id), event.kind != Observed.kind
        )
        texts: dict[str, None] = {}
        for row in await self.rows(chosen.order_by(event.seq).limit(_SAYING)):
            try:
                texts.update(dict.fromkeys(said_in(decode(row.kind, row.body))))
            except msgspec.DecodeError:  # a damaged event is reported where the run is read
                continue
        return list(texts)

    async def whole(self, run_id: str, is_all: bool = True) -> views.RunWhole:
        """Return a run that is over, with the graph as it was sent; unless `is_all`, as somebody who
        may not see its graph is shown it. Raise NotFound if there is no such run."""
        sent = await self.sent(run_id)
        found, place = await self.known(run_id), await self.place(run_id)
        shown = views.whole_view(found, sent, place=place)
        return shown if is_all else views.hidden(shown)

    async def shared(self, run_id: str) -> SharedRun:
        """Return a run that is over as a link shows it. Raise NotFound if there is no such run."""
        return shared_run(await self.whole(run_id))

    async def followed(self, run_id: str, robots_too: bool) -> tuple[Run, int]:
        """Return a run and the seq of its last event. `robots_too`: with all of its visits, so that
        the fold can continue; else with the newest visits that people are shown. Raise NotFound
        if there is no such run."""
        key = (await self.keyframe_store.keyframes(run_id)).keys[-1]
        return (key.run if robots_too else views.with_newest_visits(key.run)), key.seq

    async def known(self, run_id: str) -> Run:
        """Return a run, as of its last stored event. Raise NotFound if there is no such run."""
        return (await self.keyframe_store.keyframes(run_id)).keys[-1].run

    # --- one run ------------------------------------------------------------------------------

    async def causes(self, run_id: str) -> list[CauseShown]:
        """Return the proven causes of a run's end, the most important one first. Raise NotFound if
        there is no such run."""
        found, graph = await self.known(run_id), await self._graph(run_id)
        shown: list[CauseShown] = []
        for each in causes(found, graph)[:_CAUSES]:
            action = found.actions.get(each.action or "")
            shown.append(
                CauseShown(
                    kind=str(each.__struct_config__.tag),
                    text=cause_sentence(each, found),
                    at=views.time(each.at),
                    seq=await self.keyframe_store.seq_at(run_id, each.at),
                    action=each.action,
                    aid=action.aid if action is not None else None,
                    quote=each.quote,
                    author=each.by if isinstance(each, OPERATOR) else None,
                )
            )
        return shown

    async def rows(self, statement: Select[Any]) -> list[Row[Any]]:
        """Return the rows of a SELECT on the tables. Raise Unavailable if the journal cannot be
        read."""
        return await self._journal.query(statement)

    async def events(self, run_id: str, after: int, limit: int) -> Sequence[Event]:
        """Return the stored events of a run with `seq > after`, at most `limit`. Raise Unavailable
        if the journal cannot be read."""
        return await self._history.events(run_id, after, limit)

    async def sent(self, run_id: str) -> Sent:
        """Return the graph as it was sent, and the values of its actions. Raise NotFound if there
        is no such run."""
        return sent_of(await self._history.requested(run_id))

    async def place(self, run_id: str) -> views.ArchivePlace | None:
        """Return number, time and file of an archived run; None when its events are in the
        journal."""
        return await self._journal.place(stream_of(run_id))

    async def raw(
        self, run_id: str, recordings: Mapping[str, Sequence[Recording]], now: int
    ) -> RawMessages:
        """Return the raw messages of the run's robots from the time of the run. `recordings`: all
        recordings of each of them on this computer; `now`: microseconds UTC. Raise NotFound if
        there is no such run."""
        run_ = await self.known(run_id)
        until = run_.ended_at or now
        first, last = hours(run_.started_at or run_.requested_at, until)
        here = {
            robot: [each for each in listed if first <= each.name[: len(first)] <= last]
            for robot, listed in recordings.items()
            if robot in run_.robots
        }
        archived = [
            event
            for robot in run_.robots
            for event in await self._journal.read(stream_of_raw(robot))
        ]
        gone = (msgspec.json.decode(event.body, type=RawArchived) for event in archived)
        return raw_of(run_, here, gone, until)

    async def replay(self, run_id: str, after: int) -> RunReplay:
        """Return one page of a run's replay: the events from the last keyframe at or before
        `after`. Raise NotFound if there is no such run."""
        return await run_replay(self.keyframe_store, run_id, after=after)

    async def umrf(self, run_id: str) -> bytes:
        """Return the text of the graph as it was sent. Raise NotFound if there is no such run."""
        return (await self._history.umrf(run_id)).encode()

    async def compare(self, a: str, b: str) -> RunComparison:
        """Return the comparison of the runs with the ids `a` and `b`. Raise NotFound if one of them
        does not exist."""
        one, other = await self.known(a), await self.known(b)
        sent_a, sent_b = await self._sent_tree(a), await self._sent_tree(b)
        return compare(one, other, sent_a, sent_b)

    async def _sent_tree(self, run_id: str) -> SentTree:
        sent = await self._history.requested(run_id)
        inside = {each.name: each.digest for each in sent.subgraphs}
        return SentTree(sent.umrf, inside, sent.script)

    async def export(self, run_id: str, form: Format) -> bytes:
        """Return the run as the contents of a file in the format `form`: CSV of visits, MCAP, or
        lines of JSON. Raise NotFound if there is no such run."""
        found = await self.known(run_id)
        if form == "csv":
            return exports.intervals(found)
        events = await self._journal.read(stream_of(run_id))
        if form == "mcap":
            pieces = [
                await self._journal.read(stream_of(each))
                for each in await self._journal.pieces(run_id)
            ]
            return exports.mcap(events, pieces)
        return b"".join(exports.lines(run_id, events))

    async def incident_file(
        self, run_id: str, asked: IncidentRequest, author: str, now: int, audit: bytes
    ) -> bytes:
        """Return all that is known of a run as a ZIP file. `author`: the name of the person who makes
        it; `now`: µs UTC; `audit`: the rows of the audit in that time, as JSON. Raise NotFound if
        there is no such run, TooLarge if that is too much for one file."""
        found, first = await self.known(run_id), await self._history.requested(run_id)
        parts: dict[str, bytes] = {}
        proofs: list[incident.StreamProof] = []
        for each in (run_id, *await self._journal.pieces(run_id)):
            events = await self._journal.read(stream_of(each))
            lines, end = incident.event_lines(events)
            parts[f"events/{len(proofs):03d}.jsonl"] = lines
            proofs.append(incident.proof_of(stream_of(each), end, await self._end(each)))
        graphs = list(incident.graph_files(first))
        for number, (_, _, umrf) in enumerate(graphs):
            parts[f"graphs/{number:03d}.umrf.graph.json"] = umrf.encode()
        since, until = incident.window(first.at, found.ended_at, now)
        robots = [await self._robot_facts(each, since, until) for each in found.robots]
        parts["robots.json"] = msgspec.json.format(msgspec.json.encode(robots))
        parts["audit.json"] = audit
        parts["audit-of-editor.json"] = msgspec.json.encode(asked.editor_audit)
        writers = await self.rows(select(runner_written_by).order_by(runner_written_by.c.since))
        return incident.packed(
            incident.Incident(
                run=run_id,
                number=found.number,
                made_at=incident.made_at(now),
                made_by=author,
                reason=asked.reason.strip(),
                is_over=found.end is not None,
                graph_name=first.graph_name,
                version=first.version,
                digest=first.digest,
                values=first.values,
                engine=first.engine,
                robots=tuple(found.robots),
                graphs=tuple((name, digest) for name, digest, _ in graphs),
                streams=tuple(proofs),
                software=incident.software([row._asdict() for row in writers]),
            ),
            parts,
        )

    async def _end(self, run_id: str) -> Head:
        """Return the end of the stream of a run as the log has it, also of an archived one."""
        head = runner_head.c
        rows = await self.rows(select(head.seq, head.chain).where(head.stream == stream_of(run_id)))
        return Head(rows[0].seq, bytes(rows[0].chain)) if rows else NOTHING

    async def _robot_facts(self, name: str, since: int, until: int) -> incident.RobotFacts:
        """Return the registration of a robot, and all that was recorded of it from `since` to
        `until` (µs UTC)."""
        registered = await self.rows(select(robot).where(robot.c.name == name))
        event = runner_event.c
        near = select(
            event.stream, event.seq, event.kind, event.author, event.at, event.body
        ).where(
            event.stream.in_((stream_of_robot(name), stream_of_raw(name))),
            event.at >= since,
            event.at <= until,
        )
        rows = await self.rows(near.order_by(event.position).limit(_NEAR))
        return incident.RobotFacts(
            name,
            registered[0]._asdict() if registered else None,
            tuple(
                incident.RobotLine(
                    row.stream, row.seq, row.kind, row.author, row.at, incident.body_of(row.body)
                )
                for row in rows
            ),
        )

    async def lines(self, run_id: str, after: int) -> tuple[int, bytes]:
        """Return a page of the stored events after number `after`, as lines of JSON, and the number
        (seq) of its last event, so that a long run need not be in memory as a whole. Raise NotFound
        if the run has no events."""
        events = await self._journal.read(stream_of(run_id), after=after, limit=_PAGE)
        if not events and not after:
            raise NotFound("There is no such run.")
        return events[-1].seq if events else after, b"".join(exports.lines(run_id, events))

    async def notes(self, run_id: str) -> list[RunNote]:
        """Return the notes at moments of a run, in the order of the moments. Raise Unavailable if the
        journal cannot be read."""
        events = await self._noted(run_id)
        noted = [msgspec.json.decode(each.body, type=annotations.Noted) for each in events]
        found = [
            RunNote(views.time(each.moment), each.text, each.author, views.time(each.at))
            for each in noted
        ]
        return sorted(found, key=lambda note: (note.moment, note.at))

    async def note_lines(self, run_id: str) -> bytes:
        """Return the notes at moments of a run as lines of JSON, in the order in which they were
        written. Raise Unavailable if the journal cannot be read."""
        return b"".join(exports.lines(run_id, await self._noted(run_id)))

    async def _noted(self, run_id: str) -> list[Event]:
        about = await self._journal.read(annotations.stream_about(run_id))
        return [each for each in about if each.kind == annotations.Noted.kind]

    async def pieces(self, run_id: str) -> list[str]:
        """Return the ids of the pieces of a led run, in the order in which they were sent.
        Raise Unavailable if the journal cannot be read."""
        return await self._journal.pieces(run_id)

    async def script(
        self,
        run_id: str,
        fault: tuple[str, expected_runs.Fault] | None,
        umrf: bytes | None = None,
        subgraphs: Sequence[SentSubgraph] = (),
    ) -> expected_runs.Recorded:
        """Return the run as a script, for its own graph or for another version of it (`umrf`: the
        text, None for its own; `subgraphs`: the graphs inside, which are opened if the run had opened
        them). `fault`: an action and the fault with which its last visit ends instead. Raise NotFound
        for an unknown run; BadInput, NotUmrf or TooLarge for a bad fault or graph, Conflict for one
        that cannot be opened."""
        found = await self.known(run_id)
        if fault is not None and fault[0] not in found.actions:
            raise BadInput(f"The run has no action {fault[0]!r}.", where={"path": "/fault"})
        script = expected_runs.recorded(found, fault)
        if umrf is None:
            return script
        graph = read_sent(umrf)[1].graph
        if subgraphs and expected_runs.has_opened(found):
            try:
                graph = opened(graph, read_inside(subgraphs, "", None, approved=False)[1]).graph
            except CannotOpen as why:
                raise Conflict(str(why), where={"path": "/umrf"}) from why
        return expected_runs.fitted(script, found, graph)

    # --- many runs ----------------------------------------------------------------------------

    async def statistics(
        self, graph: str, engine: str | None, last: int, unseen: Unseen | None = None
    ) -> statistics.Statistics:
        """Return statistics of the newest runs of a graph, at most `last` runs, without those that the
        person of `unseen` may not see. With `engine`, only runs on that engine count."""
        rows = await self._journal.query(
            statistics.runs_of(graph, engine, min(last, _LAST), unseen)
        )
        hidden = await self._hidden(unseen, rows)
        rows = [row for row in rows if row.id not in hidden]
        ids = [row.id for row in rows]
        sums: list[Row[Any]] = []
        for i in range(0, len(ids), _ROWS):
            sums += await self._journal.query(statistics.sums_of(ids[i : i + _ROWS]))
        newest = await self._graph(ids[0]) if ids else None
        return statistics.statistics(rows, sums, newest)

    async def _graph(self, run_id: str) -> Graph | None:
        try:
            text = await self._history.umrf(run_id)
            return codec.read(text.encode()).graph
        except (codec.Unreadable, Archived):
            return None

    # --- expectations -------------------------------------------------------------------------

    async def expected(
        self,
        wanted: expected_runs.Expect,
        name: str,
        author: Author,
        now: int,
    ) -> expected_runs.Expected:
        """Return the event that saves an expected course under `name`. `wanted`: a run, or a graph
        with a script; `author`: who saves it; `now`: µs UTC. Raise NotFound for an unknown run;
        BadInput, NotUmrf or TooLarge for a bad request; Conflict if the run is not over or the
        simulator takes another course."""
        if wanted.run == "":
            return expected_runs.of_dry_run(wanted, name, author, now)
        found = await self.known(wanted.run)
        if found.end is None:
            raise Conflict("The run is not over yet.")
        sent = await self._history.requested(wanted.run)
        return expected_runs.of_run(found, sent.umrf, name, author, now, sent.subgraphs)

    async def listed(
        self,
        wanted: queries.Filter,
        limit: int,
        open_runs: Mapping[str, views.RunSummary],
        unseen: Unseen | None = None,
    ) -> list[views.Listed]:
        """Return at most `limit` runs that fit the filter `wanted`, newest first. `open_runs`:
        summaries of open runs by id, whose states the tables do not have. Runs that the person of
        `unseen` may not see show little, and are left out if the filter asks for what they hide."""
        among = None if wanted.text is None else await numbers_with(wanted.text, self.rows)
        rows = await self.rows(queries.listed(wanted, limit, among, unseen))
        hidden = await self._hidden(unseen, rows)
        if wanted.asks_for_content:
            rows = [row for row in rows if row.id not in hidden]
        labels = await self._labels(rows)
        shown = (
            views.list_entry(
                open_runs.get(row.id) or views.summary_of_row(row), row, labels.get(row.id, [])
            )
            for row in rows
        )
        projected = (views.hidden(each) if each.id in hidden else each for each in shown)
        return [each for each in projected if not wanted.states or each.state in wanted.states]

    async def _labels(self, rows: Sequence[Row[Any]]) -> dict[str, list[str]]:
        found: dict[str, list[str]] = {}
        if rows:
            for row in await self.rows(queries.labels_of([row.id for row in rows])):
                found.setdefault(row.run, []).append(row.label)
        return found

    async def streamed(self, run: str, after: int) -> tuple[int, bytes]:
        """Return a page of the stored events of a run after number `after`, in the format of an
        HTTP event stream, and the number (seq) of the last one."""
        events = await self.events(run, after, _PAGE)
        lines = [
            b"id: %d\nevent: %b\ndata: %b\n\n" % (each.seq, each.kind.encode(), _event_json(each))
            for each in events
        ]
        return events[-1].seq if events else after, b"".join(lines)

    async def expectations(self, unseen: Unseen | None = None) -> list[expected_runs.Expectation]:
        """Return all expected courses that the person of `unseen` may see, by name."""
        saved = await self._seen(unseen, await self._all_saved())
        return [expected_runs.expectation_view(each) for each in saved]

    async def checked_courses(
        self,
        graph: str,
        umrf: bytes,
        subgraphs: Sequence[SentSubgraph] = (),
        unseen: Unseen | None = None,
    ) -> CheckedCourses:
        """Check the saved expected courses of a graph (its id) against this text of it and its
        sub-graphs, as far as the person of `unseen` may see them. Raise BadInput, NotUmrf or TooLarge
        if the text cannot be read."""
        saved = await self._seen(unseen, await self._all_saved(expectation.c.graph == graph))
        return check_courses(saved, umrf, subgraphs=subgraphs)

    async def hides_expectation(self, name: str, unseen: Unseen) -> bool:
        """Return whether there is an expected course of this name which the person of `unseen` may not
        see."""
        saved = await self._all_saved(expectation.c.name == name)
        return len(await self._seen(unseen, saved)) < len(saved)

    async def _seen(
        self, unseen: Unseen | None, saved: list[expected_runs.Expected]
    ) -> list[expected_runs.Expected]:
        """Return those expected courses whose graphs, and whose run, the person may see."""
        if unseen is None:
            return saved
        found = []
        for each in saved:
            graphs = (each.graph, *(inside.graph for inside in each.subgraphs))
            of = RunGraphs("", tuple(graph for graph in graphs if graph))
            run_of = await self.run_graphs(each.run) if each.run else None
            if not unseen.hides(of) and (run_of is None or not unseen.hides(run_of)):
                found.append(each)
        return found

    async def _all_saved(self, *where: ColumnElement[bool]) -> list[expected_runs.Expected]:
        asked = select(expectation).where(*where).order_by(expectation.c.name)
        return [await self._saved(row.seq) for row in await self._journal.query(asked)]

    async def _saved(self, seq: int) -> expected_runs.Expected:
        (event,) = await self._journal.read(expected_runs.STREAM, after=seq - 1, upto=seq)
        return msgspec.json.decode(event.body, type=expected_runs.Expected)
