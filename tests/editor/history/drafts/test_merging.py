"""A merge takes what one side alone changed, asks for the rest, and leaves no arrow without an end."""

import random
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec import UNSET

from action_assistant.editor.history.drafts.merging import Choices, KeyMerge, Places, merged
from action_assistant.editor.history.key_changes import Place, exist, owner_of
from editor.history.drafts.random_sides import loose, sides
from support.doses import examples

seeds = st.integers(0, 2**32 - 1)
often = settings(
    max_examples=examples(200), deadline=None, suppress_health_check=[HealthCheck.too_slow]
)

DOCK, CHARGE, LIFT = "Dock" * 3, "Char" * 3, "Lift" * 3
PAIR: dict[Place, Any] = {
    ("actions", DOCK): "Dock",
    ("actions", f"{DOCK}|in/speed"): '{"pvf_value":1}',
    ("actions", f"{DOCK}|in"): '["speed"]',
    ("actions", CHARGE): "Charge",
    ("relations", f"{DOCK}>{CHARGE}|on_true"): "run",
    ("positions", DOCK): [1.0, 1.0],
}


def _result(ours: Places, found: KeyMerge) -> dict[Place, Any]:
    both = {**ours, **found.targets}
    return {place: value for place, value in both.items() if value is not UNSET}


def _silent(places: Places) -> dict[Place, Any]:
    return {place: value for place, value in places.items() if place[0] != "comments"}


def _any_choices(found: KeyMerge, seed: int) -> Choices:
    dice = random.Random(seed)
    return {each.place: dice.choice(("ours", "theirs")) for each in found.conflicts}


def _without(places: Places, *owners: str) -> dict[Place, Any]:
    return {p: v for p, v in places.items() if not any(o in owner_of(*p) for o in owners)}


@given(seeds)
@often
def test_an_unchanged_side_becomes_equal_to_the_changed_one(seed: int) -> None:
    base, _, theirs = sides(seed, ours=0)
    found = merged(base, base, theirs, {})
    assert found.conflicts == ()
    assert _silent(_result(base, found)) == _silent(theirs)


@given(seeds)
@often
def test_an_unchanged_other_side_sets_nothing(seed: int) -> None:
    base, ours, _ = sides(seed, theirs=0)
    assert merged(base, ours, base, {}) == KeyMerge({}, ())
    assert merged(base, ours, ours, {}) == KeyMerge({}, ())


@given(seeds, seeds)
@often
def test_no_arrow_without_an_end_comes_to_be_whatever_is_chosen(seed: int, choice: int) -> None:
    base, ours, theirs = sides(seed)
    asked = merged(base, ours, theirs, {})
    found = merged(base, ours, theirs, _any_choices(asked, choice))
    assert found.conflicts == asked.conflicts
    assert loose(_result(ours, found)) <= loose(ours)


@given(seeds, seeds)
@often
def test_a_merge_touches_only_keys_that_the_other_side_changed(seed: int, choice: int) -> None:
    base, ours, theirs = sides(seed)
    asked = merged(base, ours, theirs, {})
    found = merged(base, ours, theirs, _any_choices(asked, choice))
    changed = {owner_of(*p) for p in base.keys() | theirs.keys() if base.get(p) != theirs.get(p)}
    asked_of = {conflict.owner for conflict in asked.conflicts}
    gone = (exist(base) | exist(ours)) - exist(_result(ours, found))
    for place in found.targets:
        owner = owner_of(*place)
        assert owner in changed | asked_of or (gone | asked_of) & {*owner.split(">")}, place
    for conflict in asked.conflicts:
        kept = merged(base, ours, theirs, {c.place: "ours" for c in asked.conflicts})
        if conflict.key is not None:
            assert conflict.key not in kept.targets


@given(seeds)
@often
def test_merges_in_both_directions_agree_if_every_conflict_is_chosen(seed: int) -> None:
    base, ours, theirs = sides(seed)
    there = merged(base, ours, theirs, {})
    back = merged(base, theirs, ours, {})
    assert {c.place for c in there.conflicts} == {c.place for c in back.conflicts}
    into_ours = merged(base, ours, theirs, {c.place: "theirs" for c in there.conflicts})
    into_theirs = merged(base, theirs, ours, {c.place: "ours" for c in back.conflicts})
    assert _meant(_result(ours, into_ours)) == _meant(_result(theirs, into_theirs))


def _meant(places: Places) -> dict[Place, Any]:
    """Return the places without positions and orders, which nobody chooses, and without dangling
    arrows."""
    lost = loose(dict(places))
    return {
        (root, key): value
        for (root, key), value in _silent(places).items()
        if (root != "positions" or key.startswith("g/"))
        and not key.endswith(("|order", "|in"))
        and owner_of(root, key) not in lost  # type: ignore[arg-type]
    }


