"""Run an exported agent with onnxruntime alone: a target, then what the camera sees, picture after picture.

pip install numpy pillow onnxruntime
clearway export runs/bathroom --out bathroom.onnx
python examples/run_onnx.py bathroom.onnx target.png view-1.png view-2.png
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnxruntime
from PIL import Image


def main(arguments: Sequence[str] | None = None) -> list[str]:
    """Print what the agent would do at each view; gives back the most probable actions' names."""
    parser = argparse.ArgumentParser(description="Run an exported agent with onnxruntime alone.")
    parser.add_argument("agent", type=Path, help="a file that clearway export wrote")
    parser.add_argument("target", type=Path, help="picture of the place to walk to")
    parser.add_argument("views", type=Path, nargs="+", help="what the camera sees, in order")
    options = parser.parse_args(arguments)

    session = onnxruntime.InferenceSession(str(options.agent), providers=["CPUExecutionProvider"])
    card = json.loads(session.get_modelmeta().custom_metadata_map["clearway"])
    print(f"scene {card['scene']}, encoder {card['encoder']['name']}")

    # A target's features are the newest of the history that begins with its picture.
    history = np.zeros((1, card["history_length"], card["feature_count"]), np.float32)
    nothing, begins, goes_on = history[:, 0], np.array([True]), np.array([False])
    given = {"picture": picture(options.target), "start": begins, "history": history, "target": nothing}
    (seen,) = session.run(["history_after"], given)
    target = seen[:, -1]

    names = []
    for number, view in enumerate(options.views):
        start = goes_on if number else begins
        given = {"picture": picture(view), "start": start, "history": history, "target": target}
        probabilities, value, history = session.run(["probabilities", "value", "history_after"], given)
        names.append(card["actions"][int(probabilities[0].argmax())])
        shares = ", ".join(f"{name} {p:.2f}" for name, p in zip(card["actions"], probabilities[0], strict=True))
        print(f"{view.name}: {names[-1]}   ({shares}; value {value[0, 0]:.2f})")
    return names


def picture(path: Path) -> np.ndarray:
    """A picture file as (1, height, width, 3) uint8 RGB; the agent resizes it itself."""
    with Image.open(path) as file:
        return np.asarray(file.convert("RGB"))[None]


if __name__ == "__main__":
    main()
