"""A graph as numbers and bit masks, for the fast rules of the checks.

It is built from the same nodes and edges as the engine's graph (`parts.build`), so that both mean
one graph. Each action has an index, and `Network.exit` is one more. Times are milliseconds, all of
them exact in a double, since sums are compared.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import Final, NamedTuple

from action_assistant.umrf.components import Mask, reachable
from action_assistant.umrf.model import PRECONDITIONS, Graph, Precondition, Response
from action_assistant.umrf.semantics.parts import RESERVED, Edge, Node, Running, build
from action_assistant.umrf.semantics.script import Behaviour
from action_assistant.umrf.semantics.values import (
    MISSING,
    RemapUnknown,
    Slot,
    fill_outputs,
    renamed,
)

#: The length of a round, which is about the time that an action takes, and the step by which ends of different
#: actions differ within it. No two actions end at the same time, so the order of their reports is always the same.
ROUND_MS: Final = 1_000.0
STEP_MS: Final = 1 / 16
STOP_MS: Final = 50.0


class EdgeQuestion(NamedTuple):
    """One edge of a graph, by which a parent that ends asks a child for its response. `child`: the
    index of the child; `responses`: the child's response to each outcome.

    `link`: the parent's bit among the child's required parents. `given`: the inputs of the child
    that the parent's outputs fill, before and after the parent has first run; None if the renaming
    kills the engine.
    """

    child: int
    responses: dict[Precondition, Response]
    link: Mask
    given: tuple[Mask, Mask] | None


class Network:
    """Holds a graph as numbers. A mask of parents or inputs has one bit for each parent or input of
    one action.

    `names`: full names by index; `index`: indices by full name. `needs`: the required parents of
    each action, `wants`: its required inputs, `has`: its inputs that hold a value from the start.
    `able`: False for actions whose name the engine never runs. `late`: the time in ms at which each
    action ends within a round of `round_ms`. `edges`: the edges of each action; None in place of an
    edge at which the engine aborts.
    """

    def __init__(self, graph: Graph, *, slower_first: bool = False) -> None:
        running = Running(graph.name, graph, None, None)
        build(running, {action.key: (Behaviour(),) for action in graph.actions})
        self.nodes: list[Node] = list(running.nodes.values())
        count = len(self.nodes)
        self.exit = count
        self.names = [node.full_name for node in self.nodes]
        self.index = {name: number for number, name in enumerate(self.names)}
        self.able = [node.name not in RESERVED for node in self.nodes]
        self.round_ms = ROUND_MS * (1 + count // 8_000)
        late = range(count, 0, -1) if slower_first else range(1, count + 1)
        self.late = [number * STEP_MS for number in late]
        # Stops end at moments of their own, too.
        self.stopping_ms = [STOP_MS + number * STEP_MS / 2**15 for number in range(1, count + 1)]
        every = [*self.nodes, running.exit]
        bits = [_bits(node) for node in every]
        self.required = [{bit: name for name, bit in own.items()} for own in bits]
        self.needs = [sum(own.values()) for own in bits]
        slots = [{name: 1 << n for n, name in enumerate(node.inputs)} for node in every]
        self.wants = [
            sum(own[name] for name, slot in node.inputs.items() if slot.required)
            for node, own in zip(every, slots, strict=True)
        ]
        self.has = [
            sum(own[name] for name, slot in node.inputs.items() if slot.has_value())
            for node, own in zip(every, slots, strict=True)
        ]
        indices = {id(node): number for number, node in enumerate(every)}
        empty: dict[str, Slot] = {}
        self.entry = [_asked(edge, running.entry, (empty, empty), indices, bits, slots) for edge in running.entry.children]  # fmt: skip
        self.edges: list[list[EdgeQuestion | None]] = []
        self._bypasses: dict[Precondition, dict[int, list[int]]] = {}
        for node in self.nodes:
            before = {name: slot for name, slot in node.outputs.items() if slot.has_value()}
            kinds = before, node.outputs
            row = [_asked(edge, node, kinds, indices, bits, slots) for edge in node.children]
            fill_outputs(node.outputs, None)
            self.edges.append(row)

    def due(self, index: int, now_ms: float) -> float:
        """Return the time in ms at which the action `index` ends if it begins at `now_ms`: its own
        time within the next round."""
        return (now_ms // self.round_ms + 1) * self.round_ms + self.late[index]

    @cached_property
    def reachable(self) -> list[Mask]:
        """Return for each action, as a mask, the actions and the exit to which a path of arrows
        leads from it."""
        return reachable([[e.child for e in row if e is not None] for row in self.edges])

    @cached_property
    def circling(self) -> dict[str, Mask]:
        """Return for each outcome, as a mask, the actions on a cycle of arrows that all respond to
        this outcome with a bypass: the child does not run, and passes the outcome on."""
        return {outcome: self._circling(outcome) for outcome in PRECONDITIONS}

    @cached_property
    def plain(self) -> dict[str, Mask]:
        """Return for each outcome, as a mask, the actions whose end with it causes only bypasses
        (each child passes the outcome on without running), and halts nothing."""
        return {outcome: self._plain(outcome) for outcome in PRECONDITIONS}

    @cached_property
    def ends(self) -> dict[str, Mask]:
        """Return for each outcome, as a mask, the actions from which arrows lead to the exit that
        all respond to this outcome with a bypass: each child passes the outcome on without running.
        """
        mask = (1 << len(self.nodes)) - 1
        return {o: self._leading(o, {self.exit}) & mask for o in PRECONDITIONS}

    @cached_property
    def last(self) -> list[int]:
        """Return the indices of the actions with an arrow to the exit."""
        rows = enumerate(self.edges)
        return [index for index, row in rows if any(e and e.child == self.exit for e in row)]

    def _plain(self, outcome: Precondition) -> Mask:
        other = {
            index
            for index, row in enumerate(self.edges)
            if not all(e and e.responses[outcome] in ("bypass", "ignore") for e in row)
            or all(e and e.responses[outcome] == "ignore" for e in row)
        }
        every: Mask = (1 << len(self.nodes)) - 1
        return every & ~self._leading(outcome, other)

    def _leading(self, outcome: Precondition, to: set[int]) -> Mask:
        """Return, as a mask, the actions of `to` and all actions from which bypasses with this
        outcome lead to them."""
        found, stack = set(to), list(to)
        while stack:
            for index in self._bypassing(outcome).get(stack.pop(), ()):
                if index not in found:
                    found.add(index)
                    stack.append(index)
        return sum(1 << index for index in found)

    def _bypassing(self, outcome: Precondition) -> dict[int, list[int]]:
        """Return, for each action that can be bypassed with this outcome, the actions that bypass
        it."""
        if outcome not in self._bypasses:
            found: dict[int, list[int]] = {}
            for index, row in enumerate(self.edges):
                for e in row:
                    if e is not None and e.responses[outcome] == "bypass":
                        found.setdefault(e.child, []).append(index)
            self._bypasses[outcome] = found
        return self._bypasses[outcome]

    def _circling(self, outcome: Precondition) -> Mask:
        ways = [
            [e.child for e in row if e is not None and e.responses[outcome] == "bypass"]
            for row in self.edges
        ]
        if not any(ways):
            return 0
        return sum(1 << index for index, mask in enumerate(reachable(ways)) if mask >> index & 1)


def _bits(node: Node) -> dict[str, Mask]:
    required = [name for name, link in node.links.items() if link.required]
    return {name: 1 << number for number, name in enumerate(required)}


def _asked(
    edge: Edge,
    parent: Node,
    outputs: tuple[dict[str, Slot], dict[str, Slot]],
    indices: dict[int, int],
    bits: Sequence[dict[str, Mask]],
    slots: Sequence[dict[str, Mask]],
) -> EdgeQuestion | None:
    """Return an edge in numbers; None if the engine aborts at this edge, since the child is missing
    or does not list the parent. `outputs`: the parent's outputs that have a value before its first
    run, and all of its outputs. `indices`: the indices of the actions; `bits`, `slots`: by index of
    the action, the bits of its required parents and of its inputs."""
    link = edge.child.links.get(parent.full_name) if edge.child is not None else None
    if edge.child is None or link is None:
        return None
    child = indices[id(edge.child)]
    responses = {o: link.conditions.answer(o) for o in PRECONDITIONS}
    bit = bits[child].get(parent.full_name, 0)
    try:
        found = renamed(parent.outputs, edge.remap, edge.child.inputs)
    except RemapUnknown:
        return EdgeQuestion(child, responses, bit, None)
    before = after = 0
    for name, source in found.items():
        slot = parent.outputs[source]
        if _takes(edge.child.inputs[name], slot):
            after |= slots[child][name]
            before |= slots[child][name] if source in outputs[0] else 0
    return EdgeQuestion(child, responses, bit, (before, after))


def _takes(target: Slot, source: Slot) -> bool:
    """Return whether the input `target` accepts the value that the output `source` holds once its
    action has run."""
    filled = {source.name: _copy(source)}
    fill_outputs(filled, None)
    probe = _copy(target)
    probe.value = MISSING
    probe.receive(source.type, filled[source.name].value)
    return probe.has_value()


def _copy(slot: Slot) -> Slot:
    same = Slot(slot.name, {"pvf_type": slot.type})
    same.value, same.updatable, same.allowed = slot.value, slot.updatable, slot.allowed
    return same
