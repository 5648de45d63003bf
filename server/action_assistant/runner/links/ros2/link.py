"""The link to one robot over ROS 2: commands to its engine, gets, and reports.

Nothing here waits for an engine: a command is published, and whether it was obeyed is not known. Only an
answer of the one server on the robot's path says what the engine holds, and only if the same server was the
only one before and after.
"""

import time
from collections.abc import Awaitable, Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Final, TypeAlias, assert_never

import anyio
from temoto_msgs.msg import UmrfGraphModify, UmrfGraphPause, UmrfGraphResume, UmrfGraphStart

from action_assistant.runner.links.engine_process import engine_process, indexes_again
from action_assistant.runner.links.engine_text import NotAGraph
from action_assistant.runner.links.listeners import Listeners
from action_assistant.runner.links.port import (
    Answer,
    EngineChanged,
    EngineLog,
    EngineState,
    Feedback,
    ForeignCommand,
    Leaves,
    NoAnswer,
    NotSent,
    Order,
    Registration,
    Report,
    Standing,
    unwatched,
)
from action_assistant.runner.links.ros2.domain import Domain
from action_assistant.runner.links.ros2.newcomers import Newcomers
from action_assistant.runner.links.ros2.outlets import M, Topics
from action_assistant.runner.links.ros2.peers import (
    OLDER,
    belonging,
    foreign_middleware,
    generation_of,
    topics_of,
    two_servers,
)
from action_assistant.runner.links.ros2.ros_values import (
    Endpoint,
    LogLine,
    OverheardCommand,
    RosValue,
)
from action_assistant.umrf.facts import EngineFacts

_LOOK_S: Final = 1.0
_IDLE_GET_S: Final = 10.0
_BUSY_S: Final = 1.0  # an engine that is not busy answers within milliseconds
_SETTLE_S: Final = 1.0  # a publisher may know a subscription before that one knows it
_AGAIN_S: Final = 5.0  # until joining a domain is tried again

_COMMANDS: Final = ("start", "stop", "pause", "resume", "modify")

Join: TypeAlias = Callable[[int, Topics], Awaitable[Domain]]


