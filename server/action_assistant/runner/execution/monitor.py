"""The monitor of a run: asks its engine, listens, and concludes only what the evidence allows."""

import itertools
import logging
from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from typing import Final, Protocol

import anyio
from anyio.abc import TaskGroup
from msgspec.structs import replace

from action_assistant.errors import Refused
from action_assistant.runner.execution.echo_difference import differs
from action_assistant.runner.execution.feedback_order import fresh
from action_assistant.runner.execution.sub_graphs import LastLook, SubGraphs
from action_assistant.runner.links.engine_process import has_ended
from action_assistant.runner.links.observations import TERMINAL, Seen, Snapshot
from action_assistant.runner.links.port import Answer, Link, NoAnswer
from action_assistant.runner.runs import refusals, stall
from action_assistant.runner.runs.events import Answered, End, Proof, Published, RunEvent, Silent
from action_assistant.runner.runs.fold import is_news
from action_assistant.runner.runs.run import Run
from action_assistant.runner.stop.doubtful_errors import DoubtfulErrors
from action_assistant.runner.stop.engine_threads import EngineThreads
from action_assistant.runner.stop.loading import LoadingAction, LoadingWatch, in_words
from action_assistant.runner.stop.proof import RestProof, hash_of
from action_assistant.umrf.triggers import NEVER_BEGAN
from action_assistant.web.workers.lanes import RunInWorker

log: Final = logging.getLogger(__name__)

_POLL_S: Final = 1.0
_STOP_POLL_S: Final = 0.1
_GET_S: Final = 1.0  # an engine that is not busy answers within milliseconds
_SILENT_S: Final = 3.0
_APPEAR_S: Final = 3.0  # until a started graph must show in answers
_ABSENT_S: Final = 1.0  # for which answers must lack what the engine has said it refused
_GIVEN_UP_S: Final = 30.0  # until a stopped run that never showed is believed to have never begun
_LOADING_TOLD_S: Final = 1.5  # what feedback has still to tell has come by then
_NO_PROOF: Final = "{doubt}, so that no answer proves anything"


class MonitoredRun(Protocol):
    """The run that is watched."""

    run: Run

    def tell(self, event: RunEvent, author: str = "") -> None:
        """Show and store an event."""
        ...

    def observe(self, seen: tuple[Seen, ...]) -> None:
        """Show and store what was seen."""
        ...

    def end(self, state: End, detail: str) -> None:
        """The run is over."""
        ...

    def lose(self, why: str) -> None:
        """The engine does not hold the run any more."""
        ...

    def doubt(self, why: str) -> None:
        """The code of an action may go on whatever the engine says."""
        ...

    def load(self, actions: Sequence[LoadingAction], waited_s: float) -> None:
        """Nothing moves, but these actions may still be loading, for so long by now; none: that is
        over."""
        ...

    def engine_ended(self) -> None:
        """The engine's process was seen to end, and the code of all its actions with it."""
        ...

    def threads_ended(self) -> None:
        """No thread of the engine is left that could run code of this run."""
        ...

    def alarm(self, code: str, text: str) -> None:
        """Tell people something now."""
        ...


