"""The port through which actions are carried out outside of the simulator, where no script says how
they behave.

A performed action never ends by itself: the performer reports its end (`Engine.returned`).
"""

from collections.abc import Mapping
from typing import Any, Final, Protocol

import msgspec

from action_assistant.umrf.model import Action, Precondition
from action_assistant.umrf.semantics.parts import Execution, Node, Running
from action_assistant.umrf.semantics.script import Behaviour
from action_assistant.umrf.semantics.values import Opaque

#: The behaviour of a call that a performer carries out.
PERFORMED: Final = Behaviour(never=True, ignores_stop=True)


class Call(msgspec.Struct, frozen=True, kw_only=True):
    """One call of an action's code. `number` is unique in its engine, `graph` a running name and
    `node` a full name.

    `inputs`: values by flat name (`pose::x`), numbers as doubles, without values whose type only
    actions know. `outputs`: the type of each output by flat name.
    """

    number: int
    graph: str
    node: str
    name: str
    inputs: dict[str, Any]
    outputs: dict[str, str]


class Returned(msgspec.Struct, frozen=True, kw_only=True):
    """The end of a call, sent when none of its code runs any more. `result`: one of `OUTCOMES`, or
    `on_stopped` if something else than the graph has stopped it.

    `outputs`: the values of outputs, of the types that the call named, by flat name; `unset`: outputs
    that are known to have none, others get their default. `message`: a text about the end for people.
    """

    number: int
    result: str
    outputs: dict[str, Any] = {}
    message: str | None = None
    unset: tuple[str, ...] = ()


class Performer(Protocol):
    """Carries out calls of actions outside of the simulated engine, such as by Python code or by
    robots. No method waits. `takes_graphs`: it carries out also actions that stand for graphs, each
    as one call."""

    takes_graphs: bool

    def performs(self, action: Action, *, inside: bool) -> bool:
        """Return whether this performer carries out this action, rather than the script. `inside`:
        it is an action of a sub-graph."""

    def begin(self, call: Call) -> None:
        """Begin to carry out a call; do not wait for its end."""

    def stop(self, number: int) -> None:
        """Ask the call with this number to end soon."""

    def pause(self, number: int) -> None:
        """Ask the call with this number to pause."""

    def resume(self, number: int) -> None:
        """Let the paused call with this number continue."""

    def give_up(self, number: int) -> str | None:
        """End the code of the call with this number by force, since the engine's stop timeout has
        passed, and return a message about it for people, None if there is none. The end is then
        reported like any other return."""

    def ended(self, number: int, result: Precondition, outputs: Mapping[str, Any]) -> None:
        """Take the end of a call that was given back to the script (`Engine.play`). `outputs`: its
        values by flat name."""


class PerformedCalls:
    """Tracks the calls that a performer carries out for one engine until all of their code has
    ended. Without a performer there are none."""

    def __init__(self, performer: Performer | None) -> None:
        self._performer = performer
        self._going: dict[int, tuple[Running, Node, Execution]] = {}
        self._played: dict[Execution, int] = {}  # calls that were given back to the script
        self._newest = 0

    def performs(self, action: Action, *, inside: bool) -> bool:
        """Return whether this action is performed. `inside`: it is an action of a sub-graph."""
        return self._performer is not None and self._performer.performs(action, inside=inside)

    @property
    def takes_graphs(self) -> bool:
        """True if there is a performer and it carries out an action that stands for a graph as one
        call, instead of its actions one by one."""
        return self._performer is not None and self._performer.takes_graphs

    def begin(self, graph: Running, node: Node) -> None:
        """Have the performer begin a call of the code of an action (`node` in `graph`) with its
        current inputs; does nothing if the script plays it."""
        if self._performer is None or node.execution is None:
            return
        self._newest += 1
        node.execution.number = self._newest
        self._going[self._newest] = graph, node, node.execution
        inputs = {
            name: slot.value
            for name, slot in node.inputs.items()
            if slot.has_value() and not isinstance(slot.value, Opaque)
        }
        outputs = {name: slot.type for name, slot in node.outputs.items()}
        call = Call(
            number=self._newest,
            graph=graph.name,
            node=node.full_name,
            name=node.name,
            inputs=inputs,
            outputs=outputs,
        )
        self._performer.begin(call)

    def stop(self, node: Node) -> None:
        """Ask the action's call to end; does nothing if it has no open call."""
        if self._performer is not None and (number := self._number(node)):
            self._performer.stop(number)

    def pause(self, node: Node) -> None:
        """Ask the action's call to pause; does nothing if it has no open call."""
        if self._performer is not None and (number := self._number(node)):
            self._performer.pause(number)

    def resume(self, node: Node) -> None:
        """Let the action's paused call continue; does nothing if it has no open call."""
        if self._performer is not None and (number := self._number(node)):
            self._performer.resume(number)

    def give_up(self, node: Node) -> str | None:
        """End the action's call by force, and return the performer's message, if it has one; None
        if the action has no open call."""
        if self._performer is not None and (number := self._number(node)):
            return self._performer.give_up(number)
        return None

    def take(self, number: int) -> tuple[Running, Node, Execution] | None:
        """Remove the call with this number, which has ended, and return its graph, node and
        execution; None if there is no such call."""
        return self._going.pop(number, None)

    def play(self, number: int) -> tuple[Running, Node, Execution] | None:
        """Give the call with this number back to the script; return its graph, node and execution,
        None if there is no such call."""
        found = self.take(number)
        if found is not None:
            found[2].number = 0
            self._played[found[2]] = number
        return found

    def ended(self, node: Node, result: Precondition) -> None:
        """Tell the performer that the action's call has ended, if it was given back to the script."""
        number = self._played.pop(node.execution, 0) if node.execution is not None else 0
        if self._performer is not None and number:
            outputs = {
                name: slot.value
                for name, slot in node.outputs.items()
                if slot.has_value() and not isinstance(slot.value, Opaque)
            }
            self._performer.ended(number, result, outputs)

    def _number(self, node: Node) -> int:
        """Return the number of the node's open call; 0 without one."""
        number = node.execution.number if node.execution is not None else 0
        return number if number in self._going else 0
