"""POST /v1/associate, /v1/associate:batch, /v1/register and /v1/vectorize: scans."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter

from linefix.documents import examples
from linefix.documents.encoding import encode, encode_list
from linefix.documents.found import AssociateAnswer
from linefix.documents.reading import read_batch
from linefix.documents.replies import RegisterAnswer, VectorizeAnswer
from linefix.documents.requests import AssociateRequest, BatchItem, BatchRequest, RegisterRequest, VectorizeRequest
from linefix.operations import registered, vectorized

from ...errors import ShareHeldError, TooMuchHeldError
from ...work.results import BatchResult, batch_done
from ..answers import BatchAnswer
from ..exchange import Exchange
from ..problems import problem_or_defect
from ..searching import searching
from ..stages import in_search_slot, in_search_slots, look_up_maps

router = APIRouter()
_EXAMPLES = {
    "a room": examples.ASSOCIATE,
    "a stored map": examples.ASSOCIATE_STORED,
    "several maps": examples.ASSOCIATE_SEVERAL,
}
_STORED = ("unknown_map", "map_corrupt")


@searching(router, "/v1/associate", AssociateRequest, AssociateAnswer, _EXAMPLES, *_STORED)
async def associate(exchange: Exchange, asked: AssociateRequest) -> bytes:
    """Find the pose without knowing correspondences.

    Estimate the pose of a scan in a map, or on one of several, with a verdict and its probability.
    """
    exchange.limit(asked.options.deadline_ms)
    target = await look_up_maps(exchange, asked)
    return await in_search_slot(exchange, partial(exchange.services.associator.answer, asked, target, exchange))


@searching(
    router, "/v1/associate:batch", BatchRequest, BatchAnswer, {"two scans": examples.BATCH}, *_STORED, reader=read_batch
)
async def associate_batch(exchange: Exchange, read: tuple[BatchRequest, list[BatchItem | Exception]]) -> bytes:
    """Find several scans in one map.

    Estimate the poses of several scans in one map, or on several; an invalid scan yields one problem item.
    """
    asked, items = read
    exchange.limit(asked.options.deadline_ms)
    services, deadline = exchange.services, exchange.deadline
    target = await look_up_maps(exchange, asked)
    exchange.watch.lap("decode")
    with services.answers.account(exchange.ticket.holder) as account:

        def find(number: int, item: BatchItem | Exception) -> BatchResult:
            found = services.associator.find_for_batch(target, number, item, asked.options, deadline)
            account.take(len(found.body))  # beyond the limit, the remaining scans are not searched
            return found

        def failed(number: int, error: Exception) -> BatchResult:
            if isinstance(error, ShareHeldError | TooMuchHeldError):
                raise error
            return _refused(number, error, exchange.request_id)

        calls = [partial(find, number, item) for number, item in enumerate(items)]
        results = await in_search_slots(exchange, calls, failed)
        exchange.watch.lap("search")
        return await services.parse_threads.run(partial(batch_done, asked, target, results, exchange))


def _refused(index: int, error: Exception, request_id: str) -> BatchResult:
    """Return the item of a scan that has no answer."""
    problem = problem_or_defect(error, request_id)
    moved = problem.as_json(request_id, partial(_in_batch, index))
    status = problem.kind.status
    return BatchResult(str(status), encode({"index": index, "status_code": status, "problem": moved}))


def _in_batch(index: int, pointer: str) -> str:
    """Turn a place in one scan or prior into its place in the batch."""
    for one, many in (("/scan", f"/scans/{index}"), ("/prior", f"/priors/{index}")):
        if pointer == one or pointer.startswith(one + "/"):
            return many + pointer.removeprefix(one)
    return pointer


@searching(router, "/v1/register", RegisterRequest, RegisterAnswer, {"a corner": examples.REGISTER})
async def register(exchange: Exchange, asked: RegisterRequest) -> bytes:
    """Find the pose from known correspondences.

    Lay scan segments on the map segments that they are known to belong to.
    """
    return await in_search_slot(exchange, lambda: exchange.encoded(registered(asked, exchange.watch, encode_list)))


@searching(router, "/v1/vectorize", VectorizeRequest, VectorizeAnswer, {"a corner": examples.VECTORIZE})
async def vectorize(exchange: Exchange, asked: VectorizeRequest) -> bytes:
    """Find the segments in ranges or points.

    Cut a scan into directed segments, as /v1/associate does with a scan that comes as ranges or points.
    """
    return await in_search_slot(exchange, lambda: exchange.encoded(vectorized(asked, exchange.watch)))
