"""POST /v1/associate and /v1/associate:batch: unknown correspondences."""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response

from association import CancelledError, Deadline

from ...parsing.reading import read_batch, read_model
from ...runtime import runtime_of
from ...schemas import examples
from ...schemas.encoding import require_finite
from ...schemas.replies import AssociateAnswer, BatchAnswer
from ...schemas.requests import AssociateRequest, BatchItem, BatchRequest
from ...work.association import map_reference, search
from ..problems import internal
from ..reception import note, request_id_of
from ..translation import problem_of
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
    asked, watch = await runtime.read(request, partial(read_model, AssociateRequest))
    deadline = watch.deadline(asked.options.deadline_ms, runtime.settings.max_deadline_ms)

    def answer() -> bytes:
        cached, revision = runtime.lookup.indexed(asked.map, oriented=asked.options.oriented)
        watch.lap("decode")
        found = search(cached, (asked.scan, asked.prior, asked.options), deadline, runtime.metrics)
        watch.lap("search")
        found["map"] = map_reference(asked.map, revision)
        note(request.scope, map=found["map"], verdict=found["status"], usable=found["usable"])
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
    (asked, items), watch = await runtime.read(request, read_batch)
    deadline = watch.deadline(asked.options.deadline_ms, runtime.settings.max_deadline_ms)

    async def work() -> dict[str, Any]:
        index = partial(runtime.lookup.indexed, asked.map, oriented=asked.options.oriented)
        cached, revision = await runtime.take_turn(request, index, deadline)
        watch.lap("decode")

        def search_one(item: BatchItem | Exception) -> dict[str, Any]:
            if isinstance(item, Exception):
                raise item
            found = search(cached, (item.scan, item.prior, asked.options), deadline, runtime.metrics)
            require_finite(found)
            return found

        results = await _answer_all(request, [partial(search_one, item) for item in items], deadline)
        watch.lap("search")
        named = map_reference(asked.map, revision)
        verdicts = Counter(item["result"]["status"] if "result" in item else item["status_code"] for item in results)
        note(request.scope, map=named, verdicts={str(verdict): count for verdict, count in verdicts.items()})
        return {"results": results, "map": named, "client_ref": asked.client_ref}

    answer = await runtime.unless_hung_up(request, work(), deadline)
    return json_response(await runtime.in_parser(lambda: sealed(answer, request, watch)))


async def _answer_all(
    request: Request, calls: Sequence[Callable[[], dict[str, Any]]], deadline: Deadline
) -> list[dict[str, Any]]:
    """Search for every scan, as many at once as there are cores; others' requests get their turns in between."""
    runtime, request_id = runtime_of(request), request_id_of(request.scope)
    results: list[dict[str, Any]] = [{} for _ in calls]
    todo = iter(enumerate(calls))

    async def take_turns() -> None:
        for index, call in todo:
            try:
                found = await runtime.take_turn(request, call, deadline)
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


def _in_batch(index: int, pointer: str) -> str:
    """Turn a place in one scan or prior into its place in the batch."""
    for one, many in (("/scan", f"/scans/{index}"), ("/prior", f"/priors/{index}")):
        if pointer == one or pointer.startswith(one + "/"):
            return many + pointer.removeprefix(one)
    return pointer
