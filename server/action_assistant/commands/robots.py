"""The command `robots`: which robots are registered, registering one, and forgetting one."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote

import msgspec

from action_assistant.commands.client import command, decoded, print_json, running
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line
from action_assistant.umrf.facts import SECOND_PERSON

if TYPE_CHECKING:  # slow to load, and most calls do not need it
    from action_assistant.runner.robots.registration import Robot


def _add_robots(robots: argparse.ArgumentParser) -> None:
    robots.epilog = "example: action-assistant robots add David --domain 7"
    words = robots.add_subparsers(dest="word", required=True, metavar="WORD")

    listed = command(words, "list", "the simulator and each robot, and whether it answers", "")
    listed.add_argument("--json", action="store_true", help="as JSON, for programs")
    listed.set_defaults(handler=_list)

    add = command(words, "add", "register a robot", "David --domain 7")
    add.add_argument("name", metavar="NAME", help="the engine's --actor-name, letter for letter")
    add.add_argument(
        "--domain", type=int, default=0, metavar="N", help="its ROS_DOMAIN_ID; default: 0"
    )
    add.add_argument(
        "--rmw", default="", metavar="RMW", help="its middleware; default: that of the runner"
    )
    add.add_argument(
        "--get-service",
        metavar="PATH",
        help="the path of its get, where that is not umrf_graph_get",
    )
    add.add_argument(
        "--profile",
        metavar="FILE",
        help="a JSON file that says what is true of its engine (docs/robots.md)",
    )
    add.add_argument(
        "--second-person",
        action="store_true",
        help="it takes only what a second person has said yes to",
    )
    add.add_argument(
        "--led",
        action="store_true",
        help="the runner may lead it step by step, in runs that several robots share",
    )
    add.add_argument(
        "--replace", action="store_true", help="register it anew, if it is registered already"
    )
    add.set_defaults(handler=_add)

    remove = command(words, "remove", "forget a robot; its runs stay in the history", "David")
    remove.add_argument("name", metavar="NAME")
    remove.set_defaults(handler=_remove)


COMMANDS: Final = {"robots": _add_robots}


def _list(options: argparse.Namespace) -> int:
    with running(options) as server:
        answer = server.runner("GET", "/api/robots")
    if options.json:
        print_json(answer.json())
        return 0
    from action_assistant.runner.robots.registration import Robot

    for each in decoded(answer, list[Robot]):
        print(_line(each))
    return 0


def _add(options: argparse.Namespace) -> int:
    profile = {} if options.profile is None else _profile(Path(options.profile))
    if options.second_person:
        profile[SECOND_PERSON] = True
    wanted: dict[str, Any] = {"name": options.name, "domain": options.domain, "profile": profile}
    if options.led:
        wanted["led"] = True
    if options.rmw:
        wanted["rmw"] = options.rmw
    if options.get_service is not None:
        wanted["get_service"] = options.get_service
    with running(options) as server:
        from action_assistant.runner.robots.registration import Robot

        robots = decoded(server.runner("GET", "/api/robots"), list[Robot])
        if options.name in {each.name for each in robots} and not options.replace:
            raise RequestRefused(
                f"{options.name} is registered already. --replace registers it anew."
            )
        print(_line(decoded(server.runner("POST", "/api/robots", json=wanted), Robot)))
    return 0


def _remove(options: argparse.Namespace) -> int:
    with running(options) as server:
        server.runner("DELETE", f"/api/robots/{quote(options.name, safe='')}")
    print(one_line(f"{options.name} is not registered any more"))
    return 0


def _line(robot: "Robot") -> str:
    """Return one robot as a line: its name, domain and state, and why it does not answer."""
    domain = "" if robot.domain is None else f"  domain {robot.domain}"
    why = f": {robot.why}" if robot.why else ""
    return one_line(f"{robot.name}{domain}  {robot.state}{why}")


def _profile(path: Path) -> dict[str, Any]:
    """Read a robot's profile from the JSON file `path`. Raise CannotStart if it cannot be read or
    is no JSON object."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=dict[str, Any])
    except OSError as error:
        raise CannotStart(f"Cannot read the profile {path}: {error.strerror}.") from error
    except msgspec.DecodeError as error:
        raise CannotStart(f"The profile {path} is no JSON object: {error}.") from error
