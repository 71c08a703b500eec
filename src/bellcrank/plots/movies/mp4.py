"""MP4 by PyAV: H.264, 4:2:0, in the colours of HD television, ready to be streamed."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings, StorageError

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from bellcrank.plots.movies.formats import Pictures

ENCODERS: dict[str, dict[str, str]] = {
    "libx264": {"crf": "17", "preset": "veryfast", "tune": "animation"},
    "libopenh264": {"rc_mode": "quality", "b": "12M"},
}
"""With their options, the first that is there is taken."""
WAITING = 4
"""Pictures drawn ahead of the encoder."""
KEPT_BYTES = 2**28
"""Memory for pictures that come again on the way back."""
THREADS = 1
"""Of the encoder: with more, the same movie is not always the same file."""
BT709, STUDIO = 1, 1
"""Codes of the colour space of HD television, and of its range of brightness."""


def require_encoder() -> str:
    """Return the name of an H.264 encoder.

    Raises
    ------
    InvalidSettings
        If there is none, or no PyAV.
    """
    module = _av()
    for name in ENCODERS:
        try:
            module.codec.Codec(name, "w")
        except ValueError:
            continue
        return name
    raise InvalidSettings(
        f"this build of PyAV has no H.264 encoder ({' or '.join(ENCODERS)}); install that of "
        "the package index with: pip install --force-reinstall av, or write a .gif"
    )


def check(_fps: int, size: tuple[int, int]) -> None:
    """Refuse odd sizes, which 4:2:0 cannot have.

    Raises
    ------
    InvalidSettings
    """
    if size[0] % 2 or size[1] % 2:
        raise InvalidSettings(f"size: expected even numbers for an MP4, got {size[0]}x{size[1]}")


def encode(pictures: Pictures, fps: int, tell: Callable[[int], None]) -> bytes:
    """Encode all frames; drawing and encoding overlap.

    Raises
    ------
    InvalidSettings
        If there is no encoder.
    StorageError
        If the disk for temporary files is full.
    """
    module, name = _av(), require_encoder()
    # In a folder of its own: moving the index to the front needs a file that can be read again.
    with TemporaryDirectory() as folder:
        path = Path(folder) / "movie.mp4"
        try:
            _write(module, name, path, pictures, fps, tell)
            return path.read_bytes()
        except OSError as error:
            raise StorageError(f"{path}: cannot be written ({error.strerror})") from error


def _write(
    module: Any, name: str, path: Path, pictures: Pictures, fps: int, tell: Callable[[int], None]
) -> None:
    """Write all frames to a file."""
    with (
        module.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as container,
        ThreadPoolExecutor(1) as encoder,
    ):
        track = _Track(module, container, name, pictures.size, fps)
        work: deque[Future[None]] = deque()
        try:
            for frame, state in enumerate(pictures.order.tolist()):
                picture = pictures.draw(state) if track.asks_for(state) else None
                work.append(encoder.submit(track.put, frame, state, picture))
                if len(work) > WAITING:
                    work.popleft().result()
                tell(frame + 1)
            for waiting in work:
                waiting.result()
            track.end()
        finally:
            encoder.shutdown(cancel_futures=True)


class _Track:
    """The stream of pictures in a file; keeps those that may come again, while there is room.

    All but `asks_for` is called in the encoder's thread.
    """

    def __init__(
        self, module: Any, container: Any, name: str, size: tuple[int, int], fps: int
    ) -> None:
        self._module, self._container = module, container
        self._room = KEPT_BYTES // (size[0] * size[1] * 3 // 2)
        self._known: set[int] = set()
        self._kept: dict[int, Any] = {}
        self._stream = container.add_stream(name, rate=fps, options=dict(ENCODERS[name]))
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        context = self._stream.codec_context
        context.thread_count = THREADS
        context.colorspace = context.color_primaries = context.color_trc = BT709
        context.color_range = STUDIO

    def asks_for(self, state: int) -> bool:
        """Whether a state must be drawn; it will then be kept if there is room."""
        if state in self._known:
            return False
        if len(self._known) < self._room:
            self._known.add(state)
        return True

    def put(self, frame: int, state: int, picture: NDArray[np.uint8] | None) -> None:
        """Encode one picture; None for one that was kept."""
        if picture is None:
            image = self._kept[state]
        else:
            drawn = self._module.VideoFrame.from_ndarray(picture, format="rgba")
            image = drawn.reformat(
                format="yuv420p", dst_colorspace=BT709, dst_color_range=STUDIO,
                interpolation="BICUBIC",
            )  # fmt: skip
            if state in self._known:
                self._kept[state] = image
        image.pts = frame
        self._container.mux(self._stream.encode(image))

    def end(self) -> None:
        """Encode what waits in the encoder."""
        self._container.mux(self._stream.encode(None))


def _av() -> Any:
    """Return the module av (PyAV).

    Raises
    ------
    InvalidSettings
        If it is not installed.
    """
    try:
        import av as module
    except ImportError as missing:
        raise InvalidSettings(
            "movies in MP4 need PyAV; install it with: pip install 'bellcrank[movies]', "
            "or write a .gif"
        ) from missing
    return module
