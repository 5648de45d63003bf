"""A start as one pipeline: claim, read, check, ask the engine, decide, store, hand over.

Each stage takes the values of the stages before it and returns the next one:

    claim            StartRequest            the run that this request has become, if any
    read             StartRequest            Prepared: the graph as it will be sent
    check            Prepared                rights, approval, free robot; refuses
    ask the engine   KnownEngine             EngineView: the answer to a get that was sent now
    decide           Prepared, EngineView    AcceptedStart; refuses
    store            AcceptedStart           Run: `run.requested.v1` is in the journal
    hand over        Run, Order              OpenRun, which sends one start message

A start happens at most once and is never retried: what waits in a queue comes here by a press of its own. A refusal before `store` leaves
nothing behind, and a start that cannot be stored is not sent.
"""

from collections.abc import AsyncIterator, Iterable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Final
from weakref import WeakValueDictionary

import anyio
import msgspec

from action_assistant.errors import BadInput, Refused
from action_assistant.random_ids import random_id
from action_assistant.runner.execution.accepted_start import AcceptedStart
from action_assistant.runner.execution.conductors import Conductors
from action_assistant.runner.execution.open_runs import OpenRuns
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.execution.start_checks import StartChecks
from action_assistant.runner.links.port import SIMULATOR, GraphOutline, Leaves, NotSent, Order
from action_assistant.runner.runs.events import Author, Led, PartOfRepeat, Requested
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runtime import Runtime
from action_assistant.runner.start.admission import GroupRequest, StartRequest
from action_assistant.runner.start.casting import require_not_led
from action_assistant.runner.start.idempotency import IdempotentStarts, StopOrder
from action_assistant.runner.start.orders import (
    Often,
    claim_of,
    engines_of,
    kept_for,
    require_plain,
)
from action_assistant.runner.start.rights_registry import RightsRegistry
from action_assistant.web.auth.identity import Identity

#: Why nothing was sent to one of several robots, as far as a later request knows.
NOT_WITH: Final = "It was not started with the others."
#: How the request ids begin that the queue and repeats give to their starts.
_INNER: Final = ("queue/", "repeat/")


class Started(msgspec.Struct, frozen=True):
    """The answer to a start. `fresh` is false if an earlier request with the same id has already
    started the run."""

    run: Run
    fresh: bool


class Grouped(msgspec.Struct, frozen=True):
    """The answer to the start of a group. `group`: its id; `failed`: the reasons, by engine, for
    those that nothing was sent to; `fresh`: as in `Started`."""

    group: str
    runs: list[Run]
    failed: dict[str, str]
    fresh: bool


