"""Which of two values a key has when both sides went on from a third: the one rule of every merge. Pure."""

from typing import Literal, TypeAlias

from action_assistant.editor.documents.document import is_same

#: Whose value counts: of those into whom is merged, of those who are merged, or that is to be asked.
Side: TypeAlias = Literal["ours", "theirs"]


def chosen(base: object, ours: object, theirs: object) -> Side | None:
    """Return the side whose value wins; None where both sides changed it in different ways. UNSET stands for no
    value."""
    if is_same(ours, theirs) or is_same(theirs, base):
        return "ours"
    return "theirs" if is_same(ours, base) else None
