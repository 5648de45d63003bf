"""Reads the runs from which others are started: only runs that are over and at rest."""

from typing import Final

import anyio
import msgspec

from action_assistant.errors import BadInput, Conflict, Forbidden, NotFound, Unavailable
from action_assistant.runner.execution.open_runs import OpenRuns
from action_assistant.runner.execution.stored_course import ending_of, stored_course
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.history import RunHistory
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sight import RunSight, run_graphs
from action_assistant.runner.runs.views import AT_REST, rests_of
from action_assistant.runner.start.admission import (
    AskedInputsRequest,
    GroupRequest,
    StartRequest,
    asked_for,
)
from action_assistant.runner.start.start_from import EarlierRun, listed
from action_assistant.umrf.start_values import AskedInput
from action_assistant.web.auth.identity import Identity
from action_assistant.web.workers.lanes import RunInWorker

_STORED_S: Final = 5  # for which the end of a run is waited to be stored
_WHERE: Final[dict[str, object]] = {"path": "/from/run"}


class EarlierRuns:
    """Finds how far an earlier run got. Nothing is stored."""

    def __init__(
        self, runs: OpenRuns, history: RunHistory, sight: RunSight, in_worker: RunInWorker
    ) -> None:
        self._runs = runs
        self._history = history
        self._sight = sight
        self._in_worker = in_worker

    async def read(
        self, request: StartRequest | GroupRequest | AskedInputsRequest, starter: Identity
    ) -> EarlierRun | None:
        """Return the run from which a start takes outcomes and values; None if it takes none. Raise
        NotFound if the starter may not see it, Conflict unless it was led, is over, every robot of it is
        at rest, and nothing has continued it; BadInput for choices that say too little, Forbidden for
        the word of a program."""
        start = request.start_from
        if start is None:
            return None
        if start.choices and not start.continues:
            text = "Choices are for a run that is continued where it ended."
            raise BadInput(text, where={"path": "/from/choices"})
        if start.has_words and starter.token is not None:
            raise Forbidden("A program's token cannot state an outcome: it takes a person.")
        if start.has_words and not start.reason.strip():
            text = "Say how you know the outcome: it is recorded with the run."
            raise BadInput(text, where={"path": "/from/reason"})
        if not start.run:
            return None
        run = await self._ended(start.run, request.graph, starter)
        if start.continues:
            await self._require_last(run)
        try:
            first = await self._history.requested(run.id)
            course = await stored_course(self._history, first)
        except msgspec.DecodeError as damaged:
            text = f"Some events of run {run.number} cannot be read: nobody knows how far it got."
            raise Conflict(text, where=_WHERE) from damaged
        unsent = {each.piece for each in run.rests.values() if each.state == "unsent"}
        calls = frozenset(call for call, piece in course.newest.items() if piece in unsent)
        ended_at = run.ended_at or run.requested_at
        ending = await self._in_worker(ending_of, first, course, ended_at, calls, start.choices)
        return EarlierRun(first, ending)

    async def asked_inputs(
        self, wanted: AskedInputsRequest, starter: Identity
    ) -> tuple[AskedInput, ...]:
        """Return the inputs for which a start asks. Raise a subclass of Refused if it cannot begin
        there."""
        earlier = await self.read(wanted, starter)
        return await self._in_worker(asked_for, wanted, earlier)

    async def _ended(self, id_: str, graph: str | None, starter: Identity) -> Run:
        opened = self._runs.by_id.get(id_)
        run = await self._runs.find(id_)
        if self._sight.hides(run_graphs(run), starter):
            raise NotFound("There is no such run.")
        if run.piece is not None or run.led is None:
            text = f"Run {run.number} was not led step by step: nobody knows how far it got."
            raise Conflict(text, where=_WHERE)
        if run.graph is None or run.graph != graph:
            raise Conflict(f"Run {run.number} was of another graph.", where=_WHERE)
        if run.end is None:
            raise Conflict(f"Run {run.number} is not over.", where=_WHERE)
        moving = [each.robot for each in rests_of(run) if each.state not in AT_REST]
        if moving:
            raise Conflict(
                f"It is not proven that {listed(moving)} is at rest since run {run.number}: look at the "
                "robot, and confirm that first.",
                where=_WHERE,
            )
        if opened is not None:
            try:
                with anyio.fail_after(_STORED_S):
                    await opened.recorder.flushed()
            except TimeoutError:
                raise Unavailable("The end of that run could not be stored yet.") from None
        return run

    async def _require_last(self, run: Run) -> None:
        """Raise Conflict if a run has continued this one: what followed would begin once more."""
        rows = await self._history.rows(queries.continued_by(run.id))
        if rows:
            text = f"Run {rows[0].number} has continued run {run.number}: continue that one."
            raise Conflict(text, where=_WHERE)
