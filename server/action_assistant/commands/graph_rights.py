"""`rights`: who may see and who may edit a graph, or the graphs in a folder."""

import argparse
from typing import TYPE_CHECKING, Final

import msgspec

from action_assistant.commands.answers import decoded
from action_assistant.commands.client import Server, add_server, print_json, running
from action_assistant.commands.folders import folder_id, known_folders, tell_runner_rules
from action_assistant.errors import RequestRefused
from action_assistant.safe_text import one_line
from action_assistant.web.auth.graph_rules import OPEN, Rule, Who, rule_words
from action_assistant.web.auth.keys import PersonRef

if TYPE_CHECKING:  # slow to load, and most calls do not need it
    from action_assistant.editor.api.graph_rights import RuleView

_ALL: Final = "all"
_NOBODY: Final = "nobody"


def _add_rights(rights: argparse.ArgumentParser) -> None:
    rights.description = (
        "Shows or sets who may see and who may edit a graph, or the graphs in a folder. Owners may "
        "always do both; editing takes a role that allows it, too."
    )
    thing = rights.add_mutually_exclusive_group(required=True)
    thing.add_argument("graph", nargs="?", metavar="GRAPH", help="id or name")
    thing.add_argument("--folder", metavar="FOLDER", help="path or id")
    names = "names or ids of persons and groups; 'all', or 'nobody' for owners alone"
    rights.add_argument("--see", nargs="+", metavar="WHO", help=names)
    rights.add_argument(
        "--edit", nargs="+", metavar="WHO", help="as --see; 'all' for all who may see"
    )
    rights.add_argument(
        "--inherit",
        action="store_true",
        help="remove its rule: that of the folder around it counts",
    )
    rights.add_argument("--json", action="store_true", help="as JSON, for programs")
    add_server(rights, "patrol --see 'night shift' Ann --edit Ann")
    rights.set_defaults(handler=_rights)


COMMANDS: Final = {"rights": _add_rights}


def _rights(options: argparse.Namespace) -> int:
    """Show or set the rule of a graph or folder, and return the exit code."""
    from action_assistant.editor.api.graph_rights import RuleView

    changes = options.see is not None or options.edit is not None
    if changes and options.inherit:
        raise RequestRefused("--inherit removes the rule; leave --see and --edit out.")
    with running(options) as server:
        path, what = _thing(server, options), "them" if options.folder else "it"
        view = decoded(server.editor("GET", path), RuleView)
        known = _known(server)
        if changes:
            rule = Rule(
                view.counts.readers if options.see is None else _who(options.see, known),
                view.counts.editors if options.edit is None else _who(options.edit, known),
            )
            view = _put(server, path, rule)
        elif options.inherit:
            view = _put(server, path, None)
    if options.json:
        print_json(view)
        return 0
    names = {each.id: each.name for each in known}
    print(one_line(rule_words(view.counts, what, lambda each: names.get(each, ""))))
    if view.own is None and view.counts != OPEN:
        print("So says the folder around it.")
    return 0


def _thing(server: Server, options: argparse.Namespace) -> str:
    """Return the path of the rule of the graph or folder that is named."""
    if options.folder is None:
        return f"/api/graphs/{server.graph_id(options.graph)}/rule"
    folder = folder_id(known_folders(server), options.folder)
    if folder is None:
        raise RequestRefused("Name a folder; / stands for none.")
    return f"/api/folders/{folder}/rule"


def _known(server: Server) -> list[PersonRef]:
    """Return the persons and groups that a rule may name."""
    members = server.editor("GET", "/api/members").json()
    found = [*members["people"], *members["groups"], *server.editor("GET", "/api/people").json()]
    return list({each["id"]: PersonRef(each["id"], each["name"]) for each in found}.values())


def _who(asked: list[str], known: list[PersonRef]) -> Who:
    """Return the persons and groups with these names or ids. Raise RequestRefused unless each name
    stands for exactly one."""
    if asked == [_ALL]:
        return "all"
    if asked == [_NOBODY]:
        return ()
    found = []
    for text in asked:
        meant = [each.id for each in known if each.id == text] or [
            each.id for each in known if each.name.casefold() == text.casefold()
        ]
        if len(meant) != 1:
            raise RequestRefused(
                f"No person or group is called {text!r}."
                if not meant
                else f"{len(meant)} are called {text!r}; name one by id: {', '.join(meant)}."
            )
        found.append(meant[0])
    return tuple(dict.fromkeys(found))


def _put(server: Server, path: str, rule: Rule | None) -> "RuleView":
    """Store a rule at the editor, and bring all rules to the runner. Return the rule that counts."""
    from action_assistant.editor.api.graph_rights import RuleView

    body = {"rule": None if rule is None else msgspec.to_builtins(rule)}
    view = decoded(server.editor("PUT", path, json=body), RuleView)
    tell_runner_rules(server)
    return view
