"""PyTorch as an optional dependency, and devices and precisions of this machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings, first_line
from bellcrank.surrogate.recipes import PRECISIONS

if TYPE_CHECKING:
    import torch as torch_module

INSTALL = "pip install 'bellcrank[ml]'"
DEVICES = ("cpu", "cuda")


def import_torch() -> Any:
    """Return PyTorch.

    Raises
    ------
    InvalidSettings
        If PyTorch or safetensors is not installed.
    """
    try:
        import safetensors  # noqa: F401
        import torch
    except ImportError as missing:
        raise InvalidSettings(
            f"networks need PyTorch and safetensors; install them with: {INSTALL}"
        ) from missing
    return torch


def find_device(name: str) -> torch_module.device:
    """Return a device by name; ``auto`` is a GPU if there is one.

    Raises
    ------
    InvalidSettings
        If the device is not available.
    """
    torch = import_torch()
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    if name.partition(":")[0] not in DEVICES:
        raise InvalidSettings(f"device: expected auto, cpu or cuda, got {name!r}")
    try:
        device = torch.device(name)
        torch.empty(1, device=device)
    except (RuntimeError, AssertionError) as error:
        raise InvalidSettings(
            f"device: {name!r} is not available here ({first_line(error)}); "
            f"expected auto, cpu or cuda"
        ) from None
    found: torch_module.device = device
    return found


def find_precision(name: str, device: torch_module.device) -> str:
    """Return ``float32`` or ``bfloat16``; ``auto`` is bfloat16 where the hardware supports it.

    Raises
    ------
    InvalidSettings
        If the name is unknown.
    """
    torch = import_torch()
    if name not in PRECISIONS:
        raise InvalidSettings(f"precision: expected {', '.join(PRECISIONS)}, got {name!r}")
    if name != "auto":
        return name
    if device.type == "cuda":
        return "bfloat16" if torch.cuda.is_bf16_supported() else "float32"
    has = torch.cpu.get_capabilities()
    return "bfloat16" if has.get("avx512_bf16") or has.get("amx_bf16") else "float32"


def autocast(device: torch_module.device, precision: str) -> Any:
    """Return a context in which networks compute in a precision."""
    torch = import_torch()
    return torch.autocast(device.type, torch.bfloat16, enabled=precision == "bfloat16")


def name_of(device: torch_module.device) -> str:
    """Return the model of a GPU, or the type of another device."""
    torch = import_torch()
    return str(torch.cuda.get_device_name(device)) if device.type == "cuda" else device.type
