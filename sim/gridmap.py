"""Read a map_server map (.yaml + .pgm) and merge its occupied cells into rectangles. No ROS, no drawing."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from sim.geometry import Pose

MAX_CELLS = 4_000_000  # 2000 x 2000 cells: 100 m at 5 cm
Rectangle = tuple[float, float, float, float]


class GridMapError(Exception):
    """A map is not readable; the message names the file and the reason."""


def read(path: Path) -> tuple[tuple[Rectangle, ...], Pose]:
    """Return the occupied area as rectangles in metres, and the pose of the image's lower left corner.

    The format is map_server's: `image`, `resolution`, `origin: [x, y, yaw]`, `negate`, `occupied_thresh`. Unknown
    cells count as free.

    Raises:
        GridMapError: a file is missing or is not in map_server's format.
    """
    meta = _meta(path)
    try:
        pixels = read_pgm((path.parent / str(meta["image"])).read_bytes())
        resolution = float(meta["resolution"])
        x, y, yaw = (float(v) for v in meta["origin"])
        threshold = float(meta.get("occupied_thresh", 0.65))
        negate = bool(int(meta.get("negate", 0)))
    except OSError as error:
        raise GridMapError(f"{path.name}: its image {meta['image']!r} cannot be read ({error.strerror})") from error
    except KeyError as error:
        raise GridMapError(f"{path.name}: the key {error.args[0]!r} is missing") from error
    except (TypeError, ValueError) as error:
        raise GridMapError(f"{path.name}: {error}") from error
    if not (resolution > 0 and all(math.isfinite(v) for v in (resolution, x, y, yaw))):
        raise GridMapError(f"{path.name}: resolution and origin must be finite, and resolution above 0")
    darkness = pixels / 255.0 if negate else (255.0 - pixels) / 255.0
    occupied = (darkness > threshold)[::-1]  # the image's first row is at the top, y points upwards
    return merge(occupied, resolution), Pose(x, y, yaw)


def merge(occupied: NDArray[np.bool_], resolution: float) -> tuple[Rectangle, ...]:
    """Return a small number of rectangles that cover exactly the occupied cells; row 0 is at y = 0."""
    left = occupied.copy()
    rectangles: list[Rectangle] = []
    for row, column in np.argwhere(occupied):
        if not left[row, column]:
            continue
        run = left[row, column:]
        width = int(np.argmin(run)) if not run.all() else run.size
        height = 1
        while row + height < left.shape[0] and left[row + height, column : column + width].all():
            height += 1
        left[row : row + height, column : column + width] = False
        rectangles.append(
            (column * resolution, row * resolution, (column + width) * resolution, (row + height) * resolution)
        )
    return tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in rectangles)


def read_pgm(data: bytes) -> NDArray[np.float64]:
    """Return the grey values, 0 to 255, first row at the top, of a binary (P5) or text (P2) PGM.

    Raises:
        ValueError: it is not an 8-bit PGM, or has fewer pixels than its header says.
    """
    header = re.match(rb"(P[25])" + rb"(?:\s+|#[^\n]*\n)+(\d+)" * 3 + rb"\s", data)
    if not header:
        raise ValueError("the image is not a PGM; save it as an 8-bit PGM, binary (P5) or text (P2)")
    width, height, deepest = (int(v) for v in header.groups()[1:])
    if not (0 < width * height <= MAX_CELLS and 0 < deepest <= 255):
        raise ValueError(
            f"the image has {width} x {height} cells and values up to {deepest}; the limits are {MAX_CELLS} and 255"
        )
    body = data[header.end() :]
    values = np.frombuffer(body, np.uint8) if header[1] == b"P5" else np.array(body.split(), dtype=np.uint8)
    if values.size < width * height:
        raise ValueError(f"the image has only {values.size} of {width * height} pixels")
    grey: NDArray[np.float64] = values.astype(np.float64)[: width * height].reshape(height, width) * (255.0 / deepest)
    return grey


def _meta(path: Path) -> dict[str, Any]:
    try:
        meta = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise GridMapError(f"{path.name} cannot be read ({error.strerror})") from error
    except yaml.YAMLError as error:
        raise GridMapError(f"{path.name} is not YAML") from error
    if not isinstance(meta, dict) or "image" not in meta:
        raise GridMapError(f"{path.name} is not a map_server file: the key 'image' is missing")
    return meta
