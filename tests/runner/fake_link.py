"""A link to a robot through the fake network of virtual time, by the rules of the one over rclpy."""

from collections.abc import Callable
from contextlib import AbstractContextManager

import anyio

from action_assistant.runner.emulator.messages import Modify, Pause, Resume, Start
from action_assistant.runner.links.listeners import Listeners
from action_assistant.runner.links.port import (
    Answer,
    EngineChanged,
    EngineLog,
    Feedback,
    ForeignCommand,
    Leaves,
    NoAnswer,
    NotSent,
    Order,
    Report,
    Standing,
    unwatched,
)
from action_assistant.runner.links.ros2.newcomers import Newcomers
from action_assistant.runner.links.ros2.ros_values import LogLine, OverheardCommand
from runner.fake_network import HASH, FakeNetwork, now
from runner.harness import clock_us


class FakeLink:
    """A link to one robot through the fake network, by the rules of the one over rclpy: an answer counts only
    while the same one server stands on the path before and after."""

    simulated = False
    pauses = False

    def __init__(self, network: FakeNetwork, name: str, path: str = "/umrf_graph_get") -> None:
        self._network = network
        self._name = name
        self._path = path
        self._known = ""
        self._subscribers = Listeners[Report]()
        self._newcomers = Newcomers()
        self._told: tuple[str, str] = ("", "")

    @property
    def standing(self) -> Standing:
        """The standing that discovery shows now."""
        network = self._network
        servers = network.servers(self._path)
        if len(servers) == 1:
            self._known = servers[0].gid
        return Standing(
            state="answering" if len(servers) == 1 else "busy" if servers else "gone",
            why="" if len(servers) == 1 else f"{len(servers)} engines answer on its path.",
            incarnation=self._known,
            generation="older" if any(e.type_hash != HASH for e in servers) else "current",
            servers=len(servers),
            listeners=dict.fromkeys(("start", "stop"), len(servers)),
            others=len(network.publishers("start")),
            indexes=False,
            newcomers=self._newcomers.among(
                network.listeners("start"), servers, lambda: network.bystanders(self._path), now()
            ),
            ids_unknown=network.ids_unknown,
        )

    async def start(self, order: Order, leaves: Leaves = unwatched) -> None:
        """Publish one start message."""
        if self.standing.generation == "older":
            raise NotSent("its messages are another generation")
        if not self._network.servers(self._path):
            raise NotSent("nobody listens")
        message = Start(graph_name=order.graph.name, targets=(self._name,), graph_json=order.umrf)

        def leaving() -> Start:
            leaves()
            return message

        await self._network.outlets.start.send(leaving)

    async def stop(self, graph_name: str) -> None:
        """Publish one stop, also when nobody seems to listen."""
        await self._network.outlets.send_stop(graph_name, self._name)
        if not self._network.servers(self._path):
            raise NotSent("nobody listens")

    async def pause(self, graph_name: str) -> None:
        """Publish one pause message."""
        message = Pause(graph_name=graph_name, targets=(self._name,))
        await self._network.outlets.pause.send(lambda: message)

    async def resume(
        self, graph_name: str, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Publish one resume message."""
        message = Resume(graph_name=graph_name, targets=(self._name,))
        await self._network.outlets.resume.send(lambda: message)

    async def modify(
        self, order: Order, continue_from: str = "", leaves: Leaves = unwatched
    ) -> None:
        """Publish one modify message."""
        message = Modify(
            graph_name=order.graph.name,
            targets=(self._name,),
            modified_graph=order.umrf,
            continue_from=continue_from,
        )
        await self._network.outlets.modify.send(lambda: message)

    async def get(self) -> Answer:
        """Send a get to the one server. Raises NoAnswer."""
        before, asked_at = self._network.servers(self._path), clock_us()
        if len(before) != 1:
            raise NoAnswer(self.standing.why)
        got = await self._network.ask(self._path)
        if self._network.servers(self._path) != before:
            raise NoAnswer("while it was asked, another engine came or went")
        return Answer(
            asked_at=asked_at,
            at=clock_us(),
            incarnation=before[0].gid,
            graphs=got.graphs,
            texts=got.texts,
            known_actions=got.known_actions,
            known_graphs=got.known_graphs,
        )

    async def run(self) -> None:
        """Look every second who is there."""
        with self._network.hearing(self._hear):
            while True:
                seen = self.standing
                if self._told != (seen.state, seen.incarnation):
                    self._told = seen.state, seen.incarnation
                    self._subscribers.tell(
                        EngineChanged(
                            at=clock_us(),
                            state=seen.state,
                            incarnation=seen.incarnation,
                            why=seen.why,
                        )
                    )
                await anyio.sleep(1)

    def _hear(self, value: object) -> None:
        match value:
            case Feedback():
                self._subscribers.tell(value)
            case OverheardCommand() if self._name in value.targets:
                self._subscribers.tell(
                    ForeignCommand(
                        at=clock_us(),
                        command=value.command,
                        graph=value.graph,
                        umrf=value.umrf,
                        targets=value.targets,
                        sender=value.sender,
                    )
                )
            case LogLine(text=text) if len(self._network.publishers("feedback")) <= 1:
                self._subscribers.tell(EngineLog(at=clock_us(), text=text))
            case _:
                pass

    def listen(self, hear: Callable[[Report], None]) -> AbstractContextManager[None]:
        """Call `hear` with every report that concerns this robot."""
        return self._subscribers.listening(hear)

    async def aclose(self) -> None:
        """Do nothing: it has no resources of its own."""
