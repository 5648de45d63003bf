"""What is wrong with ROS 2 here, as far as can be seen from this process: its environment, who is on
its domains, and whether each registered robot answers."""

import importlib
import os
import pwd
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

import anyio

from action_assistant import ros_workspace
from action_assistant.runner.links.diagnostics import Diagnostic, Verdict
from action_assistant.runner.links.port import (
    Candidate,
    EngineChanged,
    Link,
    Reach,
    Registration,
    Report,
    Standing,
)
from action_assistant.runner.links.ros2.availability import ros2_reach
from action_assistant.umrf.facts import BadProfile, facts_of

_PATIENCE_S: Final = 6.0
_SAFE_DOMAIN: Final = 101
_SHM: Final = Path("/dev/shm")
_CONTAINER: Final = (Path("/.dockerenv"), Path("/run/.containerenv"))
_SAYS_FASTRTPS: Final = "FASTDDS_BUILTIN_TRANSPORTS"


async def look(
    robots: Sequence[Registration],
    clock_us: Callable[[], int],
    environ: Mapping[str, str] = os.environ,
) -> list[Diagnostic]:
    """Everything there is to say, the ground first. Takes some seconds; never raises for trouble."""
    found = environment(environ)
    reach = ros2_reach(clock_us, environ)
    if isinstance(reach, str):
        verdict: Verdict = "wrong" if robots else "note"  # a computer without robots needs none
        return [*found, Diagnostic(topic="rclpy", verdict=verdict, what=reach)]
    found.append(
        Diagnostic(
            topic="rclpy",
            verdict="fine",
            what=f"rclpy of {_origin('rclpy')} speaks {reach.rmw}, with the temoto_msgs of "
            f"{_origin('temoto_msgs')}.",
        )
    )
    try:
        found += await _robots(reach, robots)
        found += _seen(await reach.candidates(), robots)
    except RuntimeError as error:
        found.append(
            Diagnostic(
                topic="domain",
                verdict="wrong",
                what=f"The middleware cannot be started: {error}.",
                advice="Its own messages above may say why.",
            )
        )
    finally:
        await reach.aclose()
    return found


def environment(environ: Mapping[str, str]) -> list[Diagnostic]:
    """What the environment sets, and what follows."""
    return [*_sourced(environ), *_domain(environ), *_shared_memory(environ)]


def _sourced(environ: Mapping[str, str]) -> list[Diagnostic]:
    if environ.get("ROS_VERSION") == "1":
        return [
            Diagnostic(
                topic="environment",
                verdict="wrong",
                what="ROS 1 is sourced in this shell.",
                advice="Open a fresh shell, and source ROS 2 only.",
            )
        ]
    distro = environ.get("ROS_DISTRO")
    what = f"ROS 2 {distro} is sourced." if distro else "No ROS 2 is sourced."
    return [Diagnostic(topic="environment", verdict="fine", what=what)]


def _domain(environ: Mapping[str, str]) -> list[Diagnostic]:
    number = environ.get("ROS_DOMAIN_ID", "0")
    found = [
        Diagnostic(topic="domain", verdict="fine", what=f"The domain of this shell is {number}.")
    ]
    if number.isdigit() and int(number) > _SAFE_DOMAIN:
        found.append(
            Diagnostic(
                topic="domain",
                verdict="note",
                what=f"Domain {number} uses ports that Linux also hands out to other programs.",
                advice=f"Domains up to {_SAFE_DOMAIN} are safe.",
            )
        )
    scope = environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper()
    local = scope == "LOCALHOST" or environ.get("ROS_LOCALHOST_ONLY") == "1"
    if local or scope == "OFF":
        sees = "only engines on this computer" if local else "no engine by itself"
        found.append(
            Diagnostic(
                topic="domain",
                verdict="note",
                what=f"Discovery is restricted, so this process sees {sees}.",
                advice="For robots elsewhere: unset ROS_AUTOMATIC_DISCOVERY_RANGE and "
                "ROS_LOCALHOST_ONLY, here and there.",
            )
        )
    return found


def _shared_memory(environ: Mapping[str, str]) -> list[Diagnostic]:
    found: list[Diagnostic] = []
    if not os.access(_SHM, os.W_OK):
        found.append(
            Diagnostic(
                topic="shared memory",
                verdict="note",
                what=f"{_SHM} cannot be written, so messages go over the network stack.",
            )
        )
    if any(each.exists() for each in _CONTAINER) and _SAYS_FASTRTPS not in environ:
        found.append(
            Diagnostic(
                topic="shared memory",
                verdict="note",
                what="This is a container. Where it shares the host's network but not its memory, "
                "engines outside are listed, yet nothing arrives.",
                advice=f"Share memory and user with them (ipc: host), or set {_SAYS_FASTRTPS}=UDPv4 "
                "on both sides.",
            )
        )
    strangers = sorted(_name(uid) for uid in _owners() - {os.getuid()})
    if strangers:
        runs = "runs" if len(strangers) == 1 else "run"
        found.append(
            Diagnostic(
                topic="shared memory",
                verdict="note",
                what=f"{' and '.join(strangers)} {runs} nodes of Fast DDS too. Nodes of different "
                "users see each other, but may not read each other's memory.",
                advice=f"Run them as one user, or set {_SAYS_FASTRTPS}=UDPv4 for all of them.",
            )
        )
    return found


