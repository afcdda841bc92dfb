"""Runs tests on the copy of the code, each time in a process forked from this one, which has loaded what is heavy.

A run of hours has to stand back for other work, and then a test can fail because its time was up while it waited for a
processor. So the time that was waited is not counted, and where it was long a test that fails has to pass without the
mistake.
"""

from __future__ import annotations

import hashlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
import traceback
from collections import defaultdict
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import hypothesis
import numba
import pytest

from .drawing import Mutant, mutated
from .rules import Suite

RESULTS = "benchmarks/mutants/results.jsonl"
"""What is known of mutants, from the project's root; kept with the code, since it takes hours to find out."""
WALL_FACTOR = 4.0  # of the processor time allowed, beside the time that processes waited for a processor
LOOK_SECONDS = 1.0
LEAST_SECONDS, TIMES = 60.0, 1.5  # of processor time: so much more than what tests took before, times this
# Likewise, each by itself, so that a loop without end is found soon; the first may have to compile what was changed.
LEAST_SECONDS_OF_A_TEST, TIMES_OF_A_TEST = 60.0, 5.0
BASELINE_SECONDS = 3600.0
SKIPPED = "long"
HEAVY = (
    "alembic.command",
    "fastapi",
    "httpx",
    "jwt",
    "orjson",
    "prometheus_client",
    "psycopg",
    "pydantic_settings",
    "scipy.special",
    "scipy.stats",
    "sqlalchemy.dialects.postgresql",
    "sqlalchemy.dialects.sqlite",
    "typer",
    "granian",
)
"""Loaded before the fork, since most tests need one or the other."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a mutant.

    Attributes
    ----------
    killed : bool
    by : str
        The test that noticed it, "time" where the tests did not end; empty for one that survived.
    seconds : float
        Of processor time, without that of services that it started.
    """

    killed: bool
    by: str
    seconds: float


@dataclass(frozen=True, slots=True)
class Ran:
    """What a run of tests came to.

    Attributes
    ----------
    failed : tuple of str
        Names of tests.
    seconds : dict
        Of processor time, by test.
    waited : float
        Seconds that its processes waited for a processor, together.
    """

    failed: tuple[str, ...]
    seconds: dict[str, float]
    waited: float = 0.0

    @property
    def total(self) -> float:
        """Processor time of all tests, seconds."""
        return sum(self.seconds.values())

    def by_file(self) -> dict[str, float]:
        """Return the processor time of each file's tests, seconds."""
        out: dict[str, float] = defaultdict(float)
        for name, seconds in self.seconds.items():
            out[_file(name)] += seconds
        return out


NOTHING = Ran((), {})


