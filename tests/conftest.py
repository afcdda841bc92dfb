"""The running service that the HTTP tests talk to, and an end of the tests whatever they leave behind."""

from __future__ import annotations

import faulthandler
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
from hypothesis import HealthCheck, settings

from tests.issuing import ADMIN, KEYS, OPEN, PAGE, key_lines
from tests.running import RunningService, running

TESTS = Path(__file__).parent
EXIT_SECONDS = 30.0
# Whose files take long.
SLOW_DIRECTORIES = ("faults", "service", "ros2", "map_quality", "cli", "experiments", "benchmarks")

# The same examples in each run: what fails does so again, and no run fails by what it alone has drawn. Whoever looks
# for other examples says `--hypothesis-profile=other`.
EXAMPLES = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow], "database": None}
settings.register_profile("same", derandomize=True, **EXAMPLES)
settings.register_profile("other", derandomize=False, print_blob=True, **EXAMPLES)
settings.load_profile("same")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--soak-minutes", type=float, default=30.0, help="how long the mixed load of tests/faults lasts")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what takes long: of two processes neither waits for the other's last file."""
    places = {directory: number for number, directory in enumerate(SLOW_DIRECTORIES)}
    items.sort(key=lambda item: places.get(item.path.relative_to(TESTS).parts[0], len(SLOW_DIRECTORIES)))


def pytest_unconfigure(config: pytest.Config) -> None:
    """Python waits for threads that do not end, as one that a failed test left waiting: not for ever here.

    Of several processes the first ends the others; one that is through early waits for the rest.
    """
    if not hasattr(config, "workerinput"):
        faulthandler.dump_traceback_later(EXIT_SECONDS, exit=True)


@pytest.fixture(scope="session")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """One service for all tests that leave it as it was; it goes on for as long as a slow machine needs."""
    with running(tmp_path_factory.mktemp("service"), max_deadline_ms=600_000) as started:
        yield started
        assert "a defect" not in started.log()


@pytest.fixture(scope="session")
def patient(service: RunningService) -> RunningService:
    return service


@pytest.fixture(scope="session")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """One that requests a key: ``ADMIN``, or one of `KEYS`; a page of `PAGE` may ask."""
    folder = tmp_path_factory.mktemp("guarded")
    (folder / "keys").mkdir()
    lines = "".join(key_lines(key, roles, maps) for key, (roles, maps) in KEYS.items())
    (folder / "keys" / "robots.toml").write_text(lines)
    with running(folder, keys=f"{ADMIN},{OPEN}", keys_file=folder / "keys", cors_origins=PAGE) as started:
        yield started
        log, counts = started.log(), started.client.get("/metrics").text
        assert "a defect" not in log
        assert [key for key in (ADMIN, OPEN, *KEYS) if key in log or key in counts] == []


@pytest.fixture(scope="session")
def narrow(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """One that takes and gives small bodies only, by names of its own, and that lets a page of `PAGE` ask."""
    settings = {"max_body_bytes": 200_000, "max_answers_bytes": 200_000, "searches": 1}
    hosts = "linefix,robots.example"
    with running(tmp_path_factory.mktemp("narrow"), hosts=hosts, cors_origins=PAGE, **settings) as started:
        yield started


@pytest.fixture
def client(service: RunningService) -> httpx.Client:
    return service.client


@pytest.fixture
def start_service(tmp_path: Path) -> Iterator[Callable[..., RunningService]]:
    """Start services with settings of their own; they end with the test."""
    with ExitStack() as started:

        def start_one(data_dir: Path = tmp_path, **settings: object) -> RunningService:
            return started.enter_context(running(data_dir, **settings))

        yield start_one
