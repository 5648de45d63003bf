"""Codes by which a person lets a program in: one use, one winner, and bounds for who guesses."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from action_assistant.errors import (
    Conflict,
    NotFound,
    OutcomeUnknown,
    Refused,
    TooMany,
    Unavailable,
)
from action_assistant.web.auth.desk import Held
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Keys, Person
from action_assistant.web.auth.login_codes import Claimed, Confirmed, LoginCodes, claim
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.tokens import MadeToken, TokenFiles


class Clock:
    """A clock that stands until a test moves it."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


def word(person: str = "mari") -> Confirmed:
    return Confirmed(Identity(Person(person, person.title(), "owner")), "cli", ("read",), None)


def maker(data: Path) -> TokenFiles:
    return TokenFiles(data, Keys("k" * 43), Revocations(data))


async def fetched(codes: LoginCodes, secret: str, tokens: TokenFiles) -> Claimed:
    """Ask as a program does; the disk takes a turn of the event loop."""

    async def make(said: Confirmed) -> MadeToken:
        await asyncio.sleep(0)
        return tokens.make(said.by, said.name, said.scopes, said.days)

    return await claim(Held(codes), secret, make)


@pytest.fixture
def tokens(tmp_path: Path) -> TokenFiles:
    return maker(tmp_path)


def test_a_program_waits_until_a_person_confirms_and_gets_its_token_once(
    tokens: TokenFiles,
) -> None:
    async def played() -> None:
        clock = Clock()
        codes = LoginCodes(clock)
        begun = codes.begin("cli", ("read",), None, "10.0.0.9")
        assert (await fetched(codes, begun.secret, tokens)).state == "waiting"
        looked = codes.look(begun.code.lower().replace("-", " "), "mari")
        assert (looked.name, looked.address, looked.state) == ("cli", "10.0.0.9", "waiting")
        codes.confirm(begun.code, word())
        clock.now += 2
        granted = await fetched(codes, begun.secret, tokens)
        assert granted.made is not None
        opened = tokens.opens(granted.made.token)
        assert opened is not None
        assert opened.person.id == "mari"
        assert codes.look(begun.code, "mari").state == "fetched"
        clock.now += 2
        assert (await fetched(codes, begun.secret, tokens)).state == "gone"
        assert len(tokens.every()) == 1

    asyncio.run(played())


@given(askers=st.integers(2, 8), confirmers=st.integers(2, 5))
def test_of_many_who_use_a_code_at_once_one_wins(
    tmp_path_factory: pytest.TempPathFactory, askers: int, confirmers: int
) -> None:
    tokens = maker(tmp_path_factory.mktemp("race"))

    async def played() -> None:
        codes = LoginCodes()
        begun = codes.begin("cli", ("read",), None, "")
        won = []
        for number in range(confirmers):
            try:
                codes.confirm(begun.code, word(f"p{number}"))
                won.append(number)
            except Conflict:
                pass
        assert won == [0]
        answers = await asyncio.gather(
            *(fetched(codes, begun.secret, tokens) for _ in range(askers))
        )
        states = [each.state for each in answers]
        assert states.count("granted") == 1
        assert set(states) == {"granted", "gone"}

    asyncio.run(played())
    assert [each.record.person.id for each in tokens.every()] == ["p0"]


def test_a_full_disk_loses_no_confirmed_login(tokens: TokenFiles) -> None:
    async def full(_: Confirmed) -> MadeToken:
        raise Unavailable("The disk is full.")

    async def played() -> None:
        codes = LoginCodes()
        begun = codes.begin("cli", ("read",), None, "")
        codes.confirm(begun.code, word())
        with pytest.raises(Unavailable):
            await claim(Held(codes), begun.secret, full)
        assert (await fetched(codes, begun.secret, tokens)).state == "granted"

    asyncio.run(played())


class Lost(Held[LoginCodes]):
    """The codes in another editor, which is gone when it is told that the token is made."""

    async def call(self, method: Any, *arguments: Any, **named: Any) -> Any:
        """Call it, or lose its answer."""
        if method is LoginCodes.end_fetch:
            raise OutcomeUnknown("The editor has ended, and may have done it before that.")
        return await super().call(method, *arguments, **named)


def test_a_token_that_was_made_reaches_its_program(tokens: TokenFiles) -> None:
    async def make(said: Confirmed) -> MadeToken:
        return tokens.make(said.by, said.name, said.scopes, said.days)

    async def played() -> None:
        codes = LoginCodes()
        begun = codes.begin("cli", ("read",), None, "")
        codes.confirm(begun.code, word())
        granted = await claim(Lost(codes), begun.secret, make)
        assert granted.made is not None
        assert tokens.opens(granted.made.token) is not None
        assert (await fetched(codes, begun.secret, tokens)).state == "gone"
        assert len(tokens.every()) == 1

    asyncio.run(played())