def _owners() -> set[int]:
    """The users whose nodes have shared memory here; it comes and goes while one looks."""
    found: set[int] = set()
    for each in _SHM.glob("fastrtps_*"):
        with suppress(OSError):
            found.add(each.stat().st_uid)
    return found


def _name(uid: int) -> str:
    """A user for people. Those of containers mostly have no name outside."""
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return f"User {uid}"


def _origin(module: str) -> str:
    """Where a package of ROS 2 comes from, for people."""
    place = getattr(importlib.import_module(module), "__file__", None)
    return ros_workspace.prefix_of(place) if place else "an unknown place"


async def _robots(reach: Reach, robots: Sequence[Registration]) -> list[Diagnostic]:
    """Whether each registered robot answers, all at once."""
    links: list[tuple[Registration, Link]] = []
    found: list[Diagnostic] = []
    for each in robots:
        try:
            links.append((each, reach.link(each, facts_of(each.profile))))
        except BadProfile as bad:
            found.append(Diagnostic(topic=each.name, verdict="wrong", what=f"Its profile: {bad}"))
    async with anyio.create_task_group() as tasks:
        for _, link in links:
            tasks.start_soon(link.run)
        with anyio.move_on_after(_PATIENCE_S):
            for _, link in links:
                await _answering(link)
        found += [_robot(registration, link.standing) for registration, link in links]
        tasks.cancel_scope.cancel()
    return found


async def _answering(link: Link) -> None:
    """Wait until an engine answers."""
    answers = anyio.Event()

    def hear(report: Report) -> None:
        if isinstance(report, EngineChanged) and report.state == "answering":
            answers.set()

    with link.listen(hear):
        if link.standing.state != "answering":
            await answers.wait()


def _robot(robot: Registration, standing: Standing) -> Diagnostic:
    """What one robot's standing means."""
    if standing.generation == "older":
        return Diagnostic(
            topic=robot.name,
            verdict="wrong",
            what="Its temoto_msgs are another generation than the ones here; starts are refused.",
            advice="Build its engine with temoto_msgs of March 2025 or later.",
        )
    if standing.state != "answering":
        return Diagnostic(
            topic=robot.name, verdict="wrong", what=standing.why, advice=_advice(standing)
        )
    deaf = [name for name in ("start", "stop") if not standing.listeners.get(name)]
    if deaf:
        return Diagnostic(
            topic=robot.name,
            verdict="wrong",
            what=f"It answers, but nobody listens to {' and '.join(deaf)}.",
            advice="Compare the topics in its profile with `ros2 topic list`.",
        )
    return Diagnostic(
        topic=robot.name,
        verdict="fine",
        what=f"It answers on {robot.get_service}, domain {robot.domain}, and listens.",
    )


def _advice(standing: Standing) -> str:
    if standing.servers == 1:
        return (
            "It may be busy with a long stop, hang, speak another middleware (RMW_IMPLEMENTATION "
            "must be the same on both sides), or be cut off from shared memory."
        )
    if standing.servers > 1:
        return ""
    return (
        "Is the engine running, on this domain, within ROS_AUTOMATIC_DISCOVERY_RANGE, and on the "
        "path that is registered?"
    )


def _seen(candidates: Sequence[Candidate], robots: Sequence[Registration]) -> list[Diagnostic]:
    """Engines that nobody registered, and what is odd about any."""
    known = {(each.domain, f"/{each.get_service.lstrip('/')}") for each in robots}
    found: list[Diagnostic] = []
    for each in candidates:
        if each.problem:
            found.append(_odd(each))
        elif (each.domain, each.get_service) not in known:
            name = f" of {each.actor}" if each.actor else ""
            found.append(
                Diagnostic(
                    topic="engines",
                    verdict="note",
                    what=f"An engine{name} on {each.get_service}, domain {each.domain}, is not "
                    "registered.",
                )
            )
    return found or [
        Diagnostic(
            topic="engines", verdict="fine", what="No engine that is not registered is in sight."
        )
    ]


def _odd(candidate: Candidate) -> Diagnostic:
    place = f"{candidate.get_service}, domain {candidate.domain}"
    return Diagnostic(topic="engines", verdict="wrong", what=f"On {place}: {candidate.problem}")
