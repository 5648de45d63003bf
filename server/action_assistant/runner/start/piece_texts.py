"""The texts of the pieces of a led run: written once, filled in for each call.

The id of the run of a piece, and the values that other pieces give, are known only when it is sent.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from action_assistant.runner.runs.events import RunSubgraph
from action_assistant.runner.runs.sent_graphs import graphs_in
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.text import dump, parse_small
from action_assistant.umrf.kept_values import (
    as_json,
    receiving,
    taken_on_false,
    value_arrows,
    with_keepers,
)
from action_assistant.umrf.led_subgraphs import Inside, graphs_within
from action_assistant.umrf.limits import (
    Limit,
    LimitedInputs,
    OverLimit,
    extremes,
    inputs_of,
    over_limits,
    with_received,
)
from action_assistant.umrf.model import Action, Graph, JsonText, Parameter
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.pieces import piece_name, piece_of


class PieceText(msgspec.Struct, frozen=True, kw_only=True):
    """The text of a piece, in `parts` between which the id of its run stands. `action`: the one that
    it sends; `inside`: the graphs inside of it, by name, empty if it stands for none; `piece`: the
    graph that it says, and `stamp` the ids in it.

    `inputs`: the leaves that get a value for each call, by flat name, as JSON without one; in the text
    their `marks` stand. `is_taken`: some arrow hands the outputs on; `taken_on_false`: also after
    false. `limited`: the inputs that have the same value for each call, for the limits of the robot.
    """

    parts: tuple[str, ...]
    action: Action
    piece: Graph
    stamp: codec.Stamp
    inside: dict[str, Graph] = {}
    inputs: dict[str, JsonText] = {}
    marks: dict[str, str] = {}
    is_taken: bool = False
    taken_on_false: bool = False
    limited: LimitedInputs = {}

    def over(self, limits: Sequence[Limit], values: Mapping[str, Any]) -> OverLimit | None:
        """Return what is outside of these limits with the values that `for_run` takes; None if nothing
        is."""
        if not limits:
            return None
        sent = with_received(self.limited, self.action, values, self.inputs)
        return next(over_limits(limits, sent), None)

    def kept_parts(self) -> tuple[str, ...]:
        """Return the parts of the text in which keepers (actions that hold values and never run)
        are added for all outputs of `action`. The id of the run stands between the parts, as in
        `parts`."""
        kept = with_keepers(self.piece, self.action, taken_on_false=self.taken_on_false)
        return _split(codec.write(kept, self.stamp), self.stamp)

    def for_run(self, run: str, values: Mapping[str, Any], parts: tuple[str, ...]) -> str:
        """Return the text with the id of this run. `values`: those of the inputs, by flat name, as the
        whole graph has them now; `parts`: those of the text, or `kept_parts`."""
        text = run.join(parts)
        if not self.marks:
            return text
        leaves = {self.marks[name]: leaf for name, leaf in self.inputs.items()} | {
            self.marks[name]: f'{leaf[:-1]},"pvf_value":{as_json(values[name])}}}'
            for name, leaf in self.inputs.items()
            if name in values
        }
        marks = re.compile("|".join(map(re.escape, leaves)))
        return marks.sub(lambda found: leaves[found[0]], text)  # never inside of a value

    def name(self, graph: str, run: str) -> str:
        """Return the name of the graph in the text for this run. `graph`: the name of the whole
        graph."""
        return piece_name(graph, self.action.full_name, run if self.inside else "")


def piece_texts(umrf: str, subgraphs: Sequence[RunSubgraph]) -> dict[str, PieceText]:
    """Return the pieces of a graph as it was sent, by full name of their action. `subgraphs`: the
    graphs inside, as they were sent along. For workers."""
    return texts_of(codec.read(umrf).graph, graphs_in(subgraphs), codec.stamp_of(umrf))


def texts_of(graph: Graph, inside: Inside, stamp: codec.Stamp) -> dict[str, PieceText]:
    """Return the pieces of a graph, by full name of their action. `stamp`: its run is replaced in each
    text."""
    arrows = tuple(value_arrows(graph))
    inputs, on_false = receiving(graph, arrows), taken_on_false(graph, arrows)
    taken = frozenset(each.parent for each, _ in arrows)
    texts: dict[str, PieceText] = {}
    for action in graph.actions:
        if action.missing:
            continue
        own = {name: inside[name] for name in sorted(graphs_within(action, inside))}
        visit = (stamp.run or "") if own else ""
        given = inputs.get(action.key, frozenset())
        alone = Graph(name=graph.name, actions=(action,))
        leaves, marks, piece, text = _marked(graph, action, visit, stamp, given)
        texts[action.full_name] = PieceText(
            parts=_split(text, stamp),
            action=action,
            piece=piece,
            stamp=stamp,
            inside=own,
            inputs=leaves,
            marks=marks,
            is_taken=action.key in taken,
            taken_on_false=action.key in on_false,
            limited=extremes(inputs_of(alone, own, {action.key: leaves.keys()})),
        )
    return texts


def _marked(
    graph: Graph, action: Action, visit: str, stamp: codec.Stamp, given: frozenset[str]
) -> tuple[dict[str, JsonText], dict[str, str], Graph, str]:
    """Return the leaves of the `given` inputs without a value, and the marks in their places, by flat
    name; the piece with the marks, and its text. No mark is in another place of the text."""
    sign = "?"
    while True:
        leaves: dict[str, JsonText] = {}
        marks: dict[str, str] = {}
        inputs: list[Parameter] = []
        for parameter in action.inputs:
            leaf, name = parse_small(parameter.text), flat_name(parameter.path)
            if name not in given or not isinstance(leaf, dict) or name in leaves:
                inputs.append(parameter)
                continue
            leaves[name] = dump({key: value for key, value in leaf.items() if key != "pvf_value"})
            marks[name] = f'"{sign}input {len(leaves)}{sign}"'
            inputs.append(Parameter(parameter.path, marks[name]))
        opened = msgspec.structs.replace(action, inputs=tuple(inputs)) if marks else action
        piece = piece_of(graph, opened, visit)
        text = codec.write(piece, stamp)
        if all(text.count(mark) == 1 for mark in marks.values()):
            return leaves, marks, piece, text
        sign += "?"


def _split(text: str, stamp: codec.Stamp) -> tuple[str, ...]:
    return tuple(text.split(stamp.run)) if stamp.run else (text,)
