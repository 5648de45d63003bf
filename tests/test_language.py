"""Check that documentation of code is written in sentences that stand by themselves.

A docstring is an imperative ("Return …") or a sentence with its own subject. One that opens with "What",
"Whether", "Of" or "It" leaves its subject to be guessed from the signature (CONTRIBUTING, "Language").
"""

from pathlib import Path
from typing import Final

import pytest

from support.figures import Docstring, docstrings, tsdocs

ROOT: Final = Path(__file__).parents[1]
#: Docstrings that may open so or be as short, by file and name, and why.
ACCEPTED: Final[dict[str, str]] = {}
#: The share of the page's comments of documentation that may open without a subject.
TSDOC_SHARE: Final = 0.01


def found(kind: str) -> dict[str, Docstring]:
    """Return the docstrings of the server that have this fault, by file and name."""
    return {f"{each.path} {each.name}": each for each in docstrings(ROOT) if getattr(each, kind)}


@pytest.mark.parametrize("kind", ["has_no_subject", "is_short"])
def test_docstrings_of_the_server_are_sentences_with_a_subject(kind: str) -> None:
    faults = {name: str(each) for name, each in found(kind).items() if name not in ACCEPTED}
    assert faults == {}


def test_accepted_exceptions_still_exist() -> None:
    assert set(ACCEPTED) <= {*found("has_no_subject"), *found("is_short")}


def test_comments_of_documentation_of_the_page_open_with_their_subject() -> None:
    every = list(tsdocs(ROOT))
    faults = [str(each) for each in every if each.has_no_subject]
    assert len(faults) <= TSDOC_SHARE * len(every), "\n".join(faults)
