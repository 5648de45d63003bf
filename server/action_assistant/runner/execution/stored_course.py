"""The course of a led run, from its stored events, and how far its engine got by it."""

from collections.abc import Iterable
from typing import Any, Final

import msgspec

from action_assistant.errors import Conflict
from action_assistant.runner.execution.conducted_steps import leading_facts
from action_assistant.runner.execution.piece_values import returned_of
from action_assistant.runner.links.led_calls import CourseStep, LedCalls, Played, Stopped
from action_assistant.runner.links.port import SIMULATOR, CallBegan, CallPlayed, CallStopped
from action_assistant.runner.links.simulator import engine_of
from action_assistant.runner.runs.earlier import (
    Before,
    Choice,
    Ending,
    PastEnd,
    UnderWay,
    newest_of,
)
from action_assistant.runner.runs.events import (
    PieceBegan,
    PieceEnded,
    PieceWaits,
    PlayBegan,
    Published,
    Requested,
    StopRequested,
    decode,
)
from action_assistant.runner.runs.history import RunHistory
from action_assistant.runner.runs.question_events import PauseBegan, QuestionAsked
from action_assistant.runner.runs.sent_graphs import graphs_in
from action_assistant.umrf.files import codec
from action_assistant.umrf.kept_values import kept_outputs, value_arrows
from action_assistant.umrf.model import OUTCOMES, PRECONDITIONS, Action, Precondition
from action_assistant.umrf.partial_runs import AssumedOutcome, AssumedValue
from action_assistant.umrf.semantics import GraphRefused, Returned

_PAGE: Final = 500  # events read at once
_MOST_AHEAD: Final = 1000  # engine steps for which a call of a course is waited
_MOST_ENDS: Final = 5_000  # outcomes that are taken over


class StoredCourse(msgspec.Struct, frozen=True, kw_only=True):
    """The course of a led run. `began`: when its graph was started, µs UTC; `steps`: with their ms after
    that; `calls`: all calls, and `played`: those that the simulator plays, with the full names of their
    actions; `ended`: the outcomes by call; `newest`: the last noted piece of each call without one;
    `asked`: those without one of which people were asked, or for which the runner waits, and `pauses` until
    when (µs UTC);
    `noted`: all noted pieces; `by_word`: those whose outcome a person gave, in order."""

    began: int
    steps: tuple[tuple[float, CourseStep], ...]
    calls: dict[int, str]
    played: dict[int, str]
    ended: dict[int, PieceEnded]
    newest: dict[int, str]
    noted: frozenset[str]
    by_word: tuple[str, ...]
    asked: dict[int, str] = {}
    pauses: dict[int, int] = {}

    @property
    def over(self) -> frozenset[int]:
        """The calls that no other engine would be asked for."""
        return frozenset(self.ended) | frozenset(self.played)


async def stored_course(history: RunHistory, first: Requested) -> StoredCourse:
    """Read the course of a led run. `first`: its first event. Raise Unavailable if the journal cannot
    be read, msgspec.DecodeError if an event cannot."""
    before = first.before
    took_us = 0 if before is None else round(before.took_ms * 1000)
    began = first.at - took_us
    steps: list[tuple[int, CourseStep]] = []
    calls: dict[int, str] = {} if before is None else dict(before.calls)
    played: dict[int, str] = {}
    ended: dict[int, PieceEnded] = {}
    newest: dict[int, str] = {}
    noted: set[str] = set()
    by_word: list[str] = []
    asked: dict[int, str] = {}
    pauses: dict[int, int] = {}
    after = 0
    while events := await history.events(first.run, after, _PAGE):
        after = events[-1].seq
        for stored in events:
            match decode(stored.kind, stored.body):
                case Published(at=at):
                    began = at - took_us
                case PieceWaits(call=call, node=node):
                    calls[call] = node
                case PieceBegan(call=call, piece=piece, node=node):
                    calls[call] = node
                    noted.add(piece)
                    newest[call] = piece
                case PieceEnded(at=at, call=call, how=how, piece=piece) as end:
                    if how == "word":
                        by_word.append(piece)
                    calls[call] = end.node
                    newest.pop(call, None)
                    asked.pop(call, None)
                    ended[call] = end
                    steps.append((at, returned_of(end)))
                case PlayBegan(at=at, call=call, node=node):
                    calls[call] = played[call] = node
                    steps.append((at, Played(call, node)))
                case QuestionAsked(call=call, node=node):
                    calls[call] = asked[call] = node
                case PauseBegan(call=call, node=node, until=until):
                    calls[call] = asked[call] = node
                    pauses[call] = until
                case StopRequested(at=at):
                    steps.append((at, Stopped()))
    own = tuple(((at - began) / 1000, step) for at, step in steps)
    past = () if before is None else tuple((each.ms, each.returned) for each in before.ends)
    return StoredCourse(
        began=began,
        steps=(*past, *own),
        calls=calls,
        played=played,
        ended=ended,
        newest=newest,
        noted=frozenset(noted),
        by_word=tuple(by_word),
        asked=asked,
        pauses=pauses,
    )


