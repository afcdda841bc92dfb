"""What the routes work with: the parts of one application, made by `create_app`."""

from __future__ import annotations

from dataclasses import dataclass

from starlette.types import Scope

from ..admission.entrance import Entrance
from ..admission.gate import SearchGate
from ..admission.readiness import Readiness
from ..maps import MapStore
from ..parsing.parser_process import ParserProcess
from ..settings import Settings
from ..telemetry.metrics import Metrics
from ..telemetry.refusals import RefusalTally
from ..threads import Threads
from ..work.association import Associator
from .bodies import BodyReceiver
from .probe import StoreProbe

KEY = "services"
"""Where they are in the state that the application gives to each request."""


@dataclass(frozen=True, slots=True)
class Services:
    """The parts of one application; all belong to one event loop.

    Attributes
    ----------
    settings : Settings
    metrics : Metrics
    refusals : RefusalTally
    readiness : Readiness
    entrance : Entrance
    gate : SearchGate
    bodies : BodyReceiver
    parser : ParserProcess
        For large bodies.
    store : MapStore
    probe : StoreProbe
    associator : Associator
    parse_threads, store_threads : Threads
    """

    settings: Settings
    metrics: Metrics
    refusals: RefusalTally
    readiness: Readiness
    entrance: Entrance
    gate: SearchGate
    bodies: BodyReceiver
    parser: ParserProcess
    store: MapStore
    probe: StoreProbe
    associator: Associator
    parse_threads: Threads
    store_threads: Threads

    def close(self) -> None:
        """Give up what still runs and give everything back."""
        self.refusals.report()
        self.gate.cancel_all()
        self.gate.close()
        self.parser.close()
        for threads in (self.parse_threads, self.store_threads, self.probe):
            threads.close()
        self.store.close()


def services_of(scope: Scope) -> Services:
    """Return the parts of the application that a request came to."""
    services = scope["state"][KEY]
    assert isinstance(services, Services)
    return services
