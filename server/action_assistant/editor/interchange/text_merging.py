"""An edited text merged into a graph that may have changed since: key by key, or not at all. For workers."""

import msgspec
from msgspec import UNSET

from action_assistant.editor.documents.contents import GraphAtSeq, Inside, maps_of, read
from action_assistant.editor.documents.document import Maps
from action_assistant.editor.interchange.changes import setting
from action_assistant.editor.interchange.edited_text import KeyChange, text_edit
from action_assistant.editor.interchange.three_way import chosen
from action_assistant.umrf.model import Problem


class MergingOutcome(msgspec.Struct, frozen=True):
    """The update that brings in what an edited text changes. `conflicts`: keys that somebody else has
    given another value meanwhile; then there is no update. `problems`: errors that come with it."""

    update: bytes
    conflicts: tuple[str, ...]
    problems: tuple[Problem, ...]


def merging(then: GraphAtSeq, state: bytes, text: bytes, inside: Inside) -> MergingOutcome:
    """Merge an edited text into a graph that may have changed since. `text` was edited from that of the moment
    `then`; `state` is the document now; `inside` are the graphs inside.

    Raises BadInput, NotUmrf, TooLarge with the place.
    """
    found = read(then)
    edit = text_edit(found.moment, text, found.problems(inside), inside)
    now = maps_of(state)
    conflicts = tuple(each.key for each in edit.changes if _is_other(now, each))
    if conflicts:
        return MergingOutcome(b"", conflicts, edit.problems)
    targets = {(each.root, each.key): each.after for each in edit.changes}
    return MergingOutcome(setting(state, targets), (), edit.problems)


def _is_other(now: Maps, change: KeyChange) -> bool:
    """Tell whether a key has neither the value from before the edit nor the wanted one."""
    value = now.get(change.root, {}).get(change.key, UNSET)
    return chosen(change.before, value, change.after) is None
