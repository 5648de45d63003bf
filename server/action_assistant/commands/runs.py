"""The command `runs` with its own commands: at-rest, wait, step, go-on, log, since, examples, verify, archive and copy."""

import argparse
import asyncio
import sys
from collections.abc import Iterator, Mapping
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import msgspec

from action_assistant import settings
from action_assistant.commands.answers import decoded
from action_assistant.commands.backups.progress import Progress
from action_assistant.commands.client import (
    Server,
    add_server,
    command,
    print_json,
    refused,
    running,
)
from action_assistant.commands.drafts import changes_lines
from action_assistant.commands.place import add_data
from action_assistant.commands.presses import press
from action_assistant.commands.questions import add_questions
from action_assistant.commands.repeats import add_repeats
from action_assistant.commands.run_log import add_log
from action_assistant.commands.runners import Gathered
from action_assistant.commands.second_person import add_second_person
from action_assistant.errors import CannotStart, Refused, RequestRefused
from action_assistant.safe_text import one_line, told
from action_assistant.umrf.difference import Difference
from action_assistant.umrf.difference_text import lines, without_looks

if TYPE_CHECKING:  # slow to load, and most calls do not need it
    from action_assistant.editor.history.course_search import SinceWhen
    from action_assistant.runner.analysis.expected_runs import Expectation


_TIME: Final = "%Y-%m-%dT%H:%M:%S"
_AT_REST: Final = frozenset({"unused", "proven", "seen", "unsent"})  # states of a robot


def _add_runs(runs: argparse.ArgumentParser) -> None:
    add_server(runs, "--graph patrol")
    runs.add_argument("--graph", metavar="GRAPH", help="id or name")
    runs.add_argument("--json", action="store_true", help="as JSON, for programs")
    runs.set_defaults(handler=_runs)
    more = runs.add_subparsers(
        metavar="at-rest | wait | step | go-on | log | questions | answer | repeats | next | stop-repeating | look-again | since | verify | archive | restore | copy | examples"
    )
    rests = command(
        more,
        "at-rest",
        "confirm that a run is at rest which no answer of its engine can prove so: after you looked",
        'RUN --how "I stand beside it; nothing moves."',
    )
    rests.add_argument("run", metavar="RUN", help="id of the run")
    rests.add_argument("--how", required=True, help="how you have seen that nothing moves")
    rests.set_defaults(handler=_at_rest)
    goes_on = command(
        more, "go-on", "let a held run go on: its robots may begin to move at once", "RUN"
    )
    goes_on.add_argument("run", metavar="RUN", help="id of the run")
    _add_watching(goes_on)
    goes_on.set_defaults(handler=_go_on)
    waits = command(
        more,
        "wait",
        "let a led run begin no further action; what is under way goes on (to stop it: stop)",
        "RUN",
    )
    waits.add_argument("run", metavar="RUN", help="id of the run")
    waits.add_argument("--reason", default="", metavar="TEXT", help="shown to everybody")
    waits.set_defaults(handler=_wait)
    steps = command(
        more,
        "step",
        "let one action of a held run begin, then hold it again: its robot may begin to move at once",
        "RUN --until Lift_0",
    )
    steps.add_argument("run", metavar="RUN", help="id of the run")
    goal = steps.add_mutually_exclusive_group()
    goal.add_argument("--action", default="", metavar="NAME", help="the one of those that wait")
    goal.add_argument("--until", default="", metavar="NAME", help="all that come before this one")
    goal.add_argument(
        "--over",
        default=[],
        action="append",
        metavar="NAME",
        help="all inside of this opened sub-graph; again for each level down",
    )
    _add_watching(steps)
    steps.set_defaults(handler=_step)
    add_log(more)
    add_questions(more)
    add_repeats(more)
    add_second_person(more)
    _add_archives(more)
    _add_copy(more)
    _add_since(more)
    brought = command(
        more,
        "examples",
        "take in recorded runs that failed, to see how causes are found; each is there once",
        "",
    )
    brought.set_defaults(handler=_examples)
    again = command(
        more,
        "verify",
        "simulate every expected course again, with the graph as it was and as it is now; exit 1 if "
        "any goes another way",
        "--graph patrol",
    )
    again.add_argument("--graph", metavar="GRAPH", help="id or name; only what is expected of it")
    again.add_argument("--json", action="store_true", help="as JSON, for programs")
    again.set_defaults(handler=_verify)


