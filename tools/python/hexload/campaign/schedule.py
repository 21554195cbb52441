"""Where cases run: on all cores of this machine, or on a cluster of dask.distributed."""

import contextlib
import logging
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from distributed import Client, LocalCluster, as_completed

from hexload.campaign.store import AnyCase
from hexload.errors import InputError, ToolFailed

CONNECT_TIMEOUT_S = 5.0


@contextlib.contextmanager
def connected(address: str | None) -> Iterator[Client]:
    """A client of the scheduler at the address, or of one of this process with a worker per core.

    Raises InputError when no scheduler answers there, ToolFailed when it has no workers.
    """
    if address is not None:
        with _remote(address) as client:
            yield client
        return
    with (
        tempfile.TemporaryDirectory(prefix="hexload-dask-") as folder,
        LocalCluster(
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",
            local_directory=folder,
            silence_logs=logging.CRITICAL,  # what fails is told once, by results()
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client


def _remote(address: str) -> Client:
    try:
        client = Client(address, timeout=CONNECT_TIMEOUT_S)
    except (OSError, ValueError, TimeoutError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"--scheduler: found no scheduler at {address} ({reason}), expected one that `dask scheduler` has "
            "started, such as tcp://HOST:8786"
        ) from None
    if not client.scheduler_info(n_workers=-1)["workers"]:
        client.close()
        raise ToolFailed(
            f"--scheduler: the scheduler at {address} has no workers: start some with `dask worker {address}`"
        )
    return client


def results(
    client: Client,
    run: Callable[[AnyCase, Path | None], dict],
    cases: Sequence[AnyCase],
    code: str,
    folder: Path | None,
) -> Iterator[tuple[AnyCase, dict]]:
    """Each case with the result of `run` of it and the folder, in the order in which they are ready.

    Raises ToolFailed when a case fails, or a worker has another version of the code.
    """
    futures = {client.submit(run, case, folder, pure=False): case for case in cases}
    try:
        for future in as_completed(futures):
            case = futures[future]
            try:
                result = future.result()
            except ToolFailed:
                raise
            except Exception as error:
                raise ToolFailed(f"case {case.name}: {type(error).__name__}: {error}") from error
            if result["code"] != code:
                raise ToolFailed(
                    f"case {case.name}: a worker has code {result['code']}, expected {code}, this machine's: build the "
                    "same version on both"
                )
            yield case, result
            future.release()
    finally:
        client.cancel(list(futures))
