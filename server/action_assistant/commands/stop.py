"""`stop`: a Stop of one run or of everything, and what becomes of it."""

import argparse
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import ExitStack, contextmanager
from typing import Final, NamedTuple, NotRequired, TypedDict, TypeVar

from action_assistant.commands.answers import decoded
from action_assistant.commands.client import Server, add_server, running
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line

ENDED: Final = frozenset({"finished", "halted", "stopped", "error", "refused", "lost"})
_POLL: Final = 0.2  # seconds
_INSIST_S: Final = 5.0
_NOBODY_ANSWERS: Final = frozenset({502, 503, 504})  # statuses of a proxy that reaches nobody
_NOT_FOUND: Final = 404
_STOP_ANSWER_S: Final = 10.0  # after which a runner that is silent about a Stop is called silent
_LOOK_AT_ROBOT: Final = "Look at the robot; use its hardware stop."

T = TypeVar("T")


class _Stopping(TypedDict):
    """The answer to a Stop. `runs`: ids; `graphs`: of other programs, by robot; `unknown`: why it is not
    known what a robot runs, by robot."""

    runs: list[str]
    graphs: NotRequired[dict[str, list[str]]]
    unknown: NotRequired[dict[str, str]]


class _Person(TypedDict):
    name: str


class _Seen(TypedDict):
    """A person, or the runner where `by` is None, saw a run at rest."""

    by: _Person | None
    how: str


class Run(TypedDict):
    """The part of a run's JSON that says whether it is at rest."""

    number: int
    graph_name: str
    state: str
    detail: str
    unconfirmed: str | None
    at_rest: _Seen | None


class _Held(TypedDict):
    """A graph that a robot runs."""

    graph: str
    active: bool
    stopping: str | None


class _Robot(TypedDict):
    name: str
    state: str
    holds: list[_Held]
    why: NotRequired[str]


def _add_stop(stop: argparse.ArgumentParser) -> None:
    add_server(stop, "--all")
    which = stop.add_mutually_exclusive_group(required=True)
    which.add_argument("run", nargs="?", metavar="RUN", help="id of the run")
    which.add_argument("--all", action="store_true", help="every run of every robot")
    stop.add_argument("--wait", type=float, default=30.0, metavar="SECONDS", help="for proof")
    stop.set_defaults(handler=_stop)


COMMANDS: Final = {"stop": _add_stop}


def insisting(server: Server, method: str, path: str, kind: type[T]) -> T:
    """Send a request about a Stop to the runner and return the answer's JSON as this type; repeat it
    while the connection fails, a proxy says that nobody answers, or the answer has another form. Raise
    RequestRefused if it is refused, CannotStart after some seconds without an answer."""
    deadline = time.monotonic() + _INSIST_S
    while True:
        try:
            return decoded(server.runner(method, path, timeout=_STOP_ANSWER_S), kind)
        except RequestRefused as error:
            if error.status not in _NOBODY_ANSWERS:
                raise
            silence = CannotStart(str(error))
        except CannotStart as error:
            silence = error
        if time.monotonic() > deadline:
            raise silence
        time.sleep(_POLL)


class _Stopped(NamedTuple):
    """The outcome of a Stop: sentences about what is in doubt, and about what is at rest."""

    doubts: Sequence[str]
    ends: Sequence[str]

    def print(self, place: str = "") -> None:
        """Print the doubts as errors, then the rest; `place` stands before each line."""
        for said in self.doubts:
            print(one_line(place + said), file=sys.stderr, flush=True)
        for said in dict.fromkeys(self.ends):
            print(one_line(place + said), flush=True)


def _stop(options: argparse.Namespace) -> int:
    """Request a Stop of one run or of everything. Wait until nothing moves or a Stop is
    unconfirmed, for `options.wait` seconds at most; print each doubt that is left. Return 0 if
    nothing is in doubt, else 1. Raise RequestRefused if the Stop is refused, CannotStart if the
    server does not answer."""
    with _reached_for_stop(options) as server:
        known, is_done = server.known, False
        try:
            code = (
                _stop_at_sites(server, options)
                if len(known.sites) > 1
                else _stop_at(server, options)
            )
            is_done = not options.all
        finally:
            if known.further and not is_done:
                print(one_line(known.further), file=sys.stderr, flush=True)
    return 1 if known.is_in_doubt and options.all else code


