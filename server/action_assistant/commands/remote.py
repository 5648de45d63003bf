"""Commands that talk to a running server: export, graphs, run."""

import argparse
import sys
import time
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import msgspec

from action_assistant.commands import queue, repeats
from action_assistant.commands.answers import decoded
from action_assistant.commands.client import Server, add_server, print_json, running
from action_assistant.commands.folders import folder_id, known_folders
from action_assistant.commands.stop import ENDED
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line, told

if TYPE_CHECKING:  # slow to load
    from action_assistant.runner.runs.views import RunShown
    from action_assistant.umrf.start_values import AskedInput

_TIME: Final = "%Y-%m-%dT%H:%M:%S"
_POLL: Final = 0.2  # seconds


def _add_export(export: argparse.ArgumentParser) -> None:
    add_server(export, "patrol --at 120 > patrol.json")
    export.add_argument("graph", metavar="GRAPH", help="id or name")
    export.add_argument("--at", type=int, metavar="SEQ", help="as it was then")
    export.set_defaults(handler=_export)


def _add_graphs(graphs: argparse.ArgumentParser) -> None:
    add_server(graphs, "--json")
    graphs.add_argument("--json", action="store_true", help="as JSON, for programs")
    graphs.add_argument(
        "--folder", metavar="FOLDER", help="only those in it: path or id; / for those in none"
    )
    graphs.set_defaults(handler=_graphs)


def _add_run(run: argparse.ArgumentParser) -> None:
    add_server(run, "patrol --script fast.json")
    run.add_argument("graph", metavar="GRAPH", help="id or name")
    run.add_argument("--engine", default="simulator", metavar="ROBOT", help="default: %(default)s")
    run.add_argument(
        "--people",
        type=_people,
        metavar="ROLE=ID,…",
        help="lead it step by step; a person or group, by id, answers the questions of each role, ROLE= "
        "stands for all who may run it",
    )
    run.add_argument(
        "--robots",
        type=_robots,
        metavar="ACTOR=ROBOT,…",
        help="lead it step by step on these robots; =ROBOT plays actions without an actor",
    )
    run.add_argument(
        "--lost",
        choices=("stop", "wait"),
        default="stop",
        help="what happens when one of --robots is lost: everything stops, or waits for you; "
        "default: %(default)s",
    )
    run.add_argument(
        "--break",
        dest="breaks",
        type=_break,
        action="append",
        default=[],
        metavar="NAME[:VISIT]",
        help="with --robots: wait before this action, at each visit or at this one; again for each",
    )
    run.add_argument(
        "--breakpoints",
        action="store_true",
        help="with --robots: wait at the breakpoints of the graph, too",
    )
    run.add_argument(
        "--into",
        action="store_true",
        help="with --robots: the actions inside of sub-graphs are steps of their own; else each sub-graph "
        "is one step",
    )
    run.add_argument(
        "--accept",
        nargs=2,
        metavar=("CODE,…", "REASON"),
        help="start despite these problems, and why: 'two-at-once' 'They share no space.'",
    )
    run.add_argument(
        "--watching",
        action="append",
        default=[],
        metavar="ROBOT",
        help="you watch this robot, with its hardware stop within reach; again for each",
    )
    run.add_argument(
        "--drill", action="store_true", help="it is for a Stop drill: press Stop while it moves"
    )
    run.add_argument(
        "--set",
        dest="values",
        type=_setting,
        action="append",
        default=[],
        metavar="[ACTION.]INPUT=VALUE",
        help="the value of an input for which the graph asks; again for each. Lists are JSON",
    )
    _add_from(run)
    repeats.add_options(run)
    queue.add_options(run)
    run.add_argument("--script", type=Path, metavar="S.json", help="what simulated actions do")
    run.add_argument("--label", default="", help="of the version")
    run.add_argument("--no-wait", action="store_true", help="print the run's id and return")
    run.set_defaults(handler=_run)


