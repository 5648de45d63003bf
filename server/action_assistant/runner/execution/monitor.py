"""The monitor of a run: takes in what its engine says, and concludes only what the evidence allows."""

import itertools
import logging
from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from typing import Final, NamedTuple, TypeAlias

import anyio
from msgspec.structs import replace

from action_assistant.errors import Refused
from action_assistant.kit.clock import ClockUs
from action_assistant.runner.execution.evidence import (
    LastLook,
    SubGraphs,
    differs,
    newer_than_answers,
)
from action_assistant.runner.execution.run_changes import LOOK_AT_IT, RunChanges
from action_assistant.runner.links.engine_process import EngineProcess
from action_assistant.runner.links.observations import TERMINAL, Snapshot
from action_assistant.runner.links.port import Answer, Standing
from action_assistant.runner.runs import refusals, stall
from action_assistant.runner.runs.events import Answered, Loading, Proof, Published, Silent
from action_assistant.runner.runs.fold import is_news
from action_assistant.runner.runs.run import Run
from action_assistant.runner.stop.doubtful_errors import DoubtfulErrors
from action_assistant.runner.stop.engine_threads import EngineThreads
from action_assistant.runner.stop.loading import (
    LoadingAction,
    LoadingTimes,
    LoadingWatch,
    in_words,
)
from action_assistant.runner.stop.proof import RestProof, hash_of
from action_assistant.umrf.pieces import outcome_of
from action_assistant.umrf.triggers import NEVER_BEGAN
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_POLL_S: Final = 1.0
_STOP_POLL_S: Final = 0.1
_SILENT_S: Final = 3.0
#: A wait that lasts longer than it was asked for by this: the process itself stood still.
STOOD_S: Final = 0.5
_APPEAR_S: Final = 3.0  # after a start until its graph must show in answers
_ABSENT_S: Final = 1.0  # for which answers must lack a graph whose start the engine has refused
_GIVEN_UP_S: Final = 30.0  # until a stopped run that never showed is believed to have never begun
_LOADING_REPORTED_S: Final = 1.5  # by then feedback that may rule loading out has come
_NO_PROOF: Final = "{doubt}, so that no answer proves anything"


class Finding(NamedTuple):
    """The result of a background job: an alarm (`code` and `text`, "" for none). `only_open`: the
    alarm does not concern a run that is over. `asks`: the engine should be asked again, since more
    is known now."""

    code: str = ""
    text: str = ""
    only_open: bool = False
    asks: bool = False


#: Work that no look waits for. It may raise Refused, and is given up then.
Job: TypeAlias = Callable[[RunInWorker], Awaitable[Finding]]


class EngineQuery(NamedTuple):
    """One question (get) to an engine. `order`: its number in the order of everything that is sent;
    `began`: its time in seconds of the event loop's clock."""

    order: int
    began: float


