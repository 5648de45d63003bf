"""The views of a run that pages and programs get (docs/contracts.md 4)."""

from collections.abc import Iterable, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any, Final, TypeVar

import msgspec
from msgspec.structs import replace
from sqlalchemy import Row

from action_assistant.kit.moments import moment
from action_assistant.runner.links.observations import LogLevel
from action_assistant.runner.runs.counts import VisitCount, visit_counts
from action_assistant.runner.runs.course_bar import CoursePart, stored_course
from action_assistant.runner.runs.durations import DurationBounds, of_run
from action_assistant.runner.runs.earlier_views import (
    EarlierShown,
    StartFromShown,
    earlier_view,
    start_from_view,
)
from action_assistant.runner.runs.events import (
    AtRest,
    Author,
    HeldHow,
    Overridden,
    Override,
    PartOfRepeat,
)
from action_assistant.runner.runs.page_presence import PagePresence
from action_assistant.runner.runs.question_views import (
    AnswerShown,
    PauseShown,
    QuestionShown,
    answers_by_visit,
    pauses_of,
    questions_of,
)
from action_assistant.runner.runs.rest_views import AT_REST as AT_REST
from action_assistant.runner.runs.rest_views import RobotRestShown as RobotRestShown
from action_assistant.runner.runs.rest_views import rests_of as rests_of
from action_assistant.runner.runs.run import Answer, Desired, Result, Run, Said, State
from action_assistant.runner.runs.sent_graphs import Sent, SubgraphShown, subgraphs_shown
from action_assistant.runner.runs.sight import HIDDEN_NAME
from action_assistant.runner.runs.visits import ActionRun, How, Outcome, Visit
from action_assistant.safe_text import hold_names, sentence
from action_assistant.umrf.breakpoints import Breakpoint
from action_assistant.umrf.json.text import UmrfGraph
from action_assistant.umrf.limits import Limit
from action_assistant.umrf.start_values import StartValues

_LIVE: Final = 3_000  # visits in one live message, over all actions
_WHOLE: Final = 20_000
_LINES: Final = 20  # of the engine's log in one live message
#: Fields of a summary that a run and its row in the table have under the same names; of these, times.
_SAME: Final = (
    "id",
    "number",
    "graph",
    "graph_name",
    "version",
    "digest",
    "engine",
    "simulated",
    "state",
    "desired",
    "result",
)
_SAME_TIMES: Final = ("requested_at", "started_at", "ended_at")
#: The texts of alarms that everybody is shown, whatever they may see of the run.
_LOOKS: Final = {
    "stop_unconfirmed": "STOP UNCONFIRMED: look at the robot.",
    "moves_again": "MOVES AGAIN: look at the robot.",
}
_UNPROVEN: Final = "it is not proven that nothing moves: look at the robot"
#: The fields that a reader who may not see the graph of a run gets without their content.
_BLANK: Final[dict[str, Any]] = {
    "hidden": True,
    "graph": None,
    "graph_name": HIDDEN_NAME,
    "version": None,
    "digest": "",
    "result": None,
    "took": None,
    "detail": "",
    "held": None,
    "breakpoints": msgspec.UNSET,
    "lead": msgspec.UNSET,
    "batons": msgspec.UNSET,
    "values": msgspec.UNSET,
    "sent_digest": msgspec.UNSET,
    "start_from": msgspec.UNSET,
    "people": msgspec.UNSET,
    "questions": msgspec.UNSET,
    "pauses": msgspec.UNSET,
    "repeat": msgspec.UNSET,
    "earlier": None,
    "cause": "",
    "pinned": False,
    "note": "",
    "labels": [],
    "course": (),
    "archived": None,
    "like": None,
    "behaviours": False,
    "actions": {},
    "log": [],
    "umrf": msgspec.Raw(b"{}"),
    "override": None,
    "sent": {},
    "despite": [],
    "subgraphs": [],
    "tree_digest": None,
}
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


