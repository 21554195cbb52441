"""Runs cases with a bar on stderr; each result is a file as soon as it is there."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from hexload.campaign import schedule
from hexload.campaign.store import AnyCase, Store


def complete(
    cases: Sequence[AnyCase],
    run: Callable[[AnyCase, Path | None], dict],
    code: str,
    store: Store,
    remarks: Sequence[str],
    cluster: schedule.Cluster | None,
    folder: Path | None,
) -> dict[AnyCase, dict]:
    """The results of all cases: those in the store, and the others, which are run. Says so after `remarks`, on stderr."""
    done, more = store.split(cases, code)
    missing = [case for case in cases if case not in done]
    if done:
        more.append(f"{len(done)} of {len(cases)} cases are done already, {len(missing)} to go")
    for remark in (*remarks, *more):
        print(f"hexload: {remark}", file=sys.stderr)
    return done | _run_and_store(missing, run, code, store, cluster, folder) if missing else done


def _run_and_store(
    cases: Sequence[AnyCase],
    run: Callable[[AnyCase, Path | None], dict],
    code: str,
    store: Store,
    cluster: schedule.Cluster | None,
    folder: Path | None,
) -> dict[AnyCase, dict]:
    """The results by case. `run` gets case and folder, on a worker. Raises as schedule.results; at Ctrl-C, says how to go
    on."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    done = {}
    with schedule.connected(cluster) as place, Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task("cases", total=len(cases))
        try:
            for case, result in schedule.results(place, run, cases, code, folder):
                store.write(case, result)
                done[case] = result
                progress.advance(task)
        except KeyboardInterrupt:
            print(f"hexload: {len(done)} of {len(cases)} cases were done; the same command goes on", file=sys.stderr)
            raise
    return done
