"""Names of packages, classes and libraries: what the engine makes of a name, and which cannot be.

The engine takes the name of an action for its class and, in snake case, for its library
(docs/umrf-and-the-engine.md 5).
"""

import re
from collections.abc import Iterable, Iterator
from typing import Final

import msgspec

from action_assistant.safe_text import hold_names
from action_assistant.umrf.packages.reserved import (
    C_FUNCTIONS,
    CLASS_NAMES,
    CPP_KEYWORDS,
    LOWER_MACROS,
    MACROS,
    PACKAGE_NAMES,
)

#: Of a name; file systems have 255 bytes for it with what is added.
MAX_NAME: Final = 100
_IDENTIFIER: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_ROS_NAME: Final = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
_CAPITALS: Final = re.compile(r"[A-Z][A-Z0-9_]+")


class NameRefusal(msgspec.Struct, frozen=True):
    """Why there can be no package of something. `place` is a JSON pointer below the action's name,
    `reason` a sentence."""

    place: str
    reason: str

    def __post_init__(self) -> None:
        hold_names(self, "reason")

    @property
    def sentence(self) -> str:
        """Place and reason."""
        return f"{self.place}: {self.reason}"


def snake_case(name: str) -> str:
    """The name of package, folder and library. ASCII alone, as the engine's locale has it: `TaURDF`
    is `ta_u_r_d_f`."""
    first, rest = name[:1].translate(_LOWER), name[1:]
    return first + re.sub("[A-Z]", lambda found: "_" + found[0].translate(_LOWER), rest)


_LOWER: Final = {code: code + 32 for code in range(ord("A"), ord("Z") + 1)}


def check_name(name: str) -> tuple[NameRefusal, ...]:
    """What stands against a package of an action of this name; nothing if it can be."""
    reason = next(_against(name), None)
    return () if reason is None else (NameRefusal(name, reason),)


def check_names(names: Iterable[str]) -> tuple[NameRefusal, ...]:
    """The same of several that lie side by side, and those of them that would be one package."""
    listed = list(dict.fromkeys(names))
    found = [refusal for name in listed for refusal in check_name(name)]
    taken: dict[str, str] = {}
    for name in listed:
        other = taken.setdefault(snake_case(name), name)
        if other != name:
            same = f"“{name}” and “{other}” would both be the package “{snake_case(name)}”."
            found.append(NameRefusal(name, same))
    return tuple(found)


def check_package(package: str) -> tuple[NameRefusal, ...]:
    """What stands against a package of this name."""
    reason = next(_against_package(package), None)
    return () if reason is None else (NameRefusal(package, reason),)


def _against(name: str) -> Iterator[str]:
    """Reasons, the gravest first."""
    package = snake_case(name)
    if not name:
        yield "The action has no name."
    if name in {"graph_entry", "graph_exit"}:
        yield f"“{name}” is the engine's own name of an end of each graph."
    if not _IDENTIFIER.fullmatch(name):
        yield (
            f"“{name}” is no name of a C++ class: it may have letters of ASCII, digits and _, and "
            "begins with no digit."
        )
    if name in CPP_KEYWORDS:
        yield f"“{name}” is a word of C++ itself, and no name of a class."
    if name in MACROS | LOWER_MACROS:
        yield f"“{name}” is a macro of C, and no name of a class."
    if name in CLASS_NAMES:
        yield f"“{name}” is a class that the engine or the package has already."
    if name in C_FUNCTIONS:
        yield f"“{name}” is a function of C; the library would give its own to the engine."
    yield from _against_package(package)


def _against_package(package: str) -> Iterator[str]:
    if len(package) > MAX_NAME:
        yield f"The package would be called by {len(package)} characters; it may be {MAX_NAME}."
    if not _ROS_NAME.fullmatch(package):
        yield (
            f"The package would be “{package}”, and ROS takes small letters and digits with single _ "
            "between them, the first a letter."
        )
    if len(package) < 2:
        yield f"The package would be “{package}”, and ROS wants two characters."
    if package in PACKAGE_NAMES:
        yield f"The package would be “{package}”, which ROS, CMake or the system have for themselves."


def member_name(key: str) -> str:
    """The C++ member for a key of parameters. What is no letter, digit or single _ between them becomes
    one; what C++ or a header has taken gets one at its end. Several keys may have the same member."""
    word = re.sub("_+", "_", re.sub("[^A-Za-z0-9]", "_", key)).strip("_")
    if not word or word[0].isdigit():
        word = f"p_{word}".rstrip("_")
    taken = word in CPP_KEYWORDS or word in LOWER_MACROS or _CAPITALS.fullmatch(word)
    return f"{word}_" if taken else word
