"""`drafts`: the drafts of a graph, what they did, and merging them."""

import argparse
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Final

from action_assistant.commands.answers import decoded
from action_assistant.commands.client import Server, command, print_json, running
from action_assistant.errors import CannotStart
from action_assistant.safe_text import one_line
from action_assistant.umrf.difference import Difference
from action_assistant.umrf.difference_text import lines

if TYPE_CHECKING:  # slow to load, and most calls do not need them
    from action_assistant.editor.history.change_summaries import Changes
    from action_assistant.editor.history.drafts.draft_merges import MergePreview
    from action_assistant.editor.history.drafts.merge_previews import DraftConflict

_SIDES: Final = ("origin", "draft")


def _add_drafts(drafts: argparse.ArgumentParser) -> None:
    drafts.epilog = "example: action-assistant drafts list patrol"
    words = drafts.add_subparsers(dest="word", required=True, metavar="WORD")

    listed = command(words, "list", "the drafts of a graph, the last changed first", "patrol")
    listed.add_argument("graph", metavar="GRAPH", help="id or name")
    listed.add_argument("--json", action="store_true", help="as JSON, for programs")
    listed.set_defaults(handler=_list)

    new = command(words, "new", "make a draft, and print its id", "patrol --name 'gentler grip'")
    new.add_argument("graph", metavar="GRAPH", help="id or name")
    new.add_argument("--name", default="", help="what it is about")
    new.add_argument("--at", type=int, metavar="SEQ", help="of the graph as it was then")
    new.set_defaults(handler=_new)

    merge = command(
        words,
        "merge",
        "bring what a draft did into its graph, or the other way; exit 1 and nothing where something "
        "that both changed has no choice",
        "DRAFT --choose 'actions/AbCdEfGhIjKl|in/speed=draft'",
    )
    merge.add_argument("draft", metavar="DRAFT", help="id")
    merge.add_argument(
        "--into", choices=_SIDES, default="origin", help="which of the two (default: %(default)s)"
    )
    merge.add_argument(
        "--choose",
        action="append",
        default=[],
        metavar="PLACE=SIDE",
        help="whose value counts there, origin or draft; may stand several times",
    )
    merge.add_argument("--look", action="store_true", help="only say what it would do")
    merge.add_argument("--json", action="store_true", help="with --look, as JSON, for programs")
    merge.set_defaults(handler=_merge)


COMMANDS: Final = {"drafts": _add_drafts}


def _list(options: argparse.Namespace) -> int:
    with running(options) as server:
        graph = server.graph_id(options.graph)
        answer = server.editor("GET", f"/api/graphs/{graph}/drafts")
    if options.json:
        print_json(answer.json())
        return 0
    from action_assistant.editor.history.drafts.drafts import DraftView

    for each in decoded(answer, list[DraftView]):
        apart = f"{each.ahead} ahead, {each.behind} behind"
        print(one_line(f"{each.id}  {each.state}  {apart}  {each.name}"))
    return 0


def _new(options: argparse.Namespace) -> int:
    from action_assistant.editor.history.drafts.drafts import DraftView

    wanted = {"name": options.name, "seq": options.at}
    with running(options) as server:
        graph = server.graph_id(options.graph)
        answer = server.editor("POST", f"/api/graphs/{graph}/drafts", json=wanted)
    print(decoded(answer, DraftView).id)
    return 0


def _merge(options: argparse.Namespace) -> int:
    from action_assistant.editor.history.drafts.draft_merges import MergePreview

    asked = {"into": options.into, "choices": _choices(options.choose)}
    with running(options) as server:
        below = f"/api/drafts/{options.draft}"
        answer = server.editor("POST", f"{below}/preview", json=asked)
        if options.json and options.look:
            print_json(answer.json())
            return 0
        preview = decoded(answer, MergePreview)
        _print_preview(preview)
        left = [each for each in preview.conflicts if each.place not in asked["choices"]]
        _print_conflicts(left)
        if options.look or left:
            return 1 if left else 0
        return _merged(server, below, preview, asked)


def _merged(server: Server, below: str, preview: "MergePreview", asked: dict[str, Any]) -> int:
    """Merge as the preview showed, print the result and return the exit code. `below`: the path of
    the draft in the API; `asked`: the request of the preview."""
    from action_assistant.editor.history.drafts.draft_merges import MergedDraft

    moments = {"seq": preview.seq, "draft_seq": preview.draft_seq}
    done = decoded(server.editor("POST", f"{below}/merge", json=asked | moments), MergedDraft)
    print(f"merged: change {done.seq}" if done.changed else "Nothing is to be merged.")
    return 0


def _choices(words: Iterable[str]) -> dict[str, str]:
    """Parse arguments such as `PLACE=draft`; return the chosen side by place of the conflict. Raise
    CannotStart for a malformed argument."""
    found = {}
    for each in words:
        place, equals, side = each.rpartition("=")
        if not equals or side not in _SIDES:
            raise CannotStart(f"{each!r} is no PLACE=origin or PLACE=draft.")
        found[place] = side
    return found


def _print_preview(preview: "MergePreview") -> None:
    for line in changes_lines(preview.changes):
        print(one_line(line))
    for problem in preview.problems:
        print(one_line(f"! {problem.message}"))


def _print_conflicts(conflicts: Iterable["DraftConflict"]) -> None:
    for each in conflicts:
        print(one_line(f"? both changed {each.what}: --choose '{each.place}=origin|draft'"))
        for side, changes in (("origin", each.origin), ("draft", each.draft)):
            did = ["removed it"] if each.removed == side else changes_lines(changes)
            for line in did:
                print(one_line(f"    {side}: {line.strip()}"))


def changes_lines(changes: "Changes") -> list[str]:
    """Return the lines of changes, as `difference_text.lines` prints a difference."""
    parts = changes.fields, changes.actions, changes.relations, changes.notes
    return [*lines(Difference(0, 0, *parts))]
