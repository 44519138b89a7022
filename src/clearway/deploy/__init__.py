"""Trained agents outside the training script: `export` writes ONNX files, `navigator` acts on pictures, one at a time.

What an exported file is run with (`card`, `model`, `onnx_file`, `navigator`) imports neither PyTorch nor the learner.
"""