def _add_from(run: argparse.ArgumentParser) -> None:
    """Add the options of a run that does not begin at the entry."""
    begins = run.add_argument_group("where it begins")
    begins.add_argument(
        "--from",
        dest="earlier",
        metavar="RUN",
        help="continue this led run where it ended, in its version, with its robots and values; with "
        "--at, only take outcomes and values of it",
    )
    begins.add_argument(
        "--at", action="append", default=[], metavar="NAME", help="begin here; again for each"
    )
    begins.add_argument("--only", action="store_true", help="play nothing but these actions")
    for option, means in (("again", "begins again"), ("leave", "is left: nothing goes on from it")):
        begins.add_argument(
            f"--{option}",
            action="append",
            default=[],
            metavar="NAME",
            help=f"this action, which was under way, {means}; again for each",
        )
    begins.add_argument(
        "--done",
        type=_outcome,
        action="append",
        default=[],
        metavar="NAME=OUTCOME",
        help="this one is taken as done: true, false or error, by your word; again for each",
    )
    begins.add_argument("--reason", default="", metavar="TEXT", help="how you know the outcome")


def _outcome(text: str) -> tuple[str, str]:
    """Return the action and the outcome in `Lift_0=true`. Raise ArgumentTypeError for another text."""
    name, _, outcome = text.rpartition("=")
    if not name or outcome not in {"true", "false", "error"}:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form NAME=true|false|error")
    return name, outcome


def _start_from(options: argparse.Namespace) -> dict[str, Any] | None:
    """Return where a run begins, as a start says it; None for the entry."""
    if options.earlier is None and not options.at:
        return None
    choices = dict.fromkeys(options.again, "again") | dict.fromkeys(options.leave, "leave")
    start: dict[str, Any] = {"at": options.at, "only": options.only}
    if options.earlier is not None:
        start["run"] = options.earlier
    if choices or options.done:
        start |= {"choices": choices | dict(options.done), "reason": options.reason}
    return start


def _setting(text: str) -> tuple[str, str]:
    """Return the input and the value in `place=valve_8`. Raise ArgumentTypeError for another text."""
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form [ACTION.]INPUT=VALUE")
    return name, value


def values_of(
    settings: Sequence[tuple[str, str]], asked: Sequence["AskedInput"]
) -> dict[str, dict[str, Any]]:
    """Return the values of a start by action and input. `settings`: names of inputs, with or without
    that of their action, and texts; `asked`: what the graph asks for. Raise CannotStart for a name
    that means no one input, and for a text that is no value of its type."""
    found: dict[str, dict[str, Any]] = {}
    for name, text in settings:
        named = [each for each in asked if name in {each.name, f"{each.action}.{each.name}"}]
        if len(named) != 1:
            every = ", ".join(f"{each.action}.{each.name}" for each in named or asked)
            why = "is asked of several actions" if named else "is not asked for"
            raise CannotStart(f"--set {name}: it {why}. One of: {every or 'nothing is asked for'}.")
        (one,) = named
        given = found.setdefault(one.action, {})
        if one.name in given:
            raise CannotStart(f"--set {name}: it is set twice.")
        given[one.name] = _value_of(one, text)
    return found


def _value_of(one: "AskedInput", text: str) -> Any:
    if one.type == "string":
        return text
    try:
        return msgspec.json.decode(text)
    except (msgspec.DecodeError, RecursionError):
        raise CannotStart(f"--set {one.action}.{one.name}: {text!r} is no {one.type}.") from None


def _break(text: str) -> dict[str, Any]:
    """Return the breakpoint before an action; `text`: its full name, perhaps with a visit. Raise
    ArgumentTypeError for a visit that is no number from 1."""
    name, colon, visit = text.rpartition(":")
    if not colon:
        return {"action": text}
    if not visit.isdecimal() or int(visit) < 1:
        raise argparse.ArgumentTypeError(f"{visit!r} is no visit: 1, 2, …")
    return {"action": name, "visit": int(visit)}


def _robots(text: str) -> dict[str, str]:
    """Parse `Scout=David,Carrier=Carol` into robots by actor. Raise ArgumentTypeError for another
    text."""
    pairs = [each.rpartition("=") for each in text.split(",")]
    robots = {actor: robot for actor, _, robot in pairs}
    if len(robots) < len(pairs) or any(not equals or not robot for _, equals, robot in pairs):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not of the form ACTOR=ROBOT,…, each actor once"
        )
    return robots


def _people(text: str) -> dict[str, str]:
    """Parse `Nurse=ID,Guard=` into who answers by role. Raise ArgumentTypeError for another text."""
    pairs = [each.partition("=") for each in text.split(",")]
    people = {role: who for role, _, who in pairs}
    if len(people) < len(pairs) or any(not equals for _, equals, _ in pairs):
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form ROLE=ID,…, each role once")
    return people


