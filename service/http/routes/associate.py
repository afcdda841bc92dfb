"""POST /v1/associate: unknown correspondences."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter, Request, Response

from ...parsing.reading import read_model
from ...schemas import examples
from ...schemas.replies import AssociateAnswer
from ...schemas.requests import AssociateRequest
from ..exchange import searching
from .documenting import EVERYWHERE, READS_BODY, SEARCHES, problems, takes

router = APIRouter(tags=["associate"])


@router.post(
    "/v1/associate",
    operation_id="associate",
    response_model=AssociateAnswer,
    responses=problems(*EVERYWHERE, *READS_BODY, *SEARCHES, "unknown_map", "map_corrupt"),
    openapi_extra=takes(AssociateRequest, {"a room": examples.ASSOCIATE, "a stored map": examples.ASSOCIATE_STORED}),
    summary="Find the pose without knowing correspondences",
)
async def post_associate(request: Request) -> Response:
    """Find where in the map the scan was taken, and say how sure that is."""
    exchange = searching(request)
    asked = await exchange.read(partial(read_model, AssociateRequest))
    job = exchange.job(asked.options.deadline_ms)
    async with exchange.looking_up(asked.map, job.deadline, oriented=asked.options.oriented) as on:
        work = partial(exchange.services.associator.answer, asked, on, job)
        return exchange.answer(await exchange.search(work, job.deadline, job.searching.is_set))