class VisitShown(msgspec.Struct, frozen=True, rename={"start": "from"}):
    """One visit of an action. It began between `not_before` and `from`, and ended between `until`
    (null: no end was seen) and `not_after` (null: it may still be running). If `until` is before
    `from`, there is no time at which it ran for certain. `inputs`: the values that the engine
    reported, by flat name, as JSON texts (a long one is cut and ends with an ellipsis); null if
    none were seen; `outputs`: likewise those that it gave, where an answer could show them. In a
    led run, `robot`: the engine that played it ("people", or "runner" for a wait); `said`: the person who
    stated the result, where no answer has shown it; `answered`: the person who was asked, with the
    answer."""

    start: datetime
    not_before: datetime
    not_after: datetime | None
    until: datetime | None
    result: Outcome | None
    how: How
    inputs: dict[str, str] | None = None
    robot: str | msgspec.UnsetType = msgspec.UNSET
    said: "SaidShown | msgspec.UnsetType" = msgspec.UNSET
    outputs: dict[str, str] | msgspec.UnsetType = msgspec.UNSET
    answered: AnswerShown | msgspec.UnsetType = msgspec.UNSET


class SaidShown(msgspec.Struct, frozen=True):
    """A person's statement of the result of a visit that no answer has shown."""

    by: Author
    at: datetime
    reason: str


class MessageShown(msgspec.Struct, frozen=True, omit_defaults=True):
    """A message of an action, or a line of the engine's log. `level`: of a line; left out if it is not
    known, as in runs of earlier versions."""

    at: datetime
    text: str
    level: LogLevel = ""


class ActionShown(msgspec.Struct, frozen=True, omit_defaults=True):
    """One action of a run. It ran `count` times; with `at_least` perhaps more often, since visits
    may have been missed. `visits` are the newest ones; `older`: how many are not listed. `robot`:
    the engine that plays it in a led run; `piece`: the id of the run of its newest piece;
    `asks`: it has ended without an outcome, which a person has to give; `levels`: the opened sub-graphs
    that it is inside of, the outermost first."""

    aid: str | None
    state: str
    visits: list[VisitShown]
    older: int
    messages: list[MessageShown]
    count: int = 0
    at_least: bool = False
    robot: str = ""
    piece: str = ""
    asks: bool = False
    levels: tuple[str, ...] = ()


class AlarmShown(msgspec.Struct, frozen=True):
    """A message that a person must see now."""

    code: str
    at: datetime
    text: str

    def __post_init__(self) -> None:
        hold_names(self, "text")


class AtRestShown(msgspec.Struct, frozen=True):
    """The observation that a run is at rest, where no answer of the engine could prove it: by whom
    (null: the runner saw the engine's process end), when, and how."""

    by: Author | None
    at: datetime
    how: str


class NextShown(msgspec.Struct, frozen=True):
    """An action (by its full name) that is ready to begin, and its robot."""

    action: str
    robot: str


class HeldShown(msgspec.Struct, frozen=True, omit_defaults=True):
    """The hold of a led run, which begins nothing further: by whom (null: by the runner), why, and
    since when. `how`: by a fault, by a person, after a step, or at a breakpoint; `next`: the actions
    that wait to begin, the one that has waited longest first."""

    by: Author | None
    why: str
    since: datetime
    how: HeldHow = "trouble"
    next: tuple[NextShown, ...] = ()

    def __post_init__(self) -> None:
        hold_names(self, "why")


