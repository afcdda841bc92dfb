"""The pages for people: a start page, and the contract to read and try, without the internet."""

from __future__ import annotations

import re
from base64 import b64encode
from functools import cache
from hashlib import sha256
from importlib.resources import files

from fastapi import APIRouter, Request
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import HTMLResponse, Response

from ...errors import NotFoundError
from ..bodies import JSON
from ..exchange import Admitted
from ..sending import PiecewiseResponse

router = APIRouter(include_in_schema=False)
ASSETS = {
    "swagger-ui-bundle.js": "text/javascript; charset=utf-8",
    "swagger-ui.css": "text/css; charset=utf-8",
    "favicon.png": "image/png",
}

_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)
_POLICY = (
    "default-src 'none'; script-src 'self' {scripts}; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
# The page loads only files that lie next to it; it writes no markup of its own, so no style stands in any.
_PAGE_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_PARTS = {"page.js": "text/javascript; charset=utf-8", "page.css": "text/css; charset=utf-8"}
_REVALIDATED = "no-cache"  # a newer service has a newer page
_OWN = "service.page"
_EXAMPLE = re.compile(r"[a-z]{1,40}\.json")


@cache
def _content(package: str, *names: str) -> bytes:
    """Return a file of a package; once for all who read it, however slowly."""
    found = files(package).joinpath(*names)
    if not found.is_file():
        raise NotFoundError("no file of the page has this name; load the page again")
    return found.read_bytes()


def _file(kind: str | None, cached: str, package: str, *names: str) -> Response:
    """Return a file; of `kind` None there is none."""
    if kind is None:
        raise NotFoundError("no file of the page has this name; load the page again")
    return PiecewiseResponse(_content(package, *names), media_type=kind, headers={"Cache-Control": cached})


@router.get("/", response_class=HTMLResponse)
async def start() -> HTMLResponse:
    """Give the page, which shows what the service does."""
    return _page(_content(_OWN, "built", "index.html").decode(), _PAGE_POLICY)


@router.get("/page/{name}")
async def part_of_page(name: str) -> Response:
    """Give a script or a style of the page."""
    return _file(_PARTS.get(name), _REVALIDATED, _OWN, "built", name)


@router.get("/page/examples/{name}")
async def example(name: str) -> Response:
    """Give one of the page's examples."""
    return _file(JSON if _EXAMPLE.fullmatch(name) else None, _REVALIDATED, _OWN, "examples", name)


@router.get("/openapi.json")
async def contract(request: Request, exchange: Admitted) -> Response:
    """Give the contract; from bytes that all who read it share, however slowly."""
    document = await exchange.services.parse_threads.run(request.app.state.contract)
    return PiecewiseResponse(document, media_type=JSON)


@router.get("/docs", response_class=HTMLResponse)
async def docs() -> HTMLResponse:
    """Show the contract with Swagger UI, whose files come from an installed package."""
    page = get_swagger_ui_html(
        openapi_url="/openapi.json",
        title="Linefix",
        swagger_js_url="/docs/assets/swagger-ui-bundle.js",
        swagger_css_url="/docs/assets/swagger-ui.css",
        swagger_favicon_url="/docs/assets/favicon.png",
    )
    text = bytes(page.body).decode()
    scripts = " ".join(
        "'sha256-" + b64encode(sha256(script.encode()).digest()).decode() + "'" for script in _SCRIPT.findall(text)
    )
    return _page(text, _POLICY.format(scripts=scripts))


def _page(text: str, policy: str) -> HTMLResponse:
    """Return a page that runs nothing but its own, and stands in no other."""
    headers = {"Content-Security-Policy": policy, "X-Frame-Options": "DENY", "Referrer-Policy": "no-referrer"}
    return HTMLResponse(text, headers={**headers, "Cross-Origin-Opener-Policy": "same-origin"})


@router.get("/docs/assets/{name}")
async def asset(name: str) -> Response:
    """Give one of the files of Swagger UI."""
    return _file(ASSETS.get(name), "public, max-age=86400", "fastapi_offline", "static", name)
