"""What the routes work with: the parts of one application, made by `create_app`."""

from __future__ import annotations

from asyncio import Semaphore
from dataclasses import dataclass

from starlette.types import Scope

from ..admission.budget import ByteBudget
from ..admission.connections import ConnectionLimit
from ..admission.entrance import Entrance
from ..admission.gate import SearchGate
from ..admission.keys import Keyring
from ..admission.readiness import Readiness
from ..maps import MapStore
from ..maps.lookup import MapLookup
from ..parsing.parser_process import ParserProcess
from ..settings import Settings
from ..telemetry.metrics import Metrics
from ..telemetry.refusals import RefusalTally
from ..telemetry.traces import Traces
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
    keyring : Keyring
    connections : ConnectionLimit
    bodies : BodyReceiver
    answers : ByteBudget
        Bytes of large answers that are being read.
    parser : ParserProcess
        For large bodies.
    store : MapStore
    probe : StoreProbe
    lookup : MapLookup
    documents : ByteBudget
        Bytes of stored maps that wait to be indexed.
    associator : Associator
    imports : Semaphore
        Of which one is free as long as no map of another tool is read.
    parse_threads, store_threads, key_threads : Threads
    traces : Traces, or None
        Where they are asked for.
    """

    settings: Settings
    metrics: Metrics
    refusals: RefusalTally
    readiness: Readiness
    entrance: Entrance
    gate: SearchGate
    keyring: Keyring
    connections: ConnectionLimit
    bodies: BodyReceiver
    answers: ByteBudget
    parser: ParserProcess
    store: MapStore
    probe: StoreProbe
    lookup: MapLookup
    documents: ByteBudget
    associator: Associator
    imports: Semaphore
    parse_threads: Threads
    store_threads: Threads
    key_threads: Threads
    traces: Traces | None = None

    def close(self) -> None:
        """Give up what still runs and give everything back."""
        self.refusals.report()
        self.gate.cancel_all()
        self.gate.close()
        self.parser.close()
        for threads in (self.parse_threads, self.store_threads, self.key_threads, self.probe):
            threads.close()
        self.store.close()
        if self.traces is not None:
            self.traces.close()


def services_of(scope: Scope) -> Services:
    """Return the parts of the application that a request came to."""
    services = scope["state"][KEY]
    assert isinstance(services, Services)
    return services
