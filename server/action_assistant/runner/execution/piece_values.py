"""The values that pieces of a led run give each other.

The engine of the whole graph holds them: it says with which inputs an action begins, and is told the
outputs that an answer of the robot showed (`umrf.kept_values`).
"""

from collections.abc import Collection, Mapping
from typing import Literal

import msgspec

from action_assistant.runner.execution.conducted_steps import Step
from action_assistant.runner.runs.events import PieceEnded
from action_assistant.runner.start.piece_texts import PieceText
from action_assistant.umrf.kept_values import KeptOutput, kept_outputs, names_in_words
from action_assistant.umrf.model import Precondition
from action_assistant.umrf.semantics import Returned


class GivenOutputs(msgspec.Struct, frozen=True):
    """The output values of a piece that has ended, as `PieceEnded` stores them. `values`: JSON
    texts by flat name; `unset`: the names of outputs that the action has not set."""

    values: dict[str, str] = {}
    unset: tuple[str, ...] = ()


class PieceValues:
    """Fills the values of inputs into the texts of pieces, and reads the outputs of pieces.
    `texts`: the pieces by full name of their action; `keeping`: the robots that have the helper
    package, by which outputs can be read."""

    def __init__(self, texts: Mapping[str, PieceText], keeping: Collection[str]) -> None:
        self._texts = texts
        self._keeping = frozenset(keeping)
        self._outputs: dict[str, tuple[KeptOutput, ...]] = {}  # by node, as they are asked for
        self._kept_parts: dict[str, tuple[str, ...]] = {}
        self._said: set[tuple[str, tuple[str, ...]]] = set()

    def text(self, step: Step, piece: str) -> str:
        """Return the UMRF text of the piece of this step, with the values of its inputs filled in.
        `piece`: the id of its run."""
        text = self._texts[step.node]
        parts = text.parts
        if self._kept(step):
            if step.node not in self._kept_parts:
                self._kept_parts[step.node] = text.kept_parts()
            parts = self._kept_parts[step.node]
        return text.for_run(piece, step.call.inputs, parts)

    def tells_false_by_rest(self, step: Step) -> bool:
        """Return whether the graph of a step goes on after its action has ended with false, and with
        no other outcome."""
        return self._texts[step.node].taken_on_false and bool(self._kept(step))

    def why_unknown(self, step: Step) -> str:
        """Return why the output values of a step are not known, as part of a sentence. Return "" if
        they are known, or if no other step takes them."""
        if step.run is None or not self._kept(step):
            return ""
        return step.run.kept.wrong if self._texts[step.node].is_taken else ""

    def ended(
        self, step: Step, outcome: Precondition, how: Literal["shape", "word", "unsent"], at: int
    ) -> PieceEnded:
        """Return the event that ends the call of a step with this outcome, with the output values.
        `how`: it was told by states of the robot ("shape"), by a person ("word"), or no piece was
        sent ("unsent"); `at`: µs UTC."""
        given = self._given(step, outcome, how)
        return PieceEnded(
            at=at,
            call=step.call.number,
            node=step.node,
            outcome=outcome,
            how=how,
            piece=step.run.id if step.run is not None else "",
            by=step.word.by if step.word is not None else None,
            reason=step.word.reason if step.word is not None else "",
            outputs=given.values,
            unset=given.unset,
            request_id=step.word.request_id if step.word is not None else "",
        )

    def lacking(self, ended: PieceEnded) -> str:
        """Return once, as the end of a sentence, which outputs a call that has ended did not set; "" if
        none is unset, or if that was reported before."""
        if not ended.unset or ended.how == "unsent" or (ended.node, ended.unset) in self._said:
            return ""
        self._said.add((ended.node, ended.unset))
        names = names_in_words(ended.unset)
        is_unseen = ended.how == "word"
        known = "has ended, without a sight of" if is_unseen else "has ended without giving"
        return f"{known} {names}: nothing is handed on from there."

    def _kept(self, step: Step) -> tuple[KeptOutput, ...]:
        """Return the outputs of a step that keepers (helper actions in its piece) hold for reading;
        () if its robot does not have the helper package."""
        if step.engine not in self._keeping:
            return ()
        if step.node not in self._outputs:
            self._outputs[step.node] = kept_outputs(self._texts[step.node].action)
        return self._outputs[step.node]

    def _given(self, step: Step, outcome: Precondition, how: str) -> GivenOutputs:
        text = self._texts[step.node]
        is_shown = outcome == "on_true" or (outcome == "on_false" and text.taken_on_false)
        outputs = self._kept(step)
        if step.run is None or not outputs or not is_shown:
            return GivenOutputs()
        names = tuple(each.name for each in outputs)
        if how != "shape" or step.run.kept.wrong:
            return GivenOutputs(unset=names if text.is_taken else ())
        kept = step.run.kept.values
        values = {each.name: kept[each.key] for each in outputs if each.key in kept}
        return GivenOutputs(values, tuple(name for name in names if name not in values))


def returned_of(ended: PieceEnded) -> Returned:
    """Return the end of a call in the form in which the engine of the whole graph takes it: what it
    stopped it calls stopped by itself."""
    is_of_engine = ended.outcome == "on_stopped" and ended.how != "deadline"
    return Returned(
        number=ended.call,
        result="on_true" if is_of_engine else ended.outcome,
        outputs={name: msgspec.json.decode(text) for name, text in ended.outputs.items()},
        unset=ended.unset,
    )
