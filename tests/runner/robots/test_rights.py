"""The rights of a robot as a value: what is refused, and what a change becomes."""

from datetime import UTC, datetime
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.errors import Conflict, Forbidden, Refused
from action_assistant.runner.robots.rights import (
    Holder,
    Lock,
    Operator,
    RightsEvent,
    RobotRights,
    Rules,
)
from action_assistant.runner.runs.events import Author
from action_assistant.web.auth.identity import Identity, Token
from action_assistant.web.auth.keys import Person, PersonRef, Session
from action_assistant.web.auth.roles import Role

NOW_US = round(datetime(2026, 11, 28, 12, tzinfo=UTC).timestamp() * 1e6)
DAY_US = 86_400_000_000
NIGHT = "g_night"


def who(name: str, *groups: str, role: Role = "operator") -> Identity:
    return Identity(Person(name.lower(), name, role), groups=frozenset(groups))


def author(identity: Identity) -> Author:
    return Author(identity.person.id, identity.person.name)


ANN, BEN, CARL, OLGA = who("Ann"), who("Ben"), who("Carl", NIGHT), who("Olga", role="owner")
LISTED = Rules(
    operators=(Operator("ann", "Ann"), Operator(NIGHT, "Night shift", NOW_US + DAY_US)), baton=True
)


def ref(identity: Identity) -> PersonRef:
    return PersonRef(identity.person.id, identity.person.name)


def why(rights: RobotRights, identity: Identity, at: int = NOW_US) -> str | None:
    return rights.refusal(identity, "operate", at / 1e6)


def test_a_robot_without_rules_refuses_nobody() -> None:
    assert why(RobotRights(name="David"), BEN) is None


def test_an_empty_list_refuses_everybody_and_says_so() -> None:
    rights = RobotRights(name="David", rules=Rules(operators=()), set_by=ref(OLGA))
    for each in (BEN, OLGA):
        assert why(rights, each) == ("You may not start on David: its list names nobody. Ask Olga.")


def test_a_refusal_says_who_may_and_whom_to_ask() -> None:
    rights = RobotRights(name="David", rules=LISTED, set_by=ref(OLGA))
    assert why(rights, BEN) == (
        "You may not start on David: only Ann or Night shift may. Ask Olga."
    )
    rights = msgspec.structs.replace(rights, holder=Holder(ref(CARL), NOW_US))
    assert why(rights, ANN) == (
        "You may not start on David: Carl has its baton. Ask Carl to hand it over, or take it over "
        "with a reason."
    )
    assert why(rights, CARL) is None


def test_a_list_counts_for_owners_too() -> None:
    assert "only Ann" in str(why(RobotRights(name="David", rules=LISTED), OLGA))


def test_a_right_ends_at_its_date() -> None:
    rights = RobotRights(name="David", rules=LISTED, holder=Holder(ref(CARL), NOW_US))
    assert why(rights, CARL, NOW_US + DAY_US - 1) is None
    assert "that right ended on 2026-11-29. Ask an owner." in str(
        why(rights, CARL, NOW_US + DAY_US)
    )


def test_sentences_about_a_starter_name_them() -> None:
    rights = RobotRights(name="David", rules=LISTED, set_by=ref(OLGA))
    (first, *_) = rights.refusals(BEN, NOW_US / 1e6, is_asking=False)
    assert first.text.startswith("Ben may not start on David")


def test_only_starts_are_refused() -> None:
    rights = RobotRights(name="David", rules=LISTED, locks=(Lock(ref(ANN), 1, "It leaks."),))
    for permission in ("see", "edit", "simulate", "register", "share"):
        assert rights.refusal(BEN, permission, NOW_US / 1e6) is None


def test_a_baton_that_somebody_holds_is_taken_over_only_with_a_reason() -> None:
    rights = RobotRights(name="David", rules=Rules(baton=True))
    first = rights.take(ANN, author(ANN), NOW_US)
    assert first is not None
    rights = rights.after(first)
    assert rights.take(ANN, author(ANN), NOW_US) is None
    with pytest.raises(Conflict, match="Ann has the baton"):
        rights.take(BEN, author(BEN), NOW_US)
    forced = rights.take(BEN, author(BEN), NOW_US, "Ann is at lunch.")
    assert forced is not None
    assert (forced.how, forced.was, forced.holder) == ("forced", ref(ANN), ref(BEN))
    with pytest.raises(Conflict, match="Ben has the baton of David, not you"):
        rights.after(forced).drop(ANN, author(ANN), NOW_US)


def test_a_baton_goes_only_to_a_person_who_may_start_there() -> None:
    rights = RobotRights(name="David", rules=LISTED, holder=Holder(ref(ANN), NOW_US))
    with pytest.raises(Forbidden, match="Ben may not start on David: only Ann"):
        rights.hand(ANN, author(ANN), BEN, NOW_US)
    with pytest.raises(Forbidden):
        rights.take(BEN, author(BEN), NOW_US, "I want it.")
    viewer = who("Vera", NIGHT, role="viewer")
    with pytest.raises(Forbidden, match="Vera may not start on robots"):
        rights.hand(ANN, author(ANN), viewer, NOW_US)
    assert rights.hand(ANN, author(ANN), CARL, NOW_US).holder == ref(CARL)


