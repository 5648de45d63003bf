"""Reaches TeMoto Action Engines over ROS 2, through rclpy.

Imported by `ros2_reach` alone, which says why it cannot be.
"""

import asyncio
import time
from collections.abc import Callable

import anyio
import anyio.to_thread
import rclpy

from action_assistant.runner.links.hardware_stop import HardwareStop, StopSignal
from action_assistant.runner.links.health import HealthCheck, HealthSignal
from action_assistant.runner.links.port import Candidate, Link, Registration, Sighting
from action_assistant.runner.links.ros2.domain import Domain
from action_assistant.runner.links.ros2.link import Ros2Link
from action_assistant.runner.links.ros2.outlets import Topics
from action_assistant.runner.links.ros2.peers import OLDER, generation_of, topics_of, two_servers
from action_assistant.runner.links.unreachable import UnreachableLink
from action_assistant.umrf.facts import PINNED, EngineFacts


class Ros2:
    """Makes links, and holds the domains that they share. There is one per process, since a process
    has one middleware, chosen by RMW_IMPLEMENTATION at its start."""

    def __init__(self, clock_us: Callable[[], int], home: int) -> None:
        self._clock_us = clock_us
        self._home = home
        self._domains: dict[tuple[int, Topics], Domain] = {}
        self._joining = anyio.Lock()

    @property
    def rmw(self) -> str:
        """The name of the ROS middleware of this process."""
        return rclpy.get_rmw_implementation_identifier()

    def link(self, registration: Registration, facts: EngineFacts) -> Link:
        """Return a link to a registered robot, whose engine build is described by `facts`. The call
        does not wait. If the robot uses another middleware than this process, the link refuses
        every command with the reason."""
        if registration.rmw not in {"", self.rmw}:
            return UnreachableLink(
                f"{registration.name} is registered with {registration.rmw}, but this runner speaks "
                f"{self.rmw}, and two of them cannot ask each other anything. A process has one: "
                "start the runner with RMW_IMPLEMENTATION set to the robot's"
            )
        return Ros2Link(self.domain, registration, facts, self._clock_us)

    async def stop_signal(
        self,
        registration: Registration,
        facts: EngineFacts,
        rule: HardwareStop,
        changed: Callable[[], None],
    ) -> StopSignal:
        """Listen to the hardware stop of a robot, as `Domain.stop_signal` does, on the robot's domain.
        Raise RuntimeError if that is not possible."""
        return (await self._domain_of(registration, facts)).stop_signal(rule, changed)

    async def health_signal(
        self, registration: Registration, facts: EngineFacts, check: HealthCheck
    ) -> HealthSignal:
        """Listen to something of a robot's health, as `Domain.health_signal` does, on the robot's
        domain. Raise RuntimeError if that is not possible."""
        return (await self._domain_of(registration, facts)).health_signal(check)

    async def _domain_of(self, registration: Registration, facts: EngineFacts) -> Domain:
        if registration.rmw not in {"", self.rmw}:
            raise RuntimeError(f"this runner does not speak {registration.rmw}")
        return await self.domain(registration.domain, topics_of(facts))

    async def domain(self, number: int, topics: Topics) -> Domain:
        """Return the domain `number`, in which this process takes part with these topics. The first
        call joins it, which takes up to some seconds. Raise RuntimeError if it cannot be joined."""
        async with self._joining:
            known = self._domains.get((number, topics))
            if known is None:
                loop = asyncio.get_running_loop()
                known = await anyio.to_thread.run_sync(
                    lambda: Domain(number, topics, loop, self._clock_us)
                )
                self._domains[number, topics] = known
            return known

    async def sighting(self) -> Sighting:
        """Return the engines that are seen now, on the domains of links and on that of the
        environment. Raise RuntimeError if that domain cannot be joined."""
        await self.domain(self._home, topics_of(PINNED))
        domains = tuple(self._domains.values())
        youngest = max(each.settled_at for each in domains)
        found = {
            (domain.number, path): self._candidate(domain, path)
            for domain in domains
            for path in domain.paths()
        }
        engines = tuple(found[key] for key in sorted(found))
        return Sighting(engines, max(0.0, youngest - time.monotonic()))

    async def candidates(self) -> tuple[Candidate, ...]:
        """Return the engines that discovery shows once it has had its time; the call waits for
        that. Raise RuntimeError if the domain of the environment cannot be joined."""
        seen = await self.sighting()
        await anyio.sleep(seen.left_s)
        return (await self.sighting()).engines if seen.left_s else seen.engines

    def _candidate(self, domain: Domain, path: str) -> Candidate:
        servers = domain.servers(path)
        alone = len(servers) == 1 and len(domain.paths()) == 1 and len(domain.actors) == 1
        generation = generation_of(domain, servers)
        problem = two_servers(path, len(servers)) if len(servers) > 1 else ""
        if generation == "older":
            problem = OLDER
        return Candidate(
            domain=domain.number,
            rmw=self.rmw,
            get_service=path,
            servers=len(servers),
            actor=next(iter(domain.actors)) if alone else "",
            generation=generation,
            problem=problem,
        )

    async def aclose(self) -> None:
        """Leave every ROS domain, and wait for that, also if the call is cancelled."""
        with anyio.CancelScope(shield=True):
            while self._domains:
                _, domain = self._domains.popitem()
                await anyio.to_thread.run_sync(domain.leave)
