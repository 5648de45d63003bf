"""The queue by the command line: `run … --queue` puts a start there, `queue` lists, starts and removes."""

import argparse
from typing import TYPE_CHECKING, Any, Final

from action_assistant.commands.client import Server, add_server, command, print_json, running
from action_assistant.errors import CannotStart
from action_assistant.safe_text import one_line

if TYPE_CHECKING:
    from collections.abc import Mapping


def add_options(run: argparse.ArgumentParser) -> None:
    """Add the options by which `run` puts a start into the queue."""
    run.add_argument(
        "--queue",
        action="store_true",
        help="put it into the queue of its robots, print its place and return: queue start",
    )
    run.add_argument(
        "--together",
        action="append",
        default=[],
        metavar="ROBOT",
        help="with --queue: this robot starts it too, at one turn; again for each",
    )


def is_asked(options: argparse.Namespace) -> bool:
    """Return whether the options of `run` ask for the queue. Raise CannotStart for robots that start
    together without it."""
    if options.together and not options.queue:
        raise CannotStart("--together is for a start that waits: --queue.")
    return bool(options.queue)


def put(server: Server, start: dict[str, Any], options: argparse.Namespace) -> int:
    """Put a start into the queue of its robots, print its id and why it waits, and return 0. `start`:
    the body of a request to start. Nothing waits for its turn: in the simulator it starts by itself,
    on robots a person starts it. Raise CannotStart for an option that does not
    fit or without an answer, RequestRefused if the runner refuses."""
    if options.watching:
        raise CannotStart("--watching is said when it starts: queue start ENTRY --watching ROBOT.")
    moves = bool(set(start.get("robots", {}).values() or {start["engine"]}) - {"simulator"})
    wanted = {"start": start, "by_itself": not moves and not start.get("behaviours")}
    if options.together:
        wanted["engines"] = [start["engine"], *options.together]
    answer = server.runner("POST", "/api/queue", json=wanted)
    entry = answer.headers["location"].rsplit("/", 1)[-1]
    print(entry, flush=True)
    for each in answer.json()["entries"]:
        if each["id"] == entry:
            print(one_line(_why(each)))
    if moves:
        print(f"at its turn, look, and start it: queue start {entry}")
    return 0


def _add_queue(queue: argparse.ArgumentParser) -> None:
    add_server(queue, "start ENTRY --watching David")
    queue.add_argument("--json", action="store_true", help="as JSON, for programs")
    queue.set_defaults(handler=_list)
    more = queue.add_subparsers(metavar="start | move | remove | close | open")
    starts = command(
        more,
        "start",
        "start what waits at its turn, if it is as it was put there: its robots may begin to move at once",
        "ENTRY --watching David",
    )
    starts.add_argument("entry", metavar="ENTRY", help="its id")
    starts.add_argument(
        "--look", metavar="LOOK", help="you have seen what differs, by the word that was printed"
    )
    starts.add_argument(
        "--watching",
        action="append",
        default=[],
        metavar="ROBOT",
        help="you watch this robot, with its hardware stop within reach; again for each",
    )
    starts.set_defaults(handler=_start)
    moves = command(more, "move", "move what waits to the end, or before another", "ENTRY")
    moves.add_argument("entry", metavar="ENTRY", help="its id")
    moves.add_argument("--before", default="", metavar="ENTRY", help="the one to come after it")
    moves.set_defaults(handler=_move)
    removes = command(more, "remove", "take out what waits", "ENTRY")
    removes.add_argument("entry", metavar="ENTRY", help="its id")
    removes.set_defaults(handler=_remove)
    closes = command(
        more, "close", "close the queue of a robot; it stops no run (to stop one: stop)", "David"
    )
    closes.add_argument("robot", metavar="ROBOT", help="its name, or simulator")
    closes.set_defaults(handler=_close)
    opens = command(
        more,
        "open",
        "open the closed queue of a robot again, if a look at its first start blocks nothing there",
        "David",
    )
    opens.add_argument("robot", metavar="ROBOT", help="its name, or simulator")
    opens.set_defaults(handler=_open)


def _list(options: argparse.Namespace) -> int:
    with running(options) as server:
        found = server.runners.gathered("/api/queue")
    queues = [(site, answer.json()) for site, answer in found.answers]
    if options.json:
        only = queues[0][1] if not queues[0][0].name else None
        print_json(only or {each.name: queue for each, queue in queues})
        return found.code
    for site, queue in queues:
        if site.name:
            print(one_line(f"{site.name}:"))
        _print(queue)
    return found.code


def _print(queue: "Mapping[str, Any]") -> None:
    for place, each in enumerate(queue["entries"], 1):
        where = ", ".join(each["robots"]) or "simulator"
        head = f"{place}  {each['id']}  {each['graph_name']}  {where}  {each['author']['name']}"
        print(one_line(f"{head}  {_why(each)}"))
    for robot in queue["robots"]:
        if robot["closed"] is not None:
            print(one_line(f"closed: {robot['robot']}: {robot['closed']['text']}"))


def _why(entry: "Mapping[str, Any]") -> str:
    """Return the state of an entry in words."""
    if entry["waits"]:
        return " ".join(each["text"] for each in entry["waits"])
    itself = ", and starts by itself" if entry["by_itself"] else ""
    return " ".join([f"its turn{itself}.", *entry["differs"]])


def _start(options: argparse.Namespace) -> int:
    path = f"/api/queue/{options.entry}"
    watching = dict.fromkeys(options.watching, True)
    with running(options) as server:
        look = options.look
        if look is None:
            found = server.runner("POST", f"{path}/look", json={"watching": watching}).json()
            look = found["look"]
            if found["differs"]:
                print("It is not as it was when it was put into the queue:")
                for each in found["differs"]:
                    print(one_line(f"  {each}"))
                print(f"to start it all the same: queue start {options.entry} --look {look}")
                return 1
        asked = {"look": look, "watching": watching}
        started = server.runner("POST", f"{path}/start", json=asked).json()
    for run in [started, *started["others"]]:
        print(run["id"], flush=True)
    for robot, why in started["failed"].items():
        print(one_line(f"not started on {robot}: {why}"))
    return 1 if started["failed"] else 0


def _move(options: argparse.Namespace) -> int:
    path, asked = f"/api/queue/{options.entry}/move", {"before": options.before}
    with running(options) as server:
        _print(server.runner("POST", path, json=asked).json())
    return 0


def _remove(options: argparse.Namespace) -> int:
    with running(options) as server:
        server.runner("POST", f"/api/queue/{options.entry}/remove")
    print("removed")
    return 0


def _close(options: argparse.Namespace) -> int:
    with running(options) as server:
        _print(server.runner("POST", f"/api/queue/robots/{options.robot}/close").json())
    return 0


def _open(options: argparse.Namespace) -> int:
    path = f"/api/queue/robots/{options.robot}"
    with running(options) as found:
        server = found.at(found.runners.of_robot(options.robot))
        queue = server.runner("GET", "/api/queue").json()
        robot = next((each for each in queue["robots"] if each["robot"] == options.robot), None)
        if robot is None:
            raise CannotStart(f"Nothing waits for {options.robot}.")
        if robot["closed"] is None:
            raise CannotStart(f"The queue of {options.robot} is open.")
        asked = {"closing": robot["closed"]["closing"]}
        _print(server.runner("POST", f"{path}/open", json=asked).json())
    return 0


COMMANDS: Final = {"queue": _add_queue}
