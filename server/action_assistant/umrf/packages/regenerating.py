"""What a new generation does to a package in which people have worked. Nothing here reads or writes."""

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
    """What was generated for a file last, and what is now."""

    last: bytes
    now: bytes


class Regeneration(msgspec.Struct, frozen=True):
    """What becomes of a package; paths are below it. While there is anything in `conflicts`, `differing`
    or `broken`, nothing may be written.

    `writes`: contents of files that change or are missing, without the base. `removals`: files that are no
    longer generated and are as they were generated. `kept`: such files that people have changed.
    `by_hand`: what is generated anew for files that are not written, or in conflict. `differing`: what is
    generated for files that no generation is known to have made. `broken`: why files that were merged could not be read.
    `base` is what is to be remembered afterwards, None where it is so already; `announced` while files are
    written.
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


class _PackageReader:
    """A regeneration while it is put together."""

    def __init__(self) -> None:
        self.writes: dict[str, bytes] = {}
        self.by_hand: dict[str, GeneratedChange] = {}
        self.conflicts: dict[str, tuple[MergeConflict, ...]] = {}
        self.differing: dict[str, bytes] = {}
        self.broken: dict[str, str] = {}

    def look_at(self, path: str, last: bytes | None, there: bytes | None, now: bytes) -> None:
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
    """`now`: what `package_files` gives; `there`: what the package has at these paths and at those that
    the base names."""
    # The base is a file, which anybody may have written: it may name what we make, and nothing else.
    settled = (base or GenerationBase()).settled(there)
    last = {path: text for path, text in settled.items() if _is_possible(package, now, path)}
    reader = _PackageReader()
    for path, text in now.items():
        reader.look_at(path, last.get(path), there.get(path), text)
    left = [path for path in sorted(last) if path not in now and path in there]
    kept = tuple(path for path in left if there[path] != last[path])
    same = {path: text for path, text in now.items() if there.get(path) == text}
    # Of what stays although it is no longer generated the base stays too: it may be generated again.
    known = GenerationBase(dict(now) | {path: last[path] for path in kept})
    return Regeneration(
        writes=reader.writes,
        removals=tuple(path for path in left if path not in kept),
        kept=kept,
        by_hand=reader.by_hand,
        conflicts=reader.conflicts,
        differing=reader.differing,
        broken=reader.broken,
        base=None if known == base else write_base(known),
        announced=_announced(reader.writes, now, last | same),
    )


def _announced(
    writes: Mapping[str, bytes], now: Mapping[str, bytes], files: dict[str, bytes]
) -> bytes:
    coming = {path: UnfinishedFile(digest(text), now[path]) for path, text in writes.items()}
    return write_base(GenerationBase(files, coming))


def readable_paths(
    package: str, now: Mapping[str, bytes], base: GenerationBase | None
) -> tuple[str, ...]:
    """The paths at which `regenerated` has to know what is there."""
    known = base or GenerationBase()
    told = (*known.files, *known.unfinished)
    return tuple(sorted({*now, *(path for path in told if _is_possible(package, now, path))}))


def _is_possible(package: str, now: Mapping[str, bytes], path: str) -> bool:
    """Whether a generation for this package could have made a file. What several actions had together
    has files of actions that are no longer among them."""
    if f"{package}.umrf.json" in now:
        return path in possible_files(package)
    return is_of_bundle(path)


def _against(path: str, before: bytes, content: bytes) -> str | None:
    """Why a merged file cannot be, if people left one that can: lines of two sides may be good each for
    itself, and no JSON together."""
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
