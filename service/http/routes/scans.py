"""POST /v1/associate, /v1/associate:batch, /v1/register and /v1/vectorize: scans."""

from __future__ import annotations

import asyncio
import re
from functools import partial

from fastapi import APIRouter, Response

from association import CancelledError
from linefix.documents import examples
from linefix.documents.encoding import encode, encode_list
from linefix.documents.found import AssociateAnswer
from linefix.documents.reading import read_batch
from linefix.documents.replies import RegisterAnswer, VectorizeAnswer
from linefix.documents.requests import AssociateRequest, BatchItem, BatchRequest, RegisterRequest, VectorizeRequest
from linefix.operations import registered, vectorized

from ...work.results import BatchResult, batch_done
from ..answers import BatchAnswer
from ..bodies import read, read_by
from ..exchange import Admitted
from ..openapi import PROBLEM, takes
from ..problems import problem_or_defect
from ..stages import look_up_maps

router = APIRouter(tags=["scans"], responses=PROBLEM)
_SEVERAL = {"a stored map": examples.ASSOCIATE_STORED, "several maps": examples.ASSOCIATE_SEVERAL}
_EXAMPLES = {"a room": examples.ASSOCIATE, **_SEVERAL}
_OF_ONE = re.compile(r"^/(scan|prior)(?=/|$)")  # a place in one scan of a batch, or its prior


@router.post("/v1/associate", **takes(AssociateRequest, AssociateAnswer, _EXAMPLES))
async def associate(exchange: Admitted) -> Response:
    """Find the pose without knowing correspondences.

    Estimate the pose of a scan in a map, or on one of several, with a verdict and its probability.
    """
    asked = await read(exchange, AssociateRequest)
    exchange.limit(asked.options.deadline_ms)
    target = await look_up_maps(exchange, asked)
    return await exchange.answer(partial(exchange.services.associator.answer, asked, target, exchange))


@router.post("/v1/associate:batch", **takes(BatchRequest, BatchAnswer, {"two scans": examples.BATCH}))
async def associate_batch(exchange: Admitted) -> Response:
    """Find several scans in one map.

    Estimate the poses of several scans in one map, or on several; an invalid scan yields one problem item.
    """
    asked, items = await read_by(exchange, read_batch)
    exchange.limit(asked.options.deadline_ms)
    services, deadline = exchange.services, exchange.deadline
    target = await look_up_maps(exchange, asked)
    exchange.watch.lap("decode")
    free = asyncio.Semaphore(services.gate.slots)  # other requests get slots in between
    with services.answers.account(exchange.ticket.holder) as take:

        async def one(number: int, item: BatchItem | Exception) -> BatchResult:
            async with free:
                try:
                    find = partial(services.associator.find_for_batch, target, number, item, asked.options, deadline)
                    found = await exchange.run(find)
                except CancelledError:
                    raise
                except Exception as error:
                    found = _refused(number, error, exchange.request_id)
                take(len(found.body))  # beyond the limit, the remaining scans are not searched
                return found

        try:
            async with asyncio.TaskGroup() as group:
                tasks = [group.create_task(one(number, item)) for number, item in enumerate(items)]
        except ExceptionGroup as raised:
            deadline.cancel()
            raise raised.exceptions[0] from None
        exchange.watch.lap("search")
        results = [task.result() for task in tasks]
        return exchange.json(await services.parse_threads.run(partial(batch_done, asked, target, results, exchange)))


def _refused(index: int, error: Exception, request_id: str) -> BatchResult:
    """Return the item of a scan that has no answer."""
    problem = problem_or_defect(error, request_id)
    moved = problem.as_json(request_id, partial(_OF_ONE.sub, rf"/\1s/{index}"))
    status = problem.kind.status
    return BatchResult(str(status), encode({"index": index, "status_code": status, "problem": moved}))


@router.post("/v1/register", **takes(RegisterRequest, RegisterAnswer, {"a corner": examples.REGISTER}))
async def register(exchange: Admitted) -> Response:
    """Find the pose from known correspondences.

    Lay scan segments on the map segments that they are known to belong to.
    """
    asked = await read(exchange, RegisterRequest)
    return await exchange.answer(lambda: exchange.encoded(registered(asked, exchange.watch, encode_list)))


@router.post("/v1/vectorize", **takes(VectorizeRequest, VectorizeAnswer, {"a corner": examples.VECTORIZE}))
async def vectorize(exchange: Admitted) -> Response:
    """Find the segments in ranges or points.

    Cut a scan into directed segments, as /v1/associate does with a scan that comes as ranges or points.
    """
    asked = await read(exchange, VectorizeRequest)
    return await exchange.answer(lambda: exchange.encoded(vectorized(asked, exchange.watch)))
