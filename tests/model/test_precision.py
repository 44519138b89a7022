"""Which factors matrix products take, by what the device can do."""

import pytest
import torch

from clearway.model.precision import factor_dtype

CPU = torch.device("cpu")


@pytest.mark.parametrize(
    ("capabilities", "dtype"),
    [
        ({"amx_bf16": True, "avx512_bf16": False}, torch.bfloat16),
        ({"amx_bf16": False, "avx512_bf16": True}, torch.bfloat16),
        ({"amx_bf16": False, "avx512_bf16": False, "avx2": True}, torch.float32),
        ({}, torch.float32),
    ],
)
def test_bfloat16_is_taken_where_the_processor_multiplies_it(
    monkeypatch: pytest.MonkeyPatch, capabilities: dict[str, bool], dtype: torch.dtype
) -> None:
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: capabilities, raising=False)
    assert factor_dtype("medium", CPU) == dtype
    assert factor_dtype("highest", CPU) == torch.float32


def test_a_pytorch_that_cannot_tell_means_float32(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(torch.cpu, "get_capabilities", raising=False)
    assert factor_dtype("medium", CPU) == torch.float32


@pytest.mark.parametrize("native", [True, False])
def test_a_gpu_that_only_emulates_it_gets_float32(monkeypatch: pytest.MonkeyPatch, native: bool) -> None:
    def supported(including_emulation: bool = True) -> bool:
        return native or including_emulation

    monkeypatch.setattr(torch.cuda, "is_bf16_supported", supported)
    assert factor_dtype("medium", torch.device("cuda")) == (torch.bfloat16 if native else torch.float32)


def test_other_devices_get_float32() -> None:
    assert factor_dtype("medium", torch.device("meta")) == torch.float32