class RunSummary(msgspec.Struct, frozen=True, kw_only=True, rename={"start_from": "from"}):
    """A run as lists show it. `took`: the time from `started_at` until nothing was seen moving any
    more, which is before the proof at `ended_at`; null if unknown. `robots`: of a led run, the
    engine of each actor, "" being the actor of actions that name none; `held`: why it begins nothing
    further; `breakpoints`: where it waits; `lead`: who let it go on last, or was handed it. `batons`: the robots whose baton `author`
    held at the start; `watching`: those that they said to watch. `hidden`: the
    reader may not see its graph, so that little else is given. `values`: those that were given at the
    start, by action and input; `digest` is that of the version, `sent_digest` that of the graph with
    them, which was sent, or of the part that was. `from`: where it began, if not at the entry. `people`: who answers
    the questions of each actor; `questions`: those that are open; `pauses`: the actions for which the runner
    waits; `repeat`: of which repeat it is a cell."""

    id: str
    number: int
    graph: str | None
    graph_name: str
    version: str | None
    digest: str
    engine: str
    simulated: bool
    author: Author
    state: State
    desired: Desired
    result: Result | None
    proof_at: datetime | None
    unknown_since: datetime | None
    unconfirmed: str | None
    at_rest: AtRestShown | None
    moves_again_at: datetime | None
    group: str | None
    requested_at: datetime
    started_at: datetime | None
    ended_at: datetime | None
    took: DurationBounds | None
    stopped_by: Author | None
    detail: str
    alarms: list[AlarmShown]
    recorded: bool
    robots: dict[str, str] | None = None
    held: HeldShown | None = None
    breakpoints: tuple[Breakpoint, ...] | msgspec.UnsetType = msgspec.UNSET
    lead: Author | msgspec.UnsetType = msgspec.UNSET
    batons: tuple[str, ...] | msgspec.UnsetType = msgspec.UNSET
    watching: tuple[str, ...] | msgspec.UnsetType = msgspec.UNSET
    hidden: bool | msgspec.UnsetType = msgspec.UNSET
    values: StartValues | msgspec.UnsetType = msgspec.UNSET
    sent_digest: str | msgspec.UnsetType = msgspec.UNSET
    start_from: StartFromShown | msgspec.UnsetType = msgspec.UNSET
    people: dict[str, str] | msgspec.UnsetType = msgspec.UNSET
    questions: list[QuestionShown] | msgspec.UnsetType = msgspec.UNSET
    pauses: list[PauseShown] | msgspec.UnsetType = msgspec.UNSET
    repeat: PartOfRepeat | msgspec.UnsetType = msgspec.UNSET

    def __post_init__(self) -> None:
        hold_names(self, "unconfirmed", "detail")


SummaryT = TypeVar("SummaryT", bound=RunSummary)


class ArchivePlace(msgspec.Struct, frozen=True):
    """The archive of a run: the run's number, when it was archived (microseconds UTC), and the path
    of the file in the folder of archives."""

    number: int
    archived_at: int
    archived_as: str


class ArchivedShown(msgspec.Struct, frozen=True):
    """The time at which the events of a run were moved to an archive, and its file in the folder of
    archives."""

    at: datetime
    file: str


class Listed(RunSummary, frozen=True, kw_only=True):
    """A run of the list, with the marks that people gave it. `cause`: one sentence why it did not
    end well, "" if unknown; `course`: its time in parts, empty until it is over and summed up."""

    cause: str
    pinned: bool
    note: str
    labels: list[str]
    archived: ArchivedShown | None
    course: tuple[CoursePart, ...] = ()


class RunShown(RunSummary, frozen=True, kw_only=True):
    """A run with its actions, by full name, and the newest lines of its engine's log. `like`: the
    robot whose engine the simulator plays; `behaviours`: whether its actions have Python
    behaviours; `rests`: of a led run, how far each robot is proven to be at rest."""

    like: str | None
    behaviours: bool
    actions: dict[str, ActionShown]
    log: list[MessageShown]
    rests: list[RobotRestShown] | msgspec.UnsetType = msgspec.UNSET


class RunWhole(RunShown, frozen=True, kw_only=True):
    """A run with the graph that was sent. `sent`: the values of its actions, by full name and flat
    name, written as in `inputs` of visits. `subgraphs`: all graphs inside that were sent along;
    `tree_digest`: of the graph together with them, null if the starter did not send it; `earlier`: what
    it takes for granted, null if it began at the entry; `limits`: those of its robots at the start,
    or at the last change of its graph; `pages`: the rules about visible pages at the start; `health`: a
    sentence for each thing that its robots reported then."""

    umrf: UmrfGraph
    override: Override | None
    sent: dict[str, dict[str, str]]
    despite: list[Overridden]
    archived: ArchivedShown | None
    subgraphs: list[SubgraphShown]
    tree_digest: str | None
    earlier: EarlierShown | None = None
    limits: dict[str, tuple[Limit, ...]] = {}
    pages: dict[str, PagePresence] = {}
    health: dict[str, tuple[str, ...]] = {}


class QueuedStart(msgspec.Struct, frozen=True):
    """A start that was put into the queue. `waits`: it is there still; else it was started, or removed."""

    entry: str
    waits: bool


