"""A sample of small faults in the firmware's sources, which the unit tests that are nearest to them should notice.

The faults are drawn by the text of their lines: a line that stays has the same ones, so that none is red at random, and one
that is changed draws anew. What the unit tests let through of all faults says `hexload mutate` (tests/README.md).
"""

import os
import subprocess
from pathlib import Path

import pytest

from hexload_dev import mutate

BUILD = Path(os.environ["HEXLOAD_BUILD_DIR"])
SHARE = 0.001
NEAREST = 2  # programs, that a fault is shown to
# Of all faults three in four are noticed at least; that of eight fewer than half are has a chance of 3 %.
LEAST = 0.5


@pytest.fixture(scope="module")
def bench():
    return mutate.prepare(BUILD)


def test_every_source_compiles_where_its_faults_do(bench):
    # GIVEN the commands for sources with faults WHEN those without compile THEN none fails, whose faults would all count as
    # none
    assert len(bench.precisions[0].compile) > 50
    for command in bench.precisions[0].compile.values():
        subprocess.run([*command, "-fsyntax-only"], cwd=bench.directory, check=True)


def test_the_unit_tests_notice_faults(bench):
    # GIVEN some faults of those that could slip in WHEN the nearest unit tests run with each of them
    mutants = mutate.steady_sample(SHARE)
    outcomes = mutate.try_nearest(bench, mutants, NEAREST)
    # THEN they notice it, but for some: those are printed
    left = mutate.not_accepted(outcomes)
    killed = sum(outcome == mutate.KILLED for outcome in outcomes.values())
    print(f"{killed} noticed, {len(left)} not:", *map(mutate.described, left), sep="\n")
    assert killed >= LEAST * (killed + len(left)) and killed > 0