COMMANDS: Final = {"runs": _add_runs}


def _add_watching(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--watching",
        action="append",
        default=[],
        metavar="ROBOT",
        help="you watch this robot, with its hardware stop within reach; again for each",
    )


def _go_on(options: argparse.Namespace) -> int:
    """Run the command that lets a held run go on, and return the exit code. Raise RequestRefused if
    it is not held."""
    held = _press_held(options, "go_on", {})
    print(one_line(f"it goes on; it was held: {held['why']}"))
    return 0


def _step(options: argparse.Namespace) -> int:
    """Run the command that lets one action of a held run begin, and return the exit code. Raise
    RequestRefused if it is not held, or no action waits to begin."""
    wanted = {"action": options.action, "until": options.until, "over": options.over}
    held = _press_held(options, "step", wanted)
    ready = [each["action"] for each in held.get("next", ())]
    goal = f"until {options.until}" if options.until else options.action or ready[0]
    if options.over:
        goal = f"over {' › '.join(options.over)}"
    print(one_line(f"one step is made: {goal}; then it waits again"))
    return 0


def _press_held(options: argparse.Namespace, route: str, more: dict[str, Any]) -> Any:
    """Send an order to a held run that may move robots, and return why the run was held. `more`: what
    the order has besides that. Raise RequestRefused if the run is not held."""
    path = f"/api/runs/{options.run}"
    with running(options) as server:
        held = server.runner("GET", path).json()["held"]
        if held is None:
            raise RequestRefused("The run is not held; it goes on already.")
        asked: dict[str, Any] = {"since": held["since"], **more}
        if options.watching:
            asked["watching"] = dict.fromkeys(options.watching, True)
        press(server, f"{path}/{route}", asked)
    return held


def _wait(options: argparse.Namespace) -> int:
    """Run the command that lets a led run wait before its next action, and return the exit code."""
    with running(options) as server:
        asked = {"reason": options.reason}
        shown = press(server, f"/api/runs/{options.run}/wait", asked).json()
    rests = shown.get("rests", ())
    going = [f"{each['action']} on {each['robot']}" for each in rests if each["state"] == "going"]
    unknown = [each["robot"] for each in rests if each["state"] not in _AT_REST | {"going"}]
    print(one_line(f"{shown['held']['why']} Let it go on: runs go-on {options.run}"))
    if going:
        print(one_line(f"STILL MOVING: {', '.join(going)}. To stop it: stop {options.run}"))
    if unknown:
        print(one_line(f"NOT KNOWN to be at rest: {', '.join(unknown)}"))
    return 0


def _runs(options: argparse.Namespace) -> int:
    with running(options) as server:
        query = {"graph": server.graph_id(options.graph)} if options.graph else {}
        found = server.runners.gathered("/api/runs", params=query)
    if options.json:
        listed = found.json()
        if len(found.answers) > 1:
            listed.sort(key=_begun, reverse=True)
        print_json(listed)
        return found.code
    from action_assistant.runner.runs.views import Listed

    rows = [(run, at) for at, answer in found.answers for run in decoded(answer, list[Listed])]
    if len(found.answers) > 1:
        rows.sort(key=lambda row: row[0].requested_at, reverse=True)
    for run, site in rows:
        what = run.state + (f" ({run.result})" if run.result else "")
        when = f"{run.started_at:{_TIME}}" if run.started_at else ""
        at = f"  {site.name}" if site.name else ""
        print(one_line(f"{run.id}  {when}  {run.graph_name}  {run.engine}  {what}{at}"))
    return found.code


def _at_rest(options: argparse.Namespace) -> int:
    """Run the command that records a person's statement that a run is at rest, where no engine can
    prove it; return the exit code."""
    with running(options) as server:
        path = f"/api/runs/{options.run}/at_rest"
        answer = server.runner("POST", path, json={"how": options.how})
    from action_assistant.runner.runs.views import RunShown

    run = decoded(answer, RunShown)
    print(one_line(f"run {run.number} of {run.graph_name} is over: {run.state}"))
    return 0


