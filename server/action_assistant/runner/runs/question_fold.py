"""The fold of questions to people: which are open, who has answered, and what became of the others."""

from typing import assert_never

from msgspec.structs import replace

from action_assistant.runner.runs.question_events import (
    AnswerRefused,
    QuestionAnswered,
    QuestionAsked,
    QuestionClosed,
)
from action_assistant.runner.runs.run import Answer, Closed, Press, Run, answer_press
from action_assistant.runner.runs.visits import KEPT, ActionRun


def after_question(
    run: Run, event: QuestionAsked | QuestionAnswered | QuestionClosed | AnswerRefused
) -> Run:
    """Return the run after news of a question."""
    match event:
        case QuestionAsked(question=question, call=call):
            waits = {number: each for number, each in run.waits.items() if number != call}
            return replace(run, questions=run.questions | {question: event}, waits=waits)
        case QuestionClosed():
            closed = Closed(question=event.question, node=event.node, at=event.at, why=event.why)
            return _closed(run, closed)
        case QuestionAnswered(question=question, by=by, value=value):
            action = run.actions.get(event.node, ActionRun())
            answer = Answer(
                visit=action.older + len(action.visits),
                question=question,
                by=by,
                at=event.at,
                value=value,
                reason=event.reason,
            )
            answers = (*run.answers.get(event.node, ()), answer)[-KEPT:]
            closed = Closed(question=question, node=event.node, at=event.at, by=by, value=value)
            run = replace(_closed(run, closed), answers=run.answers | {event.node: answers})
            return with_press(run, event.request_id, answer_press(by, question, value))
        case AnswerRefused():
            return run
        case _:
            assert_never(event)


def _closed(run: Run, closed: Closed) -> Run:
    questions = {id_: each for id_, each in run.questions.items() if id_ != closed.question}
    return replace(run, questions=questions, closed=(*run.closed, closed)[-KEPT:])


def with_press(run: Run, request: str, press: Press) -> Run:
    """Return the run with a person's press remembered under its request id ("" : not remembered);
    of many only the newest stay."""
    if not request:
        return run
    kept = tuple(run.pressed.items())[1 - KEPT :]
    return replace(run, pressed=dict(kept) | {request: press})
