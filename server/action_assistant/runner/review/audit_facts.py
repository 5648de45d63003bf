"""The facts of the audit in the log of the runner: its events in words."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

import msgspec
from sqlalchemy import Connection, select

from action_assistant.journal.databases import ask_from_worker
from action_assistant.journal.events import Event
from action_assistant.runner.links.port import CONDUCTED
from action_assistant.runner.runs.events import AtRest, Author
from action_assistant.runner.runs.history import whole_of
from action_assistant.schema.runner_tables import run as runs
from action_assistant.web.audit import events as audit
from action_assistant.web.audit.facts import described
from action_assistant.web.audit.rows import (
    AuditFilter,
    AuditKind,
    AuditPage,
    AuditRow,
    Fact,
    audit_page,
)
from action_assistant.web.auth.caller import Origin
from action_assistant.web.auth.keys import PersonRef

#: Events that are no facts about people: most of the log.
_NEVER: Final = (
    *("run.observed.v1", "run.published.v1", "run.proof.v1", "run.silent.v1", "run.answered.v1"),
    *("run.engine_said.v1", "run.unconfirmed.v1", "run.loading.v1", "run.moves_again.v1"),
    *("run.piece_began.v1", "run.piece_seen.v1", "run.piece_rest.v1", "run.stop_sent.v1"),
    *("run.alarm_raised.v1", "run.modify_refused.v1", "run.summed_up.v1", "run.archived.v1"),
    *("robot.commanded.v1", "robot.engine_became.v1", "robot.stop_proven.v1"),
    *(
        "repeat.start_kept.v1",
        "queue.start_kept.v1",
        "queue.ready.v1",
        "robot.stop_unproven.v1",
        "robot.index_written.v1",
        "raw.archived.v1",
        "stream.removed.v1",
    ),
)
#: Authors that are no people: an arrow of a graph, or the runner itself, stops a step.
_NOBODY: Final = frozenset({"graph", "runner"})
_MOST: Final = 20_000  # rows of one list
_OUTCOMES: Final = {"on_true": "true", "on_false": "false", "on_error": "error"}


class _PersonBody(msgspec.Struct, frozen=True):
    id: str = ""
    name: str = ""


class _Led(msgspec.Struct, frozen=True):
    robots: dict[str, str] = {}


class _Body(msgspec.Struct, frozen=True):
    """The fields of bodies that stand in sentences."""

    author: Author | None = None
    by: Author | int | None = None  # a number in events of the program itself
    at_rest: AtRest | None = None
    led: _Led | bool | None = None  # of a start; of a registration, whether the robot may be led
    number: int | None = None
    request_id: str = ""
    graph: str | None = None
    graph_name: str = ""
    engine: str = ""
    simulated: bool = False
    why: str = ""
    text: str = ""
    reason: str = ""
    node: str = ""
    outcome: str = ""
    how: str = ""
    step: str = ""
    until: str | int = ""  # a number where the runner waits until a time
    name: str = ""
    robot: str = ""
    folder: str = ""
    version: str = ""
    proof_us: int | None = None
    saw_it_stop: bool = False
    hardware_stop: bool = False
    holder: _PersonBody | None = None
    to: _PersonBody | str | None = None  # the id of who is asked, in a question


#: What the events say, after the name of the person; fields of the body, and `run`, in braces.
_SAID: Final[Mapping[str, tuple[AuditKind, str]]] = {
    "run.pause_requested.v1": ("starts", "paused {run}"),
    "run.resume_requested.v1": ("starts", "let the paused {run} go on"),
    "run.modify_requested.v1": ("starts", "gave {run} another version of its graph"),
    "run.stop_requested.v1": ("stops", "pressed Stop of {run}"),
    "run.breakpoints_set.v1": ("starts", "set the breakpoints of {run}"),
    "run.released.v1": ("starts", "let the held {run} go on"),
    "run.marked.v1": ("starts", "marked {run}"),
    "run.noted.v1": ("starts", "wrote a note at a moment of {run}"),
    "run.incident_kept.v1": ("starts", "keeps {run} as an incident"),
    "expectation.saved.v1": ("starts", "saved the expected course {name}"),
    "expectation.retired.v1": ("starts", "removed the expected course {name}"),
    "robot.registered.v1": ("robots", "registered {robot}, or changed its registration"),
    "robot.removed.v1": ("robots", "removed {robot} from the registry"),
    "robot.stop_asked.v1": (
        "stops",
        "pressed Stop of {graph} on {robot}, which somebody else started",
    ),
    "robot.index_write_asked.v1": ("robots", "wrote graphs into the index folder of {robot}"),
    "robot.rights_set.v1": ("robots", "set the rules of {robot}"),
    "robot.locked.v1": ("robots", "took {robot} out of service: {reason}"),
    "robot.unlocked.v1": ("robots", "put {robot} into service again"),
    "repeat.opened.v1": ("starts", "opened a repeat of {graph_name}"),
    "repeat.reopened.v1": ("starts", "opened a repeat again after a look"),
    "repeat.closed.v1": ("starts", "closed a repeat: {text}"),
    "queue.entered.v1": ("starts", "put a start of {graph_name} into the queue"),
    "queue.moved.v1": ("starts", "moved a start in the queue"),
    "queue.left.v1": ("starts", "removed a start from the queue"),
    "queue.closed.v1": ("starts", "closed the queue of {robot}: {text}"),
    "queue.opened.v1": ("starts", "opened the queue of {robot} again after a look"),
    "approval.given.v1": ("starts", "said yes to the graph of a start"),
    "engine.indexes_once.v1": ("robots", "said that the engine of {robot} indexes once: {reason}"),
}
_BATON: Final[Mapping[str, str]] = {
    "taken": "took the baton of {robot}",
    "handed": "handed the baton of {robot} to {holder}",
    "forced": "took over the baton of {robot}: {reason}",
    "dropped": "gave the baton of {robot} back",
    "off": "gave the baton of {robot} back",
    "fell": "lost the baton of {robot}",
}


class _Known(msgspec.Struct, frozen=True):
    """A run, as its row in the table names it."""

    number: int | None
    graph: str
    graph_name: str
    robots: tuple[str, ...]


class RunnerFacts:
    """Says the events of the runner's log in words. Reads runs over a connection, each once."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._runs: dict[str, _Known] = {}

    def describe(self, event: Event) -> Fact | None:
        """Return an event in words; None for events that are no facts about people. Raise
        msgspec.DecodeError for a body that cannot be read."""
        if audit.is_audit(event.stream):
            return described(event)
        body = msgspec.json.decode(event.body, type=_Body) if event.body else _Body()
        author = _author(body)
        if author is not None and author.id in _NOBODY:
            return None
        fact = self._fact(event, body)
        if fact is None or author is None:
            return fact
        known = Origin(author.name, address=author.address) if author.by else None
        return msgspec.structs.replace(fact, person=PersonRef(author.id, author.name), origin=known)

    def _fact(self, event: Event, body: _Body) -> Fact | None:
        kind, _, about = event.stream.partition("/")
        run = about.removeprefix("run/") if kind in {"run", "about"} else ""
        whole = whole_of(run) or run
        is_piece = whole != run
        match event.kind:
            case "run.requested.v1":
                # Imported runs were not started by people of this runner.
                if is_piece or body.request_id.startswith("example/"):
                    return None
                return _started(run, body)
            case "run.stop_requested.v1" if is_piece:
                return None  # its run has the Stop
            case "run.ended.v1":
                if body.at_rest is None or body.at_rest.by is None:
                    return None
                return self._about_run(whole, "starts", f"saw {{run}} at rest: {body.at_rest.how}")
            case "run.piece_ended.v1":
                if body.how != "word" or body.by is None:
                    return None
                outcome = _OUTCOMES.get(body.outcome, body.outcome)
                text = f"said that {body.node} in {{run}} ended {outcome}: {body.reason}"
                return self._about_run(whole, "starts", text)
            case "run.question_answered.v1" | "run.answer_refused.v1":
                late = " too late" if event.kind == "run.answer_refused.v1" else ""
                text = f"answered {body.node} in {{run}}{late}"
                return self._about_run(whole, "starts", text)
            case "repeat.closed.v1" | "queue.closed.v1" | "queue.left.v1" if body.by is None:
                return None  # the runner did it by itself
            case "run.handed_over.v1":
                to = body.to.name if isinstance(body.to, _PersonBody) else ""
                return self._about_run(whole, "robots", f"handed {{run}} over to {to}")
            case "run.held.v1":
                if body.by is None:
                    return None
                if body.how == "wait":
                    because = f": {body.reason}" if body.reason else ""
                    return self._about_run(whole, "starts", f"made {{run}} wait{because}")
                if body.how:
                    return None  # the step before it is the press of a person
                return self._about_run(whole, "starts", f"held {{run}}: {body.why}")
            case "run.released.v1" if body.step or body.until:
                limit = f"one step: {body.step}" if body.step else f"steps until {body.until}"
                return self._about_run(whole, "starts", f"let {{run}} make {limit}")
            case "robot.drilled.v1":
                passed = body.proof_us is not None and body.saw_it_stop and body.hardware_stop
                how = "it passed" if passed else "it failed"
                sentence = f"recorded a Stop drill of {{robot}} with run {body.number}: {how}"
            case "robot.baton_passed.v1":
                if body.author is None:
                    return None
                sentence = _BATON.get(body.how, "passed the baton of {robot}")
            case _:
                known = _SAID.get(event.kind)
                if known is None:
                    return None
                audit_kind, sentence = known
                if whole:
                    return self._about_run(whole, audit_kind, sentence)
                return _about_robot(audit_kind, sentence, about, body)
        return _about_robot("robots", sentence, about, body)

    def _about_run(self, run: str, kind: AuditKind, sentence: str) -> Fact:
        known = self._run(run)
        of = f" of {known.graph_name}" if known.graph_name else ""
        words = f"run {known.number}{of}" if known.number is not None else f"the run {run}"
        return Fact(
            kind=kind,
            text=sentence.replace("{run}", words),
            graph=known.graph,
            graph_name=known.graph_name,
            run=run,
            run_number=known.number,
            robots=known.robots,
        )

    def _run(self, run: str) -> _Known:
        if run not in self._runs:
            columns = (
                runs.c.number,
                runs.c.graph,
                runs.c.graph_name,
                runs.c.engine,
                runs.c.summary,
            )
            row = self._connection.execute(select(*columns).where(runs.c.id == run)).first()
            if row is None:
                self._runs[run] = _Known(None, "", "", ())
            else:
                led = tuple(dict.fromkeys((row.summary.get("robots") or {}).values()))
                robots = led if row.engine == CONDUCTED else (row.engine,)
                self._runs[run] = _Known(row.number, row.graph or "", row.graph_name, robots)
        return self._runs[run]


