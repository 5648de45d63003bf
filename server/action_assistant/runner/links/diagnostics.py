"""Diagnostics: one sentence about what was found, and what to do."""

from typing import Literal, TypeAlias

import msgspec

Verdict: TypeAlias = Literal["fine", "note", "wrong"]


class Diagnostic(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """One thing that was looked at. `note` may matter or not; `wrong` does. `advice` is a sentence
    on what to do, or empty."""

    topic: str
    verdict: Verdict
    what: str
    advice: str = ""
