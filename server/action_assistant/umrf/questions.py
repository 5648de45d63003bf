"""Actions that no robot carries out: people answer them, or the runner waits.

The ready-made actions are known by their names. What they ask, or how long they wait, stands in their
inputs, so that an arrow can bring it. Only a led run has somebody who can ask
(docs/decisions/140-people-as-performers.md). Pure.
"""

from collections.abc import Collection, Iterator, Mapping
from datetime import datetime, timedelta
from datetime import time as of_day
from math import isfinite
from typing import Any, Final, Literal, TypeAlias, TypeGuard

import msgspec

from action_assistant.umrf.json.text import dump, parse_small
from action_assistant.umrf.kept_values import takes, value_arrows
from action_assistant.umrf.model import (
    PRECONDITIONS,
    Action,
    Graph,
    Key,
    Parameter,
    Precondition,
    Relation,
    Signature,
)
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.pieces import Obstacle
from action_assistant.umrf.semantics.values import plain
from action_assistant.umrf.signatures import signature_of

QuestionKind: TypeAlias = Literal["confirm", "choice", "text", "number", "photo"]
#: The outcome of a question that nobody has answered by its deadline. It is never true.
AtDeadline: TypeAlias = Literal["false", "error", "stopped"]
#: Who carries an action out that no robot does: people, or the runner itself, which only waits.
AskedBy: TypeAlias = Literal["people", "runner"]

CONFIRM: Final = "AaConfirm"
CHOOSE: Final = "AaChoose"
ASK_TEXT: Final = "AaAskText"
ASK_NUMBER: Final = "AaAskNumber"
ASK_PHOTO: Final = "AaAskPhoto"
WAIT: Final = "AaWait"
UNTIL: Final = "AaUntil"
_TITLES: Final[Mapping[str, str]] = {
    ASK_TEXT: "Ask for a text",
    ASK_NUMBER: "Ask for a number",
    ASK_PHOTO: "Ask for a photo",
    CONFIRM: "Confirm",
    CHOOSE: "Choose",
    WAIT: "Wait",
    UNTIL: "Until a time",
}
_KINDS: Final[Mapping[str, QuestionKind]] = {
    ASK_TEXT: "text",
    ASK_NUMBER: "number",
    ASK_PHOTO: "photo",
    CONFIRM: "confirm",
    CHOOSE: "choice",
}
_OF_RUNNER: Final = frozenset({WAIT, UNTIL})

_LONGEST_QUESTION: Final = 1000  # characters
_MOST_CHOICES: Final = 50
_LONGEST_CHOICE: Final = 200  # characters
#: Characters of a text that a person answers.
LONGEST_TEXT: Final = 4000
#: Bytes of a photo.
LARGEST_PHOTO: Final = 8 * 1024 * 1024
_LONGEST_S: Final = 30 * 86_400
_FARTHEST: Final = timedelta(days=366)
_AT_DEADLINE: Final = ("false", "error", "stopped")
#: The output in which the answer stands, by kind of question.
OUTPUT_OF: Final[Mapping[QuestionKind, str]] = {
    "choice": "choice",
    "text": "text",
    "number": "number",
    "photo": "photo",
}


class WrongQuestion(ValueError):
    """A question or a wait cannot be made of its inputs. `name`: of the input at fault."""

    def __init__(self, name: str, text: str) -> None:
        super().__init__(text)
        self.name = name


