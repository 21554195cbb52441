"""Where cases run: in processes of this machine, one for each core, or on a cluster of dask.distributed over TLS."""

import contextlib
import ctypes
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hexload.campaign.store import AnyCase
from hexload.errors import InputError, ToolFailed

CONNECT_TIMEOUT_S = 5.0
LOOK_S = 0.1  # between looks at a cluster
NO_WORKERS_S = 30.0  # that long a cluster may be without any
PR_SET_PDEATHSIG = 1  # sys/prctl.h


@dataclass(frozen=True)
class Cluster:
    """A scheduler of dask.distributed, which runs what it is sent: so it is spoken to over TLS alone, and both sides show
    a certificate of the same authority."""

    address: str  # tls://HOST:PORT
    ca: Path  # certificates of authorities, PEM
    certificate: Path  # this side's, PEM
    key: Path  # of the certificate


def cluster_of(address: str | None, ca: Path | None, certificate: Path | None, key: Path | None) -> Cluster | None:
    """Of the command line; None: this machine. Raises InputError."""
    files = {"--tls-ca": ca, "--tls-cert": certificate, "--tls-key": key}
    if address is None:
        for option, file in files.items():
            if file is not None:
                raise InputError(f"{option}: found no --scheduler, expected one: without it nothing is sent")
        return None
    if not address.startswith("tls://"):
        raise InputError(
            f"--scheduler: found {address}, expected tls://HOST:PORT: a cluster runs whatever it is sent, so that it is "
            "reached over TLS alone"
        )
    for option, file in files.items():
        if file is None or not file.is_file():
            raise InputError(f"{option}: found {'nothing' if file is None else f'no file {file}'}, expected a PEM file")
    return Cluster(address, ca, certificate, key)


class _Pool:
    """Processes of this machine: no socket that another user could reach."""

    def __init__(self) -> None:
        self._executor = ProcessPoolExecutor(
            len(os.sched_getaffinity(0)), multiprocessing.get_context("spawn"), _begin_worker, (os.getpid(),)
        )

    def submit(self, run: Callable, case: AnyCase, folder: Path | None) -> Future:
        return self._executor.submit(run, case, folder)

    def completed(self, futures: Sequence[Future]) -> Iterator[Future]:
        return as_completed(futures)

    def close(self) -> None:
        self._executor.shutdown(cancel_futures=True)


def _begin_worker(parent: int) -> None:
    """Ctrl-C, which reaches the workers too, ends them without a word, and so does the end of their parent."""
    signal.signal(signal.SIGINT, lambda *_: os._exit(130))
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(130)


class _Remote:
    """A cluster's client."""

    def __init__(self, client: Any, address: str):
        self._client, self._address = client, address

    def submit(self, run: Callable, case: AnyCase, folder: Path | None) -> Any:
        return self._client.submit(run, case, folder, pure=False)

    def completed(self, futures: Sequence[Any]) -> Iterator[Any]:
        from distributed import as_completed as as_completed_there

        waiting = as_completed_there(futures)
        seen = time.monotonic()  # a worker, or a result
        while waiting.count():
            batch = waiting.next_batch(block=False)
            yield from batch
            if batch or self.has_workers():
                seen = time.monotonic()
            elif time.monotonic() > seen + NO_WORKERS_S:
                raise ToolFailed(
                    f"--scheduler: the scheduler at {self._address} has had no workers for {NO_WORKERS_S:g} s: start "
                    "some; the same command goes on"
                )
            time.sleep(0.0 if batch else LOOK_S)

    def has_workers(self) -> bool:
        try:
            return bool(self._client.scheduler_info(n_workers=-1)["workers"])
        except OSError:  # nor a scheduler
            return False

    def close(self) -> None:
        self._client.close()


@contextlib.contextmanager
def connected(cluster: Cluster | None) -> Iterator[_Pool | _Remote]:
    """Where cases are run, until the block ends.

    Raises InputError when no scheduler answers there, ToolFailed when it has no workers.
    """
    place = _Pool() if cluster is None else _connect(cluster)
    try:
        yield place
    finally:
        place.close()


def _connect(cluster: Cluster) -> _Remote:
    from distributed import Client, Security

    try:
        security = Security(
            tls_ca_file=str(cluster.ca),
            tls_client_cert=str(cluster.certificate),
            tls_client_key=str(cluster.key),
            require_encryption=True,
        )
        client = Client(cluster.address, timeout=CONNECT_TIMEOUT_S, security=security)
    except (OSError, ValueError, TimeoutError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"--scheduler: found no scheduler at {cluster.address} ({reason}), expected one that `dask scheduler "
            "--protocol tls` has started"
        ) from None
    remote = _Remote(client, cluster.address)
    if not remote.has_workers():
        remote.close()
        raise ToolFailed(
            f"--scheduler: the scheduler at {cluster.address} has no workers: start some with `dask worker "
            f"{cluster.address}` and its TLS options"
        )
    return remote


def results(
    place: _Pool | _Remote,
    run: Callable[[AnyCase, Path | None], dict],
    cases: Sequence[AnyCase],
    code: str,
    folder: Path | None,
) -> Iterator[tuple[AnyCase, dict]]:
    """Each case with the result of `run` of it and the folder, in the order in which they are ready.

    Raises ToolFailed when a case fails, all workers have gone, or one has another version of the code.
    """
    futures = {place.submit(run, case, folder): case for case in cases}
    try:
        for future in place.completed(list(futures)):
            case = futures.pop(future)
            yield case, _result_of(case, future, code)
    finally:
        for future in futures:
            future.cancel()


def _result_of(case: AnyCase, future: Any, code: str) -> dict:
    try:
        result = future.result()
    except ToolFailed:
        raise
    except BrokenProcessPool:
        raise ToolFailed(
            f"case {case.name}, or one beside it, has ended its process: is there memory enough?"
        ) from None
    except Exception as error:
        raise ToolFailed(f"case {case.name}: {type(error).__name__}: {error}") from error
    if result["code"] != code:
        raise ToolFailed(
            f"case {case.name}: a worker has code {result['code']}, expected {code}, this machine's: build the same "
            "version on both"
        )
    return result