class StartShown(msgspec.Struct, frozen=True, kw_only=True):
    """The state of a start. `under_way`: it is being carried out now; `queued`: the entry of the queue
    that it has become, whose run is one of `runs`. If all of them are empty, the start has not arrived
    here so far."""

    request_id: str
    under_way: bool
    runs: list[RunShown]
    queued: QueuedStart | None = None


def time(us: int) -> datetime:
    """Convert microseconds UTC to an aware datetime in UTC; see `kit/moments.py`."""
    return moment(us)


def microseconds(moment: datetime) -> int:
    """Convert a datetime to microseconds UTC; one without an offset counts as UTC."""
    aware = moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)
    return (aware - _EPOCH) // timedelta(microseconds=1)


def summary(run: Run, *, recorded: bool = True) -> RunSummary:
    """Return the view of a run without its actions. `recorded`: all of its events are stored."""
    return RunSummary(**_fields(run, recorded))


class ActionViewCache:
    """Caches the views of the actions of one run. Few actions change between two views, and a view
    is valid while its `ActionRun` is the same object."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[ActionRun, tuple[Any, ...], ActionShown]] = {}

    def action(self, run: Run, name: str, most: int, count: VisitCount) -> ActionShown:
        """Return the view of the action `name` of a run with at most `most` of its newest visits.
        `count`: how often it ran."""
        action, said = run.actions[name], run.said.get(name, ())
        answers = run.answers.get(name, ())
        asks = any(each.node == name and each.asks for each in run.rests.values())
        rest = (most, count, said, answers, asks)
        known = self._known.get(name)
        if known is not None and known[0] is action and known[1] == rest:
            return known[2]
        found = _action_view(action, most, count, said, answers, asks=asks)
        self._known[name] = action, rest, found
        return found

    def prepare(self, run: Run, at_once: int) -> Iterator[None]:
        """Return an iterator that fills the cache for `run_view`, step by step: each step views
        `at_once` actions, so that the event loop can do other work in between."""
        most, counts = _most(run, _LIVE), visit_counts(run)
        for number, name in enumerate(run.actions, 1):
            self.action(run, name, most, counts[name])
            if number % at_once == 0:
                yield


def run_view(run: Run, *, recorded: bool = True, cache: ActionViewCache | None = None) -> RunShown:
    """Return the view of a run with its actions and their newest visits, as live messages carry it.
    `recorded`: all of its events are stored; `cache`: reuses the views of unchanged actions."""
    return RunShown(
        **_fields(run, recorded),
        like=run.like,
        behaviours=run.behaviours,
        actions=_actions(run, _LIVE, cache),
        log=_log(run, _LINES),
        rests=msgspec.UNSET if run.led is None else rests_of(run),
    )


def whole_view(
    run: Run,
    graph: Sent,
    *,
    recorded: bool = True,
    place: ArchivePlace | Row[Any] | None = None,
    cache: ActionViewCache | None = None,
) -> RunWhole:
    """Return the view of a run with its graph and all visits; with a `cache`, with as many visits
    as `run_view`. `recorded`: all of its events are stored; `place`: the run's archive, or a row
    with it; None if its events are in the journal."""
    actions = _actions(run, _WHOLE if cache is None else _LIVE, cache)
    return RunWhole(
        **_fields(run, recorded),
        like=run.like,
        behaviours=run.behaviours,
        actions=actions,
        log=_log(run, len(run.log)),
        rests=msgspec.UNSET if run.led is None else rests_of(run),
        umrf=msgspec.Raw(graph.umrf.encode()),
        override=run.override,
        despite=list(run.despite),
        sent=graph.values,
        archived=archived(place),
        subgraphs=subgraphs_shown(graph.subgraphs),
        tree_digest=graph.tree_digest,
        earlier=None if run.earlier is None else earlier_view(run.earlier, run.start_from),
        limits=run.limits,
        pages=run.pages,
        health={
            robot: tuple(sentence(each.sentence()) for each in found)
            for robot, found in run.health.items()
        },
    )


def summary_of_row(row: Row[Any]) -> RunSummary:
    """Return the summary of a run that is over, from its row. It equals `summary` of the run, but that
    `took` is null until the run has been summed up."""
    more = row.summary
    stopped_by, took, at_rest = more.get("stopped_by"), more.get("took"), more.get("at_rest")
    return RunSummary(
        **_fields_of_row_and_run(row),
        author=Author(row.author_id, row.author_name),
        proof_at=_time(more.get("proof_at")),
        unknown_since=_time(more.get("unknown_since")) if row.state == "lost" else None,
        unconfirmed=None,
        at_rest=_at_rest(msgspec.convert(at_rest, AtRest) if at_rest else None),
        moves_again_at=None,
        group=more.get("group"),
        took=DurationBounds(least=took["least"], most=took["most"]) if took else None,
        stopped_by=Author(**stopped_by) if stopped_by else None,
        detail=more.get("detail", ""),
        alarms=[
            AlarmShown(each["code"], time(each["at"]), each["text"]) for each in more["alarms"]
        ],
        recorded=True,
        robots=more.get("robots"),
        batons=tuple(more["batons"]) if "batons" in more else msgspec.UNSET,
        watching=tuple(more["watching"]) if "watching" in more else msgspec.UNSET,
        repeat=msgspec.convert(more["repeat"], PartOfRepeat) if "repeat" in more else msgspec.UNSET,
        values=msgspec.convert(more["values"], StartValues) if "values" in more else msgspec.UNSET,
        sent_digest=more.get("sent_digest") or msgspec.UNSET,
        start_from=msgspec.convert(more["from"], StartFromShown)
        if "from" in more
        else msgspec.UNSET,
    )


def hidden(shown: SummaryT) -> SummaryT:
    """Return the view of a run for a reader who may not see its graph: its robots and their rest, its
    state, the persons who started and stopped it, and alarms that ask to look at a robot."""
    values: dict[str, Any] = {
        **_BLANK,
        "unconfirmed": None if shown.unconfirmed is None else _UNPROVEN,
        "at_rest": None if shown.at_rest is None else replace(shown.at_rest, how=""),
        "alarms": [
            AlarmShown(each.code, each.at, _LOOKS[each.code])
            for each in shown.alarms
            if each.code in _LOOKS
        ],
        "robots": None if shown.robots is None else {each: each for each in shown.robots.values()},
    }
    if isinstance(shown, RunShown) and isinstance(shown.rests, list):
        values["rests"] = [
            RobotRestShown(each.robot, each.state, each.since, by=each.by, stops=each.stops)
            for each in shown.rests
        ]
    known = {name: value for name, value in values.items() if hasattr(shown, name)}
    return replace(shown, **known)


def with_newest_visits(run: Run) -> Run:
    """Return the run with only the newest visits of each action, as many as `run_view` shows. The
    removed visits are counted in the action's `older`."""
    most = _most(run, _LIVE)
    actions = {
        name: replace(
            each,
            visits=each.visits[-most:],
            older=each.older + len(each.visits) - len(each.visits[-most:]),
        )
        for name, each in run.actions.items()
    }
    return replace(run, actions=actions)


