"""POST /v1/associate:batch: several scans, one map."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence
from functools import partial

from fastapi import APIRouter, Request, Response

from association import CancelledError
from linefix.documents import examples
from linefix.documents.encoding import encode
from linefix.documents.reading import read_batch
from linefix.documents.replies import BatchAnswer
from linefix.documents.requests import BatchItem, BatchRequest

from ...admission.budget import ByteAccount
from ...work.association import BatchResult, batch_done
from ...work.job import Done, Job
from ..body_stage import read
from ..exchange import Exchange, begin_search
from ..map_stage import index_map, looking_up_maps
from ..problems import INTERNAL, problem_of
from ..search_stage import in_search_slot
from ..sending import answer
from .declaring import EVERYWHERE, READS_BODY, SEARCHES, DirectRoute, problems, takes

logger = logging.getLogger("linefix")
router = APIRouter(tags=["associate"], route_class=DirectRoute)


@router.post(
    "/v1/associate:batch",
    operation_id="associate_batch",
    response_model=BatchAnswer,
    responses=problems(*EVERYWHERE, *READS_BODY, *SEARCHES, "unknown_map", "map_corrupt"),
    openapi_extra=takes(BatchRequest, {"two scans": examples.BATCH}),
    summary="Find several scans in one map",
)
async def post_batch(request: Request) -> Response:
    """Estimate the poses of several scans in one map, or on several; an invalid scan yields one problem item."""
    exchange = begin_search(request)
    asked, items = await read(exchange, read_batch)
    job = exchange.job(asked.options.deadline_ms)
    return await answer(exchange, _work(exchange, asked, items, job), job.deadline)


async def _work(exchange: Exchange, asked: BatchRequest, items: Sequence[BatchItem | Exception], job: Job) -> Done:
    """Index the map in one slot, and search for each scan in another."""
    associator, oriented = exchange.services.associator, asked.options.oriented
    async with looking_up_maps(exchange, asked, job.deadline) as source:
        ready = await index_map(exchange, source, job.deadline, oriented=oriented)
        index = partial(associator.target, asked, source, job.deadline, ready)
        target = await in_search_slot(exchange, index, job.deadline, heeds=lambda: False)
    job.watch.lap("decode")
    calls = [
        partial(associator.find_for_batch, target, index, item, asked.options, job.deadline)
        for index, item in enumerate(items)
    ]
    with exchange.services.answers.account(exchange.ticket.holder) as account:
        results = await _answer_all(exchange, calls, job, account)
        job.watch.lap("search")
        return await exchange.services.parse_threads.run(partial(batch_done, asked, target, results, job))


async def _answer_all(
    exchange: Exchange, calls: Sequence[Callable[[], BatchResult]], job: Job, account: ByteAccount
) -> list[BatchResult]:
    """Search for every scan, as many at once as there are cores; other requests get slots in between.

    Answers count as held bytes. Beyond their limit, the remaining scans are not searched.
    """
    results: dict[int, BatchResult] = {}
    todo = iter(enumerate(calls))

    async def work_through() -> None:
        for index, call in todo:
            try:
                found = await in_search_slot(exchange, call, job.deadline)
            except CancelledError:
                raise
            except Exception as error:
                found = _refused(index, error, job.request_id)
            account.take(len(found.body))
            results[index] = found

    tasks = [asyncio.ensure_future(work_through()) for _ in range(min(exchange.services.gate.slots, len(calls)))]
    try:
        await asyncio.gather(*tasks)
    except BaseException:
        job.deadline.cancel()
        for task in tasks:
            task.cancel()
        raise
    return [results[index] for index in range(len(calls))]


def _refused(index: int, error: Exception, request_id: str) -> BatchResult:
    """Return the item of a scan that has no answer."""
    problem = problem_of(error)
    if problem is None:
        logger.error("a defect", exc_info=error, extra={"request_id": request_id})
        problem = INTERNAL
    moved = problem.as_json(request_id, partial(_in_batch, index))
    status = problem.kind.status
    return BatchResult(str(status), encode({"index": index, "status_code": status, "problem": moved}))


def _in_batch(index: int, pointer: str) -> str:
    """Turn a place in one scan or prior into its place in the batch."""
    for one, many in (("/scan", f"/scans/{index}"), ("/prior", f"/priors/{index}")):
        if pointer == one or pointer.startswith(one + "/"):
            return many + pointer.removeprefix(one)
    return pointer