def _stop_at(server: Server, options: argparse.Namespace) -> int:
    stopped = _stopped(server, options)
    stopped.print()
    return 1 if stopped.doubts else 0


def _stop_at_sites(server: Server, options: argparse.Namespace) -> int:
    """Stop at all sites at once, and print what each says as soon as it does, so that one that hangs
    delays no other. The site of a single run is not known, so all are asked, and only those that have
    it count. Raise the error of a site if no site has the run."""
    failed: dict[str, RequestRefused | CannotStart] = {}
    faults: list[BaseException] = []
    doubts = found = 0
    with ThreadPoolExecutor(len(server.runners.sites)) as pool:
        asked = {
            pool.submit(_stopped, server.at(site), options): site for site in server.runners.sites
        }
        for each in as_completed(asked):
            name = asked[each].name
            match each.exception():
                case None:
                    stopped = each.result()
                    found += 1
                    doubts += len(stopped.doubts)
                    stopped.print(f"{name}: ")
                case RequestRefused() | CannotStart() as error:
                    failed[name] = error
                    if options.all:
                        _Stopped([str(error)], ()).print(f"{name}: ")
                case fault:  # raised when all sites have said what they have
                    faults.append(fault)
                    said = f"STOP UNCONFIRMED. {fault!r}. {_LOOK_AT_ROBOT}"
                    _Stopped([said], ()).print(f"{name}: ")
    if faults:
        raise faults[0]
    if options.all or found:
        return 1 if doubts or (options.all and failed) else 0
    silent = {name: error for name, error in failed.items() if _is_silent(error)}
    said = " ".join(f"{name}: {error}" for name, error in (silent or failed).items())
    raise CannotStart(said) if silent else RequestRefused(said)


def _is_silent(error: RequestRefused | CannotStart) -> bool:
    """Return whether a site may have a run although it answered a Stop of it with an error."""
    return isinstance(error, CannotStart) or error.status != _NOT_FOUND


def _stopped(server: Server, options: argparse.Namespace) -> _Stopped:
    """Stop at one runner, and follow what becomes of it as `_stop` says."""
    path = "/api/stop" if options.all else f"/api/runs/{options.run}/stop"
    asked = _sent(server, path)
    with _following():
        others = asked.get("graphs", {})
        is_over = not asked["runs"] and not options.all
        ids = [options.run] if is_over and _is_run(server, options.run) else asked["runs"]
        deadline = time.monotonic() + options.wait
        while True:
            runs = [insisting(server, "GET", f"/api/runs/{run}", Run) for run in ids]
            robots = insisting(server, "GET", "/api/robots", list[_Robot]) if others else []
            graphs = _unproven(others, robots)
            settled = all(_is_at_rest(run) or run["unconfirmed"] for run in runs)
            if (settled and not graphs) or time.monotonic() > deadline:
                break
            time.sleep(_POLL)
    doubts = [_unconfirmed(run) for run in runs if not _is_at_rest(run)]
    doubts += [f"STOP UNCONFIRMED for {each}. {_LOOK_AT_ROBOT}" for each in graphs]
    doubts += [
        f"NOT KNOWN what {each} runs: {why}" for each, why in asked.get("unknown", {}).items()
    ]
    ends = [stopped_as(run, was_over=is_over) for run in runs if _is_at_rest(run)]
    if not doubts:
        ends = ends or ["stopped" if others else "nothing was running"]
    return _Stopped(doubts, ends)


