"""Exported files that were changed, cut off or are something else are refused."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnx
import pytest

from clearway.deploy.card import Card, card_from_json
from clearway.deploy.onnx_file import MAX_BYTES, OnnxAgent, OnnxFile, read_onnx
from clearway.errors import DeployError
from clearway.scenes.actions import ACTION_NAMES


def refusal(path: Path) -> str:
    with pytest.raises(DeployError) as caught:
        OnnxAgent(read_onnx(path))
    assert str(caught.value).startswith(str(path))
    return str(caught.value)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 1.0])
def test_a_changed_byte_is_noticed_wherever_it_is(deployed, tmp_path, share) -> None:
    content = bytearray(deployed.agent.read_bytes())
    content[int(share * (len(content) - 1))] ^= 1
    path = tmp_path / "changed.onnx"
    path.write_bytes(content)
    assert "has changed since it was exported" in refusal(path)


def test_a_changed_checksum_is_noticed(deployed, tmp_path) -> None:
    model = onnx.load(deployed.agent)
    (entry,) = [entry for entry in model.metadata_props if entry.key == "clearway.sha256"]
    assert len(entry.value) == 64
    entry.value = entry.value[::-1]
    path = tmp_path / "changed.onnx"
    onnx.save(model, path)
    assert "has changed since it was exported" in refusal(path)


def test_a_card_cannot_be_exchanged(deployed, tmp_path) -> None:
    path = tmp_path / "changed.onnx"
    path.write_bytes(deployed.agent.read_bytes().replace(b"cellar", b"bunker"))
    assert "has changed since it was exported" in refusal(path)


def test_cut_off_foreign_empty_and_missing_files(deployed, tmp_path) -> None:
    content = deployed.agent.read_bytes()
    path = tmp_path / "x.onnx"
    for part in (content[: len(content) // 2], b"", b"GIF89a"):
        path.write_bytes(part)
        assert "not an agent's ONNX file, or cut off" in refusal(path)
    path.write_bytes(content[:-1])
    assert "has changed since it was exported" in refusal(path)
    path.unlink()
    assert "No such file" in refusal(path)


def test_a_file_larger_than_onnx_allows_is_not_read(tmp_path) -> None:
    path = tmp_path / "large.onnx"
    with path.open("wb") as file:
        file.truncate(MAX_BYTES + 1)  # a hole: takes no space
    assert "larger than 2048 MiB" in refusal(path)


CARD = Card("attic", ACTION_NAMES, 4, 32, True, {"name": "x"}, {"pixels": None}, (3, 4), {"seed": 0})


def test_a_card_round_trip() -> None:
    assert card_from_json(CARD.to_json(), "x") == CARD


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "metadata cannot be read"),
        ("[]", "metadata cannot be read"),
        ('{"format_version": 1}', "metadata cannot be read"),
        (json.dumps({**json.loads(CARD.to_json()), "picture_size": [1]}), "metadata cannot be read"),
        (json.dumps({**json.loads(CARD.to_json()), "colour": 1}), "metadata cannot be read"),
        ("[" * 200_000, "metadata cannot be read (it is nested too deep)"),
        *(
            (json.dumps({**json.loads(CARD.to_json()), **changed}), f"metadata cannot be read ({told}")
            for changed, told in (
                ({"history_length": "x"}, "history_length is 'x')"),
                ({"feature_count": -1}, "feature_count is -1)"),
                ({"actions": "ab"}, "2 actions)"),
                ({"actions": [1, 2, 3, 4]}, "action 0 is 1)"),
                ({"takes_pictures": "no"}, "takes_pictures is 'no')"),
                ({"picture_size": [1_000_000, 3]}, "the pictures' height is 1000000)"),
                ({"picture_size": [math.inf, 3]}, "cannot convert float infinity to integer)"),
                ({"format_version": math.inf}, "cannot convert float infinity to integer)"),
                ({"settings": None}, "a part of it is no object)"),
                ({"scene": 7}, "scene is 7)"),
            )
        ),
        (json.dumps({**json.loads(CARD.to_json()), "format_version": 4}), "written by a newer clearway (format 4)"),
    ],
)
def test_cards_that_cannot_be_read(text, part) -> None:
    with pytest.raises(DeployError) as caught:
        card_from_json(text, "x.onnx")
    assert str(caught.value).startswith("x.onnx: ") and part in str(caught.value)


class Answering:
    """Stands in for a session: puts out these arrays."""

    def __init__(self, **outputs: np.ndarray) -> None:
        self.outputs, self.metadata = outputs, {}

    def run(self, names, given):
        return [self.outputs[name] for name in names]


FAIR, SURE = np.full((1, 4), 0.25, np.float32), np.zeros((1, 1), np.float32)


@pytest.mark.parametrize(
    ("probabilities", "value", "told"),
    [
        (FAIR, SURE[0], r"value of shape \(1,\), where its card says \(1, 1\)"),
        (np.full((1, 10), 0.1, np.float32), SURE, r"probabilities of shape \(1, 10\), where its card says \(1, 4\)"),
        (np.repeat(FAIR, 2, 0), SURE, r"probabilities of shape \(2, 4\)"),
        (FAIR * np.nan, SURE, "probabilities that are not finite"),
        (FAIR, SURE + np.inf, "value that are not finite"),
        (FAIR - 0.3, SURE, "probabilities that are negative, or all zero"),
        (FAIR * 0, SURE, "probabilities that are negative, or all zero"),
    ],
)
def test_a_graph_that_puts_out_something_else_is_refused(probabilities, value, told) -> None:
    card = replace(CARD, takes_pictures=False, settings={})
    agent = OnnxAgent(OnnxFile(Answering(probabilities=probabilities, value=value), card, "x.onnx"))
    seen = {"features": np.zeros((1, card.feature_count), np.float32)}
    state = agent.reset(seen, np.zeros(1, np.int64))
    with pytest.raises(DeployError, match=rf"x\.onnx: its graph puts out {told}"):
        agent.act(seen, state)
