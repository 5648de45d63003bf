"""Looks for faults of ROS 2 from this process: in its environment, among the engines on its domains, and
whether each registered robot answers. For `doctor`."""

import asyncio
import importlib
import os
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

import anyio

from action_assistant import ros_workspace
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
from action_assistant.system import posix
from action_assistant.system.diagnostics import Diagnostic, fine, found
from action_assistant.umrf.facts import BadProfile, facts_of

_PATIENCE_S: Final = 6.0
_SAFE_DOMAIN: Final = 101
_NAMED: Final = 5  # robots in one sentence
_LAST_DOMAIN: Final = 232
_SHM: Final = Path("/dev/shm")
_MOUNTS: Final = Path("/proc/self/mountinfo")
_OWN_SHM: Final = re.compile(r"^(?:\S+ ){4}/dev/shm .* - tmpfs shm ", re.MULTILINE)
_SAYS_FASTRTPS: Final = "FASTDDS_BUILTIN_TRANSPORTS"


async def look(
    robots: Sequence[Registration],
    clock_us: Callable[[], int],
    environ: Mapping[str, str] = os.environ,
) -> list[Diagnostic]:
    """Examine the ROS 2 environment and the registered `robots`, and return all findings, first
    those about the environment. `clock_us`: returns microseconds UTC; `environ`: the environment
    variables. This takes some seconds; a fault of ROS 2 is a finding and not raised."""
    seen = [*_sourced(environ), *_domain(environ)]
    reach = ros2_reach(clock_us, environ)
    if isinstance(reach, str):
        return [*seen, _no_reach(reach, robots)]
    seen += shared_memory(environ)
    seen.append(
        fine(
            "rclpy",
            f"rclpy of {_origin('rclpy')} speaks {reach.rmw}, with the temoto_msgs of "
            f"{_origin('temoto_msgs')}.",
        )
    )
    try:
        # Discovery on the domain of this shell goes on while robots are asked.
        standings, _ = await asyncio.gather(_standings(reach, robots, seen), reach.sighting())
        candidates = await reach.candidates()
    except RuntimeError as error:
        seen.append(
            found(
                "middleware-broken",
                environ.get("RMW_IMPLEMENTATION", "the default middleware"),
                f"The middleware cannot be started: {error}.",
                "Its own messages above may say why; unset what configures it, or reinstall it.",
            )
        )
    else:
        known = {(each.domain, _path(each)) for each in robots}
        strangers = [each for each in candidates if (each.domain, each.get_service) not in known]
        unseen = [
            each
            for each, standing in standings
            if standing.state != "answering" and not standing.servers
        ]
        likely = _likely(unseen, strangers)
        told = [_robot(each, standing, likely.get(each.name, ())) for each, standing in standings]
        seen += told
        # What is wrong with the engine of a robot is said once, with the robot.
        ill = {each.where for each in told if each.severity != "fine"}
        spoken = {(each.domain, _path(each)) for each in robots if each.name in ill}
        seen += _engines(
            [each for each in candidates if (each.domain, each.get_service) not in spoken],
            strangers,
            [each for each in unseen if each.name not in likely],
        )
    finally:
        await reach.aclose()
    return seen


def _path(robot: Registration) -> str:
    return f"/{robot.get_service.lstrip('/')}"


def _no_reach(why: str, robots: Sequence[Registration]) -> Diagnostic:
    """Return the finding for a process that cannot reach robots, for the reason `why`. It is a
    fault only if robots are registered or a setting is wrong."""
    if "ROS_DOMAIN_ID" in why:
        return found(
            "domain-wrong", "ROS_DOMAIN_ID", why, "Set it to the robot's domain, or unset it."
        )
    if why.startswith("RMW_IMPLEMENTATION"):
        return found("middleware-broken", "RMW_IMPLEMENTATION", why, "Do either, and start anew.")
    if not robots:
        return fine("rclpy", f"No robot is registered, and none could be reached: {why}")
    names = ", ".join(each.name for each in robots)
    return found("rclpy-missing", "rclpy", f"{names} cannot be reached: {why}", "Do as it says.")


def _sourced(environ: Mapping[str, str]) -> list[Diagnostic]:
    if environ.get("ROS_VERSION") == "1":
        return [
            found(
                "ros1-sourced",
                "ROS_VERSION",
                "ROS 1 is sourced in this shell.",
                "Open a fresh shell, and source ROS 2 only.",
            )
        ]
    distro = environ.get("ROS_DISTRO")
    return [
        fine("environment", f"ROS 2 {distro} is sourced." if distro else "No ROS 2 is sourced.")
    ]