class StartPipeline:
    """Carries out starts. `stops`: the record of Stops, so that one pressed during a start takes
    effect on it."""

    def __init__(
        self,
        runs: OpenRuns,
        checks: StartChecks,
        stops: StopOrder,
        conductors: Conductors,
        rights: RightsRegistry,
        runtime: Runtime,
    ) -> None:
        self._runs = runs
        self._rights = rights
        self._conductors = conductors
        self._checks = checks
        self._stops = stops
        self._clock_us = runtime.clock_us
        self._claims = IdempotentStarts(runtime.journal, runtime.tasks, runtime.clock_us)
        self._turns: WeakValueDictionary[str, anyio.Lock] = WeakValueDictionary()

    async def start(
        self,
        request: StartRequest,
        author: Author,
        starter: Identity,
        repeat: PartOfRepeat | None = None,
        often: Often = None,
    ) -> Started:
        """Carry out a start of `starter`, at most once per request id. Return after the one start
        message has left. `repeat`: the repeat of which the run is a cell; `often`: how often it is
        carried out, for the yes of a second person. Raise a subclass of Refused if the start is refused; nothing was sent then."""
        stops = self._stops.count
        _require_own_id(request.request_id, often)
        async with self._claims.once(request.request_id):
            known = await self._known(request)
            if known is not None:
                return Started(known, fresh=False)
            await self._checks.require_sight(request, starter)
            async with self.turns(kept_for(request)):
                accepted = await self._checks.accept(request, starter, often)
                run = await self._store_and_hand_over(
                    accepted, author, starter, stops, repeat=repeat
                )
            return Started(run, fresh=True)

    async def start_group(
        self, group: GroupRequest, author: Author, starter: Identity, often: Often = None
    ) -> Grouped:
        """Start one version on several robots in the name of `author`. All starts are accepted
        before the first message is sent. `often`: as in `start`. Raise BadInput if the group has no request id or names the
        simulator, or has fields of a led run or of the simulator, another subclass of Refused if one start is refused; nothing was sent to any
        robot then."""
        stops = self._stops.count
        requests = [group.for_engine(engine) for engine in sorted(group.engines)]
        is_of_robots = not any(
            engine == SIMULATOR or self._checks.leads(engine, group.robots)
            for engine in group.engines
        )
        if not group.request_id or not is_of_robots:
            where = "/engines" if group.request_id else "/request_id"
            raise BadInput("A group has a request_id, and robots only.", where={"path": where})
        _require_handed_over(group)
        _require_own_id(group.request_id, often)
        async with self._claims.once(group.request_id):
            found = [await self._known(each) for each in requests]
            if known := [run for run in found if run is not None]:
                missing = [
                    each.engine for each, run in zip(requests, found, strict=True) if not run
                ]
                failed = dict.fromkeys(missing, NOT_WITH)
                return Grouped(known[0].group or "", known, failed, fresh=False)
            await self._checks.require_sight(group, starter)
            async with self.turns(group.engines):
                accepted = await self._checks.accept_all(requests, starter, often)
                return await self._hand_over_group(accepted, author, starter, stops)

    # --- claim --------------------------------------------------------------------------------

    @asynccontextmanager
    async def turns(self, keys: Iterable[str]) -> AsyncIterator[None]:
        """Return a context that keeps these robots (and a run that is continued) for one start, or for a
        change of a robot's registration. It waits until they are free. They are locked in the order of
        their names, so that two callers never wait for each other."""
        async with AsyncExitStack() as held:
            locks = [self._turns.setdefault(key, anyio.Lock()) for key in sorted(keys)]
            for lock in locks:
                await held.enter_async_context(lock)
            yield

    def is_under_way(self, request_id: str) -> bool:
        """Return whether the start, or the start of a group, with this request id is being carried
        out at this moment."""
        return self._claims.under_way(request_id)

    async def _known(self, request: StartRequest) -> Run | None:
        """Return the run that an earlier start with this request id has created, or None. Raise
        Conflict if that start was not the same request."""
        run = await self._claims.run_of(request)
        return None if run is None else await self._runs.find(run)

    # --- store, hand over -----------------------------------------------------------------------

    async def _store_and_hand_over(
        self,
        accepted: AcceptedStart,
        author: Author,
        starter: Identity,
        stops: int,
        group: str | None = None,
        repeat: PartOfRepeat | None = None,
    ) -> Run:
        """Store a start, let its run send the message, wait until it was sent, and return the run.
        `stops`: how many Stops had been pressed when the start was requested; a later one takes
        effect before anything is sent. `group`: the id of its group, or None; `repeat`: as in `start`. Raise Conflict or
        Unavailable, before anything is sent, if the robot is occupied or the start cannot be
        stored."""
        number, at = self._runs.next_number(), self._clock_us()
        requested, order = _to_store(accepted, author, at=at, number=number, group=group)
        requested = msgspec.structs.replace(requested, repeat=repeat)
        robots = engines_of(accepted.request)
        batons = self._rights.with_baton(robots)
        claim = claim_of(accepted.request, accepted.prepared)
        watching = tuple(sorted(claim.watching))
        requested = msgspec.structs.replace(requested, batons=batons, watching=watching)
        requested = self._checks.with_sight(requested, accepted.request, starter)
        await self._checks.give_words(accepted, author)
        self._checks.require_free(accepted)
        self._rights.require(robots, starter, claim)
        requested = msgspec.structs.replace(
            requested,
            pages=self._rights.page_presences(robots),
            health=self._rights.health(robots),
        )
        with anyio.CancelScope(shield=True):
            run = await self._claims.store(requested)
            occupied = self._checks.why_occupied(accepted)
            of_repeat = repeat.id if repeat is not None else ""
            names = (*robots, group or "", of_repeat, accepted.request.request_id)

            def may_leave() -> None:
                if why := self._stops.why_refused(stops, *names):
                    raise NotSent(why)
                self._rights.require_still(robots, starter, claim)
                self._checks.require_approved(accepted)
                accepted.require_still()

            opened = self._open(accepted, requested, run, starter, may_leave)
            if occupied:
                opened.end("refused", occupied)
            if pressed := self._stops.since(stops, *names):
                opened.stop(*pressed)
            elif why := self._stops.why_refused(stops, *names):
                opened.end("refused", why)
            self._runs.drive(opened, order, accepted.incarnation)
        await opened.published.wait()
        return opened.run

    def _open(
        self,
        accepted: AcceptedStart,
        requested: Requested,
        run: Run,
        starter: Identity,
        may_leave: Leaves,
    ) -> OpenRun:
        if accepted.led is None:
            is_simulated = accepted.is_simulated
            return self._runs.open(
                run, accepted.link, owns_link=is_simulated, seq=1, may_leave=may_leave
            )
        led = accepted.led
        return self._conductors.open(
            requested, run, led.pieces.texts, led.engine, lead=starter, may_leave=may_leave
        )

    async def _hand_over_group(
        self, starts: Sequence[AcceptedStart], author: Author, starter: Identity, stops: int
    ) -> Grouped:
        """Store and send accepted starts one after the other; the failure of one does not affect
        the others. `stops`: as in `_store_and_hand_over`."""
        group = random_id()
        runs: list[Run] = []
        failed: dict[str, str] = {}
        for each in starts:
            try:
                runs.append(await self._store_and_hand_over(each, author, starter, stops, group))
            except Refused as why:
                failed[each.request.engine] = why.detail
        return Grouped(group, runs, failed, fresh=True)


