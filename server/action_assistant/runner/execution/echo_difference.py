"""The difference between the graph that an engine shows and the one that was sent. Pure.

See docs/umrf-and-the-engine.md 1.4.
"""

from action_assistant.umrf.digest import digest
from action_assistant.umrf.echo import echo
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph


def differs(sent: str, text: str) -> str:
    """As `difference`, of the text that was sent. For workers."""
    return difference(codec.read(sent).graph, text)


def difference(sent: Graph, text: str) -> str:
    """In which way a graph as an engine wrote it differs from the one that was sent, in words; ""
    when it is the same."""
    try:
        seen = codec.read(text).graph
    except codec.Unreadable as wrong:
        return f"it cannot be read ({wrong.message})"
    ours, theirs = echo(sent, PINNED), echo(seen, PINNED)
    if digest(ours) == digest(theirs):
        return ""
    mine = {action.full_name for action in ours.actions}
    others = {action.full_name for action in theirs.actions}
    if mine != others:
        missing, more = sorted(mine - others)[:3], sorted(others - mine)[:3]
        parts = [f"it lacks {', '.join(missing)}"] if missing else []
        parts += [f"it has {', '.join(more)}, too"] if more else []
        return f"{'; '.join(parts)}."
    changed = [
        one.full_name
        for one, other in zip(ours.actions, theirs.actions, strict=True)
        if (one.name, one.inputs, one.outputs, one.actor)
        != (other.name, other.inputs, other.outputs, other.actor)
    ]
    return f"{', '.join(changed[:3])} differ." if changed else "the arrows differ."
