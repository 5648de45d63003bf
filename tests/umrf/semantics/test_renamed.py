"""Outputs reach inputs as in the vectors that the page reads, too."""

import json
from pathlib import Path

import pytest

from action_assistant.umrf.model import Remap
from action_assistant.umrf.semantics.values import RemapUnknown, Slot, renamed

VECTORS = json.loads(
    (Path(__file__).parents[2] / "vectors" / "handed-over.json").read_text(encoding="utf-8")
)


def slots(names: list[str]) -> dict[str, Slot]:
    return {name: Slot(name, {"pvf_type": "number"}) for name in names}


@pytest.mark.parametrize(("outputs", "remap", "inputs", "found"), VECTORS)
def test_outputs_reach_inputs_as_the_vectors_say(
    outputs: list[str],
    remap: list[list[str]],
    inputs: list[str],
    found: dict[str, str] | None,
) -> None:
    renamings = [Remap(source, target) for source, target in remap]
    if found is None:
        with pytest.raises(RemapUnknown):
            renamed(slots(outputs), renamings, slots(inputs))
    else:
        assert renamed(slots(outputs), renamings, slots(inputs)) == found
