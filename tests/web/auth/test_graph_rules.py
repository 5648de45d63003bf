"""Rules of graphs: who may see, who may edit, and how folders pass them on."""

from typing import get_args

from hypothesis import given
from hypothesis import strategies as st

from action_assistant.web.auth.graph_rules import (
    OPEN,
    Rule,
    RuledFolder,
    combined,
    may_edit,
    may_see,
    rule_at,
    with_person,
)
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Person
from action_assistant.web.auth.roles import Role

ids = st.sampled_from(["ada", "ben", "night", "day"])
whos = st.one_of(st.just("all"), st.lists(ids, max_size=3).map(tuple))
rules = st.builds(Rule, whos, whos)
identities = st.builds(
    lambda person, role, groups: Identity(Person(person, person, role), frozenset(groups)),
    st.sampled_from(["ada", "ben", "cid"]),
    st.sampled_from(get_args(Role)),
    st.lists(st.sampled_from(["night", "day"])),
)


@given(rules, identities)
def test_whoever_may_edit_may_see_and_owners_may_do_both(rule: Rule, identity: Identity) -> None:
    sees, edits = may_see(rule, identity), may_edit(rule, identity)
    assert sees or not edits
    if identity.person.role == "owner":
        assert (sees, edits) == (True, True)


@given(rules, identities)
def test_only_those_who_are_named_see_what_is_not_open_to_all(
    rule: Rule, identity: Identity
) -> None:
    if identity.person.role == "owner":
        return
    mine = {identity.person.id, *identity.groups}
    named = set(rule.readers if rule.readers != "all" else mine)
    named |= set(rule.editors if rule.editors != "all" else ())
    assert may_see(rule, identity) is bool(named & mine)
    if rule.editors != "all":
        assert may_edit(rule, identity) is bool(set(rule.editors) & mine)


@given(st.data(), st.lists(st.one_of(st.none(), rules), min_size=1, max_size=6))
def test_the_nearest_rule_counts(data: st.DataObject, chain: list[Rule | None]) -> None:
    folders = {
        str(i): RuledFolder(None if i == 0 else str(i - 1), rule) for i, rule in enumerate(chain)
    }
    own = data.draw(st.one_of(st.none(), rules))
    at = data.draw(st.integers(0, len(chain) - 1))
    way = [own, *reversed(chain[: at + 1])]
    nearest = next((rule for rule in way if rule is not None), OPEN)
    assert rule_at(own, str(at), folders) == nearest
    assert rule_at(own, None, folders) == (own or OPEN)
    assert rule_at(own, "removed", folders) == (own or OPEN)


@given(st.lists(rules, max_size=3), identities)
def test_what_is_made_of_graphs_is_for_those_who_may_see_all_of_them(
    every: list[Rule], identity: Identity
) -> None:
    made = combined(every)
    if may_see(made, identity):
        assert all(may_see(rule, identity) for rule in every)
    if may_edit(made, identity):
        assert all(may_edit(rule, identity) for rule in every)
    if not identity.groups:  # of groups nobody knows here who else is in them
        assert may_see(made, identity) == all(may_see(rule, identity) for rule in every)
        assert may_edit(made, identity) == all(may_edit(rule, identity) for rule in every)
    if all(rule == OPEN for rule in every):
        assert made == OPEN


@given(rules, identities)
def test_whoever_makes_it_may_edit_it_and_nobody_else_may_more(
    rule: Rule, identity: Identity
) -> None:
    made = with_person(rule, "dee")
    assert may_edit(made, Identity(Person("dee", "dee", "editor")))
    assert may_see(made, identity) == may_see(rule, identity)
    assert may_edit(made, identity) == may_edit(rule, identity)
