"""Maps of ROS's map_server: a description in YAML with a picture."""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from registration import RigidTransform

from ..errors import FormatError, IncompleteFileError, MalformedFileError, TooLargeError, UnsupportedFormatError, naming
from ..files import kind_of, load_yaml, name_of, read_bounded, require_content, text_of
from ..limits import MAX_CELLS, MAX_MAP_BYTES, MAX_ORIGIN, MAX_RESOLUTION, MAX_YAML_BYTES, MIN_RESOLUTION
from ..options import ImportOptions
from ..report import Notes, first_of, shown
from .cells import Grid
from .tuning import UNKNOWN_GREYS

PICTURES = ("PPM", "PNG", "BMP", "JPEG")  # what Pillow may take a picture for
TEXT_MODE = re.compile(rb"P[56](\s+(#[^\n]*\n\s*)*\d+){3}\r\n")
COLOURED = 64  # of 255, the difference between the colours of a cell; that of grey ones in a JPEG is less
NAN = re.compile(r"[-+]?\.?nan(\(ind\)|\(snan\))?", re.IGNORECASE)
WORDS = {"no": 0, "false": 0, "off": 0, "yes": 1, "true": 1, "on": 1}  # of YAML 1.1, as ROS reads it
MAX_YAW = 1.01 * math.tau  # rad; a turn that was rounded
COARSE = 0.5  # m; a resolution above is likely in centimetres
MODES = ("trinary", "scale", "raw")
RAW_UNKNOWN = 100  # in mode raw: the greatest value that is an occupancy in percent


@dataclass(frozen=True, slots=True)
class Description:
    """The content of the YAML, with its names.

    Attributes
    ----------
    image : str
        Name of the picture, without folders.
    folder : str
        Of the picture, below that of the YAML; empty for others.
    resolution : float
        Metres.
    origin : RigidTransform
        map_from_grid.
    negate : bool
    occupied_thresh, free_thresh : float
        Occupancy, 0 to 1.
    mode : str
    """

    image: str
    folder: str
    resolution: float
    origin: RigidTransform
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: str


def read_grid(
    path: Path, options: ImportOptions, notes: Notes, pictures: Mapping[str, Path] | None = None
) -> tuple[Grid, tuple[str, ...]]:
    """Read a grid and tell the names of its files.

    Parameters
    ----------
    path : Path
        Of the YAML; the picture is expected in the same folder, or in a folder in it that the YAML names.
    options : ImportOptions
        Which grey value unknown cells have.
    notes : Notes
    pictures : mapping of str to Path, optional
        Paths of pictures, by the names that a YAML may contain; no other picture is read then.

    Raises
    ------
    FormatError
        When either file is missing, too large or not what it should be.
    """
    told = read_description(path, notes)
    picture = _beside(path, told) if pictures is None else pictures.get(told.image)
    if picture is None:
        raise IncompleteFileError(
            "there is no such file among those of the request; add it", argument=shown(told.image)
        )
    if not picture.exists():
        raise IncompleteFileError(
            f"names the picture {shown(told.image)}, but there is no such file in its folder; copy the picture there"
        )
    with naming(name_of(picture)):
        pixels, alpha = read_picture(picture, notes)
    grid = Grid(
        _occupancy(pixels, alpha, told)[::-1],  # rows run down in a picture, y points up in a map
        told.resolution,
        told.origin,
        told.occupied_thresh,
        told.free_thresh,
        _levels(UNKNOWN_GREYS if not told.negate else (*UNKNOWN_GREYS, *(255 - grey for grey in UNKNOWN_GREYS)), told),
        _given(options, told),
        () if told.mode == "raw" else (0, 255) if told.negate else (255, 0),
    )
    return grid, (name_of(path), name_of(picture))


