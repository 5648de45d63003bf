"""Computes the changes of a package in which people have worked when it is generated again. Nothing
here reads or writes files."""

from collections.abc import Mapping
from xml.etree import ElementTree

import msgspec

from action_assistant.umrf.files import codec
from action_assistant.umrf.packages.bases import (
    GenerationBase,
    UnfinishedFile,
    digest,
    write_base,
)
from action_assistant.umrf.packages.bundling import is_of_bundle
from action_assistant.umrf.packages.generating import is_source, possible_files
from action_assistant.umrf.packages.merging import MergeConflict, merged


class GeneratedChange(msgspec.Struct, frozen=True):
    """The text generated for a file last time, and now."""

    last: bytes
    now: bytes


class Regeneration(msgspec.Struct, frozen=True):
    """The changes of a package; paths are below it. Nothing may be written while there are
    `conflicts`, `differing` or `broken`.

    `writes`: contents of files that change or are missing, without the base. `removals`: files that
    are no longer generated and are as they were generated. `kept`: such files that people have
    changed. `by_hand`: the new text of files that are not written, or in conflict. `differing`: the
    new text of files that no known generation has made. `broken`: the reasons for which merged
    files could not be read. `base`: the new content of the base file, None if it does not change.
    `announced`: its content while files are written.
    """

    writes: dict[str, bytes] = {}
    removals: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()
    by_hand: dict[str, GeneratedChange] = {}
    conflicts: dict[str, tuple[MergeConflict, ...]] = {}
    differing: dict[str, bytes] = {}
    broken: dict[str, str] = {}
    base: bytes | None = None
    announced: bytes = b""


class _RegenerationBuilder:
    """Collects the changes of a regeneration."""

    def __init__(self) -> None:
        self.writes: dict[str, bytes] = {}
        self.by_hand: dict[str, GeneratedChange] = {}
        self.conflicts: dict[str, tuple[MergeConflict, ...]] = {}
        self.differing: dict[str, bytes] = {}
        self.broken: dict[str, str] = {}

    def add_file(self, path: str, last: bytes | None, there: bytes | None, now: bytes) -> None:
        """Decide what to do with the file at `path`. `last`: the text generated last time; `there`:
        the present content; `now`: the text generated now; None if there is no such text."""
        if there == now:
            return
        if last is None:
            if there is None:
                self.writes[path] = now
            else:
                self.differing[path] = now
        elif is_source(path):
            if there is not None and last != now:
                self.by_hand[path] = GeneratedChange(last, now)
        elif there is None:
            self.writes[path] = now
        else:
            self.merge(path, last, there, now)

    def merge(self, path: str, last: bytes, there: bytes, now: bytes) -> None:
        """Merge the changes from the text generated last to that generated now into the present
        content (`there`). If there is a conflict, or the result could not be read, record that
        instead."""
        found = merged(last, there, now)
        if found.conflicts:
            self.conflicts[path] = found.conflicts
            self.by_hand[path] = GeneratedChange(last, now)
        elif found.content != there:
            reason = None if found.content == now else _against(path, there, found.content)
            if reason is None:
                self.writes[path] = found.content
            else:
                self.broken[path] = reason
                self.by_hand[path] = GeneratedChange(last, now)


def regenerated(
    package: str, now: Mapping[str, bytes], there: Mapping[str, bytes], base: GenerationBase | None
) -> Regeneration:
    """Return how a new generation changes a package: the three-way merge of its files. Nothing is
    written. `now`: the result of `package_files`; `there`: the present contents of these files and
    of those that the base names; `base`: the texts of the last generation, None for the first one.
    """
    # Anybody may have written the base file, so paths that we never generate are ignored.
    settled = (base or GenerationBase()).settled(there)
    last = {path: text for path, text in settled.items() if _is_possible(package, now, path)}
    builder = _RegenerationBuilder()
    for path, text in now.items():
        builder.add_file(path, last.get(path), there.get(path), text)
    left = [path for path in sorted(last) if path not in now and path in there]
    kept = tuple(path for path in left if there[path] != last[path])
    same = {path: text for path, text in now.items() if there.get(path) == text}
    # The base of a kept file stays, since the file may be generated again.
    known = GenerationBase(dict(now) | {path: last[path] for path in kept})
    return Regeneration(
        writes=builder.writes,
        removals=tuple(path for path in left if path not in kept),
        kept=kept,
        by_hand=builder.by_hand,
        conflicts=builder.conflicts,
        differing=builder.differing,
        broken=builder.broken,
        base=None if known == base else write_base(known),
        announced=_announced(builder.writes, now, last | same),
    )


def _announced(
    writes: Mapping[str, bytes], now: Mapping[str, bytes], files: dict[str, bytes]
) -> bytes:
    coming = {path: UnfinishedFile(digest(text), now[path]) for path, text in writes.items()}
    return write_base(GenerationBase(files, coming))


def readable_paths(
    package: str, now: Mapping[str, bytes], base: GenerationBase | None
) -> tuple[str, ...]:
    """Return the paths of the files that have to be read before the package `package` is generated
    again. `now`: the newly generated texts by path; `base`: the texts generated before, None
    without."""
    known = base or GenerationBase()
    named = (*known.files, *known.unfinished)
    return tuple(sorted({*now, *(path for path in named if _is_possible(package, now, path))}))


def _is_possible(package: str, now: Mapping[str, bytes], path: str) -> bool:
    """Return whether a generation of this package could have made a file at `path`. `now`: the
    files generated now. A package of several actions may have files of actions that are no longer
    in it."""
    if f"{package}.umrf.json" in now:
        return path in possible_files(package)
    return is_of_bundle(path)


def _against(path: str, before: bytes, content: bytes) -> str | None:
    """Return the reason for which the merged `content` of a file is invalid; None if it is valid,
    or was invalid before. Lines of two sides may each be valid alone and together be no JSON."""
    reason = _unreadable(path, content)
    return None if reason is None or _unreadable(path, before) else reason


def _unreadable(path: str, content: bytes) -> str | None:
    try:
        if path.endswith(".json"):
            codec.read_action(content)
        elif path.endswith(".xml"):
            ElementTree.fromstring(content)
    except (codec.Unreadable, ElementTree.ParseError) as error:
        return str(error)
    return None
