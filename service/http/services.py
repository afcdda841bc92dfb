"""The services that the routes use: the parts of one application, made by `create_app`."""

from __future__ import annotations

from dataclasses import dataclass

from ..admission.budget import ByteBudget
from ..admission.entrance import Entrance
from ..admission.gate import Gate
from ..admission.keys import Keyring
from ..admission.readiness import Readiness
from ..importing.reader import Bounds
from ..maps import MapStore
from ..maps.lookup import MapLookup
from ..parsing.child import Child
from ..settings import Settings
from ..telemetry.metrics import Metrics, RefusalTally
from ..telemetry.traces import Traces
from ..thread_pool import Threads
from ..work.association import Associator
from .bodies import BodyReceiver
from .probe import StoreProbe


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
    gate : Gate
    parsing, indexing : Gate
        Slots to parse large bodies, in another process, and to index large maps.
    keyring : Keyring
    bodies : BodyReceiver
    answers : ByteBudget
        Bytes of large answers that are being read.
    parser : Child
        For large bodies.
    store : MapStore
    probe : StoreProbe
    lookup : MapLookup
    documents : ByteBudget
        Bytes of stored maps that wait to be indexed.
    associator : Associator
    importing : Gate
        Slot in which maps of other tools are read, one at a time: each may take much memory.
    import_bounds : Bounds
        That reading one is held to.
    parse_threads, store_threads, key_threads : Threads
    traces : Traces, or None
        None where no traces are requested.
    """

    settings: Settings
    metrics: Metrics
    refusals: RefusalTally
    readiness: Readiness
    entrance: Entrance
    gate: Gate
    parsing: Gate
    indexing: Gate
    keyring: Keyring
    bodies: BodyReceiver
    answers: ByteBudget
    parser: Child
    store: MapStore
    probe: StoreProbe
    lookup: MapLookup
    documents: ByteBudget
    associator: Associator
    importing: Gate
    import_bounds: Bounds
    parse_threads: Threads
    store_threads: Threads
    key_threads: Threads
    traces: Traces | None = None

    @property
    def _gates(self) -> tuple[Gate, ...]:
        return self.gate, self.parsing, self.indexing, self.importing

    def give_up(self) -> None:
        """Cancel everything that runs, and wait no longer for functions that do not check for it."""
        for gate in self._gates:
            gate.cancel_all()

    def close(self) -> None:
        """Give up what still runs and give everything back."""
        self.refusals.report()
        self.give_up()
        for gate in self._gates:
            gate.close()
        self.parser.close()
        for threads in (self.parse_threads, self.store_threads, self.key_threads, self.probe):
            threads.close()
        self.store.close()
        if self.traces is not None:
            self.traces.close()
