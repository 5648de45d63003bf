"""Routes by which owners say who may see and edit a graph, or the graphs in a folder."""

from typing import Any

import msgspec
from litestar import Request, get, put
from litestar.types import ControllerRouterHandler

from action_assistant.editor.catalogue.graph_rights import Rules
from action_assistant.editor.services import EditorServices, EditorState
from action_assistant.errors import BadInput
from action_assistant.web.auth.access import Needs
from action_assistant.web.auth.graph_rules import Rule, Who
from action_assistant.web.auth.graph_seals import Statement

Asking = Request[Any, Any, Any]


class Ruling(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A new rule; null: that of the folder around it counts."""

    rule: Rule | None


class RuleView(msgspec.Struct, frozen=True):
    """The own rule of a graph or folder, if any, the rule that counts for it, and the one that would
    count without an own one."""

    own: Rule | None
    counts: Rule
    around: Rule


def routes(app_state: EditorState) -> list[ControllerRouterHandler]:
    """Return the routes that read and change the rules of graphs and folders (who may see and edit
    them). Only people with the right "share", who are owners, may call them."""

    @get(
        "/api/graphs/{graph_id:str}/rule",
        summary="Who may see and edit a graph",
        operation_id="getGraphRule",
        guards=[Needs("share")],
    )
    async def get_graph_rule(graph_id: str) -> RuleView:
        return RuleView(*await app_state.services.rights.rules_of("graph", graph_id))

    @put(
        "/api/graphs/{graph_id:str}/rule",
        summary="Say who may see and edit a graph; others who have it open are put out at once",
        operation_id="putGraphRule",
        description='`readers` and `editors` are each `"all"` or ids of persons and groups.',
        guards=[Needs("share")],
    )
    async def put_graph_rule(graph_id: str, data: Ruling, request: Asking) -> RuleView:
        services, person = await app_state.acting(request)
        await services.catalogue.require(graph_id, "graph")
        rule = _checked(services, data.rule, await services.rights.rules_of("graph", graph_id))
        await services.rights.rule_for_graph(graph_id, rule, person.id)
        return RuleView(*await services.rights.rules_of("graph", graph_id))

    @get(
        "/api/folders/{folder_id:str}/rule",
        summary="Who may see and edit the graphs in a folder",
        operation_id="getFolderRule",
        guards=[Needs("share")],
    )
    async def get_folder_rule(folder_id: str) -> RuleView:
        return RuleView(*await app_state.services.rights.rules_of("folder", folder_id))

    @put(
        "/api/folders/{folder_id:str}/rule",
        summary="Say who may see and edit the graphs in a folder",
        operation_id="putFolderRule",
        guards=[Needs("share")],
    )
    async def put_folder_rule(folder_id: str, data: Ruling, request: Asking) -> RuleView:
        services, person = await app_state.acting(request)
        await services.folders.require(folder_id)
        rule = _checked(services, data.rule, await services.rights.rules_of("folder", folder_id))
        await services.rights.rule_for_folder(folder_id, rule, person.id)
        return RuleView(*await services.rights.rules_of("folder", folder_id))

    @get(
        "/api/graph-rules",
        summary="The rules of all graphs, sealed for a runner with a data folder of its own",
        operation_id="getGraphRules",
        guards=[Needs("share")],
    )
    async def get_graph_rules() -> Statement:
        return app_state.services.rights.statement()

    return [
        *(get_graph_rule, put_graph_rule, get_folder_rule, put_folder_rule),
        get_graph_rules,
    ]


def _checked(services: EditorServices, rule: Rule | None, before: Rules) -> Rule | None:
    """Return a rule with each id once. Raise BadInput for an id of nobody, unless it stands in the
    rule `before`: a group may have been removed."""
    if rule is None:
        return None
    known = {
        *(each.id for each in services.people.everyone()),
        *(each.id for each in services.members.all(with_links=False)),
        *(each.id for each in services.members.groups()),
    }
    for old in (before.own, before.counts):
        if old is not None:
            known.update(old.readers if old.readers != "all" else ())
            known.update(old.editors if old.editors != "all" else ())
    return Rule(_once(rule.readers, "readers", known), _once(rule.editors, "editors", known))


def _once(who: Who, field: str, known: set[str]) -> Who:
    if who == "all":
        return who
    for number, each in enumerate(who):
        if each not in known:
            raise BadInput(
                f"There is no person or group {each!r}.", where={"path": f"/rule/{field}/{number}"}
            )
    return tuple(dict.fromkeys(who))
