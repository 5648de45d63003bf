"""Assigns each person a colour that no other connected person has (decision 57)."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

#: All equally light, 3 to 1 against both themes and 4.5 to 1 under white letters; as far from each
#: other as that leaves room for, the first ones furthest, and none like an outcome's or a state's.
PALETTE: Final = (
    "#d110bc", "#657d2d", "#056bfb", "#876999", "#9a40fd", "#c74573", "#2b7f89", "#8d6e59",
    "#ac50b0", "#626dc8", "#d72190", "#ba2cdf", "#8b5cce", "#b05b60", "#5f7b63", "#6a7587",
    "#8e7110", "#a65c86", "#5760fe", "#e1156e", "#bc4993", "#8e6b79", "#6572a5", "#a54ccc",
)  # fmt: skip
#: The colour of people who left before others took all colours.
NOBODYS: Final = "#757575"


def colour_at(place: int) -> str:
    """Return the colour at a place of the palette. Beyond its end the colours come again, slightly changed."""
    turn, at = divmod(place, len(PALETTE))
    red_and_green, blue = PALETTE[at][:5], int(PALETTE[at][5:], 16)
    return f"{red_and_green}{(blue + turn if blue < 128 else blue - turn) % 256:02x}"


class PersonColours:
    """Assigns colours to people, the same in all rooms. A colour does not change while its person
    is connected.

    People who have left keep theirs until the palette is used up; then the one who left first loses
    theirs. A restart assigns colours again.
    """

    def __init__(self) -> None:
        self._places: dict[str, int] = {}  # by person, in the order in which they left
        self._sockets: dict[str, int] = {}  # open sockets of each person

    @contextmanager
    def held(self, person: str) -> Iterator[str]:
        """Count a socket of a person inside of the `with`, and yield their colour."""
        colour = self.given(person)
        self._sockets[person] = self._sockets.get(person, 0) + 1
        try:
            yield colour
        finally:
            self._sockets[person] -= 1
            if self._sockets[person] == 0:
                del self._sockets[person]
                self._places[person] = self._places.pop(person)

    def given(self, person: str) -> str:
        """Return the colour of a person; assign a free one if they have none."""
        if person not in self._places:
            self._places[person] = self._free()
        return colour_at(self._places[person])

    def of(self, person: str) -> str:
        """Return the colour of a person who may have left; grey if they have none any more."""
        place = self._places.get(person)
        return NOBODYS if place is None else colour_at(place)

    def _free(self) -> int:
        gone = [person for person in self._places if person not in self._sockets]
        if gone and len(self._places) >= len(PALETTE):
            first = min(gone, key=lambda person: self._places[person] // len(PALETTE))
            return self._places.pop(first)
        taken = set(self._places.values())
        return next(place for place in range(len(taken) + 1) if place not in taken)
