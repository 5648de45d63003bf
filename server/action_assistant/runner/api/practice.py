"""The route that starts an emulated robot on this computer, for people who want to practise."""

import os
from typing import Any

from litestar import Request, Response, post
from litestar.handlers import HTTPRouteHandler

from action_assistant.errors import Conflict, Unavailable
from action_assistant.runner.api.caller import author_of
from action_assistant.runner.api.run_guard import unseen_by
from action_assistant.runner.api.services import RunnerServices
from action_assistant.runner.robots.practice_robot import (
    NAME,
    PracticeRobot,
    is_practice,
    registration_beside,
)
from action_assistant.runner.robots.registration import Robot
from action_assistant.web.auth.access import Needs


def practice_route(services: RunnerServices, practice: PracticeRobot) -> HTTPRouteHandler:
    """Return the route that starts and registers the robot."""

    @post(
        "/api/practice",
        summary="Start an emulated robot on the computer of the runner, and register it",
        description=f"Its name is `{NAME}`. It moves nothing, is seen on this computer only, and ends with the "
        "runner, or when it is forgotten. Once it is known that it has ended, it is started again. "
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
                asked = robots.registration(NAME)
                if not is_practice(asked):
                    raise Conflict(
                        f"The robot {NAME} that is registered is not known to be an emulated one, so none "
                        "takes its place; forget it first."
                    )
                known = robots.robot(NAME)
                if practice.is_running or known.servers > 0:
                    raise Conflict(f"There is a robot {NAME} already; forget it first.")
                if not known.practice_ended:
                    raise Conflict(f"Nobody knows yet whether {NAME} is there: {known.why}")
                services.control.require_unused(NAME)
            else:
                taken = {robots.registration(name).domain for name in robots.names}
                asked = registration_beside({*taken, int(os.environ.get("ROS_DOMAIN_ID", "0"))})
            await practice.start(asked.domain)
            try:
                await services.control.register(asked, author_of(request))
            except BaseException:
                practice.end()
                raise
        robot = services.control.robot_view(NAME, unseen_by(services, request))
        return Response(robot, status_code=201, headers={"location": f"/api/robots/{NAME}"})

    return start