def _add_release(release: argparse.ArgumentParser) -> None:
    add_server(release, "patrol@tested")
    release.add_argument(
        "version", metavar="GRAPH[@VERSION]", help="its newest version, or one by label or id"
    )
    release.add_argument("--withdraw", action="store_true", help="withdraw its release")
    release.set_defaults(handler=_release)


def _release(options: argparse.Namespace) -> int:
    """Run the command that releases a version or withdraws that, and tells the runner, which may be
    on another computer. Return the exit code."""
    method = "DELETE" if options.withdraw else "PUT"
    with running(options) as server:
        id_ = _version_id(server, options.version)
        version = server.editor(method, f"/api/versions/{id_}/release").json()
        release = {
            "version": id_,
            "digest": version.get("tree_digest") or version["digest"],
            **version.get("released", {}),
        }
        body = None if options.withdraw else release
        server.runners.tell(method, f"/api/releases/{id_}", json=body)
    name = version["label"] or id_
    print(one_line(f"{name} is {'not released any more' if options.withdraw else 'released'}"))
    return 0


def _version_id(server: Server, asked: str) -> str:
    """Return the id of the version that GRAPH[@VERSION] names, the newest of several. Raise
    RequestRefused if there is none."""
    graph, at, wanted = asked.rpartition("@") if "@" in asked else (asked, "", "")
    versions = server.editor("GET", f"/api/graphs/{server.graph_id(graph)}/versions").json()
    for each in versions:
        if not at or wanted in {each["id"], each["label"]}:
            return str(each["id"])
    raise RequestRefused(f"{asked!r} is no version of a graph: publish one first.")


COMMANDS: Final = {
    "export": _add_export,
    "graphs": _add_graphs,
    "release": _add_release,
    "run": _add_run,
}


def _export(options: argparse.Namespace) -> int:
    with running(options) as server:
        graph = server.graph_id(options.graph)
        query = {"at": options.at} if options.at is not None else {}
        answer = server.editor("GET", f"/api/graphs/{graph}/umrf", params=query)
        sys.stdout.write(answer.text if answer.text.endswith("\n") else answer.text + "\n")
    return 0


def _graphs(options: argparse.Namespace) -> int:
    with running(options) as server:
        answer = server.editor("GET", "/api/graphs")
        listed = answer.json()
        if options.folder is not None:
            folder = folder_id(known_folders(server), options.folder)
            listed = [graph for graph in listed if graph.get("folder") == folder]
    if options.json:
        print_json(listed)
        return 0
    from action_assistant.editor.catalogue.catalogue import GraphView

    chosen = {graph["id"] for graph in listed}
    for graph in decoded(answer, list[GraphView]):
        if graph.id in chosen:
            print(one_line(f"{graph.id}  {graph.updated_at:{_TIME}}  {graph.name}"))
    return 0


def _run(options: argparse.Namespace) -> int:
    script = None
    if options.script:
        try:
            script = msgspec.json.decode(options.script.read_bytes())
        except (OSError, ValueError, RecursionError) as error:
            raise CannotStart(f"Cannot read the script {options.script}: {error}.") from error
    from action_assistant.runner.runs.views import RunShown

    with running(options) as server:
        graph = server.graph_id(options.graph)
        start = _start_from(options)
        continued = None
        if start is not None and not options.at:
            continued = server.runner("GET", f"/api/runs/{options.earlier}").json()
        if continued is not None:
            version = server.editor("GET", f"/api/versions/{continued['version']}").json()
        else:
            label = {"label": options.label} if options.label else {}
            version = server.editor("POST", f"/api/graphs/{graph}/versions", json=label).json()
        order = {
            "version": version["id"],
            "digest": version["digest"],
            "umrf": version["umrf"],
            "engine": options.engine,
            "request_id": str(uuid.uuid4()),
            "graph": graph,
        }
        order["sight"] = server.editor("GET", f"/api/versions/{version['id']}/sight").json()
        if version.get("subgraphs"):
            order |= {name: version[name] for name in ("subgraphs", "tree_digest")}
        if options.robots is not None or options.people is not None:
            robots, people = options.robots or {}, options.people or {}
            order |= {"engine": "conducted", "robots": robots, "lost": options.lost}
            order |= {"people": people} if people else {}
        if options.into:
            order["levels"] = "opened"
        if start is not None:
            order["from"] = start
        if continued is not None:
            led = {"robots": continued["robots"], "lost": options.lost}
            led |= {"people": continued["people"]} if "people" in continued else {}
            order |= {"engine": "conducted", "values": continued.get("values", {}), **led}
        opens = options.into or (continued is not None and _is_opened(continued))
        breakpoints = _breakpoints(server, version, options, opens=opens)
        if breakpoints:
            order["breakpoints"] = breakpoints
        if options.watching:
            order["watching"] = dict.fromkeys(options.watching, True)
        if options.values:
            order["values"] = _values(server, order, options.values)
        if options.drill:
            order["drill"] = True
        if options.accept is not None:
            codes, reason = options.accept
            order["override"] = {"codes": codes.split(","), "reason": reason}
        if script is not None:
            order["script"] = script
        if queue.is_asked(options):
            if repeats.is_asked(options):
                raise CannotStart("A repeat cannot wait in the queue.")
            return queue.put(server, order, options)
        if repeats.is_asked(options):
            asked = _asked(server, order) if options.grid else ()
            grid = repeats.grid_of(options.grid, asked)
            return repeats.open_repeat(server, order, grid, options)
        run = decoded(server.runner("POST", "/api/runs", json=order), RunShown)
        print(run.id, flush=True)
        return 0 if options.no_wait else _watch(server, run.id)