class Question(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A question to people. `choices`: of a choice; `at_least`, `at_most`: of a number; `deadline_s`: in
    seconds, None for none; `at_deadline`: the outcome then."""

    kind: QuestionKind
    text: str
    choices: tuple[str, ...] = ()
    at_least: float | None = None
    at_most: float | None = None
    deadline_s: float | None = None
    at_deadline: AtDeadline = "error"


class Pause(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A wait of the runner: for some `seconds`, or until the moment in `time`."""

    seconds: float = 0.0
    time: str = ""


class Asked(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """An action of a led run that people answer, or for which the runner waits. `role`: the actor in the
    graph; `to`: the id of the person or of the group who may answer, "" for all who may run it;
    `moves`: the robots that may move next, without another question in between; `hands_on`: the outcomes
    after which an arrow takes its outputs."""

    by: AskedBy
    action: str
    role: str = ""
    to: str = ""
    moves: tuple[str, ...] = ()
    hands_on: tuple[Precondition, ...] = ()


def is_asked(action: Action) -> bool:
    """Return whether people answer an action, or the runner waits for it."""
    return action.name in _TITLES and not action.missing


def asked_by(name: str) -> AskedBy:
    """Return who carries out a ready-made action with this name."""
    return "runner" if name in _OF_RUNNER else "people"


def without_asked(graph: Graph) -> Graph:
    """Return the graph without the actions that no robot carries out; their arrows stay."""
    kept = tuple(action for action in graph.actions if not is_asked(action))
    return (
        graph if len(kept) == len(graph.actions) else msgspec.structs.replace(graph, actions=kept)
    )


def roles_in(graph: Graph) -> frozenset[str]:
    """Return the actors of the questions to people in a graph, "" for those without one."""
    asked = (each for each in graph.actions if is_asked(each) and each.name not in _OF_RUNNER)
    return frozenset(each.actor for each in asked)


def asked_in(
    graph: Graph, people: Mapping[str, str], players: Mapping[str, str]
) -> dict[str, Asked]:
    """Return the actions of a graph that no robot carries out, by full name. `people`: who answers,
    by actor; `players`: the robot of each action that one plays, by full name."""
    found: dict[str, Asked] = {}
    arrows = [arrow for arrow, _ in value_arrows(graph)]
    for action in filter(is_asked, graph.actions):
        by = asked_by(action.name)
        found[action.full_name] = Asked(
            by=by,
            action=action.name,
            role=action.actor if by == "people" else "",
            to=people.get(action.actor, "") if by == "people" else "",
            moves=_moved_next(graph, action, players) if by == "people" else (),
            hands_on=tuple(
                outcome
                for outcome in PRECONDITIONS
                if any(each.parent == action.key and takes(each, (outcome,)) for each in arrows)
            ),
        )
    return found


def _moved_next(graph: Graph, action: Action, players: Mapping[str, str]) -> tuple[str, ...]:
    """Return the robots that may begin to move because an action ends, before another question is
    asked, sorted."""
    by_key = {each.key: each for each in graph.actions if not each.missing}
    arrows: dict[Key, list[Relation]] = {}
    for relation in graph.relations:
        arrows.setdefault(relation.parent, []).append(relation)
    robots: set[str] = set()
    seen: set[Key] = set()
    left = [action.key]
    while left:
        for relation in arrows.get(left.pop(), ()):
            child = by_key.get(relation.child)
            answers = {relation.conditions.answer(outcome) for outcome in PRECONDITIONS}
            if child is None or child.key in seen or answers <= {"ignore", "stop", "pause"}:
                continue
            seen.add(child.key)
            robot = players.get(child.full_name)
            is_passed = bool(answers & {"bypass"})
            if robot is None:
                is_passed |= not is_asked(child) or asked_by(child.name) == "runner"
            elif answers & {"run", "restart"}:
                robots.add(robot)
            if is_passed:
                left.append(child.key)
    return tuple(sorted(robots))


def obstacles_of_questions(inside: Mapping[str, Graph]) -> Iterator[Obstacle]:
    """Yield an obstacle for each graph inside that asks people or waits: a robot gets it as it is."""
    for name, graph in sorted(inside.items()):
        for action in graph.actions:
            if is_asked(action):
                yield Obstacle(code="question-inside", text=_inside(name, action))
                break


def _inside(name: str, action: Action) -> str:
    return (
        f"{action.full_name} stands in the sub-graph “{name}”, which is carried out as a whole: nobody can "
        "be asked there. Open the sub-graphs for this start, or make one graph without graphs inside."
    )


# --- the ready-made actions -------------------------------------------------------------------------


def _leaf(kind: str, **more: Any) -> str:
    return dump({"pvf_type": kind, **more})


def _deadline() -> tuple[Parameter, ...]:
    return (
        Parameter("deadline_s", _leaf("number", pvf_required=False)),
        Parameter(
            "at_deadline",
            _leaf("string", pvf_required=False, pvf_allowed_values=list(_AT_DEADLINE)),
        ),
    )


def _ready_made() -> Iterator[Action]:
    question = Parameter("question", _leaf("string"))
    bounds = tuple(
        Parameter(name, _leaf("number", pvf_required=False)) for name in ("at_least", "at_most")
    )
    for name, what, more, kind in (
        (ASK_TEXT, "text", (), "string"),
        (ASK_NUMBER, "number", bounds, "number"),
        (ASK_PHOTO, "photo", (), "string"),
    ):
        yield Action(
            key="",
            name=name,
            description=f"Asks a person for a {what}.",
            inputs=(question, *more, *_deadline()),
            outputs=(Parameter(what, _leaf(kind)),),
        )
    yield Action(
        key="",
        name=CONFIRM,
        description="Asks a person to confirm: yes ends true, no ends false.",
        inputs=(question, *_deadline()),
    )
    yield Action(
        key="",
        name=CHOOSE,
        description="Lets a person choose one of several texts.",
        inputs=(question, Parameter("choices", _leaf("strings")), *_deadline()),
        outputs=(Parameter("choice", _leaf("string")),),
    )
    yield Action(
        key="",
        name=WAIT,
        description="Waits for some seconds.",
        inputs=(Parameter("seconds", _leaf("number")),),
    )
    yield Action(
        key="",
        name=UNTIL,
        description="Waits until a time: 14:30, or 2026-11-29T14:30:00+02:00.",
        inputs=(Parameter("time", _leaf("string")),),
    )


#: The ready-made actions, as files describe them.
READY_MADE: Final[tuple[Action, ...]] = tuple(_ready_made())
#: Their parameters, by name.
READY_SIGNATURES: Final[Mapping[str, Signature]] = {
    each.name: signature_of(each) for each in READY_MADE
}


def title_of(name: str) -> str:
    """Return the title of a ready-made action for people."""
    return _TITLES[name]


def spoken(full_name: str) -> str:
    """Return an action as people call it: `AaConfirm_0` is Confirm, `AaConfirm_1` is Confirm 1;
    other names stay."""
    name, _, number = full_name.rpartition("_")
    title = _TITLES.get(name, "")
    return full_name if not title else title if number == "0" else f"{title} {number}"


# --- what they ask, and how long they wait ----------------------------------------------------------


def question_of(name: str, inputs: Mapping[str, Any]) -> Question:
    """Return the question that a ready-made action asks. `name`: the name of the action; `inputs`:
    its values by flat name. Raise WrongQuestion if one of them is missing or wrong."""
    for found in _question_faults(name, inputs):
        raise found
    kind = _KINDS[name]
    deadline = _number(inputs, "deadline_s")
    return Question(
        kind=kind,
        text=str(inputs["question"]).strip(),
        choices=tuple(inputs["choices"]) if kind == "choice" else (),
        at_least=_number(inputs, "at_least") if kind == "number" else None,
        at_most=_number(inputs, "at_most") if kind == "number" else None,
        deadline_s=deadline or None,
        at_deadline=inputs.get("at_deadline") or "error",
    )


def pause_of(name: str, inputs: Mapping[str, Any]) -> Pause:
    """Return how long a ready-made action waits. `name`, `inputs`: as of `question_of`. Raise
    WrongQuestion if the value is missing or wrong."""
    for found in _pause_faults(name, inputs):
        raise found
    if name == WAIT:
        return Pause(seconds=float(inputs["seconds"]))
    return Pause(time=str(inputs["time"]).strip())


def moment_of(time: str, now: datetime) -> datetime:
    """Return the moment that a text names: a time of the day means the next one after `now`, in its
    zone. Raise WrongQuestion for another text, and for a moment that is more than a year away."""
    text = time.strip()
    try:
        if "T" not in text and "-" not in text:
            found = datetime.combine(now.date(), of_day.fromisoformat(text), now.tzinfo)
            return found if found > now else found + timedelta(days=1)
        found = datetime.fromisoformat(text)
    except ValueError:
        raise WrongQuestion("time", f"“{text[:60]}” is no time: {_TIME_FORM}") from None
    if found.tzinfo is None:
        raise WrongQuestion("time", f"“{text[:60]}” has no time zone: {_TIME_FORM}")
    if found - now > _FARTHEST:
        raise WrongQuestion("time", f"“{text[:60]}” is more than a year away.")
    return found


_TIME_FORM: Final = "write 14:30, or 2026-11-29T14:30:00+02:00."


def literal_faults(action: Action) -> Iterator[WrongQuestion]:
    """Yield what is wrong with the values that stand in a ready-made action; nothing of inputs that
    have none, which arrows may bring."""
    inputs: dict[str, Any] = {}
    for parameter in action.inputs:
        leaf = parse_small(parameter.text)
        if isinstance(leaf, dict) and "pvf_value" in leaf:
            inputs[flat_name(parameter.path)] = plain(leaf["pvf_value"])
    check = _pause_faults if action.name in _OF_RUNNER else _question_faults
    yield from check(action.name, inputs, is_whole=False)


def _question_faults(
    name: str, inputs: Mapping[str, Any], *, is_whole: bool = True
) -> Iterator[WrongQuestion]:
    """Yield the faults of a question. `is_whole`: an input without a value is one."""
    if is_whole or "question" in inputs:
        text = inputs.get("question")
        if not isinstance(text, str) or not text.strip():
            yield WrongQuestion("question", "The question has no text.")
        elif len(text) > _LONGEST_QUESTION:
            long = f"The question has more than {_LONGEST_QUESTION:,} characters."
            yield WrongQuestion("question", long)
    if name == CHOOSE and (is_whole or "choices" in inputs):
        yield from _choice_faults(inputs.get("choices"))
    if name == ASK_NUMBER:
        yield from _bound_faults(inputs)
    yield from _deadline_faults(inputs)


def _choice_faults(choices: Any) -> Iterator[WrongQuestion]:
    if not isinstance(choices, list | tuple) or not choices:
        yield WrongQuestion("choices", "There is nothing to choose from.")
        return
    if not all(isinstance(each, str) and each.strip() for each in choices):
        yield WrongQuestion("choices", "A choice has no text.")
        return
    if len(choices) > _MOST_CHOICES or max(map(len, choices)) > _LONGEST_CHOICE:
        most = f"There are at most {_MOST_CHOICES} choices of {_LONGEST_CHOICE} characters."
        yield WrongQuestion("choices", most)
    if len(set(choices)) < len(choices):
        yield WrongQuestion("choices", "Two choices are the same.")


def _bound_faults(inputs: Mapping[str, Any]) -> Iterator[WrongQuestion]:
    bounds = {
        name: inputs[name] for name in ("at_least", "at_most") if inputs.get(name) is not None
    }
    for name, bound in bounds.items():
        if not _is_number(bound):
            yield WrongQuestion(name, "A bound is a number.")
            return
    if len(bounds) == 2 and bounds["at_least"] > bounds["at_most"]:
        yield WrongQuestion("at_least", "No number is at least that and at most the other.")


def _deadline_faults(inputs: Mapping[str, Any]) -> Iterator[WrongQuestion]:
    deadline = inputs.get("deadline_s")
    if deadline is not None and not (_is_number(deadline) and 0 <= deadline <= _LONGEST_S):
        yield WrongQuestion("deadline_s", "The deadline is in seconds, from 0 (none) to 30 days.")
    outcome = inputs.get("at_deadline")
    if outcome in {"true", "on_true"}:
        text = "A question that nobody answers never ends true: choose false, error or stopped."
        yield WrongQuestion("at_deadline", text)
    elif outcome and outcome not in _AT_DEADLINE:
        yield WrongQuestion("at_deadline", "The deadline ends false, error or stopped.")


def _pause_faults(
    name: str, inputs: Mapping[str, Any], *, is_whole: bool = True
) -> Iterator[WrongQuestion]:
    """Yield the faults of a wait. `is_whole`: as of `_question_faults`."""
    if name == WAIT and (is_whole or "seconds" in inputs):
        seconds = inputs.get("seconds")
        if not _is_number(seconds) or not 0 <= seconds <= _LONGEST_S:
            yield WrongQuestion("seconds", "A wait is in seconds, from 0 to 30 days.")
    if name == UNTIL and (is_whole or "time" in inputs):
        try:
            moment_of(str(inputs.get("time")), _SOME_DAY)
        except WrongQuestion as wrong:
            if "year away" not in str(wrong):
                yield wrong


#: A day before every other: only the form of a text is looked at.
_SOME_DAY: Final = datetime.fromisoformat("2000-01-01T00:00:00+00:00")


def _is_number(value: Any) -> TypeGuard[float]:
    is_one = isinstance(value, int | float) and not isinstance(value, bool)
    return is_one and isfinite(value)


def _number(inputs: Mapping[str, Any], name: str) -> float | None:
    value = inputs.get(name)
    return None if value is None else float(value)


# --- answers ----------------------------------------------------------------------------------------


class WrongAnswer(ValueError):
    """A value is no answer to a question."""


def checked_answer(question: Question, value: Any, photos: Collection[str] = ()) -> Any:
    """Return the value of an answer as it is handed on: True or False for a confirmation, else what
    stands in the output. `photos`: those that were sent for this question. Raise WrongAnswer if it does
    not fit the question."""
    match question.kind:
        case "confirm" if isinstance(value, bool):
            return value
        case "confirm":
            raise WrongAnswer("Answer yes or no: true or false.")
        case "choice" if value in question.choices:
            return value
        case "choice":
            raise WrongAnswer(f"Choose one of {', '.join(question.choices[:10])}.")
        case "number" if _is_number(value):
            return _in_range(question, float(value))
        case "number":
            raise WrongAnswer("Answer with a number.")
        case "text" if isinstance(value, str) and value.strip():
            if len(value) > LONGEST_TEXT:
                raise WrongAnswer(f"The text has more than {LONGEST_TEXT:,} characters.")
            return value
        case "text":
            raise WrongAnswer("Answer with a text.")
        case "photo" if isinstance(value, str) and value in photos:
            return value
        case _:
            raise WrongAnswer("Send the photo first, and answer with its id.")


def _in_range(question: Question, number: float) -> float:
    if question.at_least is not None and number < question.at_least:
        raise WrongAnswer(f"The number has to be at least {question.at_least:g}.")
    if question.at_most is not None and number > question.at_most:
        raise WrongAnswer(f"The number has to be at most {question.at_most:g}.")
    return number
