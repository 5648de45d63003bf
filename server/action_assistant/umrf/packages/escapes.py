"""Escapes texts of people for C++, CMake, XML and Markdown, with a type for each kind of place.

Templates are ours; texts that are put into them were written by anybody. A template accepts only
the types that its language lists, so a text that no filter has made safe cannot get into a file.
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
    """A text that is safe in one kind of place. Only the functions of this module make one."""

    __slots__ = ()


class CppName(SafeText):
    """An identifier, or several joined by `.`."""

    __slots__ = ()


class CppType(SafeText):
    """A C++ type that a parameter can have."""

    __slots__ = ()


class CppString(SafeText):
    """A C++ string literal with its quotes."""

    __slots__ = ()


class CppInitial(SafeText):
    """The initial value of a member, in braces."""

    __slots__ = ()


class CppComment(SafeText):
    """Text inside `/* */`, or after `//` if it has one line."""

    __slots__ = ()


class PackageName(SafeText):
    """The name of a package, which has no special meaning in any of the languages."""

    __slots__ = ()


class CMakeString(SafeText):
    """A quoted CMake argument with its quotes."""

    __slots__ = ()


class XmlText(SafeText):
    """Text between XML tags, or in a quoted attribute."""

    __slots__ = ()


class MarkdownText(SafeText):
    """Text of a paragraph without any markup."""

    __slots__ = ()


class Blanks(SafeText):
    """The indentation of a line."""

    __slots__ = ()


#: The types that templates of each language accept.
ACCEPTED: Final[dict[str, tuple[type[SafeText], ...]]] = {
    "cpp": (CppName, CppType, CppString, CppInitial, CppComment, PackageName, Blanks),
    "cmake": (CMakeString, PackageName),
    "xml": (XmlText, PackageName),
    "markdown": (MarkdownText, PackageName),
    "yaml": (),
}


def cpp_name(text: str) -> CppName:
    """Return the text as an identifier of C++. Raise ValueError for any other text."""
    if not all(_WORD.fullmatch(part) for part in text.split(".")):
        raise ValueError(f"no identifier: {text!r}")
    return CppName(text)


def cpp_type(text: str) -> CppType:
    """Return the text as the C++ type of a parameter. Raise ValueError for any other text."""
    if not _TYPE.fullmatch(text):
        raise ValueError(f"no type of a parameter: {text!r}")
    return CppType(text)


def cpp_string(text: str) -> CppString:
    """Return a C++ string literal, in UTF-8, that has this text. Octal escapes end after three
    digits, whatever follows them. `?` is escaped, since it could be part of a trigraph."""

    def octal(found: re.Match[str]) -> str:
        return "".join(f"\\{byte:03o}" for byte in found[0].encode("utf-8", "replace"))

    escaped = text.translate(_CPP_ESCAPES).replace("\t", "\\t").replace("\n", "\\n")
    return CppString(f'"{_CONTROLS.sub(octal, escaped)}"')


def cpp_initial(value: str | float | bool | tuple[str | float | bool, ...] | None) -> CppInitial:
    """Return the initial value of a member in C++, in braces; empty braces for None. Raise
    ValueError for a number that is not finite."""
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
    """Return the text of a comment whose lines continue below ` * `, indented by `indent` blanks.

    The end and beginning of comments, trigraphs and backslashes at the end of a line are taken
    apart; invisible characters are spelled out.
    """
    apart = visible(text).replace("*/", "* /").replace("/*", "/ *").replace("??", "? ?")
    lines = [re.sub(r"\\(?=\s*$)", r"\\ .", line).rstrip() for line in apart.split("\n")]
    return CppComment(f"\n{' ' * indent} * ".join(lines))


def package_name(text: str) -> PackageName:
    """Return the text as the name of a package. Raise ValueError for any other text."""
    if not _PACKAGE_NAME.fullmatch(text):
        raise ValueError(f"no name of a package: {text!r}")
    return PackageName(text)


def cmake(text: str) -> CMakeString:
    """Return a quoted CMake argument with this text, in which CMake sees no variable, list or
    generator expression."""
    return CMakeString(f'"{visible(text).translate(_CMAKE_ESCAPES)}"')


def xml(text: str) -> XmlText:
    """Return the text escaped for XML. Characters that XML cannot have are spelled out."""
    return XmlText(visible(text).translate(_XML_ESCAPES))


def markdown(text: str) -> MarkdownText:
    """Return the text as one line of Markdown: white space and line breaks become single spaces,
    and special characters are escaped, so that no list, heading or fence can begin."""
    return MarkdownText(" ".join(visible(text).split()).translate(_MARKDOWN_ESCAPES))


def blanks(depth: int) -> Blanks:
    """Return the indentation of a line: two blanks for each level of `depth`."""
    return Blanks("  " * depth)


def visible(text: str) -> str:
    """Return the text with each invisible control character spelled out, for example as `U+202E`;
    line breaks stay."""
    return _CONTROLS.sub(
        lambda found: f"U+{ord(found[0]):04X}", text.replace("\r\n", "\n").replace("\t", " ")
    )


def only(language: str) -> Callable[[Any], SafeText]:
    """Return the function that templates of this language apply to each value: it returns safe
    text, and raises TypeError for values of other types."""
    accepted = ACCEPTED[language]

    def finalize(value: Any) -> SafeText:
        if not isinstance(value, accepted):
            raise TypeError(f"{type(value).__name__} in a template of {language}: {value!r}")
        return value

    return finalize
