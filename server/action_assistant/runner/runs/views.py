"""The views of a run that pages and programs get (docs/contracts.md 4)."""

from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any, Final

import msgspec
from msgspec.structs import replace
from sqlalchemy import Row

from action_assistant.runner.runs.counts import VisitCount, visit_counts
from action_assistant.runner.runs.durations import Took, of_run
from action_assistant.runner.runs.events import AtRest, Author, Overridden, Override
from action_assistant.runner.runs.run import Desired, Result, Run, State
from action_assistant.runner.runs.sent_graphs import Sent, SubgraphShown, subgraphs_shown
from action_assistant.runner.runs.visits import ActionRun, How, Outcome, Visit
from action_assistant.safe_text import hold_names
from action_assistant.umrf.json.embedded import UmrfGraph

_LIVE: Final = 3_000  # visits in one live message, over all actions
_WHOLE: Final = 20_000
_LINES: Final = 20  # of the engine's log in one live message
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


class VisitShown(msgspec.Struct, frozen=True, rename={"start": "from"}):
    """One visit of an action. It began between `not_before` and `from`, and ended between `until`
    (null: no end was seen) and `not_after` (null: it may go on still); where `until` lies before
    `from`, no moment is known at which it went on for certain. `inputs`: values that the engine
    reported for it, by flat name, as JSON texts (a long one is cut and ends with an ellipsis); null
    when nobody saw them."""

    start: datetime
    not_before: datetime
    not_after: datetime | None
    until: datetime | None
    result: Outcome | None
    how: How
    inputs: dict[str, str] | None = None


class MessageShown(msgspec.Struct, frozen=True):
    """What an action had to say."""

    at: datetime
    text: str


class ActionShown(msgspec.Struct, frozen=True, omit_defaults=True):
    """One action of a run. `older` visits are not listed. It ran `count` times; `at_least`: or more
    often, since visits of it may have been missed."""

    aid: str | None
    state: str
    visits: list[VisitShown]
    older: int
    messages: list[MessageShown]
    count: int = 0
    at_least: bool = False


class AlarmShown(msgspec.Struct, frozen=True):
    """Something that a person must know now."""

    code: str
    at: datetime
    text: str

    def __post_init__(self) -> None:
        hold_names(self, "text")


class AtRestShown(msgspec.Struct, frozen=True):
    """How rest was seen where no answer of the engine could prove it: by whom (null: the runner saw the
    engine's process end), when, and how."""

    by: Author | None
    at: datetime
    how: str


class RunSummary(msgspec.Struct, frozen=True, kw_only=True):
    """A run as a list shows it. `took`: from `started_at` to when nothing of it moved any more, as far
    as that was seen, which is before `ended_at`, when that was proven; null where that is not known."""

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
    took: Took | None
    stopped_by: Author | None
    detail: str
    alarms: list[AlarmShown]
    recorded: bool

    def __post_init__(self) -> None:
        hold_names(self, "unconfirmed", "detail")


class ArchivedShown(msgspec.Struct, frozen=True):
    """Since when the events of a run are in an archive, and in which file of its folder."""

    at: datetime
    file: str


class Listed(RunSummary, frozen=True, kw_only=True):
    """A run of the list, with what people noted about it, and in one sentence why it did not end
    well, as far as that is recorded."""

    cause: str
    pinned: bool
    note: str
    labels: list[str]
    archived: ArchivedShown | None


class RunShown(RunSummary, frozen=True, kw_only=True):
    """A run with its actions, by full name, and the newest lines of its engine's log. `like`: the
    robot whose engine the simulator plays; `behaviours`: whether its actions have Python behaviours."""

    like: str | None
    behaviours: bool
    actions: dict[str, ActionShown]
    log: list[MessageShown]


class RunWhole(RunShown, frozen=True, kw_only=True):
    """A run with the graph as it was sent. `sent`: the values of its actions, by full name and flat
    name, written as in `inputs` of visits. `subgraphs`: all graphs inside of it, as they were sent along;
    `tree_digest`: of it together with them, null where whoever started it did not tell."""

    umrf: UmrfGraph
    override: Override | None
    sent: dict[str, dict[str, str]]
    despite: list[Overridden]
    archived: ArchivedShown | None
    subgraphs: list[SubgraphShown]
    tree_digest: str | None


class StartShown(msgspec.Struct, frozen=True, kw_only=True):
    """What has become of a start. `under_way`: it is being carried out at this moment. Without that
    and without runs nothing of it has arrived here so far."""

    request_id: str
    under_way: bool
    runs: list[RunShown]


def time(us: int) -> datetime:
    """Microseconds UTC as a moment."""
    return _EPOCH + timedelta(microseconds=us)


def summary(run: Run, *, recorded: bool = True) -> RunSummary:
    """A run without its actions."""
    return RunSummary(**_fields(run, recorded))


