"""The engines that runs can go to: the simulator, always, and the robots that somebody registered."""

import re
from collections.abc import Iterator, Mapping
from typing import ClassVar, Final, Literal, TypeAlias

import msgspec

from action_assistant.errors import BadInput, Conflict
from action_assistant.runner.links.port import EngineState, Link, Registration

SIMULATOR: Final = "simulator"
REGISTERED: Final = "robot.registered.v1"
#: The stream of all registrations.
STREAM: Final = "robots"

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,63}")
_SERVICE: Final = re.compile(r"/?[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*")
_NO_LINK: Final = (
    "No link: this installation cannot reach robots over ROS 2, so nothing can be started or "
    "stopped there from here."
)

RobotState: TypeAlias = EngineState | Literal["no_link"]


class Registered(msgspec.Struct, frozen=True, kw_only=True):
    """Somebody registered a robot, or registered it anew."""

    kind: ClassVar[str] = REGISTERED

    at: int
    name: str
    domain: int
    rmw: str
    get_service: str
    profile: dict[str, object]


class Robot(msgspec.Struct, frozen=True, kw_only=True):
    """An engine as people see it. `why` explains any state but `answering`."""

    name: str
    simulated: bool
    state: RobotState
    why: str = ""
    domain: int | None = None
    rmw: str = ""
    get_service: str = ""
    profile: dict[str, object] = {}


class Robots:
    """The registry. `links` are the robots within reach, by name."""

    def __init__(self, links: Mapping[str, Link] | None = None) -> None:
        self._links: Final = dict(links or {})
        self._registered: dict[str, Registration] = {}

    def add(self, registration: Registration) -> None:
        """Take a robot into the registry, or change it."""
        self._registered[registration.name] = registration

    def all(self) -> Iterator[Robot]:
        """Every engine, the simulator first."""
        yield Robot(name=SIMULATOR, simulated=True, state="answering")
        for name in sorted(self._registered.keys() | self._links.keys()):
            known = self._registered.get(name, Registration(name=name))
            linked = name in self._links
            yield Robot(
                name=name,
                simulated=False,
                state="answering" if linked else "no_link",
                why="" if linked else _NO_LINK,
                domain=known.domain,
                rmw=known.rmw,
                get_service=known.get_service,
                profile=known.profile,
            )

    def reachable(self, name: str) -> Link:
        """The link to a robot. Raises BadInput for an unknown name, Conflict when there is none."""
        link = self._links.get(name)
        if link is not None:
            return link
        if name in self._registered:
            raise Conflict(f"{name}: {_NO_LINK}", where={"path": "/engine"})
        raise BadInput(f"No robot is called {name!r}.", where={"path": "/engine"})

    def link(self, name: str) -> Link | None:
        """The link to a robot, if there is one."""
        return self._links.get(name)


def check_registration(asked: Registration) -> None:
    """Refuse names that cannot be on the wire. Raises BadInput, Conflict."""
    if asked.name.lower() == SIMULATOR:
        raise Conflict("The simulator is always there; a robot needs a name of its own.")
    if not _NAME.fullmatch(asked.name):
        raise BadInput(
            "A robot's name starts with a letter and has letters, digits, _ and - only, "
            "64 at most.",
            where={"path": "/name"},
        )
    if not _SERVICE.fullmatch(asked.get_service):
        raise BadInput("This is no name of a ROS 2 service.", where={"path": "/get_service"})