def _require_handed_over(group: GroupRequest) -> None:
    """Raise BadInput if a start on several robots, each of which gets the whole graph, has fields that mean
    something only in a led run or in the simulator, as a start on one of them does."""
    require_not_led(group.robots, group.people)
    require_plain(group)
    if group.levels != "one_step":
        raise BadInput("Only a led run opens its sub-graphs.", where={"path": "/levels"})


def _require_own_id(request_id: str, often: Often) -> None:
    """Raise BadInput if a start that is neither of the queue nor of a repeat has a request id of these:
    its runs would count as theirs."""
    if often is None and f"{request_id}/".startswith(_INNER):
        text = 'A request_id that begins with "queue/" or "repeat/" is given by the runner alone.'
        raise BadInput(text, where={"path": "/request_id"})


def _to_store(
    accepted: AcceptedStart, author: Author, *, at: int, number: int, group: str | None
) -> tuple[Requested, Order]:
    """Return the event that stores a start, and the order that is handed to the link. `at`: µs UTC;
    `number`: the number of the new run; `group`: the id of its group, or None."""
    request, ready, begins = accepted.request, accepted.prepared, accepted.prepared.beginning
    requested = Requested(
        at=at,
        run=ready.run,
        number=number,
        request_id=request.request_id,
        author=author,
        graph=ready.graph_id,
        graph_name=ready.name,
        version=request.version,
        digest=ready.digest,
        engine=request.engine,
        simulated=accepted.is_simulated,
        actions=ready.actions,
        umrf=ready.umrf,
        script=ready.script,
        override=request.override,
        despite=accepted.despite,
        group=group,
        like=request.like,
        behaviours=request.behaviours,
        laps=ready.laps,
        inner_laps=ready.inner_laps,
        subgraphs=ready.subgraphs,
        tree_digest=ready.tree_digest if request.subgraphs or request.tree_digest else None,
        led=_led_of(accepted),
        breakpoints=accepted.breakpoints,
        drill=request.drill,
        values=request.values,
        sent_digest=ready.sent_digest
        if request.values or ready.sent_digest != ready.digest
        else "",
        beyond=ready.beyond,
        start_from=request.start_from,
        limits=dict(ready.limits),
        earlier=None if begins is None else begins.earlier,
        before=None if begins is None else begins.before,
        levels=ready.levels,
    )
    targets = () if accepted.is_simulated or accepted.led else (request.engine,)
    graph = GraphOutline(ready.name, ready.actions)
    inside = tuple(each.umrf for each in ready.subgraphs)
    order = Order(run=ready.run, graph=graph, umrf=ready.umrf, targets=targets, inside=inside)
    return requested, order


def _led_of(accepted: AcceptedStart) -> Led | None:
    if accepted.led is None:
        return None
    request = accepted.request
    return Led(
        robots=request.robots,
        players=accepted.led.pieces.players,
        lives=accepted.led.lives,
        keeping=accepted.led.keeping,
        lost=request.lost,
        together="two-at-once" in accepted.overridden,
        people=request.people,
        asked=accepted.led.pieces.asked,
    )
