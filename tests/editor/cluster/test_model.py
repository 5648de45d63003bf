"""A model of several editors keeps every edit once, whatever is lost, late, frozen or cut off; and the model finds
each mistake that could be made in its rules."""

import os

import pytest

from editor.cluster.model import MUTANTS, Broken, Mutant, World

SEEDS = int(os.environ.get("SOAK_CLUSTER", "1000"))
PARTS = 10


@pytest.mark.parametrize("part", range(PARTS))
def test_nothing_is_lost_doubled_or_shown_otherwise(part: int) -> None:
    edits = faults = 0
    for seed in range(part, SEEDS, PARTS):
        world = World(seed)
        try:
            world.run()
        except Broken as error:
            raise AssertionError(f"seed {seed}: {error}") from error
        edits += len(world.acknowledged)
        faults += world.faults
    assert edits > 5 * faults > 0


@pytest.mark.parametrize("mutant", MUTANTS)
def test_a_mistake_in_the_rules_is_found(mutant: Mutant) -> None:
    for seed in range(300):
        try:
            World(seed, mutant).run()
        except Broken:
            return
    raise AssertionError(f"nothing shows: {mutant}")