def list_entry(found: RunSummary, row: Row[Any], labels: list[str]) -> Listed:
    """Return a summary together with the marks (pin, note, cause) in the run's row and its
    `labels`."""
    fields = {name: getattr(found, name) for name in RunSummary.__struct_fields__}
    return Listed(
        **fields,
        cause=row.summary.get("cause", ""),
        pinned=bool(row.pinned),
        note=row.note or "",
        labels=labels,
        archived=archived(row),
        course=stored_course(row.summary.get("course", ())),
    )


def archived(row: ArchivePlace | Row[Any] | None) -> ArchivedShown | None:
    """Return when and where the events of a run were archived, from its row or its archive; None if
    they were not."""
    if row is None or row.archived_at is None:
        return None
    return ArchivedShown(time(row.archived_at), row.archived_as)


def _fields_of_row_and_run(source: Run | Row[Any]) -> dict[str, Any]:
    """Return the fields of a summary that a run and its row have under the same name."""
    plain = {name: getattr(source, name) for name in _SAME}
    return plain | {name: _time(getattr(source, name)) for name in _SAME_TIMES}


def _fields(run: Run, recorded: bool) -> dict[str, Any]:
    return {
        **_fields_of_row_and_run(run),
        "author": run.author,
        "proof_at": _time(run.proof_at),
        "unknown_since": _time(run.unknown_since),
        "unconfirmed": run.lost or run.doubt or None,
        "at_rest": _at_rest(run.at_rest),
        "moves_again_at": _time(run.moves_again_at),
        "group": run.group,
        "took": of_run(run),
        "stopped_by": run.stopped_by,
        "detail": run.detail or run.lost or run.doubt,
        "alarms": [AlarmShown(each.code, time(each.at), each.text) for each in run.alarms],
        "recorded": recorded,
        "robots": None if run.led is None else run.led.robots,
        "held": _held(run),
        "breakpoints": run.breakpoints or msgspec.UNSET,
        "lead": run.lead or msgspec.UNSET,
        "batons": run.batons or msgspec.UNSET,
        "watching": run.watching or msgspec.UNSET,
        "people": (run.led and run.led.people) or msgspec.UNSET,
        "questions": questions_of(run) or msgspec.UNSET,
        "pauses": pauses_of(run) or msgspec.UNSET,
        "repeat": run.repeat or msgspec.UNSET,
        "values": run.values or msgspec.UNSET,
        "sent_digest": run.sent_digest or msgspec.UNSET,
        "start_from": msgspec.UNSET
        if run.start_from is None
        else start_from_view(run.start_from, run.earlier),
    }


