"""The Cookie header, read as browsers write it: other programs' cookies come along and never matter."""

from collections.abc import Iterator
from itertools import islice
from typing import Final

#: Of one name. Each is tried against our seal, and whoever plants more gains nothing.
_TRIED: Final = 50
_BLANKS: Final = " \t"


def values(header: str, name: str) -> Iterator[str]:
    """Yield the values of the cookies of this name, in order. Never raises.

    `http.cookies` gives up at the first malformed cookie, such as `g_state={"i_l":0}`. Browsers
    (RFC 6265, 5.4) send the cookies of all programs of this host, on any port.
    """
    pairs = (each.partition("=") for each in header.split(";"))
    ours = (value for found, sign, value in pairs if sign and found.strip(_BLANKS) == name)
    for value in islice(ours, _TRIED):
        plain = value.strip(_BLANKS)
        yield plain[1:-1] if len(plain) > 1 and plain[0] == plain[-1] == '"' else plain
