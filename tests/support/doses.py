"""Decide how many generated examples one run of a property takes, and which tests wait for another day."""

import os
import zlib
from datetime import UTC, datetime
from typing import Final

#: A factor of the number that a test asks for: `make test` takes a fifth of it, `make soak` twenty times it.
_SHARE: Final = float(os.environ.get("TEST_EXAMPLES", "0.2"))
_LEAST: Final = 10 if _SHARE >= 1 else 5
#: Of tests with the mark `turns`, each day takes one part of so many.
_PARTS: Final = 3


def examples(usual: int) -> int:
    """Return on how many generated examples a property is tried that asks for `usual` of them."""
    return max(_LEAST, round(usual * _SHARE))


def is_share(found: int, drawn: int, share: float) -> bool:
    """Return whether more than a share of the drawn examples was found; of few examples, whether any was.

    How many of few examples are found is a matter of chance.
    """
    return found > (drawn * share if drawn >= 150 else 0)


def has_its_turn(test: str) -> bool:
    """Return whether a test with the mark `turns` is tried today: every third day, by UTC. `TEST_DAY`
    names another day by its number."""
    today = int(os.environ.get("TEST_DAY", datetime.now(UTC).date().toordinal()))
    return (zlib.crc32(test.encode()) + today) % _PARTS == 0
