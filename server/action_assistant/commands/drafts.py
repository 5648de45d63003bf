"""`drafts`: the drafts of a graph, what they did, and merging them."""

import argparse
from collections.abc import Iterable
from typing import Any, Final

import msgspec

from action_assistant.commands.client import No, Server, command, print_json, refused, running
from action_assistant.errors import CannotStart
from action_assistant.safe_text import one_line
from action_assistant.umrf.difference import Difference
from action_assistant.umrf.difference_text import lines

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
        try:
            graph = server.graph_id(options.graph)
            drafts = server.editor("GET", f"/api/graphs/{graph}/drafts").json()
        except No as error:
            return refused(error)
    if options.json:
        print_json(drafts)
        return 0
    for each in drafts:
        apart = f"{each['ahead']} ahead, {each['behind']} behind"
        print(one_line(f"{each['id']}  {each['state']}  {apart}  {each['name']}"))
    return 0


def _new(options: argparse.Namespace) -> int:
    wanted = {"name": options.name, "seq": options.at}
    with running(options) as server:
        try:
            graph = server.graph_id(options.graph)
            made = server.editor("POST", f"/api/graphs/{graph}/drafts", json=wanted).json()
        except No as error:
            return refused(error)
    print(made["id"])
    return 0


def _merge(options: argparse.Namespace) -> int:
    asked = {"into": options.into, "choices": _choices(options.choose)}
    with running(options) as server:
        try:
            below = f"/api/drafts/{options.draft}"
            seen = server.editor("POST", f"{below}/preview", json=asked).json()
            if options.json and options.look:
                print_json(seen)
                return 0
            _tell(seen)
            left = [each for each in seen["conflicts"] if each["place"] not in asked["choices"]]
            _tell_conflicts(left)
            if options.look or left:
                return 1 if left else 0
            return _merged(server, below, seen, asked)
        except No as error:
            return refused(error)


def _merged(server: Server, below: str, seen: dict[str, Any], asked: dict[str, Any]) -> int:
    moments = {"seq": seen["seq"], "draft_seq": seen["draft_seq"]}
    done = server.editor("POST", f"{below}/merge", json=asked | moments).json()
    print(f"merged: change {done['seq']}" if done["changed"] else "Nothing is to be merged.")
    return 0


def _choices(words: Iterable[str]) -> dict[str, str]:
    """Return the side that was chosen for each place. Raise CannotStart for a word of another form."""
    found = {}
    for each in words:
        place, equals, side = each.rpartition("=")
        if not equals or side not in _SIDES:
            raise CannotStart(f"{each!r} is no PLACE=origin or PLACE=draft.")
        found[place] = side
    return found


def _tell(seen: dict[str, Any]) -> None:
    for line in _lines(seen["changes"]):
        print(one_line(line))
    for problem in seen["problems"]:
        print(one_line(f"! {problem['message']}"))


def _tell_conflicts(conflicts: Iterable[dict[str, Any]]) -> None:
    for each in conflicts:
        print(one_line(f"? both changed {each['what']}: --choose '{each['place']}=origin|draft'"))
        for side in _SIDES:
            did = ["removed it"] if each["removed"] == side else _lines(each[side])
            for line in did:
                print(one_line(f"    {side}: {line.strip()}"))


def _lines(changes: dict[str, Any]) -> list[str]:
    empty = {"before": 0, "after": 0, "fields": [], "actions": [], "relations": []}
    return [*lines(msgspec.convert(empty | changes, Difference))]
