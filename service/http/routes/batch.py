"""POST /v1/associate:batch: several scans, one map."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from fastapi import APIRouter, Response

from linefix.documents import examples
from linefix.documents.encoding import encode
from linefix.documents.reading import read_batch
from linefix.documents.requests import BatchItem, BatchRequest

from ...errors import ShareHeldError, TooMuchHeldError
from ...work.job import Done, Job
from ...work.results import BatchResult, batch_done
from ..answers import BatchAnswer
from ..bodies import read
from ..exchange import Exchange, Searching
from ..map_stage import index_map, looking_up_maps
from ..openapi import searches
from ..problems import problem_or_defect
from ..search_stage import in_search_slot, in_search_slots
from ..sending import answer

router = APIRouter(tags=["associate"])


@router.post(
    "/v1/associate:batch",
    response_model=BatchAnswer,
    summary="Find several scans in one map",
    **searches(BatchRequest, {"two scans": examples.BATCH}, "unknown_map", "map_corrupt"),
)
async def associate_batch(exchange: Searching) -> Response:
    """Estimate the poses of several scans in one map, or on several; an invalid scan yields one problem item."""
    asked, items = await read(exchange, read_batch)
    job = exchange.job(asked.options.deadline_ms)
    return await answer(exchange, _work(exchange, asked, items, job), job.deadline)


async def _work(exchange: Exchange, asked: BatchRequest, items: Sequence[BatchItem | Exception], job: Job) -> Done:
    """Index the map in one slot, and search for each scan in another."""
    associator, oriented = exchange.services.associator, asked.options.oriented
    async with looking_up_maps(exchange, asked, job.deadline) as source:
        ready = await index_map(exchange, source, job.deadline, oriented=oriented)
        index = partial(associator.target, asked, source, job.deadline, ready)
        target = await in_search_slot(exchange, index, job.deadline)
    job.watch.lap("decode")
    with exchange.services.answers.account(exchange.ticket.holder) as account:

        def find(number: int, item: BatchItem | Exception) -> BatchResult:
            found = associator.find_for_batch(target, number, item, asked.options, job.deadline)
            account.take(len(found.body))  # beyond the limit, the remaining scans are not searched
            return found

        def failed(number: int, error: Exception) -> BatchResult:
            if isinstance(error, ShareHeldError | TooMuchHeldError):
                raise error
            return _refused(number, error, job.request_id)

        calls = [partial(find, number, item) for number, item in enumerate(items)]
        results = await in_search_slots(exchange, calls, job.deadline, failed)
        job.watch.lap("search")
        return await exchange.services.parse_threads.run(partial(batch_done, asked, target, results, job))


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
