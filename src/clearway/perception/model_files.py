"""Finds a Hugging Face model's files: a local folder, the hub's cache, or a download. Fails quickly offline."""

from __future__ import annotations

from pathlib import Path

from clearway.errors import EncoderError
from clearway.files import read_json
from clearway.perception.preprocess import Preprocessing, preprocessing_from_json
from clearway.spelling import did_you_mean

PROBE_TIMEOUT_S = 3.0  # for the one small request that decides whether the hub can be reached
WANTED_FILES = ("*.json", "*.safetensors")  # never pickles, which could run code
CONFIG, PREPROCESSOR, WEIGHTS = "config.json", "preprocessor_config.json", "*.safetensors"
DEFAULT_SIDE = 224
NAMES = ("clearway", "resnet50", "random-resnet50")  # of encoders, for those who meant one of ours


def find_model(model: str) -> Path:
    """The folder with the files of `model`: a local folder, or a name on the Hugging Face hub.

    What is in the hub's cache is used without asking the network.

    Raises:
        EncoderError: there is no such model, it has no safetensors weights, or the hub cannot be reached.
    """
    try:
        folder = Path(model).expanduser()
    except RuntimeError as fault:
        raise EncoderError(f"encoder '{model}': there is no such home folder. Check the name") from fault
    if not folder.is_dir():
        folder = _cached(model) or _downloaded(model)
    missing = [wanted for wanted in (CONFIG, WEIGHTS) if not any(folder.glob(wanted))]
    if missing:
        remedy = "Choose a model with safetensors weights (pickled ones are not loaded)"
        raise EncoderError(f"encoder '{model}': {folder} has no {' and no '.join(missing)}. {remedy}")
    return folder


def _cached(model: str) -> Path | None:
    """The model's folder in the hub's cache, None where its weights are not there."""
    from huggingface_hub import snapshot_download
    from huggingface_hub.errors import HFValidationError, LocalEntryNotFoundError

    try:
        folder = Path(snapshot_download(model, local_files_only=True))
    except LocalEntryNotFoundError:
        return None
    except HFValidationError as fault:
        problem = f"encoder '{model}': is neither a folder nor a model's name on the Hugging Face hub"
        raise EncoderError(f"{problem}. Use clearway, resnet50 or random-resnet50, or check the name") from fault
    return folder if any(folder.glob(CONFIG)) and any(folder.glob(WEIGHTS)) else None


def _downloaded(model: str) -> Path:
    from huggingface_hub import get_hf_file_metadata, hf_hub_url, is_offline_mode, snapshot_download
    from huggingface_hub.errors import HfHubHTTPError

    remedy = "Connect, or use clearway, which comes along, a local folder with the model, or random-resnet50"
    meant = did_you_mean(model, NAMES)
    if is_offline_mode():
        raise EncoderError(f"encoder '{model}': is not in the cache, and HF_HUB_OFFLINE is set.{meant} {remedy}")
    try:
        get_hf_file_metadata(hf_hub_url(model, CONFIG), timeout=PROBE_TIMEOUT_S)
        return Path(
            snapshot_download(
                model, allow_patterns=list(WANTED_FILES), ignore_patterns=["*/*"], etag_timeout=PROBE_TIMEOUT_S
            )
        )
    except HfHubHTTPError as fault:
        status = fault.response.status_code if fault.response is not None else "no"
        problem = f"encoder '{model}': the Hugging Face hub does not hand it out (status {status})"
        raise EncoderError(f"{problem}.{meant} Check the name, or use {', '.join(NAMES)}") from fault
    except Exception as fault:
        if not _is_network_fault(fault):
            raise
        problem = f"encoder '{model}': is not in the cache, and the Hugging Face hub cannot be reached"
        raise EncoderError(f"{problem} ({type(fault).__name__}).{meant} {remedy}") from fault


def _is_network_fault(fault: Exception) -> bool:
    """Whether a fault is the operating system's or the HTTP library's, which differs by the hub's version."""
    return isinstance(fault, OSError) or type(fault).__module__.partition(".")[0] in ("httpx", "httpx2", "httpcore")


def read_preprocessing(folder: Path, model: str) -> Preprocessing:
    """Size and normalisation from the model's files; 224x224 and ImageNet's where they do not say.

    Raises:
        EncoderError: a file is damaged or holds nonsense.
    """
    kept = _read_json(folder / PREPROCESSOR, model) if (folder / PREPROCESSOR).is_file() else {}
    height, width = _size(kept) or _size(_read_json(folder / CONFIG, model)) or (DEFAULT_SIDE, DEFAULT_SIDE)
    default = Preprocessing()
    plain = kept.get("do_normalize") is False
    settings = {
        "height": height,
        "width": width,
        "mean": [0, 0, 0] if plain else kept.get("image_mean", list(default.mean)),
        "std": [1, 1, 1] if plain else kept.get("image_std", list(default.std)),
    }
    return preprocessing_from_json(settings, f"encoder '{model}'")


def _read_json(path: Path, model: str) -> dict[str, object]:
    try:
        content = read_json(path)
    except (OSError, ValueError) as fault:
        raise EncoderError(f"encoder '{model}': {path} cannot be read ({fault}). Get the model again") from fault
    if not isinstance(content, dict):
        raise EncoderError(f"encoder '{model}': {path} is not a JSON object. Get the model again")
    return content


def _size(settings: dict[str, object]) -> tuple[int, int] | None:
    """Height and width from the spellings in use: crop_size, size or image_size as numbers or objects."""
    vision = settings.get("vision_config")
    for value in (
        settings.get("crop_size"),
        settings.get("size"),
        settings.get("image_size"),
        vision.get("image_size") if isinstance(vision, dict) else None,
    ):
        if isinstance(value, dict):
            shortest = value.get("shortest_edge")
            value = [value.get("height", shortest), value.get("width", shortest)]
        height, width = value if isinstance(value, list) and len(value) == 2 else (value, value)
        if isinstance(height, int) and isinstance(width, int):
            return height, width
    return None
