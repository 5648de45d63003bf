"""Commands on files, which need no server: check, convert, simulate."""

import argparse
import json
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.safe_text import one_line, told
from action_assistant.umrf import check as checks
from action_assistant.umrf import semantics
from action_assistant.umrf.codes import QUIET, rank
from action_assistant.umrf.facts import PINNED, SIMULATED, EngineFacts, facts_for
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.action_files import ACTION_DIALECTS
from action_assistant.umrf.fixes import with_examples
from action_assistant.umrf.model import Graph, Note, Problem, Signature, Where
from action_assistant.umrf.signatures import signature_of

_DAY: Final = 24 * 3600.0  # seconds
_EVENTS: Final = 100_000
_COMMANDS: Final = frozenset({"stop", "pause", "resume"})


class CheckVerdict(msgspec.Struct, frozen=True):
    """The problems that `check` found in one file, with their places. `notes`: remarks on what was
    translated or dropped when the file was read."""

    file: str
    dialect: str | None
    problems: tuple[Problem, ...]
    notes: tuple[Note, ...] = ()


def _add_check(check: argparse.ArgumentParser) -> None:
    check.epilog = "example: action-assistant check patrol.umrf.graph.json"
    check.add_argument("files", type=Path, nargs="+", metavar="FILE")
    check.add_argument("--json", action="store_true", help="as JSON, for programs")
    check.add_argument("--facts", metavar="COMMIT", help="of the engine the graph is meant for")
    check.add_argument(
        "--actions", type=Path, metavar="DIR", help="of action packages: their *umrf.json"
    )
    check.add_argument("--graphs", type=Path, metavar="DIR", help="of sub-graphs: *graph.json")
    check.set_defaults(handler=_check)


def _add_convert(convert: argparse.ArgumentParser) -> None:
    convert.epilog = "example: action-assistant convert old.umrfg.json > new.umrf.graph.json"
    convert.add_argument("file", type=Path, metavar="FILE")
    convert.add_argument(
        "--through-document",
        action="store_true",
        help="by way of the shared document, as if it had been imported and exported",
    )
    convert.add_argument(
        "--examples",
        action="store_true",
        help="give inputs that lack a value the example that old files have for them",
    )
    convert.set_defaults(handler=_convert)


def _add_simulate(simulate: argparse.ArgumentParser) -> None:
    simulate.epilog = (
        "example: action-assistant simulate patrol.umrf.graph.json --at 1500:stop --trace"
    )
    simulate.add_argument("file", type=Path, metavar="FILE")
    simulate.add_argument("--script", type=Path, metavar="S.json", help="what the actions do")
    simulate.add_argument(
        "--behaviours",
        type=Path,
        metavar="DIR",
        help="of Python files that say what actions do, before the script; in real time then",
    )
    simulate.add_argument(
        "--actions",
        type=Path,
        metavar="DIR",
        help="of action packages (*umrf.json), which are then the only actions that the engine has",
    )
    simulate.add_argument("--graphs", type=Path, metavar="DIR", help="of sub-graphs")
    simulate.add_argument(
        "--at",
        action="append",
        default=[],
        type=_command,
        metavar="MS:stop|pause|resume[:GRAPH]",
        help="a command at a time; may be given several times",
    )
    simulate.add_argument(
        "--for", type=float, default=_DAY, dest="seconds", metavar="SECONDS", help="default: a day"
    )
    simulate.add_argument("--trace", action="store_true", help="as JSON lines, for programs")
    simulate.set_defaults(handler=_simulate)


COMMANDS: Final = {"check": _add_check, "convert": _add_convert, "simulate": _add_simulate}


def _command(text: str) -> tuple[float, str, str | None]:
    moment, _, rest = text.partition(":")
    handler, _, graph = rest.partition(":")
    if handler not in _COMMANDS:
        raise ValueError
    return float(moment), handler, graph or None