@contextmanager
def _reached_for_stop(options: argparse.Namespace) -> Iterator[Server]:
    """Yield the server that a Stop is for. Raise CannotStart, with a sentence that nothing was
    stopped, if it is not found."""
    with ExitStack() as stack:
        try:
            server = stack.enter_context(running(options, without_editor=True))
        except CannotStart as error:
            raise CannotStart(f"NOTHING WAS STOPPED. {error} {_LOOK_AT_ROBOT}") from error
        yield server


def _sent(server: Server, path: str) -> _Stopping:
    """Send a Stop and return the answer. Raise CannotStart, with a sentence that the Stop may
    not have arrived, if none comes."""
    try:
        return insisting(server, "POST", path, _Stopping)
    except CannotStart as error:
        raise CannotStart(f"NO ANSWER TO THE STOP. {error} {_LOOK_AT_ROBOT}") from error


@contextmanager
def _following() -> Iterator[None]:
    """Say that a Stop was sent, if what becomes of it is refused (a token that has expired may stop
    and see nothing) or not answered."""
    sent = "Stop was sent; what became of it is not known here."
    try:
        yield
    except RequestRefused as error:
        if error.status not in {401, 403}:
            raise
        raise RequestRefused(f"{sent} {error} {_LOOK_AT_ROBOT}", error.status) from error
    except CannotStart as error:
        raise CannotStart(f"{sent} {error} {_LOOK_AT_ROBOT}") from error


def _is_run(server: Server, run: str) -> bool:
    """Return whether an id is that of a run; False if it is the id of a group. Raise CannotStart if
    the server does not answer."""
    try:
        insisting(server, "GET", f"/api/runs/{run}", Run)
    except RequestRefused:
        return False
    return True


def _is_at_rest(run: Run) -> bool:
    """Return whether it was proven or seen that no action of a run moves."""
    return run["state"] in ENDED and (run["state"] != "lost" or bool(run["at_rest"]))


def _why(run: Run) -> str:
    said = run["unconfirmed"] or run["detail"]
    return f"{said.rstrip('.')}. " if said else ""


def stopped_as(run: Run, *, was_over: bool) -> str:
    """Return in words how a run that a person wanted to stop came to rest: only a run that its
    robot has proven to be stopped is called stopped. `run`: as JSON; `was_over`: it had ended
    before."""
    named, state = f"run {run['number']} of {run['graph_name']}", run["state"]
    if seen := run["at_rest"]:
        who = seen["by"]["name"] if seen["by"] else "the runner"
        said = f"{who} saw it at rest ({seen['how'].rstrip('.')}); no answer of a robot proves that"
        return f"{named} is over: {state}. {said}"
    if was_over:
        return f"{named} was over already: {state}"
    if state == "stopped":
        return "stopped"
    why = f": {run['detail'].rstrip('.')}" if run["detail"] else ""
    words = "nothing of it began" if state == "refused" else f"it ended as {state}, not by the Stop"
    return f"{named} is at rest: {words}{why}"


def _unconfirmed(run: Run) -> str:
    said = f"STOP UNCONFIRMED for run {run['number']} of {run['graph_name']}: it is {run['state']}."
    return f"{said} {_why(run)}{_LOOK_AT_ROBOT}"


def _unproven(stopped: dict[str, list[str]], robots: list[_Robot]) -> list[str]:
    """Return one sentence for each graph of `stopped` that is not proven to be at rest. `stopped`:
    the graphs of other programs that got a Stop, by robot; `robots`: the robots as JSON."""
    known = {robot["name"]: robot for robot in robots}
    found: list[str] = []
    for name, graphs in stopped.items():
        robot = known.get(name)
        holds = {each["graph"]: each for each in ([] if robot is None else robot["holds"])}
        silent = robot is None or robot["state"] not in {"answering", "restarted"}
        for graph in graphs:
            held = holds.get(graph)
            if silent or (held is not None and (held["active"] or held["stopping"] is not None)):
                said = held["stopping"] if held is not None else None
                why = said or (robot.get("why") if robot is not None else "") or "no proof has come"
                found.append(f"{graph} on {name}: {why.rstrip('.')}")
    return found
