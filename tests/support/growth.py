"""Checks that work grows with its input and not with the square of it, on any machine."""

import gc
import time
from collections.abc import Callable
from typing import Final

#: Input that is so many times larger takes as many times longer, or the square of it: the middle is
#: a bound that a machine of changing speed does not reach.
_TIMES: Final = 16
_MOST: Final = 64
#: The machine may be slower just while the whole is worked on, but not each time.
_TRIES: Final = 5


def grows_with_its_size(work: Callable[[int], Callable[[], object]], size: int) -> None:
    """Fail where work on `size` takes more than four times as long as a sixteenth of it lets expect.
    `work` prepares that of a size, and gives what is timed."""
    whole, told = work(size), []
    gc.freeze()  # what else the tests hold is looked through only while the whole is worked on
    try:
        for _ in range(_TRIES):
            small = min(_seconds(work(size // _TIMES)) for _ in range(3))
            took = _seconds(whole)
            if took <= _MOST * small:
                return
            told.append(f"{size:,}: {took:.3f} s; a sixteenth of it: {small:.3f} s")
    finally:
        gc.unfreeze()
    raise AssertionError("\n".join(told))


def _seconds(work: Callable[[], object]) -> float:
    """Return the processor time of some work, in seconds."""
    begun = time.process_time()
    work()
    return time.process_time() - begun
