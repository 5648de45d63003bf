"""Annotations of a run besides its own events: marks of people, sums after its end, its archive.

They have a stream of their own, `about/RUN`, apart from what a robot did. The tables here are folds
of these streams. `at` is microseconds UTC.
"""

import itertools
from collections.abc import Iterable, Mapping, Sequence, Set
from typing import Annotated, Any, ClassVar, Final

import msgspec
from sqlalchemy import Executable, delete, func, insert, update
from sqlalchemy.dialects.sqlite import insert as upsert

from action_assistant.journal.events import Draft, Event
from action_assistant.runner.analysis.cause_texts import cause_sentence
from action_assistant.runner.analysis.causes import causes
from action_assistant.runner.runs.counts import VisitCount, visit_counts
from action_assistant.runner.runs.course_bar import CoursePart, course_bar
from action_assistant.runner.runs.durations import DurationBounds, duration_bounds, of_run, of_visit
from action_assistant.runner.runs.events import Author, draft_of
from action_assistant.runner.runs.run import Run
from action_assistant.runner.runs.visits import ActionRun
from action_assistant.runner.runs.word_index import holds, will_be_indexed
from action_assistant.safe_text import hold_names
from action_assistant.schema.runner_tables import action_sum, review, run_label
from action_assistant.schema.runner_tables import run as runs
from action_assistant.umrf.model import Graph

_PREFIX: Final = "about/"
_WORDS: Final = 20_000  # characters of a run that are searched
#: Raise it when the sum of a run changes: older sums are made again then.
FIGURES: Final = 8
#: Key beside the results of an action in the table: its number of visits is a lower bound.
AT_LEAST: Final = "at_least"
#: Key beside them: the results that persons gave by word, which nothing showed.
SAID: Final = "said"
_TOOK: Final = 100  # durations kept per action and run

Label = Annotated[str, msgspec.Meta(min_length=1, max_length=60, pattern=r"^\S(.*\S)?$")]


