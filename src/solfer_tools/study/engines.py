"""Engines start the workers of a study: processes of this machine, Dask, or Slurm. All else is the folder's."""

import abc
import logging
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from solfer.errors import StudyError
from solfer.installation import pip_install


class WorkerEngine(abc.ABC):
    """Workers of a study."""

    @abc.abstractmethod
    def check(self) -> None:
        """Look after the workers.

        Raises:
            StudyError: They cannot work.
        """

    @abc.abstractmethod
    def close(self) -> None:
        """End all workers."""


class LocalEngine(WorkerEngine):
    """Processes of this machine; one that ends before its time is started again.

    Args:
        folder: The folder of the study.
        count: How many.
        follow: Whether they wait for further runs.
    """

    def __init__(self, folder: Path, count: int, follow: bool):
        self._command = worker_command(folder, follow)
        self._processes = [self._start() for _ in range(count)]
        self._short = 0

    def check(self) -> None:
        """See `WorkerEngine.check`."""
        for place, (process, begin) in enumerate(self._processes):
            code = process.poll()
            if code is None or code == 0:
                continue
            has_worked = time.monotonic() - begin >= 5.0
            self._short = 0 if has_worked else self._short + 1
            if code == 2 or self._short >= 3:  # three in a row have not worked
                _, text = process.communicate()
                raise _failed(f"a worker ended with exit code {code}: {text.strip().removeprefix('error: ')[-2000:]}")
            self._processes[place] = self._start()

    def close(self) -> None:
        """See `WorkerEngine.close`."""
        for process, _ in self._processes:
            process.terminate()
        for process, _ in self._processes:
            try:
                process.wait(5.0)
            except subprocess.TimeoutExpired:
                process.kill()

    def _start(self) -> tuple[subprocess.Popen, float]:
        process = subprocess.Popen(
            self._command, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=environment()
        )
        return process, time.monotonic()


class DaskEngine(WorkerEngine):
    """Tasks on a Dask cluster, each a worker.

    Args:
        folder: The folder of the study, which all of them have.
        count: How many.
        follow: Whether they wait for further runs.
        scheduler: Address of the scheduler; empty: a cluster on this machine.
    """

    def __init__(self, folder: Path, count: int, follow: bool, scheduler: str = ""):
        with needs("distributed", "dask"):
            from distributed import Client, LocalCluster
        logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what is lost is reported by `check`
        self._cluster = None
        if not scheduler:
            with needs("cryptography", "cryptography"):
                import cryptography  # noqa: F401
            import dask

            # tasks are code: of the users of this machine only this one may submit any, and see them
            routes: dict[str, list[str]] = {f"distributed.{each}.http.routes": [] for each in ("scheduler", "worker")}
            with dask.config.set(routes):
                self._cluster = LocalCluster(
                    n_workers=count, threads_per_worker=1, dashboard_address=None, security=True
                )
        try:
            self._client = Client(scheduler or self._cluster, timeout="10s")
        except (OSError, ValueError) as error:
            raise StudyError(
                f"no Dask scheduler answers at {scheduler}: {error}", expected="the address of a scheduler, or none"
            ) from None
        self._futures = [
            self._client.submit(run_worker, str(folder), follow, pure=False, key=f"solfer-{os.getpid()}-{index}")
            for index in range(count)
        ]

    def check(self) -> None:
        """See `WorkerEngine.check`."""
        if self._client.status not in ("running", "connecting"):
            raise _failed("the Dask scheduler has gone away")
        for future in self._futures:
            if future.status in ("error", "lost"):
                error = future.exception() if future.status == "error" else "its worker is lost"
                raise _failed(f"a worker failed: {error}")

    def close(self) -> None:
        """See `WorkerEngine.close`."""
        with suppress(Exception):  # a scheduler that has gone away
            self._client.cancel(self._futures, force=True)
            self._client.close(timeout=2)
        if self._cluster is not None:
            self._cluster.close(timeout=10)


class SlurmEngine(WorkerEngine):
    """Jobs of Slurm, each a worker, by `submitit`.

    Args:
        folder: The folder of the study, which all nodes have.
        count: How many.
        follow: Whether they wait for further runs.
        options: Parameters of `submitit`, such as `slurm_partition=short`.
    """

    def __init__(self, folder: Path, count: int, follow: bool, options: dict[str, Any]):
        with needs("submitit", "submitit"):
            import submitit
        self._next = 0.0
        try:
            logging.getLogger("submitit").setLevel(logging.ERROR)  # it warns where Slurm keeps no accounts
            executor = submitit.SlurmExecutor(folder=folder / "slurm")
            executor.update_parameters(job_name="solfer", **options)
            with executor.batch():
                self._jobs: list[Any] = [executor.submit(run_worker, str(folder), follow) for _ in range(count)]
        except (RuntimeError, OSError, ValueError, submitit.core.utils.FailedJobError) as error:
            raise StudyError(f"Slurm does not take the jobs: {error}", expected="`sbatch` on PATH") from None

    def check(self) -> None:
        """See `WorkerEngine.check`."""
        if time.monotonic() < self._next:
            return
        self._next = time.monotonic() + 5.0  # Slurm answers slowly
        for job in self._jobs:
            if job.done() and (error := job.exception()) is not None:
                raise _failed(f"a job failed: {error}")

    def close(self) -> None:
        """See `WorkerEngine.close`."""
        for job in self._jobs:
            if not job.done():
                job.cancel(check=False)


@contextmanager
def needs(package: str, project: str) -> Iterator[None]:
    """Raise a clear error where a package is missing that an engine needs; `project` is its name for pip."""
    try:
        yield
    except ModuleNotFoundError:
        raise StudyError(f"the package '{package}' is missing", expected=pip_install(project)) from None


def worker_command(folder: Path, follow: bool) -> list[str]:
    """Return the command of a worker."""
    command = [sys.executable, "-m", "solfer_tools.study.worker", str(folder), "--with-parent"]
    return [*command, "--follow"] if follow else command


def environment() -> dict[str, str]:
    """Return the environment of a worker: one thread, so that sums are the same on every machine."""
    return {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def run_worker(folder: str, follow: bool) -> int:
    """Run a worker in a process of its own, on any machine; its exit code.

    Raises:
        StudyError: It cannot work.
    """
    process = subprocess.run(
        worker_command(Path(folder), follow), stderr=subprocess.PIPE, text=True, check=False, env=environment()
    )
    if process.returncode:
        raise _failed(process.stderr.strip()[-2000:] or f"a worker ended with exit code {process.returncode}")
    return process.returncode


def _failed(what: str) -> StudyError:
    return StudyError(what, expected="the same command again, once this is mended: the study goes on")


def engine_of(name: str, folder: Path, count: int, follow: bool, options: dict[str, Any]) -> WorkerEngine:
    """Start workers by the name of an engine."""
    if name == "dask":
        return DaskEngine(folder, count, follow, scheduler=str(options.get("scheduler", "")))
    if name == "slurm":
        return SlurmEngine(
            folder, count, follow, options={key: value for key, value in options.items() if key != "scheduler"}
        )
    return LocalEngine(folder, count, follow)