class Ros2Link:
    """The link to one robot over ROS 2. It receives reports and answers only while `run` is
    running."""

    simulated: Final = False

    def __init__(
        self,
        join: Join,
        registration: Registration,
        facts: EngineFacts,
        clock_us: Callable[[], int],
    ) -> None:
        self._join = join
        self._name = registration.name
        self._number = registration.domain
        self._path = registration.get_service
        self._facts = facts
        self._topics = topics_of(facts)
        self._clock_us = clock_us
        self._subscribers = Listeners[Report]()
        self._domain: Domain | None = None
        self._runs: set[str] = set()
        self._known_since = 0.0  # when this incarnation was first seen, by the monotonic clock
        self._answered = False
        self._restarted = False
        self._unanswered_since: float | None = None
        self._asked_at = 0.0
        self._newcomers = Newcomers()
        self._standing = Standing(state="gone", why="it is not being looked for yet")

    @property
    def pauses(self) -> bool:
        """True when the robot's profile says that pausing is safe."""
        return self._facts.pauses_safely

    @property
    def standing(self) -> Standing:
        """The condition of the engine as it was found by the last check of discovery (at most a
        second ago) or the last get."""
        return self._standing

    # --- commands -----------------------------------------------------------------------------

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Publish one start message for the graph in `order`, and call `leaves` right before it
        leaves. The call may wait, for discovery and for an earlier start. Raise NotSent if the
        message has certainly not left."""
        domain = self._reachable("start", self._topics.start)
        message = UmrfGraphStart(
            umrf_graph_name=order.graph.name,
            umrf_graph_json=order.umrf,
            targets=list(order.targets or (self._name,)),
        )
        await anyio.sleep(max(0.0, self._known_since + _SETTLE_S - time.monotonic()))
        self._runs.add(order.run)
        await domain.outlets.send_start(self._name, order.run, message, leaves)

    async def stop(self, graph_name: str) -> None:
        """Publish one stop message for the graph of this name, even if no listener is visible,
        since discovery is late. Raise NotSent if it could not be sent, or, after it was sent, if no
        listener is visible."""
        domain = self._joined()
        with _sent_or_not():
            await domain.outlets.send_stop(graph_name, self._name)
        self._listened_to(domain, self._topics.stop)

    async def pause(self, graph_name: str) -> None:
        """Publish one pause message for the graph of this name. Do not wait for its effect. Raise
        NotSent if it could not be sent."""
        domain = self._reachable("pause", self._topics.pause)
        message = UmrfGraphPause(umrf_graph_name=graph_name, targets=[self._name])
        with _sent_or_not():
            await domain.outlets.pause.send(lambda: message)

    async def resume(
        self, graph_name: str, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Publish one resume message for the graph of this name. Raise NotSent if it could not be
        sent, or if `continue_from` names an action: over ROS 2 a graph only goes on where it was.
        """
        if continue_from:
            raise NotSent("over ROS 2 a graph goes on where it was; no action can be named")
        domain = self._reachable("resume", self._topics.resume)
        message = UmrfGraphResume(umrf_graph_name=graph_name, targets=[self._name])
        with _sent_or_not():
            await domain.outlets.resume.send(_once_left(message, leaves))

    async def modify(
        self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Publish one modify message with the graph in `order`. `continue_from`: the full name of
        an action that is started when the graph goes on, "" for none. Raise NotSent if it could not
        be sent."""
        domain = self._reachable("modify", self._topics.modify)
        message = UmrfGraphModify(
            umrf_graph_name=order.graph.name,
            targets=list(order.targets or (self._name,)),
            modified_graph=order.umrf,
            continue_from=continue_from,
        )
        await domain.outlets.modify.send(_once_left(message, leaves))

    def _joined(self) -> Domain:
        if self._domain is None:
            raise NotSent(self._standing.why)
        return self._domain

    def _reachable(self, command: str, topic: str) -> Domain:
        """Return the domain of this robot. `command`: for the message of the error. Raise NotSent
        if no node of this robot listens to `topic`, or its engine has an older generation of
        messages."""
        domain = self._joined()
        self._listened_to(domain, topic)
        if generation_of(domain, domain.servers(self._path)) == "older":
            raise NotSent(f"{self._name} cannot take a {command}: {OLDER}")
        return domain

    def _listened_to(self, domain: Domain, topic: str) -> None:
        if domain.ids_unknown:
            raise NotSent(
                f"the middleware does not show whether the engine of {self._name} listens to {topic}"
            )
        if not belonging(domain.servers(self._path), domain.listeners(topic)):
            raise NotSent(f"nobody listens to {topic} on domain {self._number}")

    # --- the one question ---------------------------------------------------------------------

    async def get(self) -> Answer:
        """Ask the one engine on the path for all graphs that it holds. Raise NoAnswer if discovery
        does not show exactly one engine there, or if its answer cannot be used."""
        if self._domain is None:
            raise NoAnswer(self._standing.why)
        domain = self._domain
        servers = domain.servers(self._path)
        self._look()
        if len(servers) != 1 or not domain.settled:
            raise NoAnswer(self._standing.why)
        began = self._asked_at = time.monotonic()
        asked_at = self._clock_us()
        if self._unanswered_since is None:
            self._unanswered_since = began
        try:
            got = await domain.ask(self._path)
        except (NotAGraph, RuntimeError) as error:
            raise NoAnswer(f"its answer cannot be used: {error}") from error
        after = domain.servers(self._path)
        if after != servers:
            self._look()
            raise NoAnswer("while it was asked, another engine came or went on its path")
        self._answered, self._unanswered_since = True, None
        self._look()
        domain.outlets.shown(got.graphs)
        return Answer(
            asked_at=asked_at,
            at=self._clock_us(),
            incarnation=servers[0].gid,
            graphs=got.graphs,
            texts=got.texts,
            known_actions=got.known_actions,
            known_graphs=got.known_graphs,
        )

    # --- life ---------------------------------------------------------------------------------

    async def run(self) -> None:
        """Join the domain, examine discovery every second, and send a get if there was none for 10
        s."""
        domain = await self._joining()
        domain.client(self._path)
        self._domain = domain
        try:
            with domain.hearing(self._hear):
                while True:
                    self._look()
                    if self._due():
                        await self._ask_by_ourselves()
                    left = domain.settled_at - time.monotonic()
                    await anyio.sleep(left if 0 < left < _LOOK_S else _LOOK_S)
        finally:
            self._domain = None
            self._become(Standing(state="gone", why="it is not being looked for any more"))

    async def _joining(self) -> Domain:
        while True:
            try:
                return await self._join(self._number, self._topics)
            except RuntimeError as error:
                why = f"domain {self._number} cannot be joined: {error}"
                self._become(Standing(state="gone", why=why))
                await anyio.sleep(_AGAIN_S)

    def _due(self) -> bool:
        """Return whether the engine is to be asked: it has not answered yet, or was not asked for 10 s."""
        rested = time.monotonic() - self._asked_at
        return self._standing.servers == 1 and (not self._answered or rested >= _IDLE_GET_S)

    async def _ask_by_ourselves(self) -> None:
        with anyio.move_on_after(_BUSY_S):
            try:
                await self.get()
            except NoAnswer:
                return  # `standing` shows that
        self._look()

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Return a context during which `hear` is called with every report about this robot."""
        return self._subscribers.listening(hear)

    async def aclose(self) -> None:
        """Do nothing: the domain is shared with other links."""

    # --- what is known ------------------------------------------------------------------------

    def _look(self) -> None:
        """Update `standing` from what discovery shows, and report a change of the engine's state."""
        domain = self._domain
        if domain is None:
            return
        servers = domain.servers(self._path)
        incarnation = servers[0].gid if len(servers) == 1 else ""
        before = self._standing
        known = before.incarnation
        process, indexes = before.process, before.indexes
        if incarnation and incarnation != known:
            process = engine_process(servers[0].process, domain.process, self._number, self._name)
            indexes = None if process is None else indexes_again(process)
            self._known_since = time.monotonic()
            self._answered, self._unanswered_since = False, None
            self._restarted = bool(known)
        if indexes is None and incarnation and domain.is_emulated(self._path, servers[0]):
            indexes = False
        state, why = self._judged(domain, servers)
        listeners = {
            each: len(belonging(servers, domain.listeners(getattr(self._topics, each))))
            for each in _COMMANDS
        }
        self._become(
            Standing(
                state=state,
                why=why,
                incarnation=incarnation or known,
                generation=generation_of(domain, servers),
                servers=len(servers),
                listeners=listeners,
                others=len(domain.publishers(self._topics.start)),
                actor=self._actor(domain),
                process=process,
                indexes=indexes,
                newcomers=self._newcomers.among(
                    domain.listeners(self._topics.start),
                    servers,
                    lambda: domain.bystanders(self._path),
                    time.monotonic(),
                ),
                ids_unknown=domain.ids_unknown,
                settled=domain.settled,
            )
        )

    def _judged(self, domain: Domain, servers: tuple[Endpoint, ...]) -> tuple[EngineState, str]:
        place = f"{self._path} on domain {self._number}"
        joined = f"This runner has just joined domain {self._number} and looks around."
        if not servers and not domain.settled:
            return "gone", joined
        if not servers and domain.ids_unknown:
            return "gone", (
                f"Nobody is seen on {place}, and the ids of this middleware do not tell processes apart, "
                "so no robot can be reached over it: RMW_IMPLEMENTATION has to name Fast DDS or Cyclone DDS."
            )
        if not servers:
            others = domain.paths()
            hint = f" Engines answer on {', '.join(others)}." if others else ""
            return "gone", f"Nobody answers on {place}.{hint}"
        if len(servers) > 1:
            return "busy", two_servers(place, len(servers))
        if not domain.settled:  # a second server on this path would go unnoticed
            return "busy", joined
        since = self._unanswered_since
        if since is not None and time.monotonic() - since >= _BUSY_S:
            other = foreign_middleware(domain, servers[0])
            if other:
                return "busy", (
                    f"It is there, but speaks {other}, and this runner does not, so it cannot be "
                    "asked: RMW_IMPLEMENTATION must be the same on both sides."
                )
            return "busy", "It is there, but does not answer."
        if self._answered:
            return "answering", ""
        if self._restarted:
            return "restarted", "Another engine stands where the one before was: look at the robot."
        return "busy", "It has not answered yet."

    def _become(self, now: Standing) -> None:
        before, self._standing = self._standing, now
        if (before.state, before.incarnation) != (now.state, now.incarnation):
            self._subscribers.tell(
                EngineChanged(
                    at=self._clock_us(), state=now.state, incarnation=now.incarnation, why=now.why
                )
            )

    def _actor(self, domain: Domain) -> str:
        """Return the name in the feedback of this robot; "" if unknown. It is the robot's own, or
        the only name on a domain where all feedback comes from one process."""
        if self._name in domain.actors:
            return self._name
        alone = len(domain.actors) == 1 and self._alone(domain)
        return next(iter(domain.actors)) if alone else ""

    def _alone(self, domain: Domain) -> bool:
        """Return whether all feedback on this domain comes from one process."""
        return len({each.process for each in domain.publishers(self._topics.feedback)}) <= 1

    # --- what is heard ------------------------------------------------------------------------

    def _hear(self, value: RosValue) -> None:
        match value:
            case Feedback():
                self._hear_feedback(value)
            case OverheardCommand():
                if self._name in value.targets:
                    self._subscribers.tell(
                        ForeignCommand(
                            at=self._clock_us(),
                            command=value.command,
                            graph=value.graph,
                            umrf=value.umrf,
                            targets=value.targets,
                            sender=value.sender,
                        )
                    )
            case LogLine():
                if self._domain and self._said(value.logger):
                    self._domain.outlets.said(self._name, value.text)
                    self._subscribers.tell(
                        EngineLog(
                            at=self._clock_us(),
                            text=value.text.strip(),
                            graph=value.graph,
                            level=value.level,
                        )
                    )
            case _:
                assert_never(value)

    def _hear_feedback(self, value: Feedback) -> None:
        """Report feedback of this robot. On a domain with several engines the name in it (actor)
        decides whose it is; snapshots with a run of this link are reported under any name."""
        domain = self._domain
        if domain is None:
            return
        if value.actor != self._name and not self._alone(domain):
            ours = tuple(each for each in value.snapshots if each.run in self._runs)
            if not ours:
                return
            value = Feedback(actor=value.actor, snapshots=ours)
        domain.outlets.shown(value.snapshots)
        self._subscribers.tell(value)

    def _said(self, logger: str) -> bool:
        """Return whether a log line of this logger name certainly comes from this robot's engine:
        nodes with the same name cannot be distinguished."""
        domain = self._domain
        if domain is None:
            return False
        servers = domain.servers(self._path)
        if len(servers) != 1 or servers[0].logger != logger:
            return False
        return all(
            each.process == servers[0].process
            for each in domain.publishers(self._topics.feedback)
            if each.logger == logger
        )


def _once_left(message: M, leaves: Leaves) -> Callable[[], M]:
    """Return a function for an outlet: it calls `leaves` in the moment in which the message leaves, and
    returns the message."""

    def make() -> M:
        leaves()
        return message

    return make


@contextmanager
def _sent_or_not() -> Iterator[None]:
    """Return a context that turns an error of the middleware into NotSent. Do not use it for
    starts: a failed start may have been sent."""
    try:
        yield
    except RuntimeError as error:
        raise NotSent(f"the middleware refuses it: {error}") from error
