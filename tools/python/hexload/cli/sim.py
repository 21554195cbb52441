"""`hexload sim`: a run and what is said of it on the terminal, or the run live in the browser."""

from pathlib import Path

from hexload.cli.output import print_json
from hexload.simulation import sim
from hexload.simulation.sim import SimRequest


def run(request: SimRequest, as_json: bool, view: bool) -> None:
    """Raises InputError, ToolFailed."""
    if view and request.real_time:
        _run_shown_live(request.for_live_page())
        return
    with sim.completed(request) as complete:
        directory = sim.run_simulation(complete)
    if as_json:
        print_json(sim.figures(directory))
    else:
        _print_end(directory, request.quiet)
    if view:
        from hexload.view.verb import show_run

        show_run(directory)


def _run_shown_live(request: SimRequest) -> None:
    from hexload.view.verb import show_simulation

    with sim.completed(request) as complete:
        sim.build_for(complete)  # a page is there when its address is told, and moves
        show_simulation(
            sim.platform_file(complete.scenario),
            complete.bus if complete.is_on_bus else None,
            complete.profile,
            complete.publish,
            complete.key,
            lambda: sim.run_simulation(complete),
        )


def _print_end(directory: Path, quiet: bool) -> None:
    if not quiet and (mend := sim.mend_in_words(directory)):
        print(f"  mend: {mend}")
    print(directory)
