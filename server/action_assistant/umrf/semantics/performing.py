"""What carries actions out where no script does: a port. What stands behind it is nobody's business here.

A performed action never ends by itself: whoever performs it says when (`Engine.returned`).
"""

from typing import Any, Final, Protocol

import msgspec

from action_assistant.umrf.semantics.parts import Execution, Node, Running
from action_assistant.umrf.semantics.script import Behaviour
from action_assistant.umrf.semantics.values import Opaque

#: What the engine makes of a call that somebody performs.
PERFORMED: Final = Behaviour(never=True, ignores_stop=True)


class Call(msgspec.Struct, frozen=True, kw_only=True):
    """One call of an action's code; `number` is its own in this engine. `graph` is a running name,
    `node` a full name. `inputs`: values by flat name (`pose::x`), numbers as doubles, without those
    of which only actions know the type. `outputs`: the type of each by flat name."""

    number: int
    graph: str
    node: str
    name: str
    inputs: dict[str, Any]
    outputs: dict[str, str]


class Returned(msgspec.Struct, frozen=True, kw_only=True):
    """A call of which nothing goes on any more. `result`: one of `OUTCOMES`. `outputs`: values of
    the type that the call named, by flat name. `message`: what it had to say."""

    number: int
    result: str
    outputs: dict[str, Any] = {}
    message: str | None = None


class Performer(Protocol):
    """Carries out calls beside the engine. No method waits."""

    def performs(self, name: str) -> bool:
        """Whether actions of this name are its own, rather than the script's."""

    def begin(self, call: Call) -> None:
        """A call begins."""

    def stop(self, number: int) -> None:
        """It shall end soon."""

    def pause(self, number: int) -> None:
        """It shall hold."""

    def resume(self, number: int) -> None:
        """It may go on."""

    def give_up(self, number: int) -> str | None:
        """The engine has waited for long enough: the call is ended by force, which is told as a
        return like any other. What it had to say."""


class PerformedCalls:
    """The calls of one engine that somebody performs, as long as anything of them goes on. Without a
    performer there are none, and nothing happens."""

    def __init__(self, performer: Performer | None) -> None:
        self._performer = performer
        self._going: dict[int, tuple[Running, Node, Execution]] = {}
        self._newest = 0

    def performs(self, name: str) -> bool:
        """Whether actions of this name are performed."""
        return self._performer is not None and self._performer.performs(name)

    def begin(self, graph: Running, node: Node) -> None:
        """The action's code is called."""
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
        """The action is told to stop."""
        if self._performer is not None and (number := self._number(node)):
            self._performer.stop(number)

    def pause(self, node: Node) -> None:
        """The action is told to hold."""
        if self._performer is not None and (number := self._number(node)):
            self._performer.pause(number)

    def resume(self, node: Node) -> None:
        """The action is told to go on."""
        if self._performer is not None and (number := self._number(node)):
            self._performer.resume(number)

    def give_up(self, node: Node) -> str | None:
        """The engine waits no longer for the action; what there is to say of it."""
        if self._performer is not None and (number := self._number(node)):
            return self._performer.give_up(number)
        return None

    def take(self, number: int) -> tuple[Running, Node, Execution] | None:
        """A call that goes on no more: whose it was."""
        return self._going.pop(number, None)

    def _number(self, node: Node) -> int:
        """Of the call that goes on; 0 if there is none."""
        number = node.execution.number if node.execution is not None else 0
        return number if number in self._going else 0