class Monitor:
    """Decides what the messages and answers of an engine mean for one run.

    Each method that processes one adds the resulting changes to those of the run, so that they are
    kept even if an exception prevents further conclusions. Slow jobs are collected, to be run in
    the background.

    `trouble`: why the Stop of the run is not proven yet. `seen_at`: when the engine last showed the
    run (µs UTC). `is_elsewhere`: another process of the engine shows the run than the one that it was
    sent to. `umrf`: the last graph that was sent, if known. `rested_at`: when the run was last seen to
    be over, for a run that moves again. `exact`: the engine's answers show everything.
    """

    def __init__(
        self,
        run: Run,
        *,
        exact: bool,
        clock_us: ClockUs,
        doubts: DoubtfulErrors,
        loading_times: LoadingTimes,
        rested_at: int | None = None,
    ) -> None:
        self.trouble = ""
        self.seen_at: int | None = None
        self.is_elsewhere = False
        self.umrf: str | None = None
        self._clock_us = clock_us
        self._jobs: list[Job] = []
        self._order = itertools.count(1)
        self._stop_sent: int | None = None
        self._disturbed = 0
        self._begun = 0  # order of the feedback that showed the run first
        self._sent: str | None = None  # until it was compared with what the engine shows
        self._sent_order = 0
        self._start = refusals.StartLog(run)
        self._absent: float | None = None  # since when answers lack a start that was refused
        self._standstill = stall.Standstill()
        self._stalled_as: object = None  # the actions when a standstill was last reported
        self._lacking: str | None = None  # what the graph that was sent lacks to begin
        self._parts = SubGraphs()
        self._loading = LoadingWatch(run.graph_name, meddled=run.reshaped)
        self._loading_times = loading_times
        self._threads = EngineThreads()
        self._reads = False  # while a job reads arrows of graphs
        self._loads_since: float | None = None
        self._loading_reported_at = 0.0  # seconds of loading at which that is reported again
        self._answered = False  # by a get, since the last feedback
        self._exact = exact
        self._rest = RestProof(exact=exact)
        self._doubts = doubts
        self._heard_at = self._began_at = anyio.current_time()
        self._seen_wall = rested_at
        self._seen_asked: int | None = None

    # --- what is sent -------------------------------------------------------------------------

    def starts(self, umrf: str, process: EngineProcess | None) -> None:
        """Record that the runner sends the start of this graph (UMRF text) now. `process`: the
        engine's process, None if unknown. From now on a refusal in the engine's log may belong to
        this start."""
        self._start.begins()
        self._threads.starts(process)
        self.sends(umrf)

    def sends(self, umrf: str, *, beside: bool = False) -> None:
        """Record that the runner sends this graph (UMRF text) now, so that the engine's next answer
        is compared with it. `beside`: the graph runs already, and one of its actions is started
        while others run."""
        self._loading.sends(umrf, beside=beside)
        if beside:  # what begins when that arrives has no thread yet
            self._threads = EngineThreads()
        self._sent = self.umrf = umrf
        self._sent_order = next(self._order)

    def recalls(self, umrf: str) -> None:
        """Record that this graph (`umrf`: its text) was sent by an earlier process, before this
        monitor began."""
        self.umrf = umrf
        self._loading.recalls(umrf)

    def stop_left(self) -> None:
        """Record that a stop message was sent: an answer that is asked for from now on may prove
        that the run has stopped."""
        if self._stop_sent is None:
            self._stop_sent = next(self._order)

    def started_by_others(self) -> None:
        """Record that another program has started something, so that the engine's log lines about a
        start may not be about this run."""
        self._start.doubt()

    def disturbed(self, *, meddles: bool) -> None:
        """Record that another program may just have started the graph: an answer requested before
        this proves nothing. `meddles`: the graph may go on with other arrows, or from another
        action."""
        self._disturbed = next(self._order)
        self._rest.forget()
        if meddles:
            self._loading.meddle()
            self._threads = EngineThreads()

    # --- what is heard ------------------------------------------------------------------------

    def hear(self, changes: RunChanges, line: str) -> None:
        """Process a line of the engine's log. If it refuses the start, add an alarm to `changes`."""
        if self._start.hear(line):
            words = refusals.in_words(changes.run.engine, self._start.words)
            changes.alarm(refusals.REFUSED, words)

    def feed(
        self,
        changes: RunChanges,
        standing: Standing,
        ours: tuple[Snapshot, ...],
        parts: tuple[Snapshot, ...] = (),
    ) -> None:
        """Process feedback, and add the news to `changes`. `standing`: the condition of the engine;
        `ours`: snapshots of this run, oldest first; `parts`: snapshots of graphs that have names of
        its sub-graphs."""
        run = changes.run
        if self._is_alone(run, standing):
            self._loading.see((*ours, *parts))
        if not ours:
            return
        if run.graph_state is None:
            self._begun = next(self._order)
        overtaken, self._answered = self._answered, False
        self.seen_at = self._clock_us()
        if news := newer_than_answers(run, ours) if overtaken else ours:
            asked = self._seen_asked
            changes.observe(tuple(replace(each, since_asked=asked) for each in news))

    def _is_alone(self, run: Run, standing: Standing) -> bool:
        """Return whether there is one engine only, and still the process that the run was sent to.
        If not, the sender of earlier feedback is unknown, and observations of loading are
        forgotten. `standing`: the condition of the engine."""
        lives = {run.incarnation, standing.incarnation} - {None, ""}
        if not standing.doubt and len(lives) <= 1:
            return True
        self._loading.forget()
        return False

    # --- what is asked ------------------------------------------------------------------------

    def begin_query(self) -> EngineQuery:
        """Return a mark of the get that is sent to the engine now; give it to `answered` with the
        answer."""
        return EngineQuery(next(self._order), anyio.current_time())

    def pace(self, run: Run) -> float:
        """Return the longest time in seconds until the engine is to be asked again; it is shorter
        during a Stop."""
        hurry = run.desired == "stopped" or self._rest.pending
        hurry = hurry and not run.loading  # feedback tells when a loading action begins
        return _STOP_POLL_S if hurry else _POLL_S

    def take_jobs(self) -> list[Job]:
        """Return the slow jobs that have come up since the last call, for the caller to run."""
        jobs, self._jobs = self._jobs, []
        return jobs

    def stood_still(self, seconds: float) -> None:
        """Do not count `seconds` in which this process stood still as silence of the engine."""
        self._heard_at += seconds
        self._began_at += seconds
        if self._absent is not None:
            self._absent += seconds

    def unanswered(self, changes: RunChanges, standing: Standing, why: str) -> None:
        """Process that the engine has not answered a get, and add the conclusions to `changes`.
        `standing`: its condition; `why`: the reason, "" if unknown."""
        self._is_alone(changes.run, standing)
        self._hear_nothing(changes, why)

    def answered(
        self, changes: RunChanges, standing: Standing, answer: Answer, look: EngineQuery
    ) -> None:
        """Process the answer to one get, and add the conclusions to `changes`. `standing`: the
        engine's condition after it; `look`: the mark that `begin_query` returned when it was sent.
        """
        self._take(changes, standing, answer, look)
        self._compare(changes.run, answer, look.order)

    def _hear_nothing(self, changes: RunChanges, why: str) -> None:
        silent = anyio.current_time() - self._heard_at
        self.trouble = why or "the engine does not answer"
        if silent >= _SILENT_S and changes.run.unknown_since is None:
            at = self._clock_us()
            changes.tell(Silent(at, at - round(silent * 1e6), self.trouble))

    def _take(
        self, changes: RunChanges, standing: Standing, answer: Answer, look: EngineQuery
    ) -> None:
        """Add all conclusions that one answer allows to `changes`: observations of the run, its
        loss after a restart of the engine, or its end. `standing`: the engine's condition after the
        answer; `look`: the mark of the get that it answers."""
        run = changes.run
        name = run.graph_name
        own = next((each for each in answer.graphs if each.graph == name), None)
        is_other = len({run.incarnation, answer.incarnation} - {None, ""}) > 1
        moves = own is not None and (own.state not in TERMINAL or _any_active(answer, name))
        self.is_elsewhere = is_other and own is not None and own.run == run.id and moves
        if is_other:
            self._lose_engine(changes)
            return
        if own is None or own.run != run.id:
            if standing.doubt and standing.servers:
                self._hear_nothing(changes, _NO_PROOF.format(doubt=standing.doubt))
                return
            self._heard_at = anyio.current_time()
            if look.order >= self._begun:
                self._missing(changes, standing, own, answer)
            return
        self._heard_at, self.seen_at, self._answered = anyio.current_time(), answer.at, True
        if run.incarnation is None:  # the runner died between sending and noting it
            changes.tell(Published(answer.at, answer.incarnation, standing.process))
        if changes.run.unknown_since is not None or changes.run.lost:
            changes.tell(Answered(answer.at))
        parts = [each for each in answer.graphs if each.graph.startswith(f"{name}__")]
        shown = [own, *(part for part in parts if part.run in {None, run.id})]
        ours = [own, *self._parts.ours(own, shown[1:])]
        self._note(changes, ours)
        if standing.doubt:
            self._is_alone(changes.run, standing)
            self._rest.forget()
            self.trouble = _NO_PROOF.format(doubt=standing.doubt)
        else:
            self._loading.see(ours)
            self._conclude(changes, shown, ours, answer, look)

    def _lose_engine(self, changes: RunChanges) -> None:
        """Record that another process of the engine answers than the one that the run was sent to. If
        that process shows the run, the start has reached it too, or alone: stops go on to it, but its
        answers do not prove that the other one is at rest."""
        if changes.run.lost:
            return
        alarm, why = (
            "The engine was restarted: look at the robot.",
            "The engine was restarted while the run went on.",
        )
        if self.is_elsewhere:
            why = "Another process of the engine has the run than the one that it was sent to."
            alarm = f"{why} {LOOK_AT_IT}"
        changes.alarm("engine_restarted", alarm)
        changes.lose(why + changes.last_words())

    def _compare(self, run: Run, answer: Answer, order: int) -> None:
        """Queue one comparison of the engine's graph text in an answer with the text that was sent,
        if that was not compared yet. `order`: the number of the get. A difference raises an alarm
        and never stops the engine."""
        sent, text = self._sent, answer.texts.get(run.graph_name)
        if sent is None or text is None or run.graph_state is None:
            return
        if order < self._sent_order:  # asked before that was handed over
            return
        self._sent = None

        async def compare(run_in_worker: RunInWorker) -> Finding:
            why = await run_in_worker(differs, sent, text)
            sentence = f"What {run.engine} shows is not what was sent: {why}"
            return Finding("echo_differs", sentence) if why else Finding()

        self._jobs.append(compare)

    def _note(self, changes: RunChanges, shown: list[Snapshot]) -> None:
        """Add the snapshots of an answer that show anything new to `changes`."""
        usual = LastLook(self._seen_wall, self._seen_asked)
        self._seen_wall, self._seen_asked = shown[0].at, shown[0].asked_at
        looks = {each.graph: self._parts.last_look(each.graph, usual) for each in shown}
        news = tuple(
            replace(each, since=looks[each.graph].at, since_asked=looks[each.graph].asked)
            for each in shown
            if is_news(changes.run, each)
        )
        if news:
            changes.observe(news)

    def _missing(
        self, changes: RunChanges, standing: Standing, other: Snapshot | None, answer: Answer
    ) -> None:
        """Add to `changes` what follows from an answer that does not show this run: it is lost,
        refused or not begun yet. `other`: a graph of the same name in the answer, None if there is
        none."""
        self._rest.forget()
        run = changes.run
        if run.graph_state is not None:
            changes.lose(
                "The engine does not hold this run any more."
                if other is None
                else "Another start has taken the place of this run."
            )
            return
        waited = anyio.current_time() - self._began_at
        if self._refused_and_absent(standing):
            changes.end("refused", refusals.why_refused(run.engine, self._start.words))
            return
        if waited < _APPEAR_S:
            return
        if run.incarnation is None:
            changes.lose("The runner ended before it could note whether the start was sent.")
        elif run.desired == "stopped" and waited >= _GIVEN_UP_S:
            changes.lose("The engine answers but has never shown this run.")
        elif run.unknown_since is None:
            since = answer.at - round(waited * 1e6)
            changes.tell(Silent(answer.at, since, "The engine answers but does not show this run."))

    def _refused_and_absent(self, standing: Standing) -> bool:
        """Return whether the engine has received the start, has refused it, and has not shown the
        run for a while since. Then no part of the run has begun or can begin. `standing`: the
        condition of the engine."""
        if not self._start.words or standing.doubt:
            self._absent = None
            return False
        self._absent = self._absent if self._absent is not None else anyio.current_time()
        return anyio.current_time() - self._absent >= _ABSENT_S

    def _conclude(
        self,
        changes: RunChanges,
        shown: list[Snapshot],
        ours: list[Snapshot],
        answer: Answer,
        look: EngineQuery,
    ) -> None:
        """Decide by one answer whether the run is over, or why that is not proven, and add that to
        `changes`. `shown`: the snapshots of the graph and its possible sub-graphs; `ours`: those of
        the graph and of the sub-graphs that it has begun; `look`: the mark of the get."""
        if look.order < self._disturbed:
            return
        own, at_rest = shown[0], self._rest.seen(shown, look.began)
        if self._is_told_by_shape(changes.run, shown):
            at_rest = True
        if any(each.active for each in ours):
            self._threads.see_moving()
        doubt = self._doubts.look(shown)
        if doubt and doubt != changes.run.unconfirmed:
            changes.doubt(doubt)
        run = changes.run
        if run.unconfirmed:
            going = ", ".join(run.active)
            self.trouble = f"{going} has not stopped yet" if going else run.unconfirmed
            if self._exact and at_rest:
                changes.engine_ended()  # a simulated engine is switched off then
            elif at_rest and self._threads_explain(ours, run.process):
                changes.threads_ended()
            return
        if _never_began(own) and self.umrf is not None and self._lacking is None:
            self._lacking = ""
            self._jobs.append(partial(self._find_lacking, self.umrf))
        loading = self._still_loading(changes, ours, answer)
        run = changes.run
        if run.desired != "stopped":
            end = run.apparent_end
            if end is not None and own.state in TERMINAL and at_rest:
                if not loading:
                    changes.end(end, "")
            elif at_rest and _never_began(own) and not _has_begun(run):
                changes.end("refused", self._why_unbegun(run))
            else:
                self._look_for_trouble(changes, shown, look.began)
            return
        if self._stop_sent is None or look.order <= self._stop_sent:
            return
        if at_rest and loading:
            self.trouble = in_words(loading)
        elif at_rest:
            changes.tell(Proof(answer.at, answer.asked_at, hash_of(shown)))
            changes.end(changes.run.apparent_end or "stopped", "")
        elif self._rest.pending:
            self.trouble = "nothing moves, but an action may still be about to begin"
        elif own.state == "FINISHED":
            self.trouble = (
                "the graph has finished, so the engine ignores Stop, while "
                f"{', '.join(run.active)} goes on"
            )
        else:
            self.trouble = f"{', '.join(run.active) or own.graph} has not stopped yet"

    def _is_told_by_shape(self, run: Run, shown: Sequence[Snapshot]) -> bool:
        """Return whether the states of a piece show its outcome, so that this one answer proves its
        end: it has one action, which nothing can begin again. After a Stop the usual proof is
        needed instead."""
        if run.piece is None or run.desired == "stopped" or len(shown) > 1 or run.inner:
            return False
        return outcome_of(shown[0].state, shown[0].nodes.get(run.piece.node, "")) is not None

    def _threads_explain(self, ours: Sequence[Snapshot], process: EngineProcess | None) -> bool:
        """Return whether the threads of the engine's process prove that the code of all doubtful
        actions has ended. That holds only if all of them are in graphs of this run (`ours`): a
        hanging thread of an earlier run began before this start. `process`: None if it cannot be
        observed, then the result is false."""
        begun = {each.graph for each in ours}
        return self._doubts.open_graphs <= begun and self._threads.have_ended(process)

    def _still_loading(
        self, changes: RunChanges, ours: list[Snapshot], answer: Answer
    ) -> tuple[LoadingAction, ...]:
        """Return the actions that may still be loading in a graph that looks at rest; raise an
        alarm in `changes` if that lasts. `ours`: the snapshots of this run. Arrows that are not
        known yet are read in the background."""
        if self._exact:
            return ()
        if not self._rest.pending:
            self._loads_since = None
            self._report_loading(changes, (), 0.0)
            return ()
        unread = self._loading.unread(ours)
        if unread and not self._reads:
            self._reads = True
            self._jobs.append(partial(self._read_arrows, unread, answer))
        found = self._loading.actions(ours)
        if found and self._threads.have_ended(changes.run.process):
            found = ()
        if not found:
            self._loads_since = None
            self._report_loading(changes, (), 0.0)
        elif self._loads_since is None:
            self._loads_since = anyio.current_time()
        elif (waited := anyio.current_time() - self._loads_since) >= _LOADING_REPORTED_S:
            self._report_loading(changes, found, waited)
        return found

    def _report_loading(
        self, changes: RunChanges, actions: Sequence[LoadingAction], waited_s: float
    ) -> None:
        """Report in `changes` that these actions may be loading for `waited_s` seconds or, if there
        are no actions, that loading is over. The time is reported again each time it has doubled.
        """
        run = changes.run
        why, known = in_words(actions), run.loading
        if not why and not known:
            return
        is_same = bool(why) and known.startswith(why)
        if is_same and waited_s < self._loading_reported_at:
            return
        self._loading_reported_at = max(4.0, 2 * waited_s)
        usual = self._loading_times.usual(run.engine, actions)
        times = [f"{waited_s:.0f} s so far"] * is_same + [usual] * bool(usual)
        sentence = f"{why} ({'; '.join(times)})" if times else why
        places = tuple((each.graph, each.node) for each in actions)
        changes.tell(Loading(self._clock_us(), sentence, places))
        if why:
            changes.alarm("stop_unconfirmed", f"STOP UNCONFIRMED: {why}. {LOOK_AT_IT}")

    async def _read_arrows(
        self, graphs: Sequence[str], answer: Answer, run_in_worker: RunInWorker
    ) -> Finding:
        try:
            await self._loading.read(graphs, answer.texts, run_in_worker)
        except Refused as why:  # every action that has not begun counts as loading then
            log.warning("the arrows of %s cannot be read: %s", ", ".join(graphs), why.detail)
        finally:
            self._reads = False
        return Finding(asks=True)

    def _why_unbegun(self, run: Run) -> str:
        """Return why the run has not begun. A started graph is RUNNING in the first answer after
        its start, so a held graph in another state would need another start to begin."""
        words = self._start.words
        if words:
            return f"{refusals.why_refused(run.engine, words)} It has begun none of it."
        sentence = f"{run.engine} holds the graph and has not begun it, without a word why. {self._lacking or ''}"
        return sentence.rstrip()

    async def _find_lacking(self, umrf: str, run_in_worker: RunInWorker) -> Finding:
        self._lacking = await run_in_worker(stall.lacking_in_words, umrf)
        return Finding()

    async def _report_stall(self, run: Run, run_in_worker: RunInWorker) -> Finding:
        try:
            text = await run_in_worker(stall.packed_alarm_text, stall.packed(run), self.umrf)
        except Refused:  # the graph cannot be read now; report what is known all the same
            text = stall.alarm_text(run, None)
        if not self._standstill.lasts:
            return Finding()
        return Finding(stall.STALLED, text, only_open=True)

    def _look_for_trouble(self, changes: RunChanges, shown: list[Snapshot], asked: float) -> None:
        """Check an open run for faults that the answer shows: a start refused and begun all the
        same, and a standstill. `shown`: the snapshots of its graph and sub-graphs; `asked`: when
        the get was sent, in seconds of the event loop."""
        run, own = changes.run, shown[0]
        if self._start.words and not _never_began(own):
            text = (
                f"{run.engine} refused the start ({self._start.words}) and yet shows the graph "
                f"{own.state}: some of it may have begun. Stop it, and restart its engine."
            )
            changes.alarm(refusals.HALF_BEGUN, text)
        stalls = self._standstill.seen(shown, asked) and not self._exact
        if stalls and self._stalled_as is not run.actions:
            self._stalled_as = run.actions
            self._jobs.append(partial(self._report_stall, changes.run))


def _any_active(answer: Answer, name: str) -> bool:
    """Return whether an answer shows an active action of the graph with this name, or of a sub-graph of
    it."""
    own = (
        each for each in answer.graphs if each.graph == name or each.graph.startswith(f"{name}__")
    )
    return any(each.active for each in own)


def _has_begun(run: Run) -> bool:
    """Return whether an action of the run was ever seen to begin, perhaps by a start that another
    program repeated."""
    return any(action.visits for action in run.actions.values())


def _never_began(own: Snapshot) -> bool:
    """Return whether all states of a graph that an engine shows prove that no part of it has begun;
    the states of a graph that has ended do not."""
    return NEVER_BEGAN.issuperset({own.state, *own.nodes.values()})