def test_who_asks_too_often_waits_longer() -> None:
    async def never(_: Confirmed) -> MadeToken:
        raise AssertionError

    async def played() -> None:
        clock = Clock()
        codes = LoginCodes(clock)
        secret = codes.begin("cli", ("read",), None, "").secret
        assert (await claim(Held(codes), secret, never)).state == "waiting"
        waits = []
        for _ in range(20):
            said = await claim(Held(codes), secret, never)
            assert said.state == "slower"
            waits.append(said.interval)
        assert waits == sorted(waits)
        assert waits[0] == 4
        assert waits[-1] == 30
        clock.now += 30
        assert (await claim(Held(codes), secret, never)).state == "waiting"

    asyncio.run(played())


def test_a_code_expires_is_refused_or_cancelled_and_then_nobody_gets_anything(
    tokens: TokenFiles,
) -> None:
    async def played() -> None:
        clock = Clock()
        codes = LoginCodes(clock)
        late, refused, cancelled = (codes.begin("cli", ("read",), None, "") for _ in range(3))
        codes.refuse(refused.code, "mari")
        with pytest.raises(Conflict):
            codes.confirm(refused.code, word())
        assert (await fetched(codes, refused.secret, tokens)).state == "refused"
        codes.confirm(cancelled.code, word())
        codes.cancel(cancelled.secret)
        assert (await fetched(codes, cancelled.secret, tokens)).state == "gone"
        codes.confirm(late.code, word())
        clock.now += late.expires_in
        assert (await fetched(codes, late.secret, tokens)).state == "gone"
        with pytest.raises(NotFound):
            codes.look(late.code, "mari")
        assert len(codes) == 0

    asyncio.run(played())
    assert tokens.every() == []


def test_who_guesses_codes_is_stopped_and_nobody_else_is() -> None:
    codes = LoginCodes(Clock())
    begun = codes.begin("cli", ("read",), None, "")
    refused = 0
    for number in range(1000):
        with pytest.raises(Refused) as why:
            codes.look(f"BBBB-{number:04}", "mallory")
        refused += isinstance(why.value, TooMany)
    assert refused >= 990
    with pytest.raises(TooMany):  # a right guess helps no more than a wrong one
        codes.confirm(begun.code, word("mallory"))
    assert codes.look(begun.code, "mari").name == "cli"


def test_codes_that_wait_are_bounded() -> None:
    clock = Clock()
    codes = LoginCodes(clock)
    for _ in range(10):
        codes.begin("cli", ("read",), None, "10.0.0.1")
    with pytest.raises(TooMany):
        codes.begin("cli", ("read",), None, "10.0.0.1")
    for number in range(90):
        codes.begin("cli", ("read",), None, f"10.0.1.{number}")
    with pytest.raises(TooMany):
        codes.begin("cli", ("read",), None, "10.0.2.1")
    assert len(codes) == 100
    clock.now += 600
    codes.begin("cli", ("read",), None, "10.0.2.1")
    assert len(codes) == 1


class AnyOrder(RuleBasedStateMachine):
    """Programs, people and time in any order: no token without a word, none twice, none after an
    end."""

    @initialize()
    def begins(self) -> None:
        self.clock = Clock()
        self.codes = LoginCodes(self.clock)
        self.logins: list[tuple[str, str, float]] = []
        self.confirmed: set[int] = set()
        self.over: set[int] = set()
        self.made: list[int] = []

    @rule()
    def begin(self) -> None:
        try:
            begun = self.codes.begin("cli", ("read",), None, "")
        except TooMany:
            return
        self.logins.append((begun.code, begun.secret, self.clock.now + begun.expires_in))

    @rule(which=st.integers(0, 9), person=st.sampled_from(["mari", "ada"]))
    def confirm(self, which: int, person: str) -> None:
        if which < len(self.logins):
            try:
                self.codes.confirm(self.logins[which][0], word(person))
            except (Conflict, NotFound, TooMany):
                return
            assert which not in self.confirmed | self.over
            self.confirmed.add(which)

    @rule(which=st.integers(0, 9))
    def refuse(self, which: int) -> None:
        if which < len(self.logins):
            try:
                self.codes.refuse(self.logins[which][0], "mari")
            except (Conflict, NotFound, TooMany):
                return
            assert which not in self.confirmed
            self.over.add(which)

    @rule(which=st.integers(0, 9))
    def cancel(self, which: int) -> None:
        if which < len(self.logins):
            self.codes.cancel(self.logins[which][1])
            self.over.add(which)

    @rule(which=st.integers(0, 9), times=st.integers(1, 3))
    def claim(self, which: int, times: int) -> None:
        if which >= len(self.logins):
            return

        async def make(_: Confirmed) -> MadeToken:
            await asyncio.sleep(0)
            self.made.append(which)
            return None  # type: ignore[return-value]

        async def at_once() -> None:
            await asyncio.gather(
                *(claim(Held(self.codes), self.logins[which][1], make) for _ in range(times))
            )

        before = len(self.made)
        asyncio.run(at_once())
        if len(self.made) > before:
            assert which in self.confirmed - self.over
            assert self.clock.now < self.logins[which][2]

    @rule(seconds=st.sampled_from([1.0, 60.0, 601.0]))
    def wait(self, seconds: float) -> None:
        self.clock.now += seconds

    @invariant()
    def one_token_for_one_word(self) -> None:
        made = getattr(self, "made", [])
        assert len(made) == len(set(made))


TestAnyOrder = AnyOrder.TestCase