def _held(run: Run) -> HeldShown | None:
    held = run.held
    if held is None:
        return None
    ready = tuple(NextShown(*run.waits[call]) for call in sorted(run.waits))
    return HeldShown(held.by, held.why, time(held.at), held.how, ready)


def _at_rest(seen: AtRest | None) -> AtRestShown | None:
    return None if seen is None else AtRestShown(seen.by, time(seen.at), seen.how)


def visit_view(
    each: Visit,
    robot: str = "",
    said: SaidShown | msgspec.UnsetType = msgspec.UNSET,
    answered: AnswerShown | msgspec.UnsetType = msgspec.UNSET,
) -> VisitShown:
    """Return the view of one visit, with its times as datetimes. `robot`: the engine that played it
    in a led run; `said`: the person who stated its result; `answered`: the one who was asked."""
    return VisitShown(
        time(each.start),
        time(each.not_before),
        _time(each.not_after),
        _time(each.until),
        each.result,
        each.how,
        each.inputs,
        robot or msgspec.UNSET,
        said,
        msgspec.UNSET if each.outputs is None else each.outputs,
        answered,
    )


def _most(run: Run, visits: int) -> int:
    """Return how many visits of each action a view of this run may have, so that all actions
    together have about `visits`: encoding them blocks the event loop."""
    return max(1, visits // max(1, len(run.actions)))


def _actions(run: Run, visits: int, cache: ActionViewCache | None = None) -> dict[str, ActionShown]:
    cache, most, counts = cache or ActionViewCache(), _most(run, visits), visit_counts(run)
    return {name: cache.action(run, name, most, counts[name]) for name in run.actions}


def words_for(said: Iterable[Said]) -> dict[int, SaidShown]:
    """Return the views of the results that persons stated, by the number of the visit, from 1."""
    return {each.visit: SaidShown(each.by, time(each.at), each.reason) for each in said}


def _action_view(
    action: ActionRun,
    most: int,
    count: VisitCount,
    said: Sequence[Said],
    answers: tuple[Answer, ...],
    *,
    asks: bool,
) -> ActionShown:
    words, answered = words_for(said), answers_by_visit(answers)
    first = action.older + len(action.visits) - len(action.visits[-most:]) + 1
    visits = [
        visit_view(
            each,
            action.robot,
            words.get(number, msgspec.UNSET),
            answered.get(number, msgspec.UNSET),
        )
        for number, each in enumerate(action.visits[-most:], first)
    ]
    messages = [MessageShown(time(each.at), each.text) for each in action.messages]
    older = action.older + len(action.visits) - len(visits)
    return ActionShown(
        action.aid,
        action.state,
        visits,
        older,
        messages,
        count.least,
        count.at_least,
        action.robot,
        action.piece,
        asks,
        action.levels,
    )


def _log(run: Run, most: int) -> list[MessageShown]:
    return [MessageShown(time(each.at), each.text, each.level) for each in run.log[-most:]]


def _time(us: int | None) -> datetime | None:
    return None if us is None else time(us)
