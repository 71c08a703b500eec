"""MP4 encoding by PyAV: H.264, 4:2:0, BT.709 colours, index at the start of the file."""

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

    from bellcrank.plots.movies.records import FrameSource

ENCODERS: dict[str, dict[str, str]] = {
    "libx264": {"crf": "17", "preset": "veryfast", "tune": "animation"},
    "libopenh264": {"rc_mode": "quality", "b": "12M"},
}
"""Encoders with their options; the first available one is used."""
QUEUE_LENGTH = 4
"""Number of pictures drawn ahead of the encoder."""
CACHE_BYTES = 2**28
"""Memory for pictures that are shown more than once."""
THREADS = 1
"""Threads of the encoder; with more than one, files are not reproducible."""
BT709, STUDIO = 1, 1
"""Codes of the BT.709 colour space and of the limited (studio) luminance range."""


def require_encoder() -> str:
    """Return the name of an H.264 encoder.

    Raises
    ------
    InvalidSettings
        If PyAV is not installed or has no such encoder.
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
    """Check that the size is even, as 4:2:0 requires.

    Raises
    ------
    InvalidSettings
    """
    if size[0] % 2 or size[1] % 2:
        raise InvalidSettings(f"size: expected even numbers for an MP4, got {size[0]}x{size[1]}")


def encode(source: FrameSource, fps: int, progress: Callable[[int], None]) -> bytes:
    """Encode all frames; drawing and encoding overlap.

    Raises
    ------
    InvalidSettings
        If no encoder is available.
    StorageError
        If the temporary file cannot be written.
    """
    module, name = _av(), require_encoder()
    # A file, because moving the index to the start needs a seekable, readable output.
    with TemporaryDirectory() as folder:
        path = Path(folder) / "movie.mp4"
        try:
            _write(module, name, path, source, fps, progress)
            return path.read_bytes()
        except OSError as error:
            raise StorageError(f"{path}: cannot be written ({error.strerror})") from error


def _write(
    module: Any,
    name: str,
    path: Path,
    source: FrameSource,
    fps: int,
    progress: Callable[[int], None],
) -> None:
    """Write all frames to a file."""
    with (
        module.open(str(path), "w", format="mp4", options={"movflags": "faststart"}) as container,
        ThreadPoolExecutor(1) as encoder,
    ):
        stream = _VideoStream(module, container, name, source.size, fps)
        work: deque[Future[None]] = deque()
        try:
            for frame, state in enumerate(source.order.tolist()):
                picture = source.draw(state) if stream.needs_drawing(state) else None
                work.append(encoder.submit(stream.put, frame, state, picture))
                if len(work) > QUEUE_LENGTH:
                    work.popleft().result()
                progress(frame + 1)
            for waiting in work:
                waiting.result()
            stream.end()
        finally:
            encoder.shutdown(cancel_futures=True)


class _VideoStream:
    """The video stream of a file, with a cache of pictures that are shown more than once.

    All methods except `needs_drawing` are called in the thread of the encoder.
    """

    def __init__(
        self, module: Any, container: Any, name: str, size: tuple[int, int], fps: int
    ) -> None:
        self._module, self._container = module, container
        self._room = CACHE_BYTES // (size[0] * size[1] * 3 // 2)
        self._known: set[int] = set()
        self._cached: dict[int, Any] = {}
        self._stream = container.add_stream(name, rate=fps, options=dict(ENCODERS[name]))
        self._stream.width, self._stream.height = size
        self._stream.pix_fmt = "yuv420p"
        context = self._stream.codec_context
        context.thread_count = THREADS
        context.colorspace = context.color_primaries = context.color_trc = BT709
        context.color_range = STUDIO

    def needs_drawing(self, state: int) -> bool:
        """Whether a state must be drawn; it is then cached if memory allows."""
        if state in self._known:
            return False
        if len(self._known) < self._room:
            self._known.add(state)
        return True

    def put(self, frame: int, state: int, picture: NDArray[np.uint8] | None) -> None:
        """Encode one picture; None selects the cached picture of the state."""
        if picture is None:
            image = self._cached[state]
        else:
            drawn = self._module.VideoFrame.from_ndarray(picture, format="rgba")
            image = drawn.reformat(
                format="yuv420p", dst_colorspace=BT709, dst_color_range=STUDIO,
                interpolation="BICUBIC",
            )  # fmt: skip
            if state in self._known:
                self._cached[state] = image
        image.pts = frame
        self._container.mux(self._stream.encode(image))

    def end(self) -> None:
        """Flush the encoder."""
        self._container.mux(self._stream.encode(None))


def _av() -> Any:
    """Return the module av (PyAV).

    Raises
    ------
    InvalidSettings
        If PyAV is not installed.
    """
    try:
        import av as module
    except ImportError as missing:
        raise InvalidSettings(
            "movies in MP4 need PyAV; install it with: pip install 'bellcrank[movies]', "
            "or write a .gif"
        ) from missing
    return module