class Marks(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """The marks of a run to be changed; a missing field keeps its value."""

    pinned: bool | None = None
    note: Annotated[str, msgspec.Meta(max_length=4_000)] | None = None
    labels: Annotated[tuple[Label, ...], msgspec.Meta(max_length=20)] | None = None


class Marked(msgspec.Struct, frozen=True, omit_defaults=True):
    """A person pinned a run, wrote a note or chose its labels."""

    kind: ClassVar[str] = "run.marked.v1"

    at: int
    author: Author
    marks: Marks


class Noted(msgspec.Struct, frozen=True, omit_defaults=True):
    """A person wrote a note at a moment of a run. `at`: when it was written; `moment`: the moment
    of the run; both in microseconds UTC. `request_id`: names the request of its author, "" if it had
    none. Notes are only added."""

    kind: ClassVar[str] = "run.noted.v1"

    at: int
    author: Author
    moment: int
    text: str
    request_id: str = ""

    def __post_init__(self) -> None:
        hold_names(self, "text")


class ActionSum(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The totals of one action of a run that is over. `visits`: how often it ran, with `at_least`
    perhaps more often. `results`: the number of visits by known result, without those whose result
    a person stated, which are in `said`; `inferred`: visits that nobody saw; `spans`: durations of
    ended visits, at most the newest hundred. `took`: lower bounds in microseconds, from older
    versions."""

    aid: str | None = None
    visits: int = 0
    at_least: bool = False
    results: dict[str, int] = {}
    said: dict[str, int] = {}
    inferred: int = 0
    took: tuple[int, ...] = ()
    spans: tuple[DurationBounds, ...] = ()


class SummedUp(msgspec.Struct, frozen=True, omit_defaults=True):
    """The event with the totals of a run that is over, so that lists and statistics need not read
    its events. `figures`: the value of `FIGURES` when they were computed; a run with an older value
    is summed up again."""

    kind: ClassVar[str] = "run.summed_up.v1"

    at: int
    actions: dict[str, ActionSum]
    words: str = ""
    cause: str = ""
    took: DurationBounds | None = None
    figures: int = 0
    course: tuple[CoursePart, ...] = ()

    def __post_init__(self) -> None:
        hold_names(self, "words", "cause")


class ArchivedPiece(msgspec.Struct, frozen=True, kw_only=True):
    """The archive of a piece of a led run. `run`: the id of the piece; `file`: its path in the
    folder of archives; `by`: the number of the removal event."""

    run: str
    file: str
    sha256: str
    by: int


class RunArchived(msgspec.Struct, frozen=True):
    """The events of a run were moved from the journal to an archive. `file`: its path in the folder
    of archives; `by`: the number of the removal event; `row`: the run's row at that time; `pieces`:
    the archives of its pieces, if it is a led run."""

    kind: ClassVar[str] = "run.archived.v1"

    at: int
    file: str
    sha256: str
    by: int
    row: dict[str, Any]
    pieces: tuple[ArchivedPiece, ...] = ()


class IncidentKept(msgspec.Struct, frozen=True, kw_only=True):
    """An owner keeps a run as an incident: it is never archived."""

    kind: ClassVar[str] = "run.incident_kept.v1"

    at: int
    author: Author
    reason: str = ""


def stream_about(run: str) -> str:
    """Return the name of the stream of annotations of a run."""
    return f"{_PREFIX}{run}"


def is_about(stream: str) -> bool:
    """Return whether a stream has annotations of a run."""
    return stream.startswith(_PREFIX)


def draft(event: Marked | Noted | SummedUp | RunArchived | IncidentKept) -> Draft:
    """Encode an annotation of a run for the journal."""
    author = event.author.id if isinstance(event, Marked | Noted | IncidentKept) else ""
    return draft_of(event, author)


def sum_of(run: Run, graph: Graph | None, at: int, said: Iterable[str] = ()) -> SummedUp:
    """Return the summary of a run: its cause, times and figures, and the text that searches read.
    `graph`: the graph that was sent, None if it cannot be read; `at`: the time of the summary in
    microseconds UTC; `said`: the texts of the run's events."""
    found = causes(run, graph)[:1]
    cause = cause_sentence(found[0], run) if found else ""
    texts = itertools.chain(
        [cause, run.detail],
        (alarm.text for alarm in run.alarms),
        (message.text for action in run.actions.values() for message in action.messages),
        said,
        run.actions,
    )
    searched = "\n".join(dict.fromkeys(text for text in texts if text))[:_WORDS]
    counts = visit_counts(run)
    actions = {
        name: _sum(each, counts[name], {word.visit for word in run.said.get(name, ())})
        for name, each in run.actions.items()
    }
    return SummedUp(at, actions, searched, cause, of_run(run), FIGURES, course_bar(run))


def _sum(action: ActionRun, count: VisitCount, by_word: Set[int]) -> ActionSum:
    results: dict[str, int] = {}
    said: dict[str, int] = {}
    for number, visit in enumerate(action.visits, action.older + 1):
        if visit.result is not None:
            known = said if number in by_word else results
            known[visit.result] = known.get(visit.result, 0) + 1
    spans = [took for visit in action.visits if (took := of_visit(visit)) is not None]
    return ActionSum(
        aid=action.aid,
        visits=count.least,
        at_least=count.at_least,
        results=results,
        said=said,
        inferred=sum(visit.how == "inferred" for visit in action.visits) + count.least - count.seen,
        spans=tuple(spans[-_TOOK:]),
    )


def fold(event: Event) -> Sequence[Executable]:
    """Return the statements by which a stored annotation changes the tables; () for one of an
    unknown kind."""
    run = event.stream.removeprefix(_PREFIX)
    match event.kind:
        case Marked.kind:
            return _mark(run, msgspec.json.decode(event.body, type=Marked).marks)
        case Noted.kind:
            return _note(run, msgspec.json.decode(event.body, type=Noted).text)
        case SummedUp.kind:
            return _put_sum(run, msgspec.json.decode(event.body, type=SummedUp))
        case RunArchived.kind:
            return _archive(run, msgspec.json.decode(event.body, type=RunArchived))
        case _:
            return ()


def _mark(run: str, marks: Marks) -> Sequence[Executable]:
    given = {"pinned": marks.pinned, "note": marks.note}
    fields = {name: value for name, value in given.items() if value is not None}
    statements: list[Executable] = []
    if fields:
        statements += [_review(run, fields), *holds(run, marks.note or "")]
    if marks.labels is not None:
        statements.append(delete(run_label).where(run_label.c.run == run))
        rows = [{"run": run, "label": label} for label in dict.fromkeys(marks.labels)]
        if rows:
            statements.append(insert(run_label).values(rows))
    return statements


def _note(run: str, text: str) -> Sequence[Executable]:
    first = _review(run, {})
    added = update(review).where(review.c.run == run)
    return (first, added.values(remarks=review.c.remarks + "\n" + text), *holds(run, text))


def _put_sum(run: str, summed: SummedUp) -> Sequence[Executable]:
    rows = [
        {
            "run": run,
            "action": name,
            "aid": each.aid,
            "visits": each.visits,
            "results": each.results
            | ({AT_LEAST: 1} if each.at_least else {})
            | ({SAID: each.said} if each.said else {}),
            "inferred": each.inferred,
            "took": [[each.least, each.most] for each in _spans(each)],
        }
        for name, each in summed.actions.items()
    ]
    return [
        _review(run, {"words": summed.words, "summed": True}),
        *holds(run, summed.words),
        *_summary_changes(run, summed),
        delete(action_sum).where(action_sum.c.run == run),
        *(insert(action_sum).values(rows[i : i + 100]) for i in range(0, len(rows), 100)),
    ]


def _archive(run_id: str, archived: RunArchived) -> Sequence[Executable]:
    """Return the statements that note in a run's row that it was archived. Where the tables are
    rebuilt without the run's events, they restore the row."""
    row: Mapping[str, Any] = {
        **archived.row,
        "archived_at": archived.at,
        "archived_as": archived.file,
    }
    statement = upsert(runs).values(id=run_id, **row)
    return (
        will_be_indexed(run_id, row["number"]),
        statement.on_conflict_do_update(index_elements=["id"], set_=dict(row)),
    )


def _review(run: str, fields: Mapping[str, object]) -> Executable:
    blank: dict[str, object] = {"pinned": False, "note": "", "words": "", "summed": False}
    statement = upsert(review).values(run=run, **{**blank, **fields})
    if not fields:
        return statement.on_conflict_do_nothing()
    return statement.on_conflict_do_update(index_elements=["run"], set_=dict(fields))


def _summary_changes(run: str, summed: SummedUp) -> Sequence[Executable]:
    """Return the statement that stores the cause, the duration and the course of a run for lists; ()
    if there is none of them."""
    changes: list[object] = ["$.figures", summed.figures] if summed.figures else []
    if summed.cause:
        changes += ["$.cause", summed.cause]
    if summed.took is not None:
        changes += ["$.took", func.json(msgspec.json.encode(summed.took).decode())]
    if summed.course:
        changes += ["$.course", func.json(msgspec.json.encode(summed.course).decode())]
    if not changes:
        return ()
    change = update(runs).where(runs.c.id == run)
    return (change.values(summary=func.json_set(runs.c.summary, *changes)),)


def _spans(action: ActionSum) -> Sequence[DurationBounds]:
    return action.spans or tuple(duration_bounds(each, None) for each in action.took)