class Monitor:
    """Evidence of one run. `trouble`: why its stop is not proven yet; `seen_at`: when its engine last
    showed it; `umrf`: what that has been given last, where it is known. `rested_at`: when it was last
    seen to be over, for one that moves again."""

    def __init__(
        self,
        it: MonitoredRun,
        link: Link,
        *,
        exact: bool,
        clock_us: Callable[[], int],
        run_in_worker: RunInWorker,
        doubts: DoubtfulErrors,
        rested_at: int | None = None,
    ) -> None:
        self.trouble = ""
        self.seen_at: int | None = None
        self.umrf: str | None = None
        self._it = it
        self._link = link
        self._clock_us = clock_us
        self._run_in_worker = run_in_worker
        self._look = anyio.Event()
        self._order = itertools.count(1)
        self._stop_sent: int | None = None
        self._disturbed = 0
        self._begun = 0  # when feedback was the first to show it
        self._sent: str | None = None  # until it was compared with what the engine shows
        self._sent_order = 0
        self._start = refusals.StartLog(it.run)
        self._absent: float | None = None  # since when answers lack a start that was refused
        self._standstill = stall.Standstill()
        self._stalled_as: object = None  # the actions at which that was told
        self._lacking: str | None = None  # what the graph that was sent lacks to begin
        self._beside: TaskGroup
        self._parts = SubGraphs()
        self._loading = LoadingWatch(it.run.graph_name, meddled=it.run.reshaped)
        self._threads = EngineThreads()
        self._reads = False  # the arrows of graphs, for that
        self._loads_since: float | None = None
        self._answered = False  # by a get, since the last feedback
        self._exact = exact
        self._rest = RestProof(exact=exact)
        self._doubts = doubts
        self._heard_at = self._began_at = anyio.current_time()
        self._seen_wall = rested_at
        self._seen_asked: int | None = None

    def look(self) -> None:
        """Ask now."""
        self._look.set()

    def starts(self, umrf: str) -> None:
        """This graph is being started, now: the engine's log may tell what becomes of it."""
        self._start.begins()
        self._threads.starts(self._link.standing.process)
        self.sends(umrf)

    def sends(self, umrf: str, *, beside: bool = False) -> None:
        """This graph is handed over: what the engine is asked for from now on is compared with it,
        once. `beside`: an action of it is started beside those that go on."""
        self._loading.sends(umrf, beside=beside)
        self._sent = self.umrf = umrf
        self._sent_order = next(self._order)

    def recalls(self, umrf: str) -> None:
        """This graph was handed over before this began to watch."""
        self.umrf = umrf
        self._loading.recalls(umrf)

    def hear(self, line: str) -> None:
        """A line of the engine's own log, about whatever."""
        if self._start.hear(line):
            said = refusals.in_words(self._it.run.engine, self._start.words)
            self._it.alarm(refusals.REFUSED, said)

    def started_by_others(self) -> None:
        """What the engine's log says of a start may be about that one."""
        self._start.doubt()

    def stop_left(self) -> None:
        """A stop message has left: whatever is asked from now on may prove it."""
        if self._stop_sent is None:
            self._stop_sent = next(self._order)

    def disturbed(self, *, meddles: bool) -> None:
        """Somebody else may just have set it going: what was asked before proves nothing any more.
        `meddles`: it may be this very graph that goes on, with other arrows or from elsewhere."""
        self._disturbed = next(self._order)
        self._rest.forget()
        if meddles:
            self._loading.meddle()

    def feed(self, ours: tuple[Snapshot, ...], parts: tuple[Snapshot, ...] = ()) -> None:
        """Feedback of this run, oldest first, and of graphs that have the names of its sub-graphs. That
        of others says nothing about an answer to us."""
        if self._is_alone():
            self._loading.see((*ours, *parts))
        if not ours:
            return
        if self._it.run.graph_state is None:
            self._begun = next(self._order)
        overtaken, self._answered = self._answered, False
        self.seen_at = self._clock_us()
        if news := fresh(self._it.run, ours) if overtaken else ours:
            asked = self._seen_asked
            self._it.observe(tuple(replace(each, since_asked=asked) for each in news))

    def _is_alone(self) -> bool:
        """Return whether one engine alone can have taken up starts, in the life that the run was sent to.
        If not, nobody knows who sent feedback, now or before discovery showed it: all of it is
        forgotten."""
        now = self._link.standing
        lives = {self._it.run.incarnation, now.incarnation} - {None, ""}
        if not now.doubt and len(lives) <= 1:
            return True
        self._loading.forget()
        return False

    async def run(self) -> None:
        """Ask until cancelled. What takes longer is found out beside it: no proof waits for that."""
        async with anyio.create_task_group() as self._beside:
            await self._ask()

    async def _ask(self) -> None:
        """Each second, sooner when there is news, ten times as often for a stop."""
        wait = 0.0
        while True:
            with anyio.move_on_after(wait):
                await self._look.wait()
            self._look = anyio.Event()
            order, began = next(self._order), anyio.current_time()
            try:
                with anyio.fail_after(_GET_S):
                    answer = await self._link.get()
            except (NoAnswer, TimeoutError) as nothing:
                self._is_alone()
                self._hear_nothing(str(nothing))
            else:
                self._take(answer, order, began)
                self._compare(answer, order)
            process = self._it.run.process
            if process is not None and has_ended(process):
                self._it.engine_ended()
            cost = anyio.current_time() - began
            hurry = self._it.run.desired == "stopped" or self._rest.pending
            hurry = hurry and not self._it.run.loading  # feedback tells when it begins
            pace = _STOP_POLL_S if hurry else _POLL_S
            wait = max(pace, 5 * cost)

    def _hear_nothing(self, why: str) -> None:
        silent = anyio.current_time() - self._heard_at
        self.trouble = why or "the engine does not answer"
        if silent >= _SILENT_S and self._it.run.unknown_since is None:
            at = self._clock_us()
            self._it.tell(Silent(at, at - round(silent * 1e6), self.trouble))

    def _take(self, answer: Answer, order: int, asked: float) -> None:
        """Draw the conclusions that one answer allows, and no others."""
        name = self._it.run.graph_name
        if len({self._it.run.incarnation, answer.incarnation} - {None, ""}) > 1:
            if not self._it.run.lost:
                self._it.alarm("engine_restarted", "The engine was restarted: look at the robot.")
                self._it.lose("The engine was restarted while the run went on.")
            return
        own = next((each for each in answer.graphs if each.graph == name), None)
        standing = self._link.standing
        if own is None or own.run != self._it.run.id:
            if standing.doubt and standing.servers:
                self._hear_nothing(_NO_PROOF.format(doubt=standing.doubt))
                return
            self._heard_at = anyio.current_time()
            if order >= self._begun:
                self._missing(own, answer)
            return
        self._heard_at, self.seen_at, self._answered = anyio.current_time(), answer.at, True
        if self._it.run.incarnation is None:  # the runner died between sending and noting it
            process = self._link.standing.process
            self._it.tell(Published(answer.at, answer.incarnation, process))
        if self._it.run.unknown_since is not None or self._it.run.lost:
            self._it.tell(Answered(answer.at))
        parts = [each for each in answer.graphs if each.graph.startswith(f"{name}__")]
        shown = [own, *(part for part in parts if part.run in {None, self._it.run.id})]
        ours = [own, *self._parts.ours(own, shown[1:])]
        self._note(ours)
        if standing.doubt:
            self._is_alone()
            self._rest.forget()
            self.trouble = _NO_PROOF.format(doubt=standing.doubt)
        else:
            self._loading.see(ours)
            self._conclude(shown, ours, answer, order, asked)

    def _compare(self, answer: Answer, order: int) -> None:
        """Once: whether the engine has what was sent. It is never stopped for that by itself."""
        sent, text = self._sent, answer.texts.get(self._it.run.graph_name)
        if sent is None or text is None or self._it.run.graph_state is None:
            return
        if order < self._sent_order:  # asked before that was handed over
            return
        self._sent = None

        async def compare() -> None:
            if why := await self._run_in_worker(differs, sent, text):
                self._it.alarm(
                    "echo_differs", f"What {self._it.run.engine} shows is not what was sent: {why}"
                )

        self._beside.start_soon(self._found_out, compare)

    async def _found_out(self, work: Callable[[], Awaitable[None]]) -> None:
        """What only helps people is given up where nobody can work on it."""
        try:
            await work()
        except Refused as why:
            log.warning("run %s: %s", self._it.run.id, why.detail)

    def _note(self, shown: list[Snapshot]) -> None:
        """Keep what an answer says beyond what is known already."""
        usual = LastLook(self._seen_wall, self._seen_asked)
        self._seen_wall, self._seen_asked = shown[0].at, shown[0].asked_at
        looks = {each.graph: self._parts.last_look(each.graph, usual) for each in shown}
        news = tuple(
            replace(each, since=looks[each.graph].at, since_asked=looks[each.graph].asked)
            for each in shown
            if is_news(self._it.run, each)
        )
        if news:
            self._it.observe(news)

    def _missing(self, other: Snapshot | None, answer: Answer) -> None:
        """The answer does not show this run."""
        self._rest.forget()
        if self._it.run.graph_state is not None:
            self._it.lose(
                "The engine does not hold this run any more."
                if other is None
                else "Another start has taken the place of this run."
            )
            return
        waited = anyio.current_time() - self._began_at
        if self._refused_and_absent():
            why = refusals.why_refused(self._it.run.engine, self._start.words)
            self._it.end("refused", why)
            return
        if waited < _APPEAR_S:
            return
        if self._it.run.incarnation is None:
            self._it.lose("The runner ended before it could note whether the start was sent.")
        elif self._it.run.desired == "stopped" and waited >= _GIVEN_UP_S:
            self._it.lose("The engine answers but has never shown this run.")
        elif self._it.run.unknown_since is None:
            since = answer.at - round(waited * 1e6)
            self._it.tell(
                Silent(answer.at, since, "The engine answers but does not show this run.")
            )

    def _refused_and_absent(self) -> bool:
        """Whether the engine has taken the start in, has refused it, and has not held it for a while
        since: then nothing of it has begun, and nothing of it is left that could begin."""
        if not self._start.words or self._link.standing.doubt:
            self._absent = None
            return False
        self._absent = self._absent if self._absent is not None else anyio.current_time()
        return anyio.current_time() - self._absent >= _ABSENT_S

    def _conclude(
        self,
        shown: list[Snapshot],
        ours: list[Snapshot],
        answer: Answer,
        order: int,
        asked: float,
    ) -> None:
        """`shown`: the graph and all that may be sub-graphs of it; `ours`: those that it has begun."""
        if order < self._disturbed:
            return
        own, at_rest = shown[0], self._rest.seen(shown, asked)
        if any(each.active for each in ours):
            self._threads.see_moving()
        doubt = self._doubts.look(shown)
        if doubt and doubt != self._it.run.unconfirmed:
            self._it.doubt(doubt)
        if self._it.run.unconfirmed:
            going = ", ".join(self._it.run.active)
            self.trouble = f"{going} has not stopped yet" if going else self._it.run.unconfirmed
            if self._exact and at_rest:
                self._it.engine_ended()  # a simulated one is switched off, and nothing has moved
            elif at_rest and self._threads.have_ended(self._it.run.process):
                self._it.threads_ended()
            return
        if _never_began(own) and self.umrf is not None and self._lacking is None:
            self._lacking = ""
            self._beside.start_soon(self._found_out, self._find_lacking)
        loading = self._still_loading(ours, answer)
        if self._it.run.desired != "stopped":
            end = self._it.run.apparent_end
            if end is not None and own.state in TERMINAL and at_rest:
                if not loading:
                    self._it.end(end, "")
            elif at_rest and _never_began(own) and not self._has_begun():
                self._it.end("refused", self._why_unbegun())
            else:
                self._look_for_trouble(shown, asked)
            return
        if self._stop_sent is None or order <= self._stop_sent:
            return
        if at_rest and loading:
            self.trouble = in_words(loading)
        elif at_rest:
            self._it.tell(Proof(answer.at, answer.asked_at, hash_of(shown)))
            self._it.end(self._it.run.apparent_end or "stopped", "")
        elif self._rest.pending:
            self.trouble = "nothing moves, but an action may still be about to begin"
        elif own.state == "FINISHED":
            self.trouble = (
                "the graph has finished, so the engine ignores Stop, while "
                f"{', '.join(self._it.run.active)} goes on"
            )
        else:
            self.trouble = f"{', '.join(self._it.run.active) or own.graph} has not stopped yet"

    def _still_loading(self, ours: list[Snapshot], answer: Answer) -> tuple[LoadingAction, ...]:
        """Return what may still be loading where nothing moves, and tell of it when it stays so."""
        if self._exact:
            return ()
        if not self._rest.pending:
            self._loads_since = None
            self._it.load((), 0.0)
            return ()
        unread = self._loading.unread(ours)
        if unread and not self._reads:
            self._reads = True
            self._beside.start_soon(self._found_out, partial(self._read_arrows, unread, answer))
        found = self._loading.actions(ours)
        if found and self._threads.have_ended(self._it.run.process):
            found = ()
        if not found:
            self._loads_since = None
            self._it.load((), 0.0)
        elif self._loads_since is None:
            self._loads_since = anyio.current_time()
        elif (waited := anyio.current_time() - self._loads_since) >= _LOADING_TOLD_S:
            self._it.load(found, waited)
        return found

    async def _read_arrows(self, graphs: Sequence[str], answer: Answer) -> None:
        try:
            await self._loading.read(graphs, answer.texts, self._run_in_worker)
        finally:
            self._reads = False
            self.look()

    def _has_begun(self) -> bool:
        """Whether it was ever seen otherwise: somebody may have played its start again."""
        return any(action.visits for action in self._it.run.actions.values())

    def _why_unbegun(self) -> str:
        """An engine calls a graph running before the first answer after its start. One that it holds
        and does not call so was not begun, and only another start would begin it."""
        engine, words = self._it.run.engine, self._start.words
        if words:
            return f"{refusals.why_refused(engine, words)} It has begun none of it."
        told = f"{engine} holds the graph and has not begun it, without a word why. {self._lacking or ''}"
        return told.rstrip()

    async def _find_lacking(self) -> None:
        self._lacking = await self._run_in_worker(stall.lacking_in_words, self.umrf)

    async def _tell_stall(self) -> None:
        run = self._it.run
        try:
            text = await self._run_in_worker(stall.told_of, stall.packed(run), self.umrf)
        except Refused:  # nobody can read the graph now; what is known must be said all the same
            text = stall.told(run, None)
        if self._it.run.end is None and self._standstill.lasts:
            self._it.alarm(stall.STALLED, text)

    def _look_for_trouble(self, shown: list[Snapshot], asked: float) -> None:
        """It goes on, as far as the engine says."""
        run, own = self._it.run, shown[0]
        if self._start.words and not _never_began(own):
            text = (
                f"{run.engine} refused the start ({self._start.words}) and yet shows the graph "
                f"{own.state}: some of it may have begun. Stop it, and restart its engine."
            )
            self._it.alarm(refusals.HALF_BEGUN, text)
        stalls = self._standstill.seen(shown, asked) and not self._exact
        if stalls and self._stalled_as is not run.actions:
            self._stalled_as = run.actions
            self._beside.start_soon(self._tell_stall)


def _never_began(own: Snapshot) -> bool:
    """Whether an engine holds a graph of which it has begun nothing. Unlike a graph that has ended it
    was not even tried: no state of an action can hide that one ran."""
    return NEVER_BEGAN.issuperset({own.state, *own.nodes.values()})
