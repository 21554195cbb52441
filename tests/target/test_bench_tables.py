"""The controller's tables of `hexload bench`."""

from hexload import project
from hexload_dev import controller_bench, target
from hexload_dev.bench_page import write_page

SHORT_MOTION_S = 1.0  # the figures of a longer motion are those of the budgets
PUBLISHED = ("TinyEKF", "kalman-clib", "CMSIS-DSP, dense", "Eigen fixed-size, dense", "Eigen, block-structured")


def test_bench_prints_stages_filters_and_memory(capsys, monkeypatch):
    # GIVEN a terminal that is wide enough WHEN the tables are printed
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setattr(controller_bench, "MOTION_S", SHORT_MOTION_S)
    controller_bench.print_controller_tables()
    output = capsys.readouterr().out
    # THEN each row has its numbers: a stage and the tick at both levels, in motion and for hard input
    rows = [
        [cell.strip() for cell in line.strip("│").split("│")] for line in output.splitlines() if line.startswith("│")
    ]
    numbers = {name: [int(cell.replace(",", "")) for cell in cells if cell] for name, *cells in rows}
    for stage in (*target.STAGES, "whole tick"):
        assert len(numbers[stage]) == 4, stage
        assert min(numbers[stage]) > 100, stage
    # AND the momentum filter costs more with bias and friction than without them, at both levels
    plain, machine = (numbers[f"whole tick, {name}"] for name in controller_bench.MOMENTUM.values())
    assert len(plain) == len(machine) == 4
    assert all(less < more for less, more in zip(plain, machine))
    # AND so have the parts of a whole sample, for each filter and profile
    for name, profile in controller_bench.NODE_KINDS:
        for part in target.NODE_PARTS:
            assert len(numbers[f"{part}, {name}, {profile}"]) == 4
    # AND the filters measured here and those that others have published
    assert len([name for name in numbers if name.startswith("* ")]) == 5
    assert all(name in numbers for name in PUBLISHED)
    # AND the memory
    assert numbers["an estimator"][0] == numbers["an estimator"][1] > 500
    for what in ("an estimator", "stack of a tick"):
        rows = (what, *(f"{what}, {name}" for name in controller_bench.MOMENTUM.values()))
        paper, plain, machine = (numbers[row][0] for row in rows)
        assert paper < plain < machine
    assert numbers["a bus node, either estimator included"][0] > numbers["an estimator, momentum"][0]
    print(output)


def test_the_page_has_every_table_and_plays_the_run(tmp_path):
    # GIVEN the figures of a bench
    table = {"Memory": [{"what": "an estimator", "-O2": "1,560", "-O3": "1,568"}]}
    figures = {
        "tick_s": 5.8e-6,
        "rig_case": {20.0: 1.125},
        "simulator": {"Speed": [{"simulator": "MuJoCo", "x real time": "23"}]},
        "cortex_m7": table,
    }
    page = tmp_path / "bench" / "report.html"
    # WHEN the page is written
    write_page(page, figures, "a processor", project.SCENARIOS / "paper.toml")
    # THEN it has them, and the run as an animated view, in one file below 2 MB
    text = page.read_text()
    for words in (
        "<h2>Memory</h2>",
        "<td>1,568</td>",
        "<td>MuJoCo</td>",
        "5800 ns",
        "20 s: 1.12 times",
        "a processor",
        'id="bench-motion"',
    ):
        assert words in text
    assert len(text) < 2_000_000
    assert "src=" not in text and "<link" not in text