class Watcher:
    """Pytest's plugin: notes what failed and what each test took.

    The module's own tests come first, which notice most, then the quick files.
    """

    def __init__(self, report: Path, baseline: Ran, module: str) -> None:
        self._report = report
        self._baseline = baseline
        self._own = f"/test_{module}.py"
        self.failed: list[str] = []
        self.seconds: dict[str, float] = defaultdict(float)

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Leave out what fails without any mistake; pytest keeps what is equal in order."""
        items[:] = [item for item in items if item.nodeid not in self._baseline.failed]
        took, files = self._baseline.by_file(), {item: _file(item.nodeid) for item in items}
        items.sort(key=lambda item: (not files[item].endswith(self._own), took.get(files[item], 0.0)))

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Any:
        """Count the processor time of a test, and of the processes that it waited for; end this one at its limit."""
        usual, before = self._baseline.seconds.get(item.nodeid), sum(os.times()[:4])
        if usual is not None:
            signal.setitimer(signal.ITIMER_PROF, LEAST_SECONDS_OF_A_TEST + TIMES_OF_A_TEST * usual)
        yield
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        self.seconds[item.nodeid] += sum(os.times()[:4]) - before

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note what failed."""
        if report.failed:
            self.failed.append(report.nodeid)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Note what could not even be loaded."""
        if report.failed:
            self.failed.append(report.nodeid or "loading")

    def pytest_sessionfinish(self) -> None:
        """Tell the process that waits."""
        self._report.write_text(json.dumps({"failed": self.failed, "seconds": self.seconds}))


class Runner:
    """Runs tests in a copy of the code.

    Parameters
    ----------
    root : Path
        The project.
    place : Path
        Where the copy and what is kept for the next time go.
    """

    def __init__(self, root: Path, place: Path) -> None:
        self.tree = place / "tree"
        self._report = place / "report.json"
        self._log = place / "log"
        self._known: dict[Suite, Ran] = {}
        self._baselines = place / "baselines.json"
        self._bytecode = (place / "bytecode").absolute()
        shutil.rmtree(self.tree, ignore_errors=True)
        self.tree.mkdir(parents=True)
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=root, capture_output=True, check=True).stdout
        names = (name for name in listed.decode().split("\0") if name not in ("", RESULTS))
        self._files = [name for name in names if (root / name).exists()]
        for name in self._files:
            (self.tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, self.tree / name)
        for name in HEAVY:
            import_module(name)
        # Not LINEFIX_KERNELS, which tests take from the services that they start.
        os.environ.setdefault("LINEFIX_KERNELS", str(place.absolute() / "kernels"))

    def baseline(self, suite: Suite) -> Ran:
        """Return what the tests take without any mistake, and what fails all the same; kept until a file changes."""
        if suite not in self._known:
            self._known[suite] = self._kept(suite) or self._measured(suite)
        return self._known[suite]

    def _measured(self, suite: Suite) -> Ran:
        found = self._run(suite, NOTHING, BASELINE_SECONDS, stop=False)
        if found is not None and found.total > LEAST_SECONDS:  # the first time kernels may have been compiled
            found = self._run(suite, NOTHING, BASELINE_SECONDS, stop=False)
        if found is None:
            raise RuntimeError(f"the tests do not end, see {self._log}: {suite.tests}")
        for name in found.failed:
            print(f"left out, fails without any mistake: {name}", file=sys.stderr)
        with self._baselines.open("a") as file:
            file.write(
                json.dumps({"key": self._digest(suite), "failed": found.failed, "seconds": found.seconds}) + "\n"
            )
        return found

    def _kept(self, suite: Suite) -> Ran | None:
        if self._baselines.exists():
            for line in self._baselines.read_text().splitlines():
                entry = json.loads(line)
                if entry["key"] == self._digest(suite):
                    return Ran(tuple(entry["failed"]), entry["seconds"])
        return None

    def _digest(self, suite: Suite) -> str:
        """Return a digest of a suite and of all files but the tests outside of it."""
        digest = hashlib.sha256(repr(suite).encode())
        for name in self._files:
            if not Path(name).name.startswith("test_") or name.startswith(suite.tests):
                digest.update(name.encode() + (self.tree / name).read_bytes())
        return digest.hexdigest()[:20]

    def outcome(self, mutant: Mutant, suite: Suite) -> Outcome | None:
        """Return whether the tests notice a mistake; None where the machine was too busy to tell."""
        baseline = self.baseline(suite)
        path = self.tree / mutant.path
        whole = path.with_name(path.name + ".whole")
        shutil.copy2(path, whole)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        try:
            path.write_text(mutated(self.tree, mutant))
            allowed = LEAST_SECONDS + TIMES * baseline.total
            found = self._run(suite, baseline, allowed, stop=True, module=path.stem)
        finally:
            whole.replace(path)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        took = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        if found is None:
            return Outcome(True, "time", took)
        name = next(iter(found.failed), "")
        if "::" in name and found.waited > took:
            alone = self._run(Suite((name,), suite.compiled), NOTHING, BASELINE_SECONDS, stop=True)
            if alone is None or alone.failed:
                return None
        return Outcome(bool(name), name, took)

    def _run(self, suite: Suite, baseline: Ran, seconds: float, *, stop: bool, module: str = "") -> Ran | None:
        """Return what a run of pytest reports, None where it does not end in time; the tests of a module first."""
        self._report.unlink(missing_ok=True)
        sys.stdout.flush()
        pid = os.fork()
        if pid == 0:
            self._test(suite, Watcher(self._report, baseline, module), seconds, stop=stop)
        begin = looked = time.monotonic()
        waits: dict[Path, float] = {}
        while os.waitpid(pid, os.WNOHANG) == (0, 0):
            now = time.monotonic()
            if now - looked > LOOK_SECONDS:
                looked = now
                waits |= _waits(pid)
                if now - begin - sum(waits.values()) > WALL_FACTOR * seconds:
                    os.killpg(pid, signal.SIGKILL)
                    os.waitpid(pid, 0)
                    break
            time.sleep(0.05)
        with suppress(ProcessLookupError):
            os.killpg(pid, signal.SIGKILL)  # services that it left behind
        if not self._report.exists():
            return None
        told = json.loads(self._report.read_text())
        return Ran(tuple(told["failed"]), told["seconds"], sum(waits.values()))

    def _test(self, suite: Suite, watcher: Watcher, seconds: float, *, stop: bool) -> None:
        """Be the process that runs tests; does not return."""
        try:
            os.setpgid(0, 0)
            os.chdir(self.tree)
            sys.path[:] = [str(self.tree), *(path for path in sys.path if path not in ("", str(self.tree.parent)))]
            for name in [name for name in sys.modules if name.split(".")[0] in ("benchmarks", "registration")]:
                del sys.modules[name]  # those of the project itself
            # Written without a mistake only; what is copied keeps its time, so a mistake's file is never taken for it.
            sys.dont_write_bytecode, sys.pycache_prefix = stop, str(self._bytecode)
            os.environ |= {"PYTHONDONTWRITEBYTECODE": "1" if stop else "", "PYTHONPYCACHEPREFIX": sys.pycache_prefix}
            os.environ["NUMBA_DISABLE_JIT"] = "0" if suite.compiled else "1"
            numba.core.config.reload_config()  # type: ignore[no-untyped-call]
            resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 5))
            with self._log.open("w") as log:
                os.dup2(log.fileno(), 1)
                os.dup2(log.fileno(), 2)
            generate = [phase for phase in hypothesis.Phase if phase not in (hypothesis.Phase.shrink,)]
            hypothesis.settings.register_profile("mutants", phases=generate, database=None, derandomize=True)
            usual = [
                "-q",
                "-W",
                "ignore::pytest.PytestAssertRewriteWarning",
                "-p",
                "no:cacheprovider",
                "-p",
                "no:faulthandler",
                "-m",
                f"not {SKIPPED}",
                "--tb=line",
                "--hypothesis-profile=mutants",
            ]
            pytest.main([*usual, *(["-x"] if stop else []), *suite.tests], plugins=[watcher])
        except BaseException:
            traceback.print_exc()
        finally:
            sys.stderr.flush()
            os._exit(0)


def _file(nodeid: str) -> str:
    return nodeid.split("::", 1)[0]


def _waits(group: int) -> dict[Path, float]:
    """Return how long each thread of a process group has waited for a processor so far, seconds."""
    waits: dict[Path, float] = {}
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has ended meanwhile
            if os.getpgid(int(process.name)) == group:
                for thread in (process / "task").iterdir():
                    waits[thread] = int((thread / "schedstat").read_text().split()[1]) / 1e9
    return waits
