"""POST /v1/register: known correspondences."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter, Response

from linefix.documents import examples
from linefix.documents.reading import read_model
from linefix.documents.replies import RegisterAnswer
from linefix.documents.requests import RegisterRequest

from ...work.association import answer_registration
from ..body_stage import read
from ..exchange import Searching
from ..search_stage import in_search_slot
from ..sending import answer
from .declaring import EVERYWHERE, READS_BODY, SEARCHES, problems, takes

router = APIRouter(tags=["register"])


@router.post(
    "/v1/register",
    operation_id="register",
    response_model=RegisterAnswer,
    responses=problems(*EVERYWHERE, *READS_BODY, *SEARCHES),
    openapi_extra=takes(RegisterRequest, {"a corner": examples.REGISTER}),
    summary="Find the pose from known correspondences",
)
async def post_register(exchange: Searching) -> Response:
    """Lay scan segments on the map segments that they are known to belong to."""
    asked = await read(exchange, partial(read_model, RegisterRequest))
    job = exchange.job()
    return await answer(
        exchange, in_search_slot(exchange, partial(answer_registration, asked, job), job.deadline), job.deadline
    )
