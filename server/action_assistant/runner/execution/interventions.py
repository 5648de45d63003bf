"""Interventions in a run besides Stop: pause, resume, modify, confirm rest; where that is safe."""

from collections.abc import Callable
from functools import partial
from typing import Annotated, Final

import msgspec

from action_assistant.errors import BadInput, Conflict, Refused, Unavailable
from action_assistant.runner.execution.run_loop import OpenRun
from action_assistant.runner.links.port import (
    SIMULATOR,
    EngineRefused,
    GraphOutline,
    Leaves,
    NotSent,
    Order,
)
from action_assistant.runner.robots.engine import KnownEngine
from action_assistant.runner.robots.rights import Claim
from action_assistant.runner.runs.events import Author, Override
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.sent_graphs import SentGraph
from action_assistant.runner.runs.sight import RunSight, run_graphs
from action_assistant.runner.start.admission import (
    Prepared,
    StartRequest,
    Watching,
    decoded,
    prepared,
)
from action_assistant.runner.start.approvals import Approvals, Approved
from action_assistant.runner.start.orders import claim_of, ordered, overridden_in, watched_in
from action_assistant.runner.start.robot_graphs import not_matched_in, unseen_graphs_in
from action_assistant.umrf.facts import SIMULATED
from action_assistant.umrf.limits import Limits
from action_assistant.web.auth.graph_seals import Sight
from action_assistant.web.auth.identity import Identity
from action_assistant.web.workers.lanes import RunInWorker

_MOVING: Final = frozenset({"running", "paused"})


class ModifyRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Another version of the graph of a run, by value. `continue_from`: the full name of an action
    to start when the graph continues; `watching`, `sight`: as in
    `StartRequest`."""

    version: str
    digest: str
    umrf: SentGraph
    continue_from: str = ""
    override: Override | None = None
    watching: Watching = {}
    sight: Sight | None = None


async def pause(opened: OpenRun, author: Author) -> Run:
    """Pause a run in the name of `author`, and return it. Raise Conflict if the run is not running
    or pausing is not safe on its engine, Unavailable if the message could not be sent."""
    run = opened.run
    if run.state != "running" or run.desired != "running":
        raise Conflict(f"Only a running run can be paused; this one is {_condition(run)}.")
    if not opened.pauses:
        raise Conflict(f"Pausing is not safe on {run.engine}; use Stop.")
    try:
        await opened.pause(author)
    except NotSent as why:
        raise Unavailable(f"The pause could not be sent: {why}") from why
    return opened.run


async def resume(
    opened: OpenRun, author: Author, watching: tuple[str, ...], may_leave: Leaves
) -> Run:
    """Let a paused run go on in the name of `author`, who watches these robots, and return it.
    `may_leave`: as for `OpenRun.resume`. Raise Conflict if the run is not paused, Unavailable if the
    message could not be sent."""
    if opened.run.desired != "paused":
        raise Conflict(f"Only a paused run can go on; this one is {_condition(opened.run)}.")
    try:
        await opened.resume(author, watching, may_leave)
    except NotSent as why:
        raise Unavailable(f"The resume could not be sent: {why}") from why
    return opened.run


async def modify(
    opened: OpenRun,
    body: bytes,
    author: Author,
    *,
    engine: KnownEngine | None,
    approvals: Approvals,
    run_in_worker: RunInWorker,
    require: Callable[[Claim], None],
    limits: Limits,
    sight: RunSight,
    identity: Identity,
) -> Run:
    """Give a running graph another structure, in the name of `author`, and return the run. `body`
    is an encoded ModifyRequest; `engine` is None for a simulated run; `approvals` checks the yes of
    a second person, where the robot demands it; `require` raises a refusal if the author may not
    start this on its robot; `limits`: in force on its robot; `sight` knows which graphs `identity` and others may see. Raise BadInput if
    the body is wrong, Forbidden for a graph that the author may not see, Conflict if the run or its
    engine does not allow the change, Unavailable if the message could not be sent, and OutcomeUnknown if
    it cannot be known whether the engine has made the change."""
    run = opened.run
    _require_moving(run)
    if run.values:
        raise Conflict(
            "The run was started with values, which another version may not have: stop it, and start the "
            "new version."
        )
    if not opened.pauses:
        raise Conflict(
            f"A running graph is paused to be changed, and pausing is not safe on {run.engine}; "
            "stop it and start the new version."
        )
    asked = decoded(body, ModifyRequest)
    watching = watched_in(asked.watching, run.robots)
    await _require_sight(asked, run, sight, identity)
    facts = SIMULATED if engine is None else engine.facts
    start = _as_start(asked, run)
    prepare = partial(prepared, limits=limits)
    ready = await run_in_worker(prepare, start, facts, run.id)
    if sight.has_rules and not run.unsighted:
        _require_own_sight(asked.sight, ready)
    approved: tuple[Approved, ...] = ()
    if engine is not None:
        order = ordered(start, ready.digest, overridden_in(start), limits).going_on(
            asked.continue_from
        )
        demand = approvals.demand(order, start, author.id)
        approved = await approvals.require(engine.registration, demand)
        await _require_matched(engine, ready.umrf, run_in_worker)
        if limits.get(run.engine):
            await _require_held(engine, run, ready.umrf, run_in_worker)
    _require_moving(opened.run)  # it may have been stopped meanwhile
    if ready.name != run.graph_name:
        raise Conflict(
            f"The run is of {run.graph_name}; a graph called {ready.name} cannot take its place.",
            where={"path": "/umrf/graph_name"},
        )
    targets = () if run.simulated else (run.engine,)
    graph = GraphOutline(ready.name, ready.actions)
    message = Order(run=run.id, graph=graph, umrf=ready.umrf, targets=targets)
    require(claim := msgspec.structs.replace(claim_of(start, ready), is_start=False))

    def may_leave() -> None:
        try:
            require(claim)
        except Refused as why:
            raise NotSent(why.detail) from why
        approvals.require_still(approved)

    try:
        await opened.modify(
            author,
            message,
            asked.version,
            ready.digest,
            asked.continue_from,
            watching,
            limits,
            may_leave,
        )
    except NotSent as why:
        raise Unavailable(f"The change could not be sent: {why}") from why
    except EngineRefused as why:
        raise Conflict(f"The engine refuses the change: {why}") from why
    return opened.run


async def _require_sight(
    asked: ModifyRequest, run: Run, sight: RunSight, identity: Identity
) -> None:
    """Check the sight of the new version of a run. Raise Conflict if it may show graphs that the
    version of the start did not show, since the rules of these say who may see the run."""
    digest = "" if asked.sight is None else asked.sight.digest  # of the graphs inside, too
    await sight.accept(asked.sight, asked.version, (digest,), identity)
    if not sight.has_rules or run.unsighted:
        return
    if asked.sight is None or not set(asked.sight.graphs) <= set(run_graphs(run).graphs):
        raise _unknown_sight()


def _require_own_sight(sight: Sight | None, ready: Prepared) -> None:
    """Raise Conflict unless a sight belongs to the graph that was sent: that of another version says
    nothing about who may see this one."""
    if sight is None or sight.digest not in {ready.digest, ready.tree_digest}:
        raise _unknown_sight()


def _unknown_sight() -> Conflict:
    return Conflict(
        "It is not known who may see all graphs of this version. Stop the run, and start the version.",
        where={"path": "/sight"},
    )


def _as_start(asked: ModifyRequest, run: Run) -> StartRequest:
    """Return the change `asked` of a run as a request to start the other version, so that the
    checks of a start can be made on it."""
    return StartRequest(
        version=asked.version,
        digest=asked.digest,
        umrf=asked.umrf,
        engine=SIMULATOR if run.simulated else run.engine,
        request_id=run.request_id,
        graph=run.graph,
        override=asked.override,
        watching=asked.watching,
        drill=run.drill,
        sight=asked.sight,
    )


async def _require_matched(engine: KnownEngine, umrf: str, run_in_worker: RunInWorker) -> None:
    """Raise Conflict if the changed graph (`umrf`: its text) has sub-graphs or actions that the
    engine cannot build. On a change the engine does not search its index for actions, and would
    abort. The engine's index is read, not the engine asked."""
    held = {each.graph for each in engine.answer.graphs} if engine.answer is not None else set()
    index = await engine.index(run_in_worker)
    lost = await run_in_worker(not_matched_in, umrf, engine.facts, index, held)
    if lost:
        raise Conflict(
            f"{engine.registration.name} does not look up {', '.join(lost[:3])} in a change, and would "
            "abort with every running graph. Stop the run and start the new version under another name.",
            where={"path": "/umrf/actions"},
        )


