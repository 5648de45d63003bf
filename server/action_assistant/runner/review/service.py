"""The review of runs: marks of people, examples, expected courses, and the loops that sum runs up."""

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Annotated, Final

import anyio
import msgspec
from sqlalchemy import select

from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.analysis import annotations, expected_runs
from action_assistant.runner.archives import examples
from action_assistant.runner.archives.archive_store import ArchiveStore
from action_assistant.runner.review.background_loops import KeyframeLoop, SumUpLoop
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.review.worker_queries import WorkerQueries
from action_assistant.runner.runs.events import Author, draft_of
from action_assistant.runner.runs.recorder import RunRecorder, stream_of
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sight import Unseen
from action_assistant.runner.runs.views import microseconds
from action_assistant.schema.runner_tables import expectation, review, run_label


class RunMarks(msgspec.Struct, frozen=True):
    """The marks that people gave a run."""

    pinned: bool
    note: str
    labels: list[str]


#: Notes of one run: each is written with all texts by which the run is found.
_MOST_NOTES: Final = 500


class NoteText(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A note for a moment of a run. `moment`: without it, now; for a run that is over, its end.
    `request_id`: names this request; a repeat by the same person adds no second note."""

    text: Annotated[str, msgspec.Meta(min_length=1, max_length=2_000, pattern=r"\S")]
    moment: datetime | None = None
    request_id: Annotated[str, msgspec.Meta(max_length=200)] = ""


class ReviewService:
    """Stores the marks of people on runs, and runs the loops that work on stored runs. It sends no
    commands. Its methods raise Unavailable while the journal cannot be read or written. `queries`
    answers questions in workers; `next_number` returns the number for a new run."""

    def __init__(
        self,
        journal: ArchiveStore,
        clock_us: ClockUs,
        queries: WorkerQueries,
        next_number: Callable[[], int],
    ) -> None:
        self._journal = journal
        self._clock_us = clock_us
        self._queries = queries
        self._next_number = next_number
        self._noting = anyio.Lock()
        self._sums = SumUpLoop(
            journal, clock_us, lambda run, now: queries.value(StoredRuns.summed, run, now)
        )
        self._keyframes = KeyframeLoop(lambda run: queries.value(StoredRuns.made_keyframes, run))

    def run_changed(self, run: Run, recorder: RunRecorder) -> None:
        """Call this when an open run has changed, so that its totals and keyframes are stored when
        due. `recorder`: the recorder of the run."""
        self._sums.run_changed(run, recorder)
        self._keyframes.run_changed(run, recorder)

    async def run(self) -> None:
        """Compute totals of ended runs and store keyframes of long ones, until cancelled."""
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._sums.run)
            tasks.start_soon(self._keyframes.run)

    async def mark(self, run_id: str, marks: annotations.Marks, author: Author) -> RunMarks:
        """Pin, annotate or label a run in the name of `author`, and return all its marks. Raise
        NotFound if there is no such run."""
        if not await self._journal.newest(stream_of(run_id)):
            raise NotFound("There is no such run.")
        marked = annotations.Marked(self._clock_us(), author, marks)
        await self._journal.append(annotations.stream_about(run_id), [annotations.draft(marked)])
        return await self.marks(run_id)

    async def note(self, run: Run, given: NoteText, author: Author) -> None:
        """Store a note at a moment of `run` in the name of `author`, once for each request id. Raise
        BadInput if the run was not there at that moment, Conflict if the request id belongs to
        another note or the run has very many, Unavailable if the journal cannot be read or
        written."""
        now = self._clock_us()
        last = now if run.ended_at is None else run.ended_at
        moment = last if given.moment is None else microseconds(given.moment)
        if run.ended_at is None:
            moment = min(moment, now)  # the clock of a page may be a little ahead
        if not run.requested_at <= moment <= last:
            text = "A note is for a moment from the request of the run to its end."
            raise BadInput(text, where={"path": "/moment"})
        stream = annotations.stream_about(run.id)
        noted = annotations.Noted(now, author, moment, given.text.strip(), given.request_id)
        async with self._noting:  # a repeat waits for the first one
            known = [
                msgspec.json.decode(event.body, type=annotations.Noted)
                for event in await self._journal.read(stream)
                if event.kind == annotations.Noted.kind
            ]
            if _is_among(known, noted):
                return
            if len(known) >= _MOST_NOTES:
                raise Conflict(f"A run has {_MOST_NOTES} notes at most.")
            await self._journal.append(stream, [annotations.draft(noted)])

    async def keep_incident(self, run_id: str, reason: str, author: Author) -> None:
        """Keep a run as an incident, so that it is never archived. Raise NotFound if there is no such
        run, Unavailable if the journal cannot be written."""
        if not await self._journal.newest(stream_of(run_id)):
            raise NotFound("There is no such run.")
        kept = annotations.IncidentKept(at=self._clock_us(), author=author, reason=reason.strip())
        await self._journal.append(annotations.stream_about(run_id), [annotations.draft(kept)])

    async def marks(self, run_id: str) -> RunMarks:
        """Return the marks of a run: pin, note and labels."""
        rows = await self._journal.query(select(review).where(review.c.run == run_id))
        labels = await self._journal.query(
            select(run_label.c.label).where(run_label.c.run == run_id).order_by(run_label.c.label)
        )
        pinned, note = (rows[0].pinned, rows[0].note) if rows else (False, "")
        return RunMarks(bool(pinned), note, [row.label for row in labels])

    async def take_in(self, texts: Sequence[bytes], author: Author) -> list[str]:
        """Import recorded runs as examples, each once; return their ids. `texts`: lines of JSON;
        `author`: who imports them. Raise BadInput if a text is no recorded run, Unavailable if the
        journal cannot be written."""
        imported: list[str] = []
        for text in texts:
            first, rest = examples.read(text)
            stream = stream_of(first.run)
            if not await self._journal.newest(stream):
                label = annotations.Marks(labels=(examples.LABEL,))
                marked = annotations.Marked(self._clock_us(), author, label)
                await self._journal.append(
                    annotations.stream_about(first.run), [annotations.draft(marked)]
                )
                begin = examples.numbered(first, self._next_number())
                await self._journal.append(stream, [begin, *rest], expected=0)
            imported.append(first.run)
        self._sums.begin_again()  # the imported runs ended long ago
        return imported

    # --- expectations -------------------------------------------------------------------------

    async def expect(
        self, wanted: expected_runs.Expect, author: Author, unseen: Unseen | None = None
    ) -> expected_runs.Expectation:
        """Save an expected course in the name of `author`. `wanted`: a run, or a graph with a
        script; `unseen`: the graphs that the author may not see, whose courses are not replaced. Raise NotFound for an unknown run; BadInput, NotUmrf or TooLarge for a bad request;
        Conflict if the simulator takes another course than the run."""
        name = expected_runs.name_of(wanted.name)
        if await self._is_hidden(name, unseen):
            raise Conflict("This name is taken. Choose another one.", where={"path": "/name"})
        now = self._clock_us()
        await self._queries.wait_until_stored(wanted.run)
        saved = await self._queries.value(StoredRuns.expected, wanted, name, author, now)
        await self._journal.append(expected_runs.STREAM, [draft_of(saved, author.id)])
        return expected_runs.expectation_view(saved)

    async def _is_hidden(self, name: str, unseen: Unseen | None) -> bool:
        if unseen is None:
            return False
        return await self._queries.value(StoredRuns.hides_expectation, name, unseen)

    async def retire(self, name: str, author: Author, unseen: Unseen | None = None) -> None:
        """Remove the expected course of this name. `author`: who removes it; `unseen`: the graphs that
        they may not see. Raise NotFound if there is no such course that they may see."""
        rows = await self._journal.query(select(expectation).where(expectation.c.name == name))
        if not rows or await self._is_hidden(name, unseen):
            raise NotFound(f"Nothing is expected under the name {name!r}.")
        retired = expected_runs.Retired(self._clock_us(), name, author)
        await self._journal.append(expected_runs.STREAM, [draft_of(retired, author.id)])


def _is_among(known: Sequence[annotations.Noted], noted: annotations.Noted) -> bool:
    """Return whether a note has been stored by an earlier request with its request id; raise Conflict
    if that belongs to another note of its author."""
    for each in known if noted.request_id else ():
        if (each.author.id, each.request_id) == (noted.author.id, noted.request_id):
            if each.text != noted.text:
                where: dict[str, object] = {"path": "/request_id"}
                raise Conflict("This request_id belongs to another note.", where=where)
            return True
    return False