def read_description(path: Path, notes: Notes) -> Description:
    """Read the YAML.

    Raises
    ------
    MalformedFileError
        When it is no YAML, or a value is out of range.
    IncompleteFileError
        When `image`, `resolution` or `origin` is missing.
    """
    values = load_yaml(text_of(read_bounded(path, MAX_YAML_BYTES)))
    if not isinstance(values, dict):
        raise MalformedFileError(
            f"expected a YAML mapping with image, resolution and origin, a space after each colon, found "
            f"{kind_of(values)}"
        )
    missing = [key for key in ("image", "resolution", "origin") if key not in values]
    if missing:
        found = first_of(list(map(str, values)))
        raise IncompleteFileError(f"has no {' and no '.join(missing)}, as the YAML file of a grid has; found {found}")
    mode = str(values.get("mode", "trinary")).lower()
    if mode not in MODES:
        raise UnsupportedFormatError(
            f"has an unknown mode; expected one of {', '.join(MODES)}, found {shown(str(mode))}"
        )
    free, occupied = (
        _number(values, f"{key}_thresh", 0.0, 1.0, usual) for key, usual in (("free", 0.196), ("occupied", 0.65))
    )
    if free > occupied:
        raise MalformedFileError(
            f"expected free_thresh below occupied_thresh, found {free:g} and {occupied:g}; exchange them"
        )
    resolution = _number(values, "resolution", MIN_RESOLUTION, MAX_RESOLUTION)
    if resolution > COARSE:
        notes.add_assumed("resolution", f"a cell is {resolution:g} m wide; if these are centimetres, divide by 100")
    return Description(
        *_image(values["image"]),
        resolution,
        _origin(values["origin"], notes),
        bool(_number(values, "negate", 0, 1, 0.0)),
        occupied,
        free,
        mode,
    )


def _beside(path: Path, told: Description) -> Path:
    named = path.parent / told.folder / told.image
    return named if named.exists() else path.parent / told.image


def _image(value: Any) -> tuple[str, str]:
    """Return the name of the picture, and its folder where that is below the folder of the YAML."""
    whole = PureWindowsPath(value if isinstance(value, str) else "")
    image = whole.name
    if not image or "\0" in image:
        found = "a name that no file can have" if isinstance(value, str) else kind_of(value)
        raise MalformedFileError(f"expected image to be the name of a file, found {found}")
    return image, "" if whole.anchor or ".." in whole.parts else whole.parent.as_posix()


def _number(values: dict[Any, Any], key: str, low: float, high: float, default: float | None = None) -> float:
    value = values.get(key, default)
    value = _numeric(WORDS.get(value.lower(), value) if isinstance(value, str) else value)
    if not isinstance(value, int | float) or not low <= value <= high:
        raise MalformedFileError(f"expected {key} to be a number from {low:g} to {high:g}, found {_found(value)}")
    return float(value)


def _numeric(value: Any) -> Any:
    """Return the number that a text is, as quotes make one of it; other values as they are."""
    try:
        return math.nan if isinstance(value, str) and NAN.fullmatch(value) else float(value)
    except (TypeError, ValueError, OverflowError):
        return value


def _found(value: Any) -> str:
    return f"'{shown(value)}'" if isinstance(value, str) else kind_of(value)


def _origin(value: Any, notes: Notes) -> RigidTransform:
    told = [v if isinstance(v, bool) else _numeric(v) for v in value] if isinstance(value, list) else []
    numbers = len(told) == 3 and all(type(v) is float for v in told)
    if not numbers or not all(math.isfinite(v) and abs(v) <= MAX_ORIGIN for v in told[:2]) or math.isinf(told[2]):
        found = ", ".join(map(_found, told[:4])) if told else _found(value)
        raise MalformedFileError(f"expected origin to be [x, y, yaw], numbers of at most {MAX_ORIGIN:g}, found {found}")
    if math.isnan(told[2]):
        notes.add_assumed("orientation", "the yaw of the origin is not a number, as map_saver writes it; 0 is assumed")
        told[2] = 0.0
    if abs(told[2]) > MAX_YAW:
        raise MalformedFileError(
            f"expected the yaw of the origin in radians, at most {math.tau:.4g}, found {told[2]:g}; if these are "
            f"degrees, write {math.radians(told[2]):.6g}"
        )
    return RigidTransform(*map(float, told))


