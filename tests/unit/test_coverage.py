"""What the unit tests run of the firmware, against uncovered.toml."""

import os
import tomllib
from pathlib import Path

from hexload_dev import coverage

BUILD = Path(os.environ["HEXLOAD_BUILD_DIR"])


def test_the_unit_tests_leave_nothing_out_but_what_is_listed():
    # GIVEN what the unit tests, which have just ended, have run of the firmware
    files = coverage.read_coverage(BUILD)
    # WHEN it is held against the list of what no unit test can run THEN it is the same, file by file
    faults = coverage.compare(files, tomllib.loads(coverage.UNCOVERED.read_text()))
    assert len(files) > 40
    assert not faults, "\n".join(faults)
