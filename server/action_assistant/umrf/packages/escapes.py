"""Texts of people inside C++, CMake, XML and Markdown: a type of its own for each place.

What stands in a template is ours; what is put into it was written by anybody. A template takes nothing
but the types that its language lists, so a text that no filter has made safe cannot get into a file.
"""

import math
import re
from collections.abc import Callable
from typing import Any, Final

_CONTROLS: Final = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u2069\ud800-\udfff\ufeff"
    "\ufff9-\uffff]"
)
_WORD: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_TYPE: Final = re.compile(
    r"double|bool|std::string|std::vector<(double|bool|std::string)>|boost::any"
)
_PACKAGE_NAME: Final = re.compile(r"[a-z][a-z0-9_]*")
_CPP_ESCAPES: Final = {ord("\\"): "\\\\", ord('"'): '\\"', ord("?"): "\\?"}
_CMAKE_ESCAPES: Final = {ord(each): f"\\{each}" for each in '\\"$@'} | {ord("\n"): "\\n"}
_XML_ESCAPES: Final = {
    ord("&"): "&amp;", ord("<"): "&lt;", ord(">"): "&gt;", ord('"'): "&quot;", ord("'"): "&apos;",
}  # fmt: skip
_MARKDOWN_ESCAPES: Final = {ord(each): f"\\{each}" for each in r"\`*_{}[]()<>#+-.!|~&$:@=\"'"}


class SafeText(str):
    """A text that may stand in one kind of place. Only the functions of this module make any."""

    __slots__ = ()


class CppName(SafeText):
    """An identifier, or several with `.` between them."""

    __slots__ = ()


class CppType(SafeText):
    """A type that a parameter may have."""

    __slots__ = ()


class CppString(SafeText):
    """A string literal with its quotes."""

    __slots__ = ()


class CppInitial(SafeText):
    """What a member is at first, in braces."""

    __slots__ = ()


class CppComment(SafeText):
    """What stands inside `/* */`, or after `//` where it has one line."""

    __slots__ = ()


class PackageName(SafeText):
    """The name of a package, which means nothing special in any of the languages."""

    __slots__ = ()


class CMakeString(SafeText):
    """A quoted argument with its quotes."""

    __slots__ = ()


class XmlText(SafeText):
    """Text between tags, or an attribute between quotes."""

    __slots__ = ()


class MarkdownText(SafeText):
    """Text of a paragraph, without any markup."""

    __slots__ = ()


class Blanks(SafeText):
    """What a line is indented by."""

    __slots__ = ()


#: What templates of each language take.
ACCEPTED: Final[dict[str, tuple[type[SafeText], ...]]] = {
    "cpp": (CppName, CppType, CppString, CppInitial, CppComment, PackageName, Blanks),
    "cmake": (CMakeString, PackageName),
    "xml": (XmlText, PackageName),
    "markdown": (MarkdownText, PackageName),
    "yaml": (),
}


def cpp_name(text: str) -> CppName:
    """Raises ValueError for what is no identifier."""
    if not all(_WORD.fullmatch(part) for part in text.split(".")):
        raise ValueError(f"no identifier: {text!r}")
    return CppName(text)


def cpp_type(text: str) -> CppType:
    """Raises ValueError for what no parameter has."""
    if not _TYPE.fullmatch(text):
        raise ValueError(f"no type of a parameter: {text!r}")
    return CppType(text)


def cpp_string(text: str) -> CppString:
    """A literal of UTF-8. Octal escapes end after three digits, whatever follows them; `?` could be
    part of a trigraph."""

    def octal(found: re.Match[str]) -> str:
        return "".join(f"\\{byte:03o}" for byte in found[0].encode("utf-8", "replace"))

    escaped = text.translate(_CPP_ESCAPES).replace("\t", "\\t").replace("\n", "\\n")
    return CppString(f'"{_CONTROLS.sub(octal, escaped)}"')


def cpp_initial(value: str | float | bool | tuple[str | float | bool, ...] | None) -> CppInitial:
    """Return the initializer of a member; empty braces for None. Raises ValueError for numbers that are
    none."""
    values = () if value is None else value if isinstance(value, tuple) else (value,)
    return CppInitial(f"{{{', '.join(map(_literal, values))}}}")


def _literal(value: str | float | bool) -> str:
    if isinstance(value, str):
        return cpp_string(value)
    if isinstance(value, bool):
        return str(value).lower()
    if not math.isfinite(value):
        raise ValueError(f"no literal: {value!r}")
    return repr(float(value))


def cpp_comment(text: str, indent: int = 0) -> CppComment:
    """Lines that go on below ` * `, `indent` blanks in. The end of a comment, its beginning, trigraphs
    and backslashes at the end of a line are taken apart; what cannot be seen is spelled out."""
    apart = visible(text).replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")
    lines = [re.sub(r"\\(?=\s*$)", r"\\ .", line).rstrip() for line in apart.split("\n")]
    return CppComment(f"\n{' ' * indent} * ".join(lines))


def package_name(text: str) -> PackageName:
    """Raises ValueError for what is none."""
    if not _PACKAGE_NAME.fullmatch(text):
        raise ValueError(f"no name of a package: {text!r}")
    return PackageName(text)


def cmake(text: str) -> CMakeString:
    """No variable, no list and no generator expression is seen in it."""
    return CMakeString(f'"{visible(text).translate(_CMAKE_ESCAPES)}"')


def xml(text: str) -> XmlText:
    """Characters that XML cannot have are spelled out."""
    return XmlText(visible(text).translate(_XML_ESCAPES))


def markdown(text: str) -> MarkdownText:
    """One paragraph, also of a text that has several: no line begins a list, a heading or a fence."""
    return MarkdownText(" ".join(visible(text).split()).translate(_MARKDOWN_ESCAPES))


def blanks(depth: int) -> Blanks:
    """Two for each level."""
    return Blanks("  " * depth)


def visible(text: str) -> str:
    """The text with `U+202E` for each character that steers and cannot be seen; lines stay."""
    return _CONTROLS.sub(
        lambda found: f"U+{ord(found[0]):04X}", text.replace("\r\n", "\n").replace("\t", " ")
    )


def only(language: str) -> Callable[[Any], SafeText]:
    """For `finalize` of templates of a language: raises TypeError for every other value."""
    accepted = ACCEPTED[language]

    def finalize(value: Any) -> SafeText:
        if not isinstance(value, accepted):
            raise TypeError(f"{type(value).__name__} in a template of {language}: {value!r}")
        return value

    return finalize