def _examples(options: argparse.Namespace) -> int:
    with running(options) as server:
        taken = decoded(server.runner("POST", "/api/examples"), list[str])
    print(f"{len(taken)} examples are there, with the label “example”.")
    return 0


class VerifyVerdict(msgspec.Struct, frozen=True, kw_only=True):
    """The verdict on one expected run.

    `against`: the graph that was simulated, either the one that the run was sent (`then`) or the
    present one (`now`).
    """

    name: str
    run: str
    against: Literal["then", "now"]
    same: bool
    why: str = ""


def _verify(options: argparse.Namespace) -> int:
    """Run the command: simulate every expected run again, with its graph of then and with the
    present one, and print the verdicts. Return 0 if all go the same course and no site is missing, else
    1."""
    with running(options) as server:
        expected = server.runners.gathered("/api/expectations")
        verdicts = list(_verdicts(server, expected, options))
    if options.json:
        print_json(msgspec.to_builtins(verdicts))
    elif not verdicts and expected.code == 0:
        print("Nothing is expected yet: open a run in the page and choose “Expect this course”.")
    else:
        for each in verdicts:
            verdict = "same   " if each.same else "DIFFERS"
            print(one_line(f"{verdict}  {each.name} ({each.against})"))
            if each.why:
                print(told(f"         {each.why}"))
    return expected.code if all(each.same for each in verdicts) else 1


def _verdicts(
    server: Server, expected: Gathered, options: argparse.Namespace
) -> Iterator[VerifyVerdict]:
    from action_assistant.runner.analysis.expected_runs import Expectation

    wanted = server.graph_id(options.graph) if options.graph else None
    for each in (each for _, at in expected.answers for each in decoded(at, list[Expectation])):
        if wanted is not None and each.graph != wanted:
            continue
        inside = {sub.name: bytes(sub.umrf) for sub in each.subgraphs}
        yield _verdict(each, bytes(each.umrf), inside, "then")
        if each.graph is not None:
            yield _now(server, each, each.graph)


def _now(server: Server, each: "Expectation", graph: str) -> VerifyVerdict:
    """Compare an expected run (`each`) with the present state of its graph (an id), and return the
    verdict; it is negative if the graph does not exist any more."""
    from action_assistant.editor.catalogue.versions import InsideView

    try:
        umrf = server.editor("GET", f"/api/graphs/{graph}/umrf").content
        found = decoded(server.editor("GET", f"/api/graphs/{graph}/subgraphs"), InsideView)
    except RequestRefused as error:
        return VerifyVerdict(
            name=each.name, run=each.run, against="now", same=False, why=str(error)
        )
    inside = {sub.name: bytes(sub.umrf) for sub in found.subgraphs}
    return _verdict(each, umrf, inside, "now")


def _verdict(
    each: "Expectation",
    umrf: bytes,
    subgraphs: Mapping[str, bytes],
    against: Literal["then", "now"],
) -> VerifyVerdict:
    """Simulate an expected run (`each`) with a graph (`umrf`) and the graphs inside of it by name
    (`subgraphs`), and return the verdict."""
    from action_assistant.umrf.courses.expected import check_expected
    from action_assistant.umrf.files import codec
    from action_assistant.umrf.hierarchy.opening import CannotOpen, opened
    from action_assistant.umrf.semantics import script_from

    script = script_from(msgspec.json.decode(each.script))
    verdict = partial(VerifyVerdict, name=each.name, run=each.run, against=against)
    try:
        was, now = codec.read(bytes(each.umrf)).graph, codec.read(umrf).graph
        inside = {name: codec.read(text).graph for name, text in subgraphs.items()}
        if each.opened and against == "now":
            now = opened(now, inside).graph
    except codec.Unreadable as wrong:
        return verdict(same=False, why=wrong.message)
    except CannotOpen as why:
        return verdict(same=False, why=str(why))
    check = check_expected(was, each.course, script, now, inside)
    return verdict(same=check.apart is None, why=check.why)