def _author(body: _Body) -> Author | None:
    by = body.by if isinstance(body.by, Author) else None
    return body.author or by or (body.at_rest.by if body.at_rest is not None else None)


def _started(run: str, body: _Body) -> Fact:
    led = body.led.robots.values() if isinstance(body.led, _Led) else ()
    robots = tuple(dict.fromkeys(led)) or (body.engine,)
    where = "in the simulator" if body.simulated else f"on {', '.join(robots)}"
    return Fact(
        kind="starts",
        text=f"started run {body.number} of {body.graph_name} {where}",
        graph=body.graph or "",
        graph_name=body.graph_name,
        run=run,
        run_number=body.number,
        robots=robots,
    )


def _about_robot(kind: AuditKind, sentence: str, about: str, body: _Body) -> Fact:
    robot = about or body.robot or body.name
    is_of_graph = "{graph_name}" in sentence
    words = {
        "robot": robot,
        "name": body.name,
        "reason": body.reason,
        "graph": body.graph or "",
        "graph_name": body.graph_name,
        "text": body.text,
        "holder": body.holder.name if body.holder is not None else "",
    }
    of_robot = "{robot}" in sentence
    return Fact(
        kind=kind,
        text=sentence.format_map(words),
        graph=(body.graph or "") if is_of_graph else "",
        graph_name=body.graph_name if is_of_graph else "",
        robots=(robot,) if of_robot else (),
    )


def page(wanted: AuditFilter, connection: Connection) -> AuditPage:
    """Return a page of the audit of the runner."""
    return audit_page(connection, "runner", wanted, RunnerFacts(connection).describe, _NEVER)


def page_in_worker(address: str, wanted: AuditFilter) -> bytes:
    """Return a page of the audit as JSON. `address`: the URL of the runner's database. For workers.
    Raise Unavailable if it cannot be read."""
    question: Callable[[Connection], AuditPage] = partial(page, wanted)
    return msgspec.json.encode(ask_from_worker(address, question))


def rows_in_worker(address: str, wanted: AuditFilter) -> bytes:
    """Return the newest `_MOST` rows of the audit of the runner as a JSON list. `address`: the URL of
    the runner's database. For workers. Raise Unavailable if it cannot be read."""

    def rows(connection: Connection) -> list[AuditRow]:
        found: list[AuditRow] = []
        before: int | None = None
        while len(found) < _MOST:
            now = page(msgspec.structs.replace(wanted, before=before), connection)
            found += now.rows
            before = now.before
            if before is None:
                break
        return found

    return msgspec.json.encode(ask_from_worker(address, rows))
