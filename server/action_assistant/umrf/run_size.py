"""The largest graph that can be run: one limit, for publishing in the editor and for a start in the
runner."""

from typing import Final

import msgspec

#: The most bytes of the UMRF texts of a graph and of all graphs inside it.
MOST_BYTES: Final = 2_000_000
#: The most graphs inside one.
MOST_INSIDE: Final = 200
#: The most actions of all of them together.
MOST_ACTIONS: Final = 5_000


class RunSize(msgspec.Struct, frozen=True):
    """The size of a graph together with all of its sub-graphs: bytes of UMRF text, number of
    actions, and number of sub-graphs (`inside`)."""

    bytes: int
    actions: int
    inside: int = 0


def excess(size: RunSize) -> str | None:
    """Return a sentence that says why a graph of this size is too large to be run, with the counts;
    None if it is not too large."""
    whole = (
        f"the graph and the {_counted(size.inside)} inside of it" if size.inside else "the graph"
    )
    has = "have" if size.inside else "has"
    if size.inside > MOST_INSIDE:
        return f"{size.inside:,} graphs are inside of the graph; at most {MOST_INSIDE} are run."
    if size.actions > MOST_ACTIONS:
        counted = f"{_begun(whole)} {has} {size.actions:,} actions"
        return f"{counted}; at most {MOST_ACTIONS:,} are run."
    if size.bytes > MOST_BYTES:
        # Rounded up, so that a text which is too large never shows the limit itself.
        megabytes = -(-size.bytes // 10_000) / 100
        text = "texts" if size.inside else "text"
        return (
            f"The UMRF {text} of {whole} {has} {megabytes:.2f} MB; at most {MOST_BYTES // 1_000_000} "
            "MB are run. Shorter descriptions and names, and fewer arrows, make it smaller."
        )
    return None


def _counted(graphs: int) -> str:
    return "graph" if graphs == 1 else f"{graphs} graphs"


def _begun(words: str) -> str:
    return words[0].upper() + words[1:]
