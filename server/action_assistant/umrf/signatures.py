"""What an action file says about its action, for libraries."""

from action_assistant.umrf.jsontext import parse_small
from action_assistant.umrf.model import Action, Parameter, Signature
from action_assistant.umrf.parameters import flat_name


def signature_of(action: Action) -> Signature:
    """The signature of an action as its own file describes it."""
    inputs, optional = _types(action.inputs)
    outputs, _ = _types(action.outputs)
    return Signature(inputs=inputs, outputs=outputs, optional=optional)


def _types(parameters: tuple[Parameter, ...]) -> tuple[dict[str, str], frozenset[str]]:
    types: dict[str, str] = {}
    optional: set[str] = set()
    for parameter in parameters:
        leaf = parse_small(parameter.text)
        if isinstance(leaf, dict) and isinstance(kind := leaf.get("pvf_type"), str):
            name = flat_name(parameter.path)
            types[name] = kind
            if leaf.get("pvf_required") is False:
                optional.add(name)
    return types, frozenset(optional)