def _domain(environ: Mapping[str, str]) -> list[Diagnostic]:
    number = environ.get("ROS_DOMAIN_ID", "0")
    scope = environ.get("ROS_AUTOMATIC_DISCOVERY_RANGE", "").upper()
    reaches = "Engines on the network are seen."
    if scope == "LOCALHOST" or environ.get("ROS_LOCALHOST_ONLY") == "1":
        reaches = "Discovery is restricted, so only engines on this computer are seen."
    elif scope == "OFF":
        reaches = "Discovery is restricted, so no engine is seen by itself."
    seen = [fine("ROS_DOMAIN_ID", f"The domain of this shell is {number}. {reaches}")]
    if number.isdigit() and _SAFE_DOMAIN < int(number) <= _LAST_DOMAIN:
        seen.append(
            found(
                "domain-high",
                "ROS_DOMAIN_ID",
                f"Domain {number} uses ports that Linux also hands out to other programs.",
                f"Take one up to {_SAFE_DOMAIN}, here and on the robot.",
            )
        )
    return seen


def shared_memory(environ: Mapping[str, str]) -> list[Diagnostic]:
    """Return findings about what keeps the nodes of this computer from sharing memory with this
    process: a private /dev/shm of a container, or another user. Missing shared memory is found by
    another check."""
    if not sys.platform.startswith("linux") or _SAYS_FASTRTPS in environ:
        return []
    seen: list[Diagnostic] = []
    if _is_private():
        seen.append(
            found(
                "shared-memory-apart",
                _SHM,
                "This container has shared memory of its own: engines outside are seen, yet nothing of "
                "them arrives.",
                f"Share memory and user with them (`ipc: host`), or set {_SAYS_FASTRTPS}=UDPv4 on both "
                "sides.",
            )
        )
    strangers = sorted(posix.user_name(uid) for uid in _owners() - {posix.user_id()})
    if strangers:
        runs = "runs" if len(strangers) == 1 else "run"
        seen.append(
            found(
                "shared-memory-users",
                _SHM,
                f"{' and '.join(strangers)} {runs} nodes of Fast DDS too. Nodes of different users see "
                "each other, but may not read each other's memory.",
                f"Run them as one user, or set {_SAYS_FASTRTPS}=UDPv4 for all of them.",
            )
        )
    return seen


def _is_private() -> bool:
    """Return whether /dev/shm belongs to this container alone: container engines mount it as `tmpfs shm`."""
    try:
        return _OWN_SHM.search(_MOUNTS.read_text()) is not None
    except OSError:
        return False


def _owners() -> set[int]:
    """Return the ids of the users whose nodes have shared memory on this computer."""
    found: set[int] = set()
    for each in _SHM.glob("fastrtps_*"):
        with suppress(OSError):
            found.add(each.stat().st_uid)
    return found


def _origin(module: str) -> str:
    """Return, for people, the folder in which the Python package `module` of ROS 2 is installed."""
    place = getattr(importlib.import_module(module), "__file__", None)
    return ros_workspace.prefix_of(place) if place else "an unknown place"


async def _standings(
    reach: Reach, robots: Sequence[Registration], seen: list[Diagnostic]
) -> list[tuple[Registration, Standing]]:
    """Return the condition of the engine of each registered robot; the call waits up to some
    seconds for all of them at once. A robot with a bad profile gets a finding in `seen` instead.
    Raise RuntimeError if a ROS domain cannot be joined."""
    links: list[tuple[Registration, Link]] = []
    for each in robots:
        try:
            links.append((each, reach.link(each, facts_of(each.profile))))
        except BadProfile as bad:
            remedy = "Correct it on the Robots page."
            seen.append(found("robot-profile", each.name, f"Its profile cannot be: {bad}", remedy))
    async with anyio.create_task_group() as tasks:
        for _, link in links:
            tasks.start_soon(link.run)
        with anyio.move_on_after(_PATIENCE_S):
            for _, link in links:
                await _answering(link)
        standings = [(registration, link.standing) for registration, link in links]
        tasks.cancel_scope.cancel()
    return standings


async def _answering(link: Link) -> None:
    """Wait until discovery shows that the engine of a link answers; without a timeout of its own."""
    answers = anyio.Event()

    def hear(report: Report) -> None:
        if isinstance(report, EngineChanged) and report.state == "answering":
            answers.set()

    with link.listen(hear):
        if link.standing.state != "answering":
            await answers.wait()


def _likely(
    unseen: Sequence[Registration], strangers: Sequence[Candidate]
) -> dict[str, list[Candidate]]:
    """Return, by robot, the engines on other domains that may be the robot's: those with its name
    and, if it is the only missing robot, those whose name is unknown. `unseen`: robots whose engine
    does not answer; `strangers`: engines that belong to no registered robot."""
    nameless = len(unseen) == 1
    found = {
        robot.name: [
            each
            for each in strangers
            if each.domain != robot.domain
            and (each.actor == robot.name or (nameless and not each.actor))
        ]
        for robot in unseen
    }
    return {name: each for name, each in found.items() if each}


