"""Reads from the endpoints on a ROS 2 domain which engines are there, and of which kind."""

from typing import Final

from action_assistant.runner.links.port import Generation
from action_assistant.runner.links.ros2.domain import Domain
from action_assistant.runner.links.ros2.outlets import Topics
from action_assistant.runner.links.ros2.ros_values import Endpoint
from action_assistant.umrf.facts import EngineFacts

OLDER: Final = (
    "its temoto_msgs are another generation than the ones here, so it would misread what is sent; "
    "build the engine with temoto_msgs of March 2025 or later"
)
#: Vendors of middlewares, by the first two bytes of their gids (the vendor id of the DDS standard).
_VENDORS: Final = {"010f": "Fast DDS", "0110": "Cyclone DDS", "0101": "Connext"}


def topics_of(facts: EngineFacts) -> Topics:
    """Return the names of the topics of an engine build."""
    return Topics(
        start=facts.start_topic,
        stop=facts.stop_topic,
        pause=facts.pause_topic,
        resume=facts.resume_topic,
        modify=facts.modify_topic,
        feedback=facts.feedback_topic,
    )


def generation_of(domain: Domain, servers: tuple[Endpoint, ...]) -> Generation:
    """Return whether the engine behind these servers reads a start message as this process writes
    it, by the hash of the message type: "current" if so, "older" if not, "unknown" with a
    middleware that gives no hash."""
    hashes = {each.type_hash for each in belonging(servers, domain.listeners(domain.topics.start))}
    known = {each for each in hashes if not each.upper().startswith("INVALID")}
    if not known:
        return "unknown"
    return "current" if known == {domain.own_hash} else "older"


def two_servers(place: str, count: int) -> str:
    """Return the sentence why answers prove no stop on a path (`place`) on which `count` engines
    answer."""
    return (
        f"{count} engines answer on {place}. Nobody can tell which of them sent an answer, so no answer "
        "proves a stop. Start each engine with a ROS_DOMAIN_ID of its own. An engine that has just "
        "crashed may still be counted for up to 20 s."
    )


def belonging(servers: tuple[Endpoint, ...], ends: tuple[Endpoint, ...]) -> tuple[Endpoint, ...]:
    """Return those endpoints in `ends` that are in the same process as one of the `servers`."""
    processes = {each.process for each in servers}
    return tuple(each for each in ends if each.process in processes)


def foreign_middleware(domain: Domain, server: Endpoint) -> str:
    """Return the name of a server's middleware if it differs from the middleware of this process,
    else "". Discovery may show a server with a different middleware, but that server never answers.
    """
    theirs = server.gid[:4]
    if theirs == domain.process[:4]:
        return ""
    return _VENDORS.get(theirs, "another middleware")