def _breakpoints(
    server: Server, version: dict[str, Any], options: argparse.Namespace, *, opens: bool
) -> list[dict[str, Any]]:
    """Return where a run of a version waits: as the command says, and, if it says so, at the breakpoints
    of the graph, with those inside of the sub-graphs that the run `opens`. Of two before one action that
    of the command counts."""
    chosen: list[dict[str, Any]] = options.breaks
    if not options.breakpoints:
        return chosen
    kept = server.editor("GET", f"/api/versions/{version['id']}/breakpoints").json()
    said = {each["action"] for each in chosen}
    of_graph = (
        each
        for each in kept
        if (opens or "inside" not in each)
        and (each["action"] not in said or not {"to", "outcomes", "inside"}.isdisjoint(each))
    )
    return [*chosen, *of_graph]


def _is_opened(run: dict[str, Any]) -> bool:
    """Return whether the actions inside of sub-graphs were steps of their own in a run."""
    return any("levels" in each for each in run["actions"].values())


def _values(
    server: Server, order: dict[str, Any], settings: Sequence[tuple[str, str]]
) -> dict[str, Any]:
    return values_of(settings, _asked(server, order))


def _asked(server: Server, order: dict[str, Any]) -> list["AskedInput"]:
    """Return the inputs for which a start asks."""
    from action_assistant.umrf.start_values import AskedInput

    wanted = {name: order[name] for name in ("umrf", "graph", "from") if name in order}
    return decoded(server.runner("POST", "/api/asked_inputs", json=wanted), list[AskedInput])


def _watch(server: Server, run: str) -> int:
    """Print each change of a run until it has ended, and return the exit code for its end."""
    from action_assistant.runner.runs.views import RunShown

    seen: dict[str, str] = {}
    held = ""
    while True:
        now = decoded(server.runner("GET", f"/api/runs/{run}"), RunShown)
        for name, action in now.actions.items():
            if seen.get(name) != action.state:
                seen[name] = action.state
                print(one_line(f"{name}: {action.state}"), flush=True)
        if now.held is not None and held != now.held.why:
            print(one_line(f"HELD: {now.held.why} Let it go on: runs go-on {run}"), flush=True)
        held = "" if now.held is None else now.held.why
        if now.state in ENDED:
            code, words = verdict(now)
            print(told(words))
            return code
        time.sleep(_POLL)


def verdict(run: "RunShown") -> tuple[int, str]:
    """Return the exit code for a run that is over, and its end in words. A robot reports no result,
    so a finished run counts as good unless an action failed."""
    if run.state != "finished" or run.result is not None:
        words = f"{run.state} ({run.result})" if run.result else run.state
        return 0 if run.state == "finished" and run.result == "on_true" else 1, words
    visits = [visit for each in run.actions.values() for visit in each.visits]
    if any(visit.result == "error" for visit in visits):
        return 1, "finished, after an action had ended in error"
    return 0, "finished; nothing is known to have failed, but the robot does not tell the result"
