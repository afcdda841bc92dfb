"""The coordinates of a GeoJSON: degrees, metres, or another unit of length."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from ..errors import IncompleteFileError
from ..report import shown
from .drawing import Drawing

EARTH = 6378137.0  # m; radius of the sphere of web mercator
MERCATOR = {3857, 900913, 3785, 102100, 102113}
GEOGRAPHIC = range(4001, 5000)
LESS_THAN_A_BUILDING = 0.1  # of a unit: a drawing as small is in degrees
DEGREES = (180.0, 90.0)

# Projected systems of EPSG in metres whose scale is that of the ground within 0.3 %: first and last code. UTM, national
# grids of Europe, Australia, New Zealand and Japan.
METRIC = (
    (2056, 2056), (2100, 2100), (2154, 2154), (2157, 2157), (2176, 2180), (2193, 2193), (2443, 2461), (3003, 3004),
    (3006, 3018), (3059, 3059), (3067, 3067), (3301, 3301), (3346, 3346), (3763, 3763), (3765, 3765), (3794, 3794),
    (3812, 3812), (3942, 3950), (5105, 5130), (5514, 5514), (6669, 6687), (7846, 7859), (21781, 21781), (23028, 23038),
    (23700, 23700), (25828, 25838), (26701, 26722), (26901, 26923), (27700, 27700), (28348, 28358), (28991, 28992),
    (31254, 31259), (31284, 31287), (31370, 31370), (31466, 31469), (31965, 31985), (32601, 32660), (32701, 32760),
)  # fmt: skip
FEET = ((2222, 2289), (2867, 2888), (2891, 2930))  # state planes of the USA


def require_lengths(told: Any, drawing: Drawing) -> None:
    """Refuse coordinates that are no lengths, or whose unit is not known; an option that states the unit decides.

    Parameters
    ----------
    told : object
        The member ``crs`` of the file, None where there is none.
    drawing : Drawing

    Raises
    ------
    IncompleteFileError
        With what to do.
    """
    if not drawing.polylines:
        return
    units = drawing.options.units
    corners = np.vstack([one.ends for one in drawing.polylines]).reshape(-1, 2)
    name, code = _named(told)
    x, y = (float(c) for c in np.median(corners, axis=0))
    why = None
    extent = float(np.ptp(corners, axis=0).max())
    small = extent < LESS_THAN_A_BUILDING and extent * (drawing.options.metres or 1.0) < LESS_THAN_A_BUILDING
    if units is None or small or (isinstance(units, str) and code in MERCATOR):
        why = _why_not(name, code, (x, y), extent, drawing.options.local_metres)
    if why is not None:
        raise IncompleteFileError(why)
    if name and not (units is None and _within(code, METRIC)):
        drawing.notes.add_assumed("crs", f"the unit is that of an option; the file has the crs {name}")


def _why_not(name: str, code: int | None, place: tuple[float, float], extent: float, metres: bool) -> str | None:
    x, y = place
    found = f"such as {x:.8g}, {y:.8g}"
    if code in MERCATOR:
        scale = math.cosh(y / EARTH)
        degrees = math.degrees(x / EARTH), math.degrees(math.atan(math.sinh(y / EARTH)))
        return (
            f"has the crs {name} (web mercator), which is {scale:.3f} times too large here; {_reprojected(*degrees)}, "
            f"or set the option units to {1.0 / scale:.6g}"
        )
    if _within(code, FEET) or re.search(r"\b(us-ft|ft|ftus|feet|foot)\b", name, re.IGNORECASE):
        return f"has the crs {name}, which is in feet; set the option units to us-ft (feet of the US survey) or ft"
    in_degrees = abs(x) <= DEGREES[0] and abs(y) <= DEGREES[1]
    if in_degrees and (extent < LESS_THAN_A_BUILDING or (code in GEOGRAPHIC and not metres) or not (metres or name)):
        flag = "" if metres else ". If it has metres, set the option local_metres"
        return f"has degrees, {found}, as its standard requires; expected metres: {_reprojected(x, y)}{flag}"
    if metres or _within(code, METRIC):
        return None
    if name and code not in GEOGRAPHIC:
        return f"has the crs {name}, whose unit is not known here; set the option units (m, ft or us-ft)"
    return f"has coordinates that are no degrees, {found}; set the option local_metres if they are metres, else units"


def _named(told: Any) -> tuple[str, int | None]:
    """Return the name of a coordinate system, and its code of EPSG where it has one."""
    properties = told.get("properties") if isinstance(told, dict) else {"name": told}
    name = properties.get("name", properties.get("code")) if isinstance(properties, dict) else None
    if type(name) is int:
        name = f"EPSG:{name}"
    if not isinstance(name, str):
        return "", None
    zone = re.search(r"UTM zone (\d{1,2}) ?([NS])", name, re.IGNORECASE)
    if zone:
        return shown(name), (32600 if zone[2].upper() == "N" else 32700) + int(zone[1])
    if re.search(r"CRS:?84|WGS ?84$", name):
        return shown(name), 4326
    found = re.search(r"(?:EPSG|ESRI)\b.{0,20}?\b(\d{4,6})\b", name, re.IGNORECASE)
    return shown(name), int(found[1]) if found else None


def _within(code: int | None, ranges: tuple[tuple[int, int], ...]) -> bool:
    return code is not None and any(first <= code <= last for first, last in ranges)


def _reprojected(longitude: float, latitude: float) -> str:
    zone = 1 + int((longitude + 180.0) % 360.0 // 6.0)
    code = (32600 if latitude >= 0.0 else 32700) + zone
    return (
        f"save it in UTM (QGIS: Export, Save Features As, CRS EPSG:{code}; or ogr2ogr -t_srs EPSG:{code} "
        "OUT.geojson IN.geojson)"
    )
