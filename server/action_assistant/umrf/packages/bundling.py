"""Generates one ROS package with several actions: the files of each, built together."""

import re
from collections.abc import Iterator, Sequence
from typing import Final

import msgspec

from action_assistant.umrf.model import Action
from action_assistant.umrf.packages.generating import (
    ImpossiblePackage,
    package_files,
    rendered,
)
from action_assistant.umrf.packages.naming import (
    NameRefusal,
    check_names,
    check_package,
    snake_case,
)

#: The files that a package has once: template and language by path.
_SHARED: Final = {
    ".clang-format": ("clang_format", "yaml"),
    "CMakeLists.txt": ("bundle_cmake_lists", "cmake"),
    "README.md": ("bundle_readme", "markdown"),
    "package.xml": ("package", "xml"),
}
#: The files that it has for each action.
_OF_ACTIONS: Final = re.compile(
    r"include/([a-z0-9_]+)/(?:(?:in|out)put_parameters|temoto_action)\.hpp"
    r"|src/([a-z0-9_]+)\.cpp|test/([a-z0-9_]+)_test\.cpp|([a-z0-9_]+)\.umrf\.json"
)


class _BundledAction(msgspec.Struct, frozen=True):
    """The facts about an action that the README lists."""

    name: str
    package: str
    description: str


def bundle_files(package: str, actions: Sequence[Action]) -> dict[str, bytes]:
    """Return the files of one package with all of these actions: contents by path below its folder.
    Raise `ImpossiblePackage` if C++ or ROS does not allow the name of the package, of an action or
    of a parameter. Files of a single action have the same paths as in its own package."""
    refusals = [*_against(package, actions), *check_names(action.name for action in actions)]
    found: dict[str, bytes] = {}
    for action in actions:
        try:
            alone = package_files(action)
        except ImpossiblePackage as error:
            refusals += error.refusals
        else:
            found |= {path: text for path, text in alone.items() if path not in _SHARED}
    if refusals:
        raise ImpossiblePackage(tuple(dict.fromkeys(refusals)))
    members = tuple(
        _BundledAction(action.name, snake_case(action.name), action.description.strip())
        for action in sorted(actions, key=lambda action: snake_case(action.name))
    )
    known = {
        "package": package,
        "description": f"Actions: {', '.join(each.name for each in members)}.",
        "members": members,
        "actions": tuple(each.package for each in members),
    }
    found |= {
        path: rendered(template, language, known) for path, (template, language) in _SHARED.items()
    }
    return dict(sorted(found.items()))


def is_of_bundle(path: str) -> bool:
    """Return whether a package of several actions can have a file at this path, whatever its
    actions are."""
    return path in _SHARED or _OF_ACTIONS.fullmatch(path) is not None


def _against(package: str, actions: Sequence[Action]) -> Iterator[NameRefusal]:
    yield from check_package(package)
    names = {snake_case(action.name): action.name for action in actions}
    if package in names:
        yield NameRefusal(
            package,
            f"“{package}” is what the package of “{names[package]}” alone is called; give the "
            "package of all another name.",
        )
    if f"{package}_uninstall" in names:
        yield NameRefusal(
            names[f"{package}_uninstall"],
            f"“{package}_uninstall” is what ament calls something in the package “{package}”.",
        )