def _robot(robot: Registration, standing: Standing, elsewhere: Sequence[Candidate]) -> Diagnostic:
    """Return the finding about one robot. `standing`: the condition of its engine, as discovery
    shows it; `elsewhere`: engines on other domains that may be the engine of this robot."""
    if standing.ids_unknown:
        return found(
            "robot-unproven",
            robot.name,
            "This middleware does not show which process an answer comes from: starts are refused, and "
            "no Stop can be proven.",
            "Start runner and engine with RMW_IMPLEMENTATION=rmw_fastrtps_cpp or rmw_cyclonedds_cpp.",
        )
    if standing.generation == "older":
        return found(
            "robot-older",
            robot.name,
            "Its temoto_msgs are another generation than the ones here; starts are refused.",
            "Build its engine with temoto_msgs of March 2025 or later.",
        )
    if standing.state != "answering":
        return _silent(robot, standing, elsewhere)
    deaf = [name for name in ("start", "stop") if not standing.listeners.get(name)]
    if deaf:
        return found(
            "robot-deaf",
            robot.name,
            f"It answers, but nobody listens to {' and '.join(deaf)}.",
            "Compare the topics in its profile with `ros2 topic list`.",
        )
    return fine(
        robot.name, f"It answers on {robot.get_service}, domain {robot.domain}, and listens."
    )


def _silent(robot: Registration, standing: Standing, elsewhere: Sequence[Candidate]) -> Diagnostic:
    """Return the finding for a robot that does not answer, with the reason as far as it can be seen
    from this computer. `standing`: the condition of its engine; `elsewhere`: engines on other
    domains that may be the engine of this robot."""
    if "RMW_IMPLEMENTATION" in standing.why:
        return found(
            "robot-middleware",
            robot.name,
            f"{standing.why}.",
            "Start runner and engine with the same RMW_IMPLEMENTATION, and register the robot with it.",
        )
    if standing.servers:
        return found("robot-silent", robot.name, standing.why, _SILENT[standing.servers > 1])
    if elsewhere:
        where = " and ".join(f"{each.domain} ({each.get_service})" for each in elsewhere)
        return found(
            "robot-elsewhere",
            robot.name,
            f"It is registered on domain {robot.domain}, where no engine is; one answers on domain "
            f"{where}.",
            "If that is it, register it with that domain, or start its engine with ROS_DOMAIN_ID="
            f"{robot.domain}.",
        )
    return found("robot-silent", robot.name, standing.why, _NOBODY)


_SILENT: Final = {
    False: "It may be busy with a long stop, hang, speak another middleware (RMW_IMPLEMENTATION must be "
    "the same on both sides), or be cut off from shared memory: look at it, and start its engine anew.",
    True: "End all of these engines but one, or give each a domain of its own (ROS_DOMAIN_ID).",
}
_NOBODY: Final = (
    "Start its engine with the registered domain (ROS_DOMAIN_ID) and path, within reach of "
    "ROS_AUTOMATIC_DISCOVERY_RANGE here and there."
)


def _engines(
    candidates: Sequence[Candidate],
    strangers: Sequence[Candidate],
    unseen: Sequence[Registration],
) -> list[Diagnostic]:
    """Return findings for engines that are not registered, and for faults of any engine.
    `candidates`: all engines in sight; `strangers`: those that belong to no registered robot;
    `unseen`: robots whose engine does not answer; an engine without a name may be any of them,
    which the finding says."""
    seen: list[Diagnostic] = []
    for each in candidates:
        place = f"{each.get_service}, domain {each.domain}"
        if each.problem:
            remedy = "Leave one engine on each path, of the generation of these messages."
            seen.append(found("engine-odd", place, each.problem, remedy))
        elif each in strangers:
            name = f" of {each.actor}" if each.actor else ""
            what = f"An engine{name} that nobody registered answers."
            remedy = "Register it on the Robots page, or leave it alone."
            absent = [robot.name for robot in unseen if robot.domain != each.domain]
            if absent and not each.actor:
                what += (
                    " It says no name, so it may be one of the robots that are registered on another "
                    f"domain and not seen: {_some(absent)}."
                )
                remedy = (
                    "Look at the robot which name its engine was started with (--actor-name). If that is "
                    f"registered, change its domain to {each.domain}; else register it, or leave it alone."
                )
            seen.append(found("engine-unregistered", place, what, remedy))
    return seen or [fine("engines", "No engine that is not registered is in sight.")]


def _some(names: Sequence[str]) -> str:
    """Return the first names, and how many more there are, as a text."""
    more = len(names) - _NAMED
    if more <= 0:
        return ", ".join(names)
    return f"{', '.join(names[:_NAMED])} and {more} more"
