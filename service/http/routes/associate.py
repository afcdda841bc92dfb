"""POST /v1/associate: unknown correspondences."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter, Response

from linefix.documents import examples
from linefix.documents.reading import read_model
from linefix.documents.replies import AssociateAnswer
from linefix.documents.requests import AssociateRequest

from ...work.job import Done, Job
from ..body_stage import read
from ..exchange import Exchange, Searching
from ..map_stage import index_map, looking_up_maps
from ..search_stage import in_search_slot
from ..sending import answer
from .declaring import EVERYWHERE, READS_BODY, SEARCHES, problems, takes

router = APIRouter(tags=["associate"])


@router.post(
    "/v1/associate",
    operation_id="associate",
    response_model=AssociateAnswer,
    responses=problems(*EVERYWHERE, *READS_BODY, *SEARCHES, "unknown_map", "map_corrupt"),
    openapi_extra=takes(
        AssociateRequest,
        {
            "a room": examples.ASSOCIATE,
            "a stored map": examples.ASSOCIATE_STORED,
            "several maps": examples.ASSOCIATE_SEVERAL,
        },
    ),
    summary="Find the pose without knowing correspondences",
)
async def post_associate(exchange: Searching) -> Response:
    """Estimate the pose of a scan in a map, or on one of several, with a verdict and its probability."""
    asked = await read(exchange, partial(read_model, AssociateRequest))
    job = exchange.job(asked.options.deadline_ms)
    return await answer(exchange, _work(exchange, asked, job), job.deadline)


async def _work(exchange: Exchange, asked: AssociateRequest, job: Job) -> Done:
    """Search in one slot at the gate, in which a small map is indexed, too."""
    oriented = asked.options.oriented
    async with looking_up_maps(exchange, asked, job.deadline) as source:
        ready = await index_map(exchange, source, job.deadline, oriented=oriented)
        work = partial(exchange.services.associator.answer, asked, source, job, ready)
        return await in_search_slot(exchange, work, job.deadline, job.searching.is_set)
