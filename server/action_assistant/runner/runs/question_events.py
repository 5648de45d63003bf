"""The events of a run about questions to people, and about waits of the runner. Times are microseconds UTC."""

from typing import ClassVar, Literal, TypeAlias

import msgspec

from action_assistant.runner.runs.author import Author
from action_assistant.umrf.model import Precondition
from action_assistant.umrf.questions import Question


class QuestionAsked(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A call of a led run asks people from now on. `question`: the id of this question, another one each
    time it is asked; `visit`: of the action, from 1. `role`, `to`, `moves`: as of `Asked`. `until`: the
    deadline, `lapses_at`: when it is asked again, 0 for never. `again`: the question that it repeats."""

    kind: ClassVar[str] = "run.question_asked.v1"

    at: int
    call: int
    node: str
    visit: int
    question: str
    asks: Question
    role: str = ""
    to: str = ""
    moves: tuple[str, ...] = ()
    until: int = 0
    lapses_at: int = 0
    again: str = ""


class QuestionAnswered(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A person answered a question, as the first. `value`: the answer as JSON, "" if the person could not
    answer, for a `reason`; `outcome`: that of the call."""

    kind: ClassVar[str] = "run.question_answered.v1"

    at: int
    call: int
    node: str
    question: str
    by: Author
    outcome: Precondition
    value: str = ""
    reason: str = ""
    request_id: str = ""


#: Why a question is not open any more, though nobody has answered it: 60 s have passed or the run waits, and
#: it is asked again; its deadline; the runner was restarted; it was stopped, by a person or an arrow.
ClosedWhy: TypeAlias = Literal["lapsed", "held", "deadline", "restarted", "stopped"]


class QuestionClosed(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A question can be answered no more, though nobody has."""

    kind: ClassVar[str] = "run.question_closed.v1"

    at: int
    call: int
    node: str
    question: str
    why: ClosedWhy


class AnswerRefused(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A person answered a question that was not open any more. Only the first ones are recorded."""

    kind: ClassVar[str] = "run.answer_refused.v1"

    at: int
    question: str
    node: str
    by: Author
    why: str


class PauseBegan(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The runner waits for a call of a led run from now on, until about `until` (µs UTC). `again`: it
    did so before it was restarted."""

    kind: ClassVar[str] = "run.pause_began.v1"

    at: int
    call: int
    node: str
    until: int
    again: bool = False
