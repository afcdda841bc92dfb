"""The pages for people: a start page, and the contract to read and try, without the internet."""

from __future__ import annotations

from importlib.resources import files

from fastapi import APIRouter
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import HTMLResponse, Response

from ..errors import NotFoundError

router = APIRouter(include_in_schema=False)
ASSETS = {
    "swagger-ui-bundle.js": "text/javascript; charset=utf-8",
    "swagger-ui.css": "text/css; charset=utf-8",
    "favicon.png": "image/png",
}

START = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Linefix</title>
<link rel="icon" href="/docs/assets/favicon.png">
<style>
  body { font: 16px/1.5 system-ui, sans-serif; max-width: 44rem; margin: 3rem auto; padding: 0 1rem; color: #1c2430 }
  code { background: #eef1f5; padding: .1em .3em; border-radius: .2em }
  a { color: #0b5fa5 }
</style>
<h1>Linefix</h1>
<p>Tells a robot where it is: it lays the line segments of a scan on those of a map, and says when it cannot.</p>
<ul>
  <li><a href="/docs">The endpoints</a>, to read and to try</li>
  <li><a href="/openapi.json">The contract</a> as OpenAPI</li>
  <li><a href="/v1/limits">Limits</a>, <a href="/version">version</a>, <a href="/readyz">readiness</a>,
    <a href="/metrics">metrics</a></li>
</ul>
</html>
"""


@router.get("/", response_class=HTMLResponse)
async def start() -> HTMLResponse:
    """Point to what there is."""
    return HTMLResponse(START)


@router.get("/docs", response_class=HTMLResponse)
async def docs() -> HTMLResponse:
    """Show the contract with Swagger UI, whose files come from an installed package."""
    return get_swagger_ui_html(
        openapi_url="/openapi.json",
        title="Linefix",
        swagger_js_url="/docs/assets/swagger-ui-bundle.js",
        swagger_css_url="/docs/assets/swagger-ui.css",
        swagger_favicon_url="/docs/assets/favicon.png",
    )


@router.get("/docs/assets/{name}")
async def asset(name: str) -> Response:
    """Give one of the page's files."""
    media_type = ASSETS.get(name)
    if media_type is None:
        raise NotFoundError("there is no such file")
    data = files("fastapi_offline").joinpath("static", name).read_bytes()
    return Response(data, media_type=media_type, headers={"Cache-Control": "public, max-age=86400"})
