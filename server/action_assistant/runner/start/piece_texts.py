"""The texts of the pieces of a conducted run: written once, filled in for each call.

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
    KeptOutput,
    as_json,
    handing,
    kept_outputs,
    receiving,
    taken_on_false,
    with_keepers,
)
from action_assistant.umrf.led_subgraphs import Inside, graphs_within
from action_assistant.umrf.model import Action, Graph, JsonText, Key, Parameter
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.pieces import piece_name, piece_of


class PieceText(msgspec.Struct, frozen=True, kw_only=True):
    """The text of a piece, in `parts` between which the id of its run stands; with keepers of the
    outputs in `kept_parts`, empty if there is nothing to keep. `action`: the one that it sends;
    `inside`: the graphs inside of it, by name, empty if it stands for none.

    `inputs`: the leaves that get a value for each call, by flat name, as JSON without one; in the text
    their flat name stands in `marks`. `outputs`: those that keepers take. `is_taken`: some arrow hands
    them on; `taken_on_false`: also after false, see `with_keepers`.
    """

    parts: tuple[str, ...]
    action: Action
    inside: dict[str, Graph] = {}
    kept_parts: tuple[str, ...] = ()
    inputs: dict[str, JsonText] = {}
    marks: dict[str, str] = {}
    outputs: tuple[KeptOutput, ...] = ()
    is_taken: bool = False
    taken_on_false: bool = False

    def for_run(self, run: str, values: Mapping[str, Any], *, keeps: bool) -> str:
        """Return the text with the id of this run. `values`: those of the inputs, by flat name, as the
        whole graph has them now; `keeps`: with keepers."""
        parts = self.kept_parts if keeps and self.kept_parts else self.parts
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
    inputs, on_false = receiving(graph), taken_on_false(graph)
    takers = frozenset(each.parent for each, _ in handing(graph))
    return {
        action.full_name: _text_of(
            graph, action, inside, stamp, inputs.get(action.key, frozenset()), takers, on_false
        )
        for action in graph.actions
        if not action.missing
    }


def _text_of(
    graph: Graph,
    action: Action,
    inside: Inside,
    stamp: codec.Stamp,
    given: frozenset[str],
    taken: frozenset[Key],
    on_false: frozenset[Key],
) -> PieceText:
    """Return the text of one piece. `given`: the inputs that other actions give; `taken` and
    `on_false`: the actions whose outputs others take, and those where they do that after false."""
    own = {name: inside[name] for name in sorted(graphs_within(action, inside))}
    visit = (stamp.run or "") if own else ""
    plain = codec.write(piece_of(graph, action, visit), stamp)
    open_, leaves, marks = _opened(action, given, plain)
    piece = piece_of(graph, open_, visit)
    kept = kept_outputs(action)
    whole = with_keepers(piece, open_, taken_on_false=action.key in on_false) if kept else None
    return PieceText(
        parts=_split(codec.write(piece, stamp), marks, stamp),
        action=action,
        inside=own,
        kept_parts=_split(codec.write(whole, stamp), marks, stamp) if whole is not None else (),
        inputs=leaves,
        marks=marks,
        outputs=kept,
        is_taken=action.key in taken,
        taken_on_false=bool(kept) and action.key in on_false,
    )


def _opened(
    action: Action, given: frozenset[str], text: str
) -> tuple[Action, dict[str, JsonText], dict[str, str]]:
    """Return an action with marks in place of the inputs that others give, the leaves without a value,
    and the marks, by flat name. `text`: no mark is part of it."""
    leaves: dict[str, JsonText] = {}
    marks: dict[str, str] = {}
    inputs: list[Parameter] = []
    sign = "?"
    while f"{sign}input " in text:
        sign += "?"
    for parameter in action.inputs:
        leaf, name = parse_small(parameter.text), flat_name(parameter.path)
        if name not in given or not isinstance(leaf, dict) or name in leaves:
            inputs.append(parameter)
            continue
        leaves[name] = dump({key: value for key, value in leaf.items() if key != "pvf_value"})
        marks[name] = f'"{sign}input {len(leaves)}{sign}"'
        inputs.append(Parameter(parameter.path, marks[name]))
    return msgspec.structs.replace(action, inputs=tuple(inputs)), leaves, marks


def _split(text: str, marks: Mapping[str, str], stamp: codec.Stamp) -> tuple[str, ...]:
    assert all(text.count(mark) == 1 for mark in marks.values())
    return tuple(text.split(stamp.run)) if stamp.run else (text,)
