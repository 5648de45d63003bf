"""A colour for each person that nobody else has, whoever comes and goes in which order."""

from contextlib import ExitStack
from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from action_assistant.editor.rooms.presence import NOBODYS, PALETTE, PersonColours, colour_at

#: Surfaces on which people are drawn: those of `frontend/src/ui/tokens.css`, light and dark.
SURFACES = ("#ffffff", "#f6f7f9", "#f1f3f6", "#fbfcfd", "#12151b", "#191d25", "#1e232d", "#14181f")
#: Outcomes and states, light and dark.
SAYING: tuple[str, ...] = ("#217031", "#9c4f00", "#c92a2a", "#6741d9", "#1767b0", "#b83c0a")
SAYING += ("#51cf66", "#ffa94d", "#ff7b7b", "#b197fc", "#4dabf7", "#ff922b", "#d92c2c")


def linear(colour: str) -> tuple[float, float, float]:
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts)
    return red, green, blue


def contrast(one: str, other: str) -> float:
    weights = (0.2126, 0.7152, 0.0722)
    low, high = sorted(
        sum(part * weight for part, weight in zip(linear(each), weights, strict=True)) + 0.05
        for each in (one, other)
    )
    return high / low


def test_every_colour_can_be_told_from_what_is_behind_it_and_carries_white_letters() -> None:
    for colour in (*PALETTE, NOBODYS, *(colour_at(place) for place in range(300))):
        assert min(contrast(colour, surface) for surface in SURFACES) >= 3
        assert contrast(colour, "#ffffff") >= 4.5


def test_no_two_places_have_one_colour_and_none_is_an_outcomes() -> None:
    colours = [colour_at(place) for place in range(1000)]
    assert len({*colours, NOBODYS, *SAYING}) == 1001 + len(SAYING)
    for one, other in (*combinations(PALETTE, 2), *((p, s) for p in PALETTE for s in SAYING)):
        away = zip(linear(one), linear(other), strict=True)
        assert max(abs(a - b) for a, b in away) > 0.02


COMINGS = st.lists(st.tuples(st.integers(0, 40), st.booleans()), max_size=120)


@given(COMINGS)
def test_nobody_takes_a_colour_in_use_and_nobody_loses_theirs(
    comings: list[tuple[int, bool]],
) -> None:
    colours = PersonColours()
    sockets: dict[str, list[ExitStack]] = {}
    seen: dict[str, str] = {}
    for number, comes in comings:
        person = f"person {number}"
        if comes:
            stack = ExitStack()
            mine = stack.enter_context(colours.held(person))
            sockets.setdefault(person, []).append(stack)
            assert seen.setdefault(person, mine) == mine  # two tabs share it
        elif person in sockets:
            sockets[person].pop().close()
            if not sockets[person]:
                del sockets[person], seen[person]
        here = [colours.of(each) for each in sockets]
        assert dict(zip(sockets, here, strict=True)) == seen
        assert len(set(here)) == len(here)


def test_a_person_who_comes_back_has_the_same_colour_while_colours_last() -> None:
    colours = PersonColours()
    with colours.held("ada") as first:
        pass
    with colours.held("bob") as other, colours.held("ada") as again:
        assert again == first != other
    for number in range(len(PALETTE)):
        colours.given(str(number))
    assert colours.of("bob") == NOBODYS
