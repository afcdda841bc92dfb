"""The services that the routes use: the parts of one application."""

from __future__ import annotations

from .admission.budget import ByteBudget
from .admission.entrance import Entrance
from .admission.gate import Gate
from .admission.keys import Keyring
from .importing.reader import Bounds
from .maps import IndexCache, MapStore
from .maps.lookup import MapLookup
from .parsing.child import Child
from .readiness import Readiness
from .settings import Settings
from .telemetry.metrics import Metrics
from .thread_pool import Threads
from .work.results import Associator

LEAST_IMPORT_BYTES = 400_000_000  # as of the setting; with less the libraries that read files are not loaded
INDEXING_NICE = 5  # searches go before it, at three times as much of a core that both want


class Services:
    """The parts of one application; of several workers each has its share. All belong to one event loop.

    Attributes
    ----------
    gate : Gate
        Slots of searches.
    parsing, indexing, operations, importing : Gate
        Slots to parse large bodies, in another process; to index large maps; to check, analyze and update maps, which
        may take half a minute; to read maps of other tools.
    bodies, answers, documents : ByteBudget
        Bytes of bodies that are being received or parsed, of large answers that are being read, and of stored maps that
        wait to be indexed.
    parser : Child
        For large bodies.
    import_bounds : Bounds
        That reading a map of another tool is held to.
    """

    def __init__(self, settings: Settings) -> None:
        searches = settings.share(settings.searches)
        self.settings = settings
        self.limits = settings.limits()
        self.metrics = Metrics()
        self.gate = Gate(searches, searches + settings.share(settings.queue))
        # The number that waits there is bounded by their bytes.
        self.parsing = Gate(1, None, "parsing", long_per_slot=0)
        self.indexing = Gate(searches, None, "indexing", INDEXING_NICE, 0, waits=False)
        self.operations = Gate(searches, None, "operation")
        # A second one when the first takes long, and not for the same key: each takes memory.
        self.importing = Gate(1, None, "importing", long_per_slot=1)
        self.import_bounds = Bounds(
            max(LEAST_IMPORT_BYTES, settings.share(settings.max_import_bytes)),
            settings.max_body_bytes,
            settings.max_map_segments,
        )
        self.keyring = Keyring(settings.keys, settings.keys_file)
        self.entrance = Entrance(
            self.gate, self.keyring, settings.max_body_bytes, settings.hosts, settings.cors_origins
        )
        self.bodies = self._budget(settings.max_bodies_bytes)
        self.answers = self._budget(settings.max_answers_bytes)
        self.documents = self._budget(settings.max_answers_bytes)
        self.parser = Child()
        self.store = MapStore(settings.url, may_make=settings.workers == 1, most_bytes=settings.max_stored_bytes)
        self.readiness = Readiness(self.store)
        cache = IndexCache(settings.share(settings.cache_bytes), self.metrics)
        self.lookup = MapLookup(cache, self.store, self.parser)
        self.associator = Associator(self.metrics)
        self.parse_threads, self.store_threads, self.key_threads = (
            Threads(count, name) for count, name in ((2, "parse"), (4, "store"), (1, "keys"))
        )
        watch = self.metrics.watch
        ready = self.readiness
        watch("linefix_workers_ready", "Processes that take requests", lambda: ready.warm and not ready.draining)
        watch("linefix_searches_running", "Searches that run", lambda: self.gate.running)
        watch("linefix_searches_waiting", "Searches that wait", lambda: self.gate.waiting)
        watch("linefix_indexing_running", "Large maps that are indexed", lambda: self.indexing.running)
        watch("linefix_operations_running", "Maps checked, analyzed or updated", lambda: self.operations.running)
        watch("linefix_bodies_bytes", "Bytes of requests held", lambda: self.bodies.held)
        watch("linefix_map_cache_bytes", "Bytes of indexed maps held", lambda: cache.bytes)
        watch("linefix_map_cache_maps", "Indexed maps held", lambda: len(cache))

    def _budget(self, most: int) -> ByteBudget:
        """Return what this worker may hold; the largest body always fits."""
        least = self.settings.max_body_bytes
        return ByteBudget(max(least, self.settings.share(most)), least_share=least)

    @property
    def _gates(self) -> tuple[Gate, ...]:
        return self.gate, self.parsing, self.indexing, self.operations, self.importing

    def give_up(self) -> None:
        """Cancel everything that runs, and wait no longer for functions that do not check for it."""
        for gate in self._gates:
            gate.cancel_all()

    def close(self) -> None:
        """Give up what still runs and give everything back."""
        self.give_up()
        for gate in self._gates:
            gate.close()
        self.parser.close()
        for threads in (self.parse_threads, self.store_threads, self.key_threads, self.readiness):
            threads.close()
        self.store.close()