def ending_of(
    first: Requested,
    course: StoredCourse,
    ended_at: int,
    unsent: frozenset[int],
    choices: dict[str, Choice],
) -> Ending:
    """Play the course of an ended led run again up to its Stop, and return how far it got. For workers.
    `first`: its first event; `ended_at`: µs UTC; `unsent`: calls whose piece has not left; `choices`:
    by full name, for the actions that were under way. Raise Conflict if the course cannot be
    repeated."""
    played = _PlayedCourse(first, course, ended_at).without_script()
    players = first.led.players if first.led is not None else {}
    under_way: list[UnderWay] = []
    chosen: list[tuple[int, Choice]] = []
    for number in sorted(played.open):
        node = played.open[number]
        if number in played.stopping:  # an arrow stopped it: that is its outcome
            played.end(number, "on_true")
            continue
        end = course.ended.get(number)
        has_begun = number in course.played or number in course.newest or end is not None
        if not has_begun or number in unsent or (end is not None and end.how == "unsent"):
            continue
        seen = end.outcome if end is not None and end.outcome in OUTCOMES else ""
        robot = players.get(node, SIMULATOR)
        under_way.append(UnderWay(action=node, robot=robot, seen=seen))
        if node in choices:
            chosen.append((number, choices[node]))
    for number, choice in chosen:
        played.choose(number, choice)
    return played.ending(tuple(under_way), choices)