def file_text(path: Path) -> bytes:
    """Return the content of the file `path`. Raise CannotStart if it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise CannotStart(f"Cannot read {path}: {error.strerror}.") from error


def refusal(name: Path | str, error: codec.Unreadable) -> str:
    """Return the line that says why the file `name` cannot be read, with the place of the fault."""
    within = f" at {error.path}" if error.path else ""
    return f"{name}:{error.line}:{error.column}: {error.message}{within}"


def _at(where: Where) -> str:
    """Return a place in words: line and column, then the JSON pointer if it is not the whole text."""
    return f"line {where.line}, column {where.column}{': ' if where.path else ''}{where.path}"


def _check(options: argparse.Namespace) -> int:
    facts = facts_for(options.facts) if options.facts else PINNED
    actions = actions_below(options.actions) if options.actions else None
    graphs = _library(options.graphs) if options.graphs else None
    if len(options.files) > 1:
        graphs = {**_given(options.files), **(graphs or {})}
    used = {action.name for graph in (graphs or {}).values() for action in graph.actions}
    verdicts = [_verdict(path, facts, actions, graphs, used) for path in options.files]
    if options.json:
        sys.stdout.write(msgspec.json.format(msgspec.json.encode(verdicts)).decode() + "\n")
    else:
        for verdict in verdicts:
            _print(verdict)
    bad = any(problem.severity == "error" for v in verdicts for problem in v.problems)
    return 1 if bad else 0


def _verdict(
    path: Path,
    facts: EngineFacts,
    actions: Mapping[str, Signature] | None,
    graphs: Mapping[str, Graph] | None,
    used: Collection[str],
) -> CheckVerdict:
    text = file_text(path)
    try:
        reading = codec.read(text)
        if reading.dialect in ACTION_DIALECTS:
            action = codec.read_action(text)
            found = checks.check_action(action)
            return CheckVerdict(str(path), action.dialect, tuple(found), action.remarks)
    except codec.Unreadable as error:
        where = Where(path=error.path, line=error.line, column=error.column)
        problem = Problem(code=error.code, severity="error", where=where, message=error.message)
        return CheckVerdict(str(path), None, (problem,))
    inside = reading.graph.name in used
    found = checks.check_reading(reading, actions, facts, graphs)
    found = [_as_sub_graph(problem) for problem in found if not (inside and problem.code == "H7")]
    found.sort(key=rank)
    return CheckVerdict(str(path), reading.dialect, tuple(dict.fromkeys(found)), reading.remarks)


def _as_sub_graph(problem: Problem) -> Problem:
    """Make the problem H7 (an entry action lacks a required value) a warning, and return others as
    they are: the file may be a sub-graph that gets its values from outside, though starting it by
    itself is refused."""
    if problem.code != "H7":
        return problem
    message = problem.message.removesuffix(" (As a sub-graph it may get one.)")
    message += " Unless it is used inside another graph: check it together with that one."
    return msgspec.structs.replace(problem, severity="warning", message=message)


def _given(paths: Sequence[Path]) -> dict[str, Graph]:
    """Return the graphs in the files `paths` by graph name, since one may be a sub-graph of
    another. Files that cannot be read as a graph are skipped; of several graphs of one name, the
    first counts. Raise CannotStart if a file cannot be opened."""
    found: dict[str, Graph] = {}
    for path in paths:
        try:
            reading = codec.read(file_text(path))
        except codec.Unreadable:
            continue  # reported when that file is checked
        if reading.dialect not in ACTION_DIALECTS and not checks.refused_by_parser(reading):
            found.setdefault(reading.graph.name, reading.graph)
    return found


def _print(verdict: CheckVerdict) -> None:
    errors = sum(problem.severity == "error" for problem in verdict.problems)
    warnings = sum(kind_word(problem) == "warning" for problem in verdict.problems)
    read = verdict.dialect or "unreadable"
    print(one_line(f"{verdict.file}: {read}, {errors} errors, {warnings} warnings"))
    for problem in verdict.problems:
        kind = f"{kind_word(problem)} {problem.code}"
        print(told(f"  {kind}: {problem.message} ({_at(problem.where)})"))
    for note in verdict.notes:
        print(told(f"  note: {note.sentence} ({_at(note.where)})"))


def kind_word(problem: Problem) -> str:
    """Return the first word of a line about a problem: `note` for a problem that nearly every graph
    has, else its severity."""
    return "note" if problem.code in QUIET else problem.severity


def _convert(options: argparse.Namespace) -> int:
    try:
        reading = codec.read(file_text(options.file))
    except codec.Unreadable as error:
        print(refusal(options.file, error), file=sys.stderr)
        return 1
    graph = reading.graph
    if options.examples:
        graph = _with_examples(options.file, graph)
    if options.through_document:
        graph = _through_document(graph)
    for note in reading.remarks:
        place = f"{options.file}:{note.where.line}:{note.where.column}"
        within = f" at {note.where.path}" if note.where.path else ""
        print(f"{place}: {note.sentence}{within}", file=sys.stderr)
    sys.stdout.write(codec.write(graph))
    return 0


def _with_examples(path: Path, graph: Graph) -> Graph:
    """Return the graph in which each input, for which the checks offer to take its declared example
    as value, has this value. Print the names of the inputs to stderr. `path`: the file of the
    graph, printed before each name."""
    offered = [problem for problem in checks.check(graph) if problem.fix == "take-example"]
    for problem in offered:
        name = problem.where.path.partition("/input_parameters/")[2].replace("/", "::")
        print(f"{path}: The example of “{name}” became its value.", file=sys.stderr)
    return with_examples(graph, offered)


def _through_document(graph: Graph) -> Graph:
    from pycrdt import Doc

    from action_assistant.editor.documents import document

    first: Doc[Any] = Doc()
    document.fill(first, graph)
    second: Doc[Any] = Doc()
    second.apply_update(first.get_update())
    return document.read(second)


def _simulate(options: argparse.Namespace) -> int:
    try:
        reading = codec.read(file_text(options.file))
        if refusals := checks.refused_by_parser(reading):
            _print_refusals(options.file, refusals)
            return 1
        actions = actions_below(options.actions) if options.actions else None
        cut_off = None
        for event in _trace(options, reading, actions):
            _report(event, as_json=options.trace)
            if isinstance(event, semantics.HazardEvent) and event.code == "refused":
                _print_unknown(options, reading, actions)
            if isinstance(event, semantics.HazardEvent) and event.code == semantics.CUT_OFF:
                cut_off = event
    except codec.Unreadable as error:
        print(refusal(options.file, error), file=sys.stderr)
        return 1
    if cut_off is None:
        return 0
    print(f"{options.file}: {cut_off.message}", file=sys.stderr)
    return 1


def _trace(
    options: argparse.Namespace, reading: codec.Reading, actions: Mapping[str, Signature] | None
) -> Iterator[semantics.Trace]:
    script = _script(options.script) if options.script else semantics.Script({})
    asked = {
        "script": script,
        "library": _library(options.graphs),
        "commands": options.at,
        "until_ms": options.seconds * 1000,
        "max_events": _EVENTS,
        "states": reading.states,
        "signatures": actions,
    }
    if options.behaviours is None:
        return semantics.simulate(reading.graph, facts=SIMULATED, **asked)
    from action_assistant.runner.links.behaviours.folder import BehaviourFolder
    from action_assistant.runner.links.behaviours.real_time import simulate_in_real_time

    folder = BehaviourFolder.opened(options.behaviours)
    return simulate_in_real_time(reading.graph, folder, **asked)


def _print_unknown(
    options: argparse.Namespace, reading: codec.Reading, actions: Mapping[str, Signature] | None
) -> None:
    """Print which actions the engine lacks, or has with other parameters, since its refusal does
    not name them. `reading`: the file as read; `actions`: those of the engine, None if unknown."""
    for problem in checks.check_reading(reading, actions, graphs=_library(options.graphs)):
        if problem.code in {"unknown-action", "signature"}:
            print(f"{options.file}: {problem.message} ({_at(problem.where)})", file=sys.stderr)


def _print_refusals(path: Path, refusals: Sequence[Problem]) -> None:
    for problem in refusals:
        place = f"({_at(problem.where)})"
        print(f"{path}: the engine refuses it: {problem.message} {place}", file=sys.stderr)


def _script(path: Path) -> semantics.Script:
    try:
        return semantics.script_from(json.loads(file_text(path)))
    except ValueError as error:
        raise CannotStart(f"{path} is no script: {error}.") from error


def _library(folder: Path | None) -> Mapping[str, Graph]:
    """Return the graphs of all `*graph.json` below a folder, by name, as the engine indexes them."""
    found: dict[str, Graph] = {}
    for path in sorted(folder.rglob("*graph.json")) if folder else ():
        try:
            reading = codec.read(file_text(path))
        except codec.Unreadable as error:
            print(f"left out {refusal(path, error)}", file=sys.stderr)
            continue
        if refusals := checks.refused_by_parser(reading):
            print(f"left out {path}: {refusals[0].message}", file=sys.stderr)
            continue
        found.setdefault(reading.graph.name, reading.graph)
    return found


def actions_below(folder: Path) -> Mapping[str, Signature]:
    """Return the signatures of a folder's actions by name. Only files `*umrf.json` are read, as
    engines do."""
    found: dict[str, Signature] = {}
    for path in sorted(folder.rglob("*umrf.json")):
        try:
            reading = codec.read_action(file_text(path))
        except codec.Unreadable as error:
            print(f"left out {refusal(path, error)}", file=sys.stderr)
            continue
        found.setdefault(reading.action.name, signature_of(reading.action))
    return found


def _report(event: semantics.Trace, *, as_json: bool) -> None:
    if isinstance(event, semantics.NodeResultEvent):
        # Only the simulator knows what an action answered; an engine does not send it.
        if event.message and not as_json:
            said = f"{event.graph}  {event.node} says: {event.message}"
            print(one_line(f"{event.t_ms / 1000:10.3f} s  {said}"))
        return
    if as_json:
        print(msgspec.json.encode(event).decode())
        return
    match event:
        case semantics.NodeStateEvent(t_ms=at, graph=graph, node=node, state=state, actor=actor):
            who = f"{node} ({actor})" if actor else node
            print(told(f"{at / 1000:10.3f} s  {graph}  {who}: {state}"))
        case semantics.GraphStateEvent(t_ms=at, graph=graph, state=state):
            print(told(f"{at / 1000:10.3f} s  {graph}: {state}"))
        case semantics.GraphResultEvent(t_ms=at, graph=graph, value=value):
            print(told(f"{at / 1000:10.3f} s  {graph} ends with {value}"))
        case semantics.HazardEvent(t_ms=at, graph=graph, code=code, node=node, message=message):
            who = f"  {node}" if node else ""
            print(told(f"{at / 1000:10.3f} s  {graph}{who}: hazard {code}: {message}"))
        case _:
            pass
