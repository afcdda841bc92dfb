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

from ..errors import NotFoundError
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
_REVALIDATED = {"Cache-Control": "no-cache"}  # a newer service has a newer page
_EXAMPLE = re.compile(r"[a-z]{1,40}\.json")


@cache
def _content(name: str) -> bytes:
    """Return a file of the page; once for all who read it, however slowly."""
    return files("fastapi_offline").joinpath("static", name).read_bytes()


@cache
def _built(*names: str) -> bytes | None:
    """Return a file of the package that holds the page; None where there is none."""
    found = files("service.page").joinpath(*names)
    return found.read_bytes() if found.is_file() else None


@router.get("/", response_class=HTMLResponse)
async def start() -> HTMLResponse:
    """Give the page, which shows what the service does."""
    return _page((_built("built", "index.html") or b"").decode(), _PAGE_POLICY)


@router.get("/page/{name}")
async def part_of_page(name: str) -> Response:
    """Give a script or a style of the page."""
    content = _built("built", name) if name in _PARTS else None
    if content is None:
        raise NotFoundError("no file of the page has this name; load the page again")
    return PiecewiseResponse(content, media_type=_PARTS[name], headers=_REVALIDATED)


@router.get("/page/examples/{name}")
async def example(name: str) -> Response:
    """Give one of the page's examples."""
    content = _built("examples", name) if _EXAMPLE.fullmatch(name) else None
    if content is None:
        raise NotFoundError("no example has this name; load the page again")
    return PiecewiseResponse(content, media_type="application/json", headers=_REVALIDATED)


@router.get("/openapi.json")
async def contract(request: Request) -> Response:
    """Give the contract; from bytes that all who read it share, however slowly."""
    return PiecewiseResponse(await request.app.state.contract.body(), media_type="application/json")


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
    """Give one of the page's files."""
    media_type = ASSETS.get(name)
    if media_type is None:
        raise NotFoundError("no file of the documentation has this name; load /docs again")
    return PiecewiseResponse(_content(name), media_type=media_type, headers={"Cache-Control": "public, max-age=86400"})