class _PlayedCourse:
    """Plays the course of a led run in an engine of its own, up to its Stop."""

    def __init__(
        self,
        first: Requested,
        course: StoredCourse,
        ended_at: int,
        past: Iterable[PastEnd] = (),
    ) -> None:
        self._first = first
        self._course = course
        self._graph = codec.read(first.umrf).graph
        self._actions = {each.full_name: each for each in self._graph.actions if not each.missing}
        self._calls = LedCalls(frozenset(first.actions))
        self._calls.expect(course.calls)
        facts = leading_facts(is_simulated=first.simulated)
        self._engine = engine_of(facts, first.script, self._calls)
        self._engine.library = graphs_in(first.subgraphs)
        past = past or (first.before.ends if first.before is not None else ())
        self._past = {each.returned.number: each for each in past}
        self._ends: list[PastEnd] = []
        self._inputs: dict[int, dict[str, Any]] = {}
        #: The calls that have begun and have no outcome, and those of them that are being stopped.
        self.open: dict[int, str] = {}
        self.stopping: set[int] = set()
        stops = [at_ms for at_ms, step in course.steps if isinstance(step, Stopped)]
        self._took_ms = stops[0] if stops else max(0.0, (ended_at - course.began) / 1000)
        self._play()

    def without_script(self) -> "_PlayedCourse":
        """Return the same course in an engine that is told each end, as it will be when the run is
        continued: there nothing is played by the script any more. Raise Conflict if it differs."""
        told = (*((each.ms, each.returned) for each in self._ends), (self._took_ms, Stopped()))
        course = msgspec.structs.replace(self._course, steps=told, calls=dict(self._calls.nodes))
        again = _PlayedCourse(self._first, course, 0, self._ends)
        if again.open != self.open:
            raise Conflict("That run cannot be continued: its course cannot be repeated.")
        return again

    def _play(self) -> None:
        try:
            self._engine.start(self._graph, 0.0)
        except GraphRefused as refused:
            raise Conflict(f"That run cannot be continued: {refused}") from refused
        self._take()
        past_ms = 0.0
        for at_ms, step in self._course.steps:
            if isinstance(step, Stopped):
                break
            self._wait_for(step.number)
            past_ms = at_ms = max(past_ms, at_ms, self._engine.now)
            self._advance(at_ms)
            if isinstance(step, Played):
                self._engine.play(self._calls.own(step.number), at_ms)
            else:
                self._note(step, at_ms)
                self._tell(step, at_ms)
            self._take()
        self._took_ms = max(self._took_ms, past_ms, self._engine.now)
        self._advance(self._took_ms)
        if self._engine.crashed or self._engine.locked:
            raise Conflict("That run cannot be continued: its course ends the engine again.")

    def _wait_for(self, number: int) -> None:
        for _ in range(_MOST_AHEAD):
            if number in self._calls.nodes or self._engine.due is None:
                break
            self._engine.advance(self._engine.due)
            self._take()
        if number not in self._calls.nodes:
            raise Conflict("That run cannot be continued: its course cannot be repeated.")

    def _advance(self, to_ms: float) -> None:
        while (due := self._engine.due) is not None and due <= to_ms:
            self._engine.advance(due)
            self._take()
        self._engine.advance(to_ms)
        self._take()

    def _take(self) -> None:
        for each in self._calls.news():
            match each:
                case CallBegan(call=call):
                    self.open[call.number] = call.node
                    self._inputs[call.number] = call.inputs
                case CallStopped(number=number):
                    self.stopping.add(number)
                case CallPlayed(number=number, outcome=outcome, outputs=outputs):
                    returned = Returned(number=number, result=_told(outcome), outputs=outputs)
                    self._note(returned, self._engine.now, outcome)

    def _note(self, returned: Returned, at_ms: float, outcome: Precondition | None = None) -> None:
        node = self.open.pop(returned.number)
        past, end = self._past.get(returned.number), self._course.ended.get(returned.number)
        if past is not None:
            self._ends.append(past)
            return
        shown = end.outcome if end is not None else outcome or returned.result
        assert shown in PRECONDITIONS
        self._ends.append(
            PastEnd(
                ms=at_ms,
                at=self._course.began + round(at_ms * 1000),
                node=node,
                outcome=shown,
                returned=returned,
                by=end.by.name if end is not None and end.by is not None else "",
            )
        )

    def end(self, number: int, result: Precondition) -> None:
        """End a call as the earlier run was stopped."""
        returned = Returned(number=number, result=result, unset=self._unset(number, result))
        shown: Precondition = "on_stopped" if number in self.stopping else result
        self._note(returned, self._took_ms, shown)
        self._tell(returned, self._took_ms)
        self._take()

    def _tell(self, returned: Returned, at_ms: float) -> None:
        own = self._calls.own(returned.number)
        self._engine.returned(msgspec.structs.replace(returned, number=own), at_ms)

    def _unset(self, number: int, result: Precondition) -> tuple[str, ...]:
        """Return the outputs of a call that a robot played, which nobody saw."""
        node = self.open[number]
        led = self._first.led
        if result == "on_error" or led is None or node not in led.players:
            return ()
        return tuple(each.name for each in kept_outputs(self._actions[node]))

    def choose(self, number: int, choice: Choice) -> None:
        """Carry out what a person chose for an action that was under way."""
        match choice:
            case "true" | "false" | "error":
                self.end(number, _OUTCOME_OF[choice])
            case "leave":
                self.end(number, "on_stopped")
            case "again":
                pass

    def ending(self, under_way: tuple[UnderWay, ...], choices: dict[str, Choice]) -> Ending:
        """Return how far the run got, with all choices carried out."""
        self._advance(self._took_ms)
        if len(self._ends) > _MOST_ENDS:
            raise Conflict(f"That run has more than {_MOST_ENDS:,} outcomes: begin at an action.")
        before = Before(
            ends=tuple(self._ends), calls=dict(self._calls.nodes), took_ms=self._took_ms
        )
        waiting = {each.action for each in under_way} - choices.keys()
        begins = {n: node for n, node in sorted(self.open.items()) if node not in waiting}
        newest = newest_of(self._ends)
        return Ending(
            before=before,
            under_way=under_way,
            begins=tuple(begins.values()),
            assumed=tuple(
                AssumedOutcome(name, end.outcome, end.at, end.by) for name, end in newest.items()
            ),
            values=tuple(
                value for n, node in begins.items() for value in self._values_of(n, node, newest)
            ),
            lacks=self._lacks(under_way, choices, goes_on=bool(begins)),
        )

    def _values_of(self, number: int, node: str, newest: dict[str, PastEnd]) -> list[AssumedValue]:
        """Return the values of earlier actions that a call takes."""
        found: list[AssumedValue] = []
        by_key: dict[str, Action] = {each.key: each for each in self._graph.actions}
        for arrow, handed in value_arrows(self._graph):
            if by_key[arrow.child].full_name != node:
                continue
            source = by_key[arrow.parent].full_name
            end = newest.get(source)
            if end is None:
                continue
            names = {remap.source: remap.target for remap in arrow.remap}
            for output in handed:
                name = names.get(output, output)
                value = end.returned.outputs.get(output)
                if value is not None and self._inputs[number].get(name) == value:
                    text = msgspec.json.encode(value).decode()
                    found.append(AssumedValue(node, name, source, text, end.at))
        return found

    def _lacks(
        self, under_way: tuple[UnderWay, ...], choices: dict[str, Choice], *, goes_on: bool
    ) -> str:
        names = [each.action for each in under_way]
        if unknown := [name for name in choices if name not in names]:
            return (
                f"{unknown[0]} was not under way when that run ended: there is nothing to choose."
            )
        for name, choice in choices.items():
            if choice == "leave" and (follower := self._follows_a_stop(name)):
                return (
                    f"{follower} would begin after {name}, since an arrow leads there when it is "
                    "stopped: choose something else."
                )
        if missing := [name for name in names if name not in choices]:
            return (
                f"{_listed(missing)} had begun and had no outcome: choose for each whether it begins "
                "again, is taken as done, or nothing goes on from it."
            )
        return "" if goes_on else "Nothing would begin: that run had nothing left to do."

    def _follows_a_stop(self, name: str) -> str:
        key = self._actions[name].key
        names = {each.key: each.full_name for each in self._graph.actions}
        for each in self._graph.relations:
            if each.parent == key and each.conditions.on_stopped != "ignore":
                return names.get(each.child, "the end of the graph")
        return ""


_OUTCOME_OF: Final[dict[Choice, Precondition]] = {
    "true": "on_true",
    "false": "on_false",
    "error": "on_error",
}


def _told(outcome: Precondition) -> Precondition:
    """Return an outcome as the engine is told it: what it stopped it calls stopped by itself."""
    return "on_true" if outcome == "on_stopped" else outcome


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return f"{', '.join(names[:3])}{more}"
