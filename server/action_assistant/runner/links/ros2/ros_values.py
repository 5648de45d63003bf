"""The values that a ROS 2 domain gives to links, free of ROS 2 types: endpoints, messages and answers.

`Domain` makes them over rclpy; the fake network of tests in virtual time makes them, too.
"""

import re
from typing import Final, TypeAlias

import msgspec

from action_assistant.runner.links.observations import LogLevel, Snapshot
from action_assistant.runner.links.port import Command, Feedback

#: A name may have blanks and quotes in it, so that the engine's own words around it say where it ends.
_GRAPH: Final = re.compile(
    r"[Gg]raph: (?P<last>.+)"
    r"|[Gg]raph '(?P<told>.+)' (?:finished\.|stopped\.|paused\.|resumed\.|modified\.|\.\.\.)$"
    r"|[Gg]raph '(?P<quoted>.+?)'(?=$|[\s.,:])"
    r"|[Gg]raph (?P<word>[^\s']+)",
    re.MULTILINE,
)

#: An emulated engine has a publisher of this name below its get service. It may be asked at any time.
EMULATED: Final = "emulated"


class Endpoint(msgspec.Struct, frozen=True):
    """A publisher, subscription or server on a domain. `gid` changes with every restart; `process`:
    its part that all endpoints of one process share. `logger`: the name under which the node
    logs."""

    gid: str
    process: str
    logger: str
    type_hash: str


class OverheardCommand(msgspec.Struct, frozen=True, kw_only=True):
    """A command that another program has published. `graph`: the name that engines use; `umrf`: the
    graph text in it, "" for none."""

    command: Command
    graph: str
    umrf: str
    targets: tuple[str, ...]
    sender: str


#: The words for the levels of ROS 2 (rcl_interfaces/msg/Log).
_LEVELS: Final[dict[int, LogLevel]] = {
    10: "debug",
    20: "info",
    30: "warn",
    40: "error",
    50: "fatal",
}


class LogLine(msgspec.Struct, frozen=True):
    """A line of a node's log. `number`: the level in the message; 0 for none."""

    logger: str
    text: str
    number: int = 0

    @property
    def level(self) -> LogLevel:
        """The level as a word; "" if ROS 2 has no word for its number."""
        return _LEVELS.get(self.number, "")

    @property
    def graph(self) -> str | None:
        """The name of the graph that the line is about; None if it names none."""
        found = _GRAPH.search(self.text.strip())
        return found[found.lastgroup or 0] if found else None


RosValue: TypeAlias = Feedback | OverheardCommand | LogLine


class GetResult(msgspec.Struct, frozen=True, kw_only=True):
    """The answer of a server. `graphs` and `texts` (by running name): those that it runs or has
    run; the other fields: the UMRF texts of its index."""

    graphs: tuple[Snapshot, ...]
    texts: dict[str, str]
    known_actions: tuple[str, ...]
    known_graphs: tuple[str, ...]
