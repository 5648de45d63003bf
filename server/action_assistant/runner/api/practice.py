"""Starts an emulated robot on this computer, for people who want to practise."""

import os
import subprocess
import sys
from collections.abc import Collection
from typing import Any, Final

from anyio import Lock, to_thread
from litestar import Request, Response, post
from litestar.handlers import HTTPRouteHandler

from action_assistant.errors import Conflict, Unavailable
from action_assistant.runner.api.caller import author_of
from action_assistant.runner.api.run_guard import unseen_by
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.links.port import Registration
from action_assistant.runner.robots.registration import Robot
from action_assistant.web.auth.access import Needs

#: The name of the robot, and the wake word of its engine.
NAME: Final = "Practice"
_DOMAINS: Final = range(101, 0, -1)  # beyond them the ports of DDS may be those of other programs
_COMMAND: Final = (sys.executable, "-m", "action_assistant", "simulate-robot", NAME, "--until-eof")
#: Nobody on another computer sees the robot, or can start anything there.
_HERE: Final = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


class PracticeRobot:
    """The process of the emulated robot, one at most. It ends with this process, whose end closes its standard
    input."""

    def __init__(self) -> None:
        self.turn = Lock()
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def is_running(self) -> bool:
        """True while the process of the robot goes on."""
        return self._process is not None and self._process.poll() is None

    async def start(self, domain: int) -> None:
        """Start the robot on a domain."""
        self.end()
        self._process = await to_thread.run_sync(_spawned, domain)

    def end(self) -> None:
        """Have the process end, if there is one."""
        if self._process is not None and self._process.stdin is not None:
            self._process.stdin.close()
            self._process.poll()
        self._process = None


def _registration(taken: Collection[int]) -> Registration:
    """Return a registration of the robot on a domain that is not `taken`."""
    return Registration(name=NAME, domain=next(d for d in _DOMAINS if d not in taken), led=True)


def _spawned(domain: int) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [*_COMMAND, "--domain", str(domain)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **_HERE},
        start_new_session=True,  # Ctrl-C is meant for this process
    )


def practice_route(services: RunnerServices, practice: PracticeRobot) -> HTTPRouteHandler:
    """Return the route that starts and registers the robot."""

    @post(
        "/api/practice",
        summary="Start an emulated robot on the computer of the runner, and register it",
        description=f"Its name is `{NAME}`. It moves nothing, is seen on this computer only, and ends with the "
        "runner, or when it is forgotten. Where it is registered and nobody answers there, it is started again. "
        "503 where the runner has no ROS 2.",
        operation_id="startPracticeRobot",
        guards=[Needs("register")],
    )
    async def start(request: Request[Any, Any, Any]) -> Response[Robot]:
        robots = services.control.robots
        async with practice.turn:
            if robots.no_reach:
                raise Unavailable(robots.no_reach)
            if NAME in robots.names:
                if practice.is_running or robots.robot(NAME).servers > 0:
                    raise Conflict(f"There is a robot {NAME} already; forget it first.")
                asked = robots.registration(NAME)
            else:
                taken = {robots.registration(name).domain for name in robots.names}
                asked = _registration({*taken, int(os.environ.get("ROS_DOMAIN_ID", "0"))})
            await practice.start(asked.domain)
            try:
                await services.control.register(asked, author_of(request))
            except BaseException:
                practice.end()
                raise
        robot = services.control.robot_view(NAME, unseen_by(services, request))
        return Response(robot, status_code=201, headers={"location": f"/api/robots/{NAME}"})

    return start
