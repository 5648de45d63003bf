"""How much of what is found by chance one run tries."""

import os
from typing import Final

#: A part of the usual dose, or a multiple of it: CI takes a third, `make soak` twenty times as much.
_SHARE: Final = float(os.environ.get("TEST_EXAMPLES", "1"))


def examples(usual: int) -> int:
    """How many generated examples a property is tried on."""
    return max(5, round(usual * _SHARE))
