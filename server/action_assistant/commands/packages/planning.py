"""What one call does to all packages below a folder: looked at first, written together."""

from collections.abc import Mapping
from pathlib import Path

import msgspec

from action_assistant.commands.packages.folder import FileStep, contents
from action_assistant.umrf.packages.bases import (
    BASE_NAME,
    GenerationBase,
    UnreadableBase,
    read_base,
)
from action_assistant.umrf.packages.regenerating import (
    Regeneration,
    readable_paths,
    regenerated,
)


class PackagesPlan(msgspec.Struct, frozen=True):
    """The changes of packages in a folder. `regenerations`: by folder of the package; `there`:
    present contents by path; `barred`: why a path cannot be read, by path."""

    regenerations: dict[str, Regeneration]
    there: dict[str, bytes] = {}
    barred: dict[str, str] = {}

    @property
    def refused(self) -> bool:
        """Return whether anything prevents writing."""
        return bool(self.barred) or any(
            each.conflicts or each.differing or each.broken for each in self.regenerations.values()
        )

    @property
    def writes(self) -> dict[str, bytes]:
        """Return the new content of each file that changes or is missing, base files included."""
        found: dict[str, bytes] = {}
        for folder, each in self.regenerations.items():
            found |= {f"{folder}/{path}": content for path, content in each.writes.items()}
            if each.base is not None:
                found[f"{folder}/{BASE_NAME}"] = each.base
        return found

    @property
    def removals(self) -> tuple[str, ...]:
        """Return the paths of files to be removed."""
        return tuple(
            f"{folder}/{path}"
            for folder, each in self.regenerations.items()
            for path in each.removals
        )

    @property
    def steps(self) -> tuple[FileStep, ...]:
        """Return the steps of writing, in an order that may be interrupted anywhere.

        The base files come last. If they came first, a killed call would leave files that look as
        if people had reverted the new content. Before all files, each base announces which files
        will follow, so that the next call knows those that were written.
        """
        announced = [
            FileStep(f"{folder}/{BASE_NAME}", each.announced)
            for folder, each in self.regenerations.items()
            if each.writes
        ]
        writes = self.writes
        files = [path for path in writes if not path.endswith(f"/{BASE_NAME}")]
        bases = [path for path in writes if path.endswith(f"/{BASE_NAME}")]
        return (
            *announced,
            *(FileStep(path, writes[path]) for path in files),
            *(FileStep(path, None) for path in self.removals),
            *(FileStep(path, writes[path]) for path in bases),
        )


def plan(root: Path, packages: Mapping[str, Mapping[str, bytes]]) -> PackagesPlan:
    """Plan how generated packages go into the folder `root`. `packages`: contents by package folder
    and path. Raise CannotStart if a folder cannot be read."""
    regenerations: dict[str, Regeneration] = {}
    there: dict[str, bytes] = {}
    barred: dict[str, str] = {}
    found = contents(root, [f"{folder}/{BASE_NAME}" for folder in packages])
    for folder, now in packages.items():
        base, at = None, f"{folder}/{BASE_NAME}"
        if at in found.barred:
            barred[at] = found.barred[at]
        elif at in found.present:
            there[at] = found.present[at]
            try:
                base = read_base(found.present[at])
            except UnreadableBase as error:
                barred[at] = str(error)
        below = contents(root, [f"{folder}/{path}" for path in readable_paths(folder, now, base)])
        there |= below.present
        barred |= below.barred
        if not barred:
            regenerations[folder] = _regenerated(folder, now, below.present, base)
    return PackagesPlan(regenerations, there, barred)


def _regenerated(
    folder: str,
    now: Mapping[str, bytes],
    there: Mapping[str, bytes],
    base: GenerationBase | None,
) -> Regeneration:
    inside = {path.removeprefix(f"{folder}/"): content for path, content in there.items()}
    return regenerated(folder, now, inside, base)
