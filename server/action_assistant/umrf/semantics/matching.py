"""Which indexed action or graph a node stands for (SPEC 2.1)."""

from action_assistant.umrf.jsontext import parse_small
from action_assistant.umrf.model import ENTRY, EXIT, Graph, Parameter, Signature
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.semantics.parts import Node


def has_action(node: Node, known: Signature | None) -> bool:
    """Whether an indexed action has exactly the parameters of a node."""
    return (
        known is not None
        and set(node.inputs) == set(known.inputs)
        and set(node.outputs) == set(known.outputs)
    )


def fits(node: Node, sub: Graph) -> bool:
    """Whether an indexed graph has the signature that a node expects."""
    entries = {r.child for r in sub.relations if r.parent == ENTRY}
    exits = sorted((r.child_order, r.parent) for r in sub.relations if r.child == EXIT)
    inputs: set[str] = set()
    outputs: set[str] = set()
    for action in sub.actions:
        if action.key in entries:
            inputs |= {name for name, has_value in _leaves(action.inputs) if not has_value}
    for _, key in exits:
        own = {name for a in sub.actions if a.key == key for name, _ in _leaves(a.outputs)}
        outputs = own or outputs
    return set(node.inputs) == inputs and set(node.outputs) == outputs


def _leaves(parameters: tuple[Parameter, ...]) -> list[tuple[str, bool]]:
    found = []
    for parameter in parameters:
        leaf = parse_small(parameter.text)
        if isinstance(leaf, dict) and "pvf_type" in leaf:
            found.append((flat_name(parameter.path), "pvf_value" in leaf))
    return found
