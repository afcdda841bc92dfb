"""POST /v1/vectorize: ranges or points to segments."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter, Response

from linefix.documents import examples
from linefix.documents.reading import read_model
from linefix.documents.replies import VectorizeAnswer
from linefix.documents.requests import VectorizeRequest

from ...work.association import answer_vectorization
from ..body_stage import read
from ..exchange import Searching
from ..search_stage import in_search_slot
from ..sending import answer
from .declaring import EVERYWHERE, READS_BODY, SEARCHES, problems, takes

router = APIRouter(tags=["vectorize"])


@router.post(
    "/v1/vectorize",
    operation_id="vectorize",
    response_model=VectorizeAnswer,
    responses=problems(*EVERYWHERE, *READS_BODY, *SEARCHES),
    openapi_extra=takes(VectorizeRequest, {"a corner": examples.VECTORIZE}),
    summary="Find the segments in ranges or points",
)
async def post_vectorize(exchange: Searching) -> Response:
    """Cut a scan into directed segments, as /v1/associate does with a scan that comes as ranges or points."""
    asked = await read(exchange, partial(read_model, VectorizeRequest))
    job = exchange.job()
    return await answer(
        exchange, in_search_slot(exchange, partial(answer_vectorization, asked, job), job.deadline), job.deadline
    )
