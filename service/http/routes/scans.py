"""POST /v1/register, /v1/vectorize and /v1/associate: one scan."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter, Response

from linefix.documents import examples
from linefix.documents.encoding import encode_list
from linefix.documents.found import AssociateAnswer
from linefix.documents.replies import RegisterAnswer, VectorizeAnswer
from linefix.documents.requests import AssociateRequest, RegisterRequest, VectorizeRequest
from linefix.operations import registered, vectorized

from ...work.job import Done, Job
from ..bodies import read_request
from ..exchange import Exchange, Searching
from ..map_stage import index_map, looking_up_maps
from ..openapi import searches
from ..search_stage import in_search_slot
from ..sending import answer, answer_in_slot

router = APIRouter()
_EXAMPLES = {
    "a room": examples.ASSOCIATE,
    "a stored map": examples.ASSOCIATE_STORED,
    "several maps": examples.ASSOCIATE_SEVERAL,
}


@router.post(
    "/v1/associate",
    tags=["associate"],
    response_model=AssociateAnswer,
    summary="Find the pose without knowing correspondences",
    **searches(AssociateRequest, _EXAMPLES, "unknown_map", "map_corrupt"),
)
async def associate(exchange: Searching) -> Response:
    """Estimate the pose of a scan in a map, or on one of several, with a verdict and its probability."""
    asked = await read_request(exchange, AssociateRequest)
    job = exchange.job(asked.options.deadline_ms)
    return await answer(exchange, _work(exchange, asked, job), job.deadline)


async def _work(exchange: Exchange, asked: AssociateRequest, job: Job) -> Done:
    """Search in one slot at the gate, in which a small map is indexed, too."""
    oriented = asked.options.oriented
    async with looking_up_maps(exchange, asked, job.deadline) as source:
        ready = await index_map(exchange, source, job.deadline, oriented=oriented)
        work = partial(exchange.services.associator.answer, asked, source, job, ready)
        return await in_search_slot(exchange, work, job.deadline)


@router.post(
    "/v1/register",
    tags=["register"],
    response_model=RegisterAnswer,
    summary="Find the pose from known correspondences",
    **searches(RegisterRequest, {"a corner": examples.REGISTER}),
)
async def register(exchange: Searching) -> Response:
    """Lay scan segments on the map segments that they are known to belong to."""
    asked = await read_request(exchange, RegisterRequest)
    return await answer_in_slot(exchange, lambda job: job.done(registered(asked, job.watch, encode_list)))


@router.post(
    "/v1/vectorize",
    tags=["vectorize"],
    response_model=VectorizeAnswer,
    summary="Find the segments in ranges or points",
    **searches(VectorizeRequest, {"a corner": examples.VECTORIZE}),
)
async def vectorize(exchange: Searching) -> Response:
    """Cut a scan into directed segments, as /v1/associate does with a scan that comes as ranges or points."""
    asked = await read_request(exchange, VectorizeRequest)
    return await answer_in_slot(exchange, lambda job: job.done(vectorized(asked, job.watch)))
