"""In which number format matrix products take their factors while learning.

The words are those of PyTorch's `set_float32_matmul_precision`: with `highest` factors are float32, with `medium` they
may be rounded to bfloat16.
"""

from __future__ import annotations

import torch

from clearway.choices import MatmulPrecision

BFLOAT16_INSTRUCTIONS = ("amx_bf16", "avx512_bf16")  # of processors, as PyTorch names them


def factor_dtype(precision: MatmulPrecision, device: torch.device) -> torch.dtype:
    """The dtype of factors: bfloat16 where `medium` allows it and the device multiplies it natively, else float32.

    Sums within a product are float32 in either case. Results of different devices differ by rounding.
    """
    return torch.bfloat16 if precision == "medium" and multiplies_bfloat16(device) else torch.float32


def multiplies_bfloat16(device: torch.device) -> bool:
    """Whether the device has instructions for it; False where PyTorch is too old to tell."""
    if device.type == "cuda":
        return torch.cuda.is_bf16_supported(including_emulation=False)
    if device.type != "cpu" or not hasattr(torch.cpu, "get_capabilities"):
        return False
    found = torch.cpu.get_capabilities()
    return any(found.get(name, False) for name in BFLOAT16_INSTRUCTIONS)
