"""What a network makes of a picture in which a block hides a part.

References
----------
M. D. Zeiler, R. Fergus, "Visualizing and understanding convolutional networks", ECCV 2014, for
the idea of sliding a block over the picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bellcrank.errors import InvalidSettings
from bellcrank.surrogate.backend import find_device, import_torch
from bellcrank.surrogate.trained import batch_of
from bellcrank.surrogate.views import PictureView

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bellcrank.surrogate.trained import TrainedModel

WHITE, BLACK = 0, 255
"""Ink of a block."""


@dataclass(frozen=True, slots=True)
class Block:
    """A square that is slid over a picture.

    Parameters
    ----------
    size
        Of its side, in pixels.
    stride
        From one place to the next, in pixels.

    Raises
    ------
    InvalidSettings
    """

    size: int = 12
    stride: int = 4

    def __post_init__(self) -> None:
        for name in ("size", "stride"):
            value = getattr(self, name)
            if value < 1:
                raise InvalidSettings(f"block {name}: expected at least 1 pixel, got {value}")

    def middles(self, extent: int) -> NDArray[np.float64]:
        """Return where the block's middle goes along one side of a picture, in pixels.

        The places tile the picture, so that blocks at the border hide only what is there.

        Examples
        --------
        >>> Block(size=12, stride=4).middles(12)
        array([ 2.,  6., 10.])
        """
        return np.asarray((np.arange(-(-extent // self.stride)) + 0.5) * self.stride, np.float64)

    def span(self, middle: float, extent: int) -> slice:
        """Return the pixels that the block hides around a middle."""
        first = int(np.floor(middle - 0.5 * self.size + 0.5))
        return slice(max(first, 0), min(max(first + self.size, 0), extent))


def occlude(
    model: TrainedModel,
    packed: NDArray[np.uint8],
    block: Block | None = None,
    *,
    ink: int = WHITE,
    device: str = "auto",
) -> NDArray[np.float64]:
    """Return how a block that hides a part of a design's picture changes the prediction.

    Parameters
    ----------
    model
        Of a network that looks at pictures.
    packed : (bytes,) uint8
        The design, over the beams of the model's problem.
    block
        Its size, and where it goes.
    ink
        Of the block: `WHITE` hides beams as if they were removed, `BLACK` as if everything
        were full of them.

    Returns
    -------
    (rows, columns) float64
        Predicted efficiency with the block less that without, at each of the block's places,
        the uppermost row first.

    Raises
    ------
    InvalidSettings
        If the network does not look at pictures, or the block is larger than them.
    """
    view = picture_view(model)
    import_torch()
    block = block or Block()
    _, height, width = view.shape
    if block.size > min(height, width):
        raise InvalidSettings(
            f"block size: expected at most {min(height, width)} pixels, as the pictures of "
            f"{width} x {height} have, got {block.size}"
        )
    picture = view.look(packed[None])[0, 0]
    rows, columns = block.middles(height), block.middles(width)
    spots = [(block.span(row, height), block.span(column, width)) for row in rows
             for column in columns]  # fmt: skip
    # A block on what is of its own colour hides nothing: often so on white paper.
    hiding = np.array([bool((picture[spot] != ink).any()) for spot in spots])
    change = np.zeros(len(spots))
    change[hiding] = _ask(model, picture, [s for s, h in zip(spots, hiding, strict=True) if h],
                          ink, device)  # fmt: skip
    return model.deviation * change.reshape(len(rows), len(columns))


def _ask(
    model: TrainedModel,
    picture: NDArray[np.uint8],
    spots: list[tuple[slice, slice]],
    ink: int,
    device: str,
) -> NDArray[np.float64]:
    """Return the network's output for each spot filled with ink, less that for the picture."""
    import torch

    where = find_device(device)
    network = model.network.to(where).eval()
    kind = next(network.parameters()).dtype

    def run(pictures: NDArray[np.uint8]) -> NDArray[np.float64]:
        inputs = torch.from_numpy(pictures[:, None]).to(where).to(kind).mul_(model.view.scale)
        inputs = inputs.contiguous(memory_format=torch.channels_last)
        return np.asarray(network(inputs).cpu().numpy(), np.float64)

    found = np.empty(len(spots))
    batch = batch_of(where)
    with torch.inference_mode():
        plain = run(picture[None])[0]
        for first in range(0, len(spots), batch):
            chosen = spots[first : first + batch]
            hidden = np.repeat(picture[None], len(chosen), axis=0)
            for one, spot in zip(hidden, chosen, strict=True):
                one[spot] = ink
            found[first : first + len(chosen)] = run(hidden) - plain
    return found


def picture_view(model: TrainedModel) -> PictureView:
    """Return how a network looks at pictures.

    Raises
    ------
    InvalidSettings
        If it looks at something else.
    """
    if not isinstance(model.view, PictureView):
        raise InvalidSettings(
            f"blocks can hide parts of pictures only; {model.architecture!r} looks at "
            f"{model.looks_at}: leave out the block, or take a network that looks at pictures"
        )
    return model.view


def sample_map(
    values: NDArray[np.float64], block: Block, places: NDArray[np.float64], height: int
) -> NDArray[np.float64]:
    """Read a map between the places of the block.

    Parameters
    ----------
    values : (rows, columns)
        As `occlude` returns them.
    places : (n, 2)
        In pixels from the lower left corner, as `Canvas.place` has them.
    height
        Of the picture, in pixels.

    Returns
    -------
    (n,) float64
        Linear between the nearest four.
    """
    from scipy.ndimage import map_coordinates

    column = places[:, 0] / block.stride - 0.5
    row = (height - places[:, 1]) / block.stride - 0.5
    return np.asarray(map_coordinates(values, [row, column], order=1, mode="nearest"))
