"""The views of questions to people, and of waits, that pages and programs get."""

from datetime import datetime
from typing import Any

import msgspec

from action_assistant.kit.moments import moment
from action_assistant.runner.runs.author import Author
from action_assistant.runner.runs.question_events import ClosedWhy, QuestionAsked
from action_assistant.runner.runs.run import Answer, Closed, Run
from action_assistant.safe_text import hold_names
from action_assistant.umrf.questions import AtDeadline, QuestionKind


class QuestionShown(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A question to people that is open. `action`: its full name; `aid`: its key in the graph; `visit`: of
    the action, from 1. `text`: the question; `choices`: of a choice; `at_least`, `at_most`: of a number.
    `deadline`: until when somebody has to answer, with `at_deadline` as the outcome then; `lapses_at`: when
    it is asked again, with another id, since a robot may move next. `role`: the actor in the graph, `to`:
    the id of the person or group who may answer, "" for all who may run it; `moves`: the robots that
    may move next, which whoever answers has to be allowed to operate. `again`: the id of the question
    that it repeats."""

    id: str
    action: str
    visit: int
    kind: QuestionKind
    text: str
    asked_at: datetime
    aid: str | None = None
    choices: tuple[str, ...] = ()
    at_least: float | None = None
    at_most: float | None = None
    deadline: datetime | None = None
    at_deadline: AtDeadline | None = None
    lapses_at: datetime | None = None
    role: str = ""
    to: str = ""
    moves: tuple[str, ...] = ()
    again: str = ""

    def __post_init__(self) -> None:
        hold_names(self, "text")


class PauseShown(msgspec.Struct, frozen=True):
    """An action for which the runner waits, until about a moment."""

    action: str
    until: datetime


class AnswerShown(msgspec.Struct, frozen=True, omit_defaults=True):
    """The answer of a person to the question of a visit. `value`: None if they could not answer, for a
    `reason`; of a photo its id."""

    question: str
    by: Author
    at: datetime
    value: bool | float | str | None = None
    reason: str = ""


class ClosedQuestion(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A question that is not open any more. `by`: who has answered it, and `value` how; `why`: the reason
    if nobody has: it was asked again since 60 s had passed ("lapsed") or the run waited ("held"), its
    deadline passed, the runner was restarted, or it was stopped."""

    question: str
    action: str
    at: datetime
    by: Author | None = None
    value: bool | float | str | None = None
    why: ClosedWhy | None = None


class QuestionsShown(msgspec.Struct, frozen=True, kw_only=True):
    """The questions of a run: those that are open, the newest first of the others, and the waits."""

    open: list[QuestionShown]
    closed: list[ClosedQuestion]
    pauses: list[PauseShown]


class WaitingQuestion(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """An open question of any run. `may`: the reader may answer it; else `why` says why not."""

    run: str
    number: int
    graph: str | None
    graph_name: str
    simulated: bool
    question: QuestionShown
    may: bool
    why: str = ""


def question_view(run: Run, asked: QuestionAsked) -> QuestionShown:
    """Return the view of an open question."""
    action = run.actions.get(asked.node)
    return QuestionShown(
        id=asked.question,
        action=asked.node,
        visit=asked.visit,
        kind=asked.asks.kind,
        text=asked.asks.text,
        asked_at=moment(asked.at),
        aid=action.aid if action is not None else None,
        choices=asked.asks.choices,
        at_least=asked.asks.at_least,
        at_most=asked.asks.at_most,
        deadline=moment(asked.until) if asked.until else None,
        at_deadline=asked.asks.at_deadline if asked.until else None,
        lapses_at=moment(asked.lapses_at) if asked.lapses_at else None,
        role=asked.role,
        to=asked.to,
        moves=asked.moves,
        again=asked.again,
    )


def questions_of(run: Run) -> list[QuestionShown]:
    """Return the views of the open questions of a run, the oldest first."""
    return [question_view(run, each) for each in run.questions.values()]


def pauses_of(run: Run) -> list[PauseShown]:
    """Return the views of the waits of a run."""
    return [PauseShown(each.node, moment(each.until)) for each in run.pauses.values()]


def closed_view(closed: Closed) -> ClosedQuestion:
    """Return the view of a question that is not open any more."""
    return ClosedQuestion(
        question=closed.question,
        action=closed.node,
        at=moment(closed.at),
        by=closed.by,
        value=_value(closed.value),
        why=closed.why,
    )


def questions_view(run: Run) -> QuestionsShown:
    """Return the view of all questions of a run."""
    closed = [closed_view(each) for each in reversed(run.closed)]
    return QuestionsShown(open=questions_of(run), closed=closed, pauses=pauses_of(run))


def answers_by_visit(answers: tuple[Answer, ...]) -> dict[int, AnswerShown]:
    """Return the views of answers by the number of the visit, from 1."""
    return {
        each.visit: AnswerShown(
            each.question, each.by, moment(each.at), _value(each.value), each.reason
        )
        for each in answers
    }


def _value(text: str) -> Any:
    return msgspec.json.decode(text) if text else None