@given(seeds, seeds)
@often
def test_the_order_of_independent_edits_does_not_matter(seed: int, order: int) -> None:
    base, _, theirs = sides(seed, ours=0)
    changed = [p for p in base.keys() | theirs.keys() if base.get(p) != theirs.get(p)]
    owners = sorted({owner_of(*place) for place in changed})
    dice = random.Random(order)
    mine = {owner for owner in owners if dice.random() < 0.5 and ">" not in owner}
    mine -= {end for owner in owners if ">" in owner for end in owner.partition(";")[0].split(">")}
    one = _with(base, theirs, mine)
    other = _with(base, theirs, set(owners) - mine)
    first, second = merged(base, one, other, {}), merged(base, other, one, {})
    assert first.conflicts == second.conflicts == ()
    assert _silent(_result(one, first)) == _silent(_result(other, second)) == _silent(theirs)


def _with(base: Places, after: Places, owners: set[str]) -> dict[Place, Any]:
    """Return the base in which some owners have become as in `after`."""
    kept = {place: value for place, value in base.items() if owner_of(*place) not in owners}
    return kept | {place: value for place, value in after.items() if owner_of(*place) in owners}


# --- cases with names ------------------------------------------------------------------------------


def test_a_removal_against_a_change_is_one_conflict() -> None:
    ours = _without(PAIR, DOCK)
    theirs = PAIR | {("actions", f"{DOCK}|in/speed"): '{"pvf_value":2}'}
    found = merged(PAIR, ours, theirs, {})
    (conflict,) = found.conflicts
    assert (conflict.place, conflict.removed) == (f"actions/{DOCK}", "ours")
    assert found.targets == {}
    kept = merged(PAIR, ours, theirs, {conflict.place: "theirs"})
    assert _result(ours, kept) == theirs


def test_an_arrow_to_what_was_removed_is_a_conflict_of_what_was_removed() -> None:
    ours = _without(PAIR, CHARGE)
    lift: dict[Place, Any] = {
        ("actions", LIFT): "Lift",
        ("relations", f"{LIFT}>{CHARGE}|on_true"): "run",
    }
    theirs = PAIR | lift
    found = merged(PAIR, ours, theirs, {})
    assert [each.place for each in found.conflicts] == [f"actions/{CHARGE}"]
    result = _result(ours, found)
    assert ("actions", LIFT) in result
    assert loose(result) == set()
    kept = merged(PAIR, ours, theirs, {f"actions/{CHARGE}": "theirs"})
    assert _result(ours, kept) == theirs


def test_a_removal_that_nobody_minds_takes_everything_along() -> None:
    moved = PAIR | {("positions", DOCK): [9.0, 9.0]}
    found = merged(PAIR, moved, _without(PAIR, DOCK), {})
    assert found.conflicts == ()
    assert _result(moved, found) == _without(PAIR, DOCK)


def test_an_arrow_that_one_removed_and_the_other_changed_is_asked() -> None:
    arrow: Place = ("relations", f"{DOCK}>{CHARGE}|on_true")
    ours = {place: value for place, value in PAIR.items() if place != arrow}
    found = merged(PAIR, ours, PAIR | {arrow: "stop"}, {})
    assert [each.place for each in found.conflicts] == [f"relations/{DOCK}>{CHARGE}"]


def test_parameters_that_both_added_stand_one_after_the_other() -> None:
    def also(name: str) -> dict[Place, Any]:
        order: Place = ("actions", f"{DOCK}|in")
        return PAIR | {("actions", f"{DOCK}|in/{name}"): "{}", order: f'["speed","{name}"]'}

    found = merged(PAIR, also("force"), also("angle"), {})
    assert found.conflicts == ()
    assert found.targets[("actions", f"{DOCK}|in")] == '["speed","force","angle"]'


def test_nobody_is_asked_where_a_card_stands() -> None:
    spot: Place = ("positions", DOCK)
    found = merged(PAIR, PAIR | {spot: [2.0, 2.0]}, PAIR | {spot: [3.0, 3.0]}, {})
    assert found == KeyMerge({}, ())


def test_comments_stay_in_the_graph_in_which_they_were_written() -> None:
    said: dict[Place, Any] = PAIR | {("comments", "t/m"): '"look"'}
    assert merged(PAIR, PAIR, said, {}) == KeyMerge({}, ())
    assert merged(said, said, PAIR, {}) == KeyMerge({}, ())
