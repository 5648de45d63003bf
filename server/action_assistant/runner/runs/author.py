"""The person behind a command."""

from typing import Literal

import msgspec


class Author(msgspec.Struct, frozen=True, omit_defaults=True):
    """The person behind a command, and the origin of the command. `address`: on the network; "" for
    the runner's own computer. `by`: "" if it was not recorded. `program`: the name of the token by
    which a program acted for the person; "" if there is none."""

    id: str
    name: str
    by: Literal["browser", "program", ""] = ""
    address: str = ""
    program: str = ""
