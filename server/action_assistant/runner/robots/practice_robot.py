"""The robot with which people practise: an emulated one, as a process of this computer."""

import os
import subprocess
import sys
from collections.abc import Collection
from typing import Final

from anyio import Lock, to_thread

from action_assistant.errors import Unavailable
from action_assistant.runner.links.port import Registration
from action_assistant.system.parent import PARENT
from action_assistant.umrf.facts import PINNED

#: The name of the robot, and the wake word of its engine.
NAME: Final = "Practice"
_NAMESPACE: Final = "action_assistant/practice"
#: Where its engine answers. No other engine does, so a registration with this path is of no real robot.
_GET_SERVICE: Final = f"{_NAMESPACE}/{PINNED.get_service}"
_DOMAINS: Final = range(101, 0, -1)  # beyond them the ports of DDS may be those of other programs
_COMMAND: Final = (
    *(sys.executable, "-m", "action_assistant"),
    *("simulate-robot", NAME, "--namespace", f"/{_NAMESPACE}"),
)
#: Nobody on another computer sees the robot, or can start anything there.
_HERE: Final = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


class PracticeRobot:
    """The process of the emulated robot, one at most. It ends with this process, too."""

    def __init__(self) -> None:
        self.turn = Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: int | None = None  # the robot ends when it closes

    @property
    def is_running(self) -> bool:
        """True while the process of the robot goes on."""
        return self._process is not None and self._process.poll() is None

    async def start(self, domain: int) -> None:
        """Start the robot on a domain."""
        self.end()
        self._process, self._pipe = await to_thread.run_sync(_spawned, domain)

    def end(self) -> None:
        """Have the process end, if there is one."""
        if self._process is not None and self._pipe is not None:
            os.close(self._pipe)
            self._process.poll()
        self._process = self._pipe = None


def registration_beside(taken: Collection[int]) -> Registration:
    """Return a registration of the robot on a domain that is not `taken`. Raise Unavailable if all
    domains are."""
    for domain in _DOMAINS:
        if domain not in taken:
            return Registration(name=NAME, domain=domain, get_service=_GET_SERVICE, led=True)
    raise Unavailable(
        f"All domains from {min(_DOMAINS)} to {max(_DOMAINS)} have robots, so none is left for {NAME}; "
        "forget a robot first."
    )


def is_practice(registration: Registration) -> bool:
    """Return whether a registration is that of the practice robot, and not of a robot that only has its
    name."""
    return registration.name == NAME and registration.get_service.strip("/") == _GET_SERVICE


def _spawned(domain: int) -> tuple[subprocess.Popen[bytes], int]:
    """Start the process on a domain; also return the descriptor whose closing ends it."""
    reading, writing = os.pipe()
    try:
        process = subprocess.Popen(
            [*_COMMAND, "--domain", str(domain)],
            pass_fds=[reading],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **_HERE, PARENT: str(reading)},
            start_new_session=True,  # Ctrl-C is meant for this process
        )
    except BaseException:
        os.close(writing)
        raise
    finally:
        os.close(reading)
    return process, writing
