"""What people are told about packages that are written anew."""

import difflib
import sys
from collections.abc import Iterator
from pathlib import Path

from action_assistant.commands.packages.planning import PackagesPlan
from action_assistant.umrf.packages.bases import BASE_NAME
from action_assistant.umrf.packages.generating import is_source
from action_assistant.umrf.packages.regenerating import GeneratedChange


def tell_refusals(root: Path, plan: PackagesPlan) -> None:
    """What stands against writing, each with its place."""
    for path, reason in plan.barred.items():
        _tell(f"{root / path}: {reason}.")
    for folder, each in plan.regenerations.items():
        for path in each.differing:
            _tell(
                f"{root / folder / path}: is there and differs; nobody knows what it was made from."
            )
        for path, conflicts in each.conflicts.items():
            for conflict in conflicts:
                _tell(
                    f"{root / folder / path}:{conflict.line}: what was changed here by hand and what is "
                    "generated now overlap."
                )
        for path, reason in each.broken.items():
            _tell(
                f"{root / folder / path}: what was changed by hand and what is generated now make no "
                f"readable file together: {reason}"
            )


def tell_refused(plan: PackagesPlan) -> None:
    """The end of a call that could not write."""
    _tell("Nothing was written.")
    if any(each.conflicts or each.broken for each in plan.regenerations.values()):
        _tell("Take over by hand what `--diff` shows for these files, and call again.")


def tell_changes(root: Path, plan: PackagesPlan) -> None:
    """What a call would do."""
    for path in plan.writes:
        _tell(f"{root / path}: {'would change' if path in plan.there else 'is not there'}.")
    for path in plan.removals:
        _tell(f"{root / path}: is no longer generated, and would be removed.")


def tell_notes(root: Path, plan: PackagesPlan, with_lines: bool) -> None:
    """What stays as it is, although it is generated otherwise or no longer. `with_lines`: also how, since
    once it is written nothing else knows what was generated before."""
    for folder, each in plan.regenerations.items():
        for path in each.kept:
            _tell(
                f"{root / folder / path}: is no longer generated; it stays, since it was changed."
            )
        for path, change in each.by_hand.items():
            if not is_source(path):
                continue
            _tell(
                f"{root / folder / path}: is yours and stays; what is generated for it is new, to be "
                f"taken over by hand{':' if with_lines else ' (`--diff` shows it).'}"
            )
            if with_lines:
                sys.stderr.writelines(_by_hand(f"{folder}/{path}", change))


def print_difference(plan: PackagesPlan) -> None:
    """As `diff -u` prints it: what would be written after merging, or stands against it, but the base,
    whose changes are those of the other files; then what would not be written, but has to be taken over by hand."""
    shown: dict[str, bytes | None] = {**plan.writes, **dict.fromkeys(plan.removals)}
    for folder, each in plan.regenerations.items():
        shown |= {f"{folder}/{path}": content for path, content in each.differing.items()}
    for path in sorted(path for path in shown if not path.endswith(f"/{BASE_NAME}")):
        there, content = plan.there.get(path), shown[path]
        sys.stdout.writelines(
            _lines(
                there or b"",
                content or b"",
                "/dev/null" if there is None else f"a/{path}",
                "/dev/null" if content is None else f"b/{path}",
            )
        )
    for folder, each in plan.regenerations.items():
        for path, change in each.by_hand.items():
            sys.stdout.writelines(_by_hand(f"{folder}/{path}", change))


def _tell(sentence: str) -> None:
    print(sentence, file=sys.stderr)


def _by_hand(path: str, change: GeneratedChange) -> Iterator[str]:
    return _lines(change.last, change.now, f"{path} as generated last", f"{path} as generated now")


def _lines(before: bytes, after: bytes, old: str, new: str) -> Iterator[str]:
    found = difflib.unified_diff(
        before.decode(errors="replace").splitlines(keepends=True),
        after.decode(errors="replace").splitlines(keepends=True),
        old,
        new,
    )
    return (
        line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n" for line in found
    )