class Memo:
    """What was shown of each action of a run, for as long as it is as it was: of thousands of them
    few change between two looks."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[ActionRun, int, VisitCount, ActionShown]] = {}

    def action(self, name: str, action: ActionRun, most: int, count: VisitCount) -> ActionShown:
        """An action with its newest visits."""
        known = self._known.get(name)
        if known is not None and known[0] is action and known[1:3] == (most, count):
            return known[3]
        found = _action(action, most, count)
        self._known[name] = action, most, count, found
        return found

    def work_out(self, run: Run, at_once: int) -> Iterator[None]:
        """Know all that `shown` will ask for, so many actions at a time."""
        most, counts = _most(run, _LIVE), visit_counts(run)
        for number, (name, action) in enumerate(run.actions.items(), 1):
            self.action(name, action, most, counts[name])
            if number % at_once == 0:
                yield


def shown(run: Run, *, recorded: bool = True, memo: Memo | None = None) -> RunShown:
    """A run with its actions and their newest visits."""
    actions = _actions(run, _LIVE, memo)
    fields = _fields(run, recorded)
    return RunShown(
        **fields,
        like=run.like,
        behaviours=run.behaviours,
        actions=actions,
        log=_log(run, _LINES),
    )


def whole(
    run: Run,
    graph: Sent,
    *,
    recorded: bool = True,
    place: Row[Any] | None = None,
    memo: Memo | None = None,
) -> RunWhole:
    """All there is; with a `memo` no more visits than `shown` shows."""
    actions = _actions(run, _WHOLE if memo is None else _LIVE, memo)
    return RunWhole(
        **_fields(run, recorded),
        like=run.like,
        behaviours=run.behaviours,
        actions=actions,
        log=_log(run, len(run.log)),
        umrf=msgspec.Raw(graph.umrf.encode()),
        override=run.override,
        despite=list(run.despite),
        sent=graph.values,
        archived=archived(place),
        subgraphs=subgraphs_shown(graph),
        tree_digest=graph.tree_digest,
    )


def summary_of_row(row: Row[Any]) -> RunSummary:
    """A run that is over, from its row."""
    more = row.summary
    stopped_by = more.get("stopped_by")
    return RunSummary(
        id=row.id,
        number=row.number,
        graph=row.graph,
        graph_name=row.graph_name,
        version=row.version,
        digest=row.digest,
        engine=row.engine,
        simulated=row.simulated,
        author=Author(row.author_id, row.author_name),
        state=row.state,
        desired=row.desired,
        result=row.result,
        proof_at=_time(more.get("proof_at")),
        unknown_since=_time(more.get("unknown_since")) if row.state == "lost" else None,
        unconfirmed=None,
        at_rest=_at_rest(msgspec.convert(more["at_rest"], AtRest) if more.get("at_rest") else None),
        moves_again_at=None,
        group=more.get("group"),
        requested_at=time(row.requested_at),
        started_at=_time(row.started_at),
        ended_at=_time(row.ended_at),
        took=_took(more.get("took")),
        stopped_by=Author(**stopped_by) if stopped_by else None,
        detail=more.get("detail", ""),
        alarms=[
            AlarmShown(each["code"], time(each["at"]), each["text"]) for each in more["alarms"]
        ],
        recorded=True,
    )


def thinned(run: Run) -> Run:
    """The run without the visits that `shown` leaves out."""
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


def listed(found: RunSummary, row: Row[Any], labels: list[str]) -> Listed:
    """A summary with the marks of its row."""
    fields = {name: getattr(found, name) for name in RunSummary.__struct_fields__}
    return Listed(
        **fields,
        cause=row.summary.get("cause", ""),
        pinned=bool(row.pinned),
        note=row.note or "",
        labels=labels,
        archived=archived(row),
    )


def archived(row: Row[Any] | None) -> ArchivedShown | None:
    """Where the events of a run are, from its row; None when they are here."""
    if row is None or row.archived_at is None:
        return None
    return ArchivedShown(time(row.archived_at), row.archived_as)


def _fields(run: Run, recorded: bool) -> dict[str, Any]:
    return {
        "id": run.id,
        "number": run.number,
        "graph": run.graph,
        "graph_name": run.graph_name,
        "version": run.version,
        "digest": run.digest,
        "engine": run.engine,
        "simulated": run.simulated,
        "author": run.author,
        "state": run.state,
        "desired": run.desired,
        "result": run.result,
        "proof_at": _time(run.proof_at),
        "unknown_since": _time(run.unknown_since),
        "unconfirmed": run.lost or run.doubt or None,
        "at_rest": _at_rest(run.at_rest),
        "moves_again_at": _time(run.moves_again_at),
        "group": run.group,
        "requested_at": time(run.requested_at),
        "started_at": _time(run.started_at),
        "ended_at": _time(run.ended_at),
        "took": of_run(run),
        "stopped_by": run.stopped_by,
        "detail": run.detail or run.lost or run.doubt,
        "alarms": [AlarmShown(each.code, time(each.at), each.text) for each in run.alarms],
        "recorded": recorded,
    }


def _at_rest(seen: AtRest | None) -> AtRestShown | None:
    return None if seen is None else AtRestShown(seen.by, time(seen.at), seen.how)


def visit(each: Visit) -> VisitShown:
    """One execution of an action."""
    return VisitShown(
        time(each.start),
        time(each.not_before),
        _time(each.not_after),
        _time(each.until),
        each.result,
        each.how,
        each.inputs,
    )


def _most(run: Run, visits: int) -> int:
    """Visits of one action. Encoding holds up everything else, so very many are not shown."""
    return max(1, visits // max(1, len(run.actions)))


def _actions(run: Run, visits: int, memo: Memo | None = None) -> dict[str, ActionShown]:
    memo, most, counts = memo or Memo(), _most(run, visits), visit_counts(run)
    return {
        name: memo.action(name, action, most, counts[name]) for name, action in run.actions.items()
    }


def _action(action: ActionRun, most: int, count: VisitCount) -> ActionShown:
    visits = [visit(each) for each in action.visits[-most:]]
    messages = [MessageShown(time(each.at), each.text) for each in action.messages]
    older = action.older + len(action.visits) - len(visits)
    return ActionShown(
        action.aid, action.state, visits, older, messages, count.least, count.at_least
    )


def _log(run: Run, most: int) -> list[MessageShown]:
    return [MessageShown(time(each.at), each.text) for each in run.log[-most:]]


def _took(kept: dict[str, Any] | None) -> Took | None:
    return None if kept is None else Took(least=kept["least"], most=kept["most"])


def _time(us: int | None) -> datetime | None:
    return None if us is None else time(us)
