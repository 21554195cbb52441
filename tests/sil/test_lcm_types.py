"""The table in lcm_types/README.md, the .lcm files, and the names that programs use are the same."""

import os
import re
import subprocess
from pathlib import Path

import pytest

from hexload import project
from hexload.io import lcm_log
from hexload.view import lcm_listener

SOURCE = Path(os.environ["HEXLOAD_SOURCE_DIR"])
FILES = sorted((SOURCE / "lcm_types").glob("*.lcm"))


def table():
    """(channel, type, producers, consumers) of each row."""
    readme = (SOURCE / "lcm_types" / "README.md").read_text()
    rows = re.findall(r"^\| (HEXLOAD_\w+) \| (\w+) \| (.*?) \| (.*?) \|", readme, re.MULTILINE)
    assert rows
    return rows


def test_the_table_has_each_type_once_on_the_channel_of_its_name():
    rows = table()
    assert sorted(row[1] for row in rows) == [path.stem for path in FILES]
    for channel, name, *_ in rows:
        assert channel == "HEXLOAD_" + name.removesuffix("_t").upper()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_message_has_a_sequence_number_and_a_tick_and_survives_the_wire(path):
    # GIVEN a message of each type
    kind = project.message_type(path.stem)
    assert kind.__slots__[:2] == ["sequence", "tick"]
    message = kind()
    message.sequence, message.tick = 2**40 + 1, 2**32 - 1
    # WHEN it is encoded and decoded THEN these two are the same
    again = kind.decode(message.encode())
    assert (again.sequence, again.tick) == (message.sequence, message.tick)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_number_has_its_unit_in_its_name_or_beside_it(path):
    # GIVEN the fields of a type that are real numbers
    for line in path.read_text().splitlines():
        field = re.match(r"\s+(?:float|double)\s+(\w+)(?:\[\w+\])?;\s*(//.*)?", line)
        # THEN each is named with an SI unit, or its comment has the unit or says what it is
        if field:
            has_unit = re.search(r"_(m|m_s|rad|rad_s|n|n_m|kg|kg_m2|s|1|1_s)$", field[1])
            assert has_unit or field[2], f"{path.name}: {field[1]} has no unit"


def test_programs_and_tools_name_the_channels_of_the_table():
    assert lcm_log.CHANNEL in {row[0] for row in table()}
    # and the default URL is one and the same
    header = (SOURCE / "lcm_types" / "include" / "hexload_lcm" / "session.hpp").read_text()
    readme = (SOURCE / "lcm_types" / "README.md").read_text()
    assert f'default_url = "{lcm_listener.DEFAULT_URL}"' in header
    assert f"`{lcm_listener.DEFAULT_URL}`" in readme


def test_the_programs_of_the_table_have_the_options_that_it_names():
    # GIVEN the producers and consumers of the table
    words = set(re.findall(r"`(hexload_\w+)(?: (--\w+)(?: lcm)?)?`", "\n".join("|".join(row) for row in table())))
    folders = {"hexload_sim": "host_sim", "hexload_bridge": "host_sim", "hexload_ecu": "firmware/ports/linux"}
    for program, option in words:
        help_text = subprocess.run(
            [project.build_directory() / folders[program] / program, "--help"], capture_output=True, text=True
        ).stdout
        # THEN each exists and knows its option
        assert program in help_text and option in help_text, f"{program} {option}"