def _add_since(runs: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command `runs since` to the sub-commands."""
    since = command(
        runs,
        "since",
        "which edit made a run's graph go another way than it went before, with what the actions of that "
        "run did; exit 1 if an edit did",
        "RUN",
    )
    since.add_argument("run", metavar="RUN", help="id of the run that went wrong")
    since.add_argument(
        "--good",
        type=int,
        metavar="CHANGE",
        help="of the graph, when it still went well (default: that of the last run before that did)",
    )
    since.add_argument("--json", action="store_true", help="as JSON, for programs")
    since.set_defaults(handler=_since)


def _since(options: argparse.Namespace) -> int:
    with running(options) as server:
        run = server.runner("GET", f"/api/runs/{options.run}").json()
        graph, bad = run["graph"], _seq(server, run)
        good = options.good or _last_good(server, run)
        script = server.runner("GET", f"/api/runs/{options.run}/script").json()
        asked = {"good": good, "bad": bad, "script": {"behaviours": script["behaviours"]}}
        answer = server.editor("POST", f"/api/graphs/{graph}/since", json=asked)
        query = {"from": good, "to": bad}
        edits = server.editor("GET", f"/api/graphs/{graph}/diff", params=query)
    from action_assistant.editor.history.course_search import SinceWhen

    found = decoded(answer, SinceWhen)
    if options.json:
        print_json(answer.json())
    else:
        _print_partings(found, decoded(edits, Difference))
    return 1 if found.partings else 0


def _seq(server: Server, run: dict[str, Any]) -> int:
    """Return the change number (seq) of the graph that a run (as JSON) was started from. Raise
    RequestRefused if the run has no version of a graph."""
    if run["graph"] is None or run["version"] is None:
        raise RequestRefused("This run is of no version of a graph here.")
    version = server.editor("GET", f"/api/versions/{run['version']}").json()
    seq: int = version["seq"]
    return seq


def _begun(run: dict[str, Any]) -> datetime:
    """Return when a run (as JSON) was asked for. Each runner counts its own runs, so that numbers of two
    say nothing about each other."""
    return datetime.fromisoformat(run["requested_at"])


def _last_good(server: Server, run: dict[str, Any]) -> int:
    """Return the change number (seq) of the graph in the last run before `run` (as JSON) that went
    well. Raise RequestRefused if there is no such run."""
    runs = server.runners.gathered("/api/runs", params={"graph": run["graph"]}).json()
    began = _begun(run)
    for each in sorted(runs, key=_begun, reverse=True):
        went_well = each["state"] == "finished" and each["result"] in {None, "on_true"}
        if _begun(each) < began and went_well and each["version"] is not None:
            return _seq(server, each)
    raise RequestRefused("No run before it went well; name a change of the graph with --good.")


def _print_partings(found: "SinceWhen", difference: Difference) -> None:
    for each in found.partings:
        who = each.author.name or each.author.id
        verb = "goes another way" if each.parts else "goes the first way again"
        at = each.at.isoformat()[:16]
        print(one_line(f"since change {each.seq} of {who}, {at}, it {verb}:"))
        for line in changes_lines(each.changes):
            print(one_line(f"    {line}"))
        print(one_line(f"    step {each.place}: {each.before} before, {each.after} after"))
    if not found.partings:
        print("No edit explains it: with what its actions did, the graph goes the same way.")
        for line in lines(without_looks(difference)):
            print(one_line(line))
    if not found.exact:
        print(f"Only {found.looked} moments were looked at; there may be further places.")


def _add_archives(runs: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the commands about archives to the sub-commands of `runs`."""
    archive = command(
        runs,
        "archive",
        "put what is old into archives, prove them, and delete it here; pinned runs stay",
        "--runs 90 --raw 14",
    )
    archive.add_argument("--runs", type=_days, metavar="DAYS", help="runs that ended longer ago")
    archive.add_argument("--raw", type=_days, metavar="DAYS", help="raw messages of robots")
    archive.add_argument(
        "--check", action="store_true", help="only prove every archive of the folder; no server"
    )
    archive.set_defaults(handler=_archive)

    restore = runs.add_parser(
        "restore",
        help="prove archives of runs and put them where the runner looks for them",
        epilog="example: action-assistant runs restore run-000042-AbC.jsonl.gz --data ./data",
    )
    restore.add_argument("files", type=Path, nargs="+", metavar="FILE")
    add_data(restore)
    restore.set_defaults(handler=_restore)


def _days(text: str) -> float:
    days = float(text)
    if not 0 <= days < 1e6:
        raise ValueError
    return days


def _archive(options: argparse.Namespace) -> int:
    if options.check:
        return _check(settings.keep(options.data.resolve()).folder)
    if options.runs is None and options.raw is None:
        raise CannotStart("Say how old what goes may be: --runs DAYS, --raw DAYS, or both.")
    with running(options) as server:
        ages = {"runs": options.runs, "raw": options.raw}
        return max(_sweep(server.at(site), ages) for site in server.runners.sites)


def _sweep(server: Server, ages: dict[str, float | None]) -> int:
    runs = hours = 0
    problems: dict[str, None] = {}
    more = True
    while more:
        swept = server.runner("POST", "/api/archive", json=ages).json()
        runs, hours, more = runs + swept["runs"], hours + swept["raw"], swept["more"]
        problems |= dict.fromkeys(swept["problems"])
        if more:
            print(f"{runs} runs so far", file=sys.stderr)
    print(f"{runs} runs and {hours} hours of raw messages are in archives now")
    for problem in problems:
        print(problem, file=sys.stderr)
    return 1 if problems else 0


def _check(folder: Path) -> int:
    from action_assistant.runner.archives import archive_file

    found = sorted(folder.glob("runs/**/*.jsonl.gz"))
    damaged = 0
    for path in found:
        try:
            for _ in archive_file.read(path):
                pass
        except (Refused, OSError) as error:
            damaged += 1
            print(error.detail if isinstance(error, Refused) else f"{path}: {error.strerror}")
    print(f"{len(found) - damaged} archives in {folder} are sound, {damaged} are not")
    return 1 if damaged else 0


def _restore(options: argparse.Namespace) -> int:
    from action_assistant.runner.archives import archive_file

    folder = settings.keep(options.data.resolve()).folder
    code = 0
    for path in options.files:
        try:
            place = archive_file.title_of(path).place
            events = sum(1 for _ in archive_file.read(path))
            archive_file.put(path, folder / place)
        except (Refused, OSError) as error:
            text = error.detail if isinstance(error, Refused) else f"{path}: {error.strerror}"
            code = refused(text)
            continue
        print(f"{place}: {events} events, all of them sound")
    return code


def _add_copy(runs: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command `runs copy` to the sub-commands."""
    copy = runs.add_parser(
        "copy",
        help="copy runs into the schema action_assistant_runs of a Postgres database, for your own "
        "queries",
        epilog="example: action-assistant runs copy --to postgresql://lab@db/lab --follow",
    )
    copy.add_argument("--to", required=True, metavar="URL", help="postgresql://USER@HOST/NAME")
    add_data(copy)
    copy.add_argument(
        "--follow", action="store_true", help="go on, until Ctrl-C, also while the database is away"
    )
    copy.set_defaults(handler=_copy)


def _copy(options: argparse.Namespace) -> int:
    data = options.data.resolve()
    path = data / "runner.db"
    if not path.is_file():
        raise CannotStart(f"There are no runs in {data}.")
    from sqlalchemy import make_url
    from sqlalchemy.exc import ArgumentError

    try:
        url = make_url(options.to)
    except ArgumentError as error:
        raise CannotStart("--to is not a URL such as postgresql://lab@db/lab.") from error
    if url.drivername not in {"postgresql", "postgres"} or not url.database:
        raise CannotStart("--to is a Postgres database: postgresql://USER@HOST/NAME.")
    # Slow to load, and most who ask about runs do not need it.
    from action_assistant.commands.databases.runs_copy import RunsCopier, followed, once
    from action_assistant.journal.failover import engine_of, failover_of

    engine = engine_of(failover_of(url)[1], {"timeout": 5}, pool_size=1)
    copier = RunsCopier(path, settings.keep(data).folder, engine, Progress())
    return asyncio.run(followed(copier) if options.follow else once(copier, str(url.database)))