def test_each_lock_counts_and_is_taken_off_by_its_person_or_an_owner() -> None:
    rights = RobotRights(name="David")
    for by, reason in ((ANN, "It leaks oil."), (BEN, "I work on its arm.")):
        rights = rights.after(rights.lock(by, author(by), NOW_US, reason))
    assert why(rights, ANN) == (
        "David is out of service. Ann: “It leaks oil”. Ben: “I work on its arm”. Ann, Ben or an owner "
        "can put David back into service."
    )
    with pytest.raises(Forbidden, match="can put David back"):
        rights.unlock(CARL, author(CARL), NOW_US)
    with pytest.raises(Forbidden):
        rights.unlock(ANN, author(ANN), NOW_US, of="ben")
    rights = rights.after(rights.unlock(ANN, author(ANN), NOW_US))
    assert "I work on its arm" in str(why(rights, ANN))
    rights = rights.after(rights.unlock(OLGA, author(OLGA), NOW_US, of="ben"))
    assert why(rights, ANN) is None
    with pytest.raises(Conflict, match="in service already"):
        rights.unlock(ANN, author(ANN), NOW_US)


def test_without_a_baton_nobody_holds_one() -> None:
    rights = RobotRights(name="David", rules=Rules(baton=True), holder=Holder(ref(ANN), 1))
    for event in rights.set_rules(Rules(), author(OLGA), NOW_US):
        rights = rights.after(event)
    assert (rights.holder, why(rights, BEN)) == (None, None)


PEOPLE = st.sampled_from([ANN, BEN, CARL, OLGA])
COMMANDS = st.one_of(
    st.tuples(
        st.sampled_from(["take", "force", "drop", "fall", "lock", "unlock", "off", "on"]), PEOPLE
    ),
    st.tuples(st.just("hand"), PEOPLE, PEOPLE),
)


def follow(rights: RobotRights, command: Any) -> tuple[RightsEvent, ...]:
    """Return the events of a command; none if it is refused."""
    what, by, *to = command
    me = author(by)
    try:
        match what:
            case "take" | "force":
                event = rights.take(by, me, NOW_US, "because" if what == "force" else "")
                return () if event is None else (event,)
            case "hand":
                return (rights.hand(by, me, to[0], NOW_US),)
            case "drop":
                return (rights.drop(by, me, NOW_US),)
            case "fall":
                fell = rights.fall(NOW_US, "gone")
                return () if fell is None else (fell,)
            case "lock":
                return (rights.lock(by, me, NOW_US, "broken"),)
            case "unlock":
                return (rights.unlock(by, me, NOW_US),)
            case _:
                return rights.set_rules(Rules(baton=what == "on"), me, NOW_US)
    except Refused:
        return ()


@given(st.lists(COMMANDS, max_size=40))
def test_whatever_people_do_at_most_the_holder_may_start(commands: list[Any]) -> None:
    """Each event begins where the one before has ended, and stored events tell the same rights."""
    rights = RobotRights(name="David", rules=Rules(baton=True))
    for command in commands:
        before = rights.holder
        for event in follow(rights, command):
            if (was := getattr(event, "was", None)) is not None:
                assert before is not None
                assert was == before.person
            stored = msgspec.json.decode(msgspec.json.encode(event), type=type(event))
            assert rights.after(stored) == rights.after(event)
            rights = rights.after(event)
        able = [each for each in (ANN, BEN, CARL, OLGA) if why(rights, each) is None]
        if rights.locks:
            assert able == []
        elif rights.rules.baton:
            holder = [] if rights.holder is None else [rights.holder.person.id]
            assert [each.person.id for each in able] == holder
        else:
            assert len(able) == 4


def confirmed(age_s: float | None, **fields: Any) -> Identity:
    """A person in a browser whose last confirmation is so old; None: there was none."""
    now = NOW_US / 1e6
    session = Session("s1", ANN.person, now + 1e6)
    at = None if age_s is None else now - age_s
    return Identity(ANN.person, session=session, confirmed_at=at, **fields)


def test_a_start_needs_a_confirmation_that_is_new_enough() -> None:
    rights = RobotRights(name="David", rules=Rules(ask_again=10))
    rule = "A start on David needs a confirmation that is at most 10 min old"
    for age in (None, 601.0):
        assert why(rights, confirmed(age)) == f"{rule}: confirm that it is you."
    assert why(rights, confirmed(600.0)) is None
    about = next(rights.refusals(confirmed(None), NOW_US / 1e6, is_asking=False))
    assert about.text == f"{rule}: Ann has given none."
    assert about.code == "confirm"


def test_a_confirmation_has_to_be_new_when_the_request_is_made_not_when_it_is_carried_out() -> None:
    rights = RobotRights(name="David", rules=Rules(ask_again=10))
    asked = confirmed(600.0, asked_at=NOW_US / 1e6)
    assert why(rights, asked, NOW_US + DAY_US) is None


def test_no_program_and_no_server_token_can_confirm_anything() -> None:
    rights = RobotRights(name="David", rules=Rules(ask_again=10))
    token = Token("t1", "night", ANN.person, frozenset({"operate"}))
    by_program = Identity(ANN.person, token=token, confirmed_at=NOW_US / 1e6)
    assert "a program cannot give one: start on the page" in str(why(rights, by_program))
    assert "the server's token cannot give one" in str(why(rights, ANN))
