"""POST /v1/associate and /v1/associate:batch: unknown correspondences."""

from __future__ import annotations

import asyncio
import logging
from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response

from association import CancelledError, Deadline

from ..bodies import validate
from ..context import request_id_of
from ..finite import require_finite
from ..lookup import indexed_map
from ..maps import CachedMap
from ..problems import internal
from ..runtime import Runtime, holder_of, runtime_of
from ..schemas import examples
from ..schemas.replies import AssociateAnswer, BatchAnswer
from ..schemas.requests import AssociateRequest, BatchItem, BatchRequest
from ..searching import map_reference, search
from ..translation import problem_of
from ..turns import Holder
from .answering import EVERYWHERE, READS_BODY, SEARCHES, json_response, problems, sealed, takes

logger = logging.getLogger("linefix")
router = APIRouter(tags=["associate"])
ERRORS = (*EVERYWHERE, *READS_BODY, *SEARCHES, "unknown_map", "map_corrupt")


@router.post(
    "/v1/associate",
    response_model=AssociateAnswer,
    responses=problems(*ERRORS),
    openapi_extra=takes(AssociateRequest, {"a room": examples.ASSOCIATE, "a stored map": examples.ASSOCIATE_STORED}),
    summary="Find the pose without knowing correspondences",
)
async def post_associate(request: Request) -> Response:
    """Find where in the map the scan was taken, and say how sure that is."""
    runtime = runtime_of(request)
    runtime.require_ready(request)
    asked, watch = await runtime.read(request, AssociateRequest)
    deadline = watch.deadline(asked.options.deadline_ms, runtime.settings.max_deadline_ms)

    def answer() -> bytes:
        cached, revision = indexed_map(asked.map, runtime.cache, runtime.store)
        watch.lap("decode")
        found = search(cached, (asked.scan, asked.prior, asked.options), deadline, runtime.metrics)
        watch.lap("search")
        found["map"] = map_reference(asked.map, revision)
        found["client_ref"] = asked.client_ref
        return sealed(found, request, watch)

    return json_response(await runtime.search(request, answer, deadline))


@router.post(
    "/v1/associate:batch",
    response_model=BatchAnswer,
    responses=problems(*ERRORS),
    openapi_extra=takes(BatchRequest, {"two scans": examples.BATCH}),
    summary="Find several scans in one map",
)
async def post_batch(request: Request) -> Response:
    """Find several scans in one map; a scan that is wrong is one error item and nothing else."""
    runtime = runtime_of(request)
    runtime.require_ready(request)
    asked, watch = await runtime.read(request, BatchRequest)
    deadline = watch.deadline(asked.options.deadline_ms, runtime.settings.max_deadline_ms)

    holder = holder_of(request)

    async def work() -> dict[str, Any]:
        cached, revision = await runtime.gate.run(
            lambda: indexed_map(asked.map, runtime.cache, runtime.store), deadline, holder
        )
        watch.lap("decode")
        results = await _search_all(runtime, asked, cached, (deadline, holder, request_id_of(request.scope)))
        watch.lap("search")
        return {"results": results, "map": map_reference(asked.map, revision), "client_ref": asked.client_ref}

    answer = await runtime.unless_hung_up(request, work(), deadline)
    return json_response(await runtime.in_parser(lambda: sealed(answer, request, watch)))


async def _search_all(
    runtime: Runtime, asked: BatchRequest, cached: CachedMap, of: tuple[Deadline, Holder, str]
) -> list[dict[str, Any]]:
    """Search for every scan, as many at once as there are cores; others' requests get their turns in between."""
    deadline, holder, request_id = of
    results: list[dict[str, Any]] = [{} for _ in asked.scans]
    todo = iter(range(len(asked.scans)))

    async def take_turns() -> None:
        for index in todo:
            call = partial(_search_one, runtime, asked, cached, (index, deadline))
            try:
                found = await runtime.gate.run(call, deadline, holder, admitted=True)
                results[index] = {"index": index, "status_code": 200, "result": found}
            except CancelledError:
                raise
            except Exception as error:
                problem = problem_of(error)
                if problem is None:
                    logger.exception("a defect", extra={"request_id": request_id})
                    problem = internal()
                moved = problem.as_json(request_id, partial(_in_batch, index))
                results[index] = {"index": index, "status_code": problem.status, "problem": moved}

    await asyncio.gather(*(take_turns() for _ in range(min(runtime.gate.slots, len(results)))))
    return results


def _search_one(runtime: Runtime, asked: BatchRequest, cached: CachedMap, turn: tuple[int, Deadline]) -> dict[str, Any]:
    index, deadline = turn
    prior = None if asked.priors is None else asked.priors[index]
    item = validate(BatchItem, {"scan": asked.scans[index], "prior": prior}, runtime.limits)
    found = search(cached, (item.scan, item.prior, asked.options), deadline, runtime.metrics)
    require_finite(found)
    return found


def _in_batch(index: int, pointer: str) -> str:
    """Turn a place in one scan or prior into its place in the batch."""
    for one, many in (("/scan", f"/scans/{index}"), ("/prior", f"/priors/{index}")):
        if pointer == one or pointer.startswith(one + "/"):
            return many + pointer.removeprefix(one)
    return pointer
