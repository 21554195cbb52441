"""The page of `hexload bench`: its tables, and the run whose time it takes."""

import tempfile
from pathlib import Path

from hexload.io.atomic_file import replaced_when_done
from hexload.report import motion
from hexload.report.page import templates
from hexload.simulation import sim
from hexload.view.recorded import recording_of_run

TEMPLATE = "bench.html.jinja"


def write_page(page: Path, figures: dict, processor: str, scenario: Path) -> None:
    """`figures`: what run_bench returns. Raises ToolFailed."""
    with tempfile.TemporaryDirectory(prefix="hexload-bench-") as name:
        directory = sim.run_simulation(sim.SimRequest(scenario, out=Path(name) / "run", quiet=True))
        platform, recording = recording_of_run(directory)
    html = motion.to_html(platform.native(), recording, "bench-motion")
    text = (
        templates("hexload_dev")
        .get_template(TEMPLATE)
        .render(
            processor=processor,
            scenario=recording.title,
            tick_s=figures["tick_s"],
            rig_case=figures["rig_case"],
            tables=figures["simulator"] | figures["cortex_m7"],
            motion=html,
        )
    )
    page.parent.mkdir(parents=True, exist_ok=True)
    with replaced_when_done(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