async def _require_held(
    engine: KnownEngine, run: Run, umrf: str, run_in_worker: RunInWorker
) -> None:
    """Raise Conflict if an action of the changed graph (`umrf`: its text) stands for a graph: a change
    brings no graphs inside, so that their values are held to no limit."""
    held = {each.graph for each in engine.answer.graphs} if engine.answer is not None else set()
    index = await engine.index(run_in_worker)
    unseen = await run_in_worker(unseen_graphs_in, umrf, index, held, tuple(run.inner))
    if unseen:
        name = engine.registration.name
        raise Conflict(
            f"{', '.join(unseen[:3])} stands for a graph that {name} has. Its values cannot be held to the "
            f"limits of {name}: a change brings no graphs inside. Stop the run, and start the new version.",
            where={"path": "/umrf/actions", "item": "limit"},
        )


class RestRequest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A person's statement that a run is at rest. `how`: how the person saw that."""

    how: Annotated[str, msgspec.Meta(min_length=3, max_length=500)]


def confirm_rest(opened: OpenRun, asked: RestRequest, author: Author) -> Run:
    """End a run because `author` has seen it at rest (nothing moves), where no answer of its engine
    can prove that; return the run. `asked`: how it was seen. Raise BadInput if it does not say how;
    Conflict if the run is simulated, if its engine still answers for it, or if actions were seen
    moving."""
    run, how = opened.run, asked.how.strip()
    if len(how) < 3:
        raise BadInput("Say how it was seen that nothing moves.", where={"path": "/how"})
    if run.simulated:
        raise Conflict("A simulation moves nothing; use Stop.")
    is_silent = bool(run.lost) or run.unknown_since is not None
    if not is_silent and not run.doubt:
        raise Conflict(
            f"{run.engine} answers for this run, so its answers have to show rest; use Stop."
        )
    if run.active and not is_silent:
        raise Conflict(
            f"{run.engine} shows {', '.join(run.active)} moving; that cannot be confirmed away."
        )
    opened.confirm_rest(author, how)
    return opened.run


def _require_moving(run: Run) -> None:
    if run.state not in _MOVING or run.desired == "stopped":
        raise Conflict(f"Only a running run can be changed; this one is {_condition(run)}.")


def _condition(run: Run) -> str:
    return "being paused" if (run.state, run.desired) == ("running", "paused") else run.state