def read_picture(path: Path, notes: Notes) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
    """Read a picture.

    Returns
    -------
    (rows, columns) float32
        0 black to 1 white, the mean of the colours; row 0 on top.
    (rows, columns) float32 or None
        0 transparent to 1 opaque, where the picture says.

    Raises
    ------
    MalformedFileError
        When it is no picture.
    TooLargeError
        When it has too many pixels.
    """
    require_content(path)
    content = read_bounded(path, MAX_MAP_BYTES)
    if TEXT_MODE.match(content):
        raise MalformedFileError(
            "was transferred as text: its header has line ends of Windows, which shift all cells. Transfer it as binary"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with Image.open(io.BytesIO(content), formats=PICTURES) as picture:
                if picture.width * picture.height > MAX_CELLS:
                    raise TooLargeError(
                        f"expected at most {MAX_CELLS} pixels, found {picture.width} x {picture.height}; crop the map"
                    )
                return _pixels(picture, notes)
    except FormatError:
        raise
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise TooLargeError(f"expected at most {MAX_CELLS} pixels, found many more; crop the map") from error
    except UnidentifiedImageError as error:
        raise MalformedFileError("is not a picture; expected PGM, PNG, BMP or JPEG. Save it as PNG") from error
    except (OSError, ValueError, SyntaxError, EOFError, Warning) as error:
        raise MalformedFileError(
            f"is a broken picture: {shown(str(error))}; expected a whole PGM, PNG, BMP or JPEG. Save it again"
        ) from error


def _pixels(picture: Image.Image, notes: Notes) -> tuple[NDArray[np.float32], NDArray[np.float32] | None]:
    if picture.mode in ("I", "I;16", "I;16B"):
        values = np.asarray(picture, dtype=np.float32)
        hidden = picture.info.get("transparency")
        alpha = np.where(values == hidden, np.float32(0), np.float32(1)) if isinstance(hidden, int) else None
        return values / np.float32(65535), alpha
    if picture.mode in ("1", "L") and not picture.has_transparency_data:
        return np.asarray(picture.convert("L"), dtype=np.float32) / np.float32(255), None
    rgba = np.asarray(picture.convert("RGBA"))
    colours, alpha = rgba[..., :3], rgba[..., 3].astype(np.float32) / np.float32(255)
    if coloured := int((np.ptp(colours, axis=2) > COLOURED).sum()):
        told = "cells have a colour, as zones of a map editor; they count by their brightness, as in map_server"
        notes.add_assumed("coloured", told, coloured)
    if hidden := int((alpha < 1.0).sum()):
        notes.add_assumed("transparent", "cells that are not opaque are unknown", hidden)
    return colours.mean(axis=2, dtype=np.float32) / np.float32(255), alpha if hidden else None


def _occupancy(
    pixels: NDArray[np.float32], alpha: NDArray[np.float32] | None, told: Description
) -> NDArray[np.float32]:
    if told.mode == "raw":
        value = np.rint(pixels * 255)
        occupancy = np.where(value <= RAW_UNKNOWN, value / np.float32(RAW_UNKNOWN), np.float32(np.nan))
    else:
        occupancy = pixels if told.negate else np.float32(1) - pixels
    return occupancy if alpha is None else np.where(alpha == 1.0, occupancy, np.float32(np.nan))


def _levels(greys: Sequence[int], told: Description) -> tuple[int, ...]:
    """Return the levels of occupancy that cells of some grey values have; those without an occupancy have none."""
    occupancy = _occupancy(np.array(greys, dtype=np.float32) / np.float32(255), None, told)
    return tuple(np.rint(255.0 * occupancy[~np.isnan(occupancy)]).astype(int).tolist())


def _given(options: ImportOptions, told: Description) -> tuple[int, ...] | None:
    """Return the levels of occupancy that the caller declares as unknown; None by default."""
    if options.unknown == "none":
        return ()
    return None if options.unknown is None else _levels([options.unknown], told) or None
