"""PyTorch, where it is installed, and what the machine at hand does well."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bellcrank.errors import InvalidSettings

if TYPE_CHECKING:
    import torch as torch_module

INSTALL = "pip install 'bellcrank[ml]'"


def import_torch() -> Any:
    """Return PyTorch.

    Raises
    ------
    InvalidSettings
        If it, or the format of its weights, is not installed.
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
        If there is no such device here.
    """
    torch = import_torch()
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
        torch.empty(1, device=device)
    except (RuntimeError, AssertionError) as error:
        raise InvalidSettings(
            f"device: {name!r} cannot be used here ({str(error).splitlines()[0]}); "
            f"expected auto, cpu or cuda"
        ) from None
    found: torch_module.device = device
    return found


def find_precision(name: str, device: torch_module.device) -> str:
    """Return ``float32`` or ``bfloat16``; ``auto`` is the latter where the hardware has it."""
    torch = import_torch()
    if name != "auto":
        return name
    if device.type == "cuda":
        return "bfloat16" if torch.cuda.is_bf16_supported() else "float32"
    has = torch.cpu.get_capabilities()
    fast = has.get("avx512_bf16") or has.get("amx_bf16")
    return "bfloat16" if fast else "float32"


def autocast(device: torch_module.device, precision: str) -> Any:
    """Return a context in which networks compute in a precision."""
    torch = import_torch()
    return torch.autocast(device.type, torch.bfloat16, enabled=precision == "bfloat16")
