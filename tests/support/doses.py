"""How much of what is found by chance one run tries."""

import os
from typing import Final

#: A part of the usual dose, or a multiple of it: CI takes a fifth, `make soak` twenty times as much.
_SHARE: Final = float(os.environ.get("TEST_EXAMPLES", "1"))
_LEAST: Final = 10 if _SHARE >= 1 else 5


def examples(usual: int) -> int:
    """How many generated examples a property is tried on."""
    return max(_LEAST, round(usual * _SHARE))
