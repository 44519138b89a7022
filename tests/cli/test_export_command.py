"""`clearway export`."""

import pytest

import clearway as package


def test_features_of_unknown_making_have_no_encoder_to_export(clearway, trained, tmp_path):
    out = tmp_path / "agent.onnx"
    answer = clearway("export", trained.run, "--out", out)
    assert answer.refusal("does not say how they were made", "--no-encoder")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (("nowhere",), ("nowhere", "no run here")),
        (("RUN", "--scene", "attic"), ("was not trained on a scene attic", "bathroom_02")),
        (("RUN", "--format", "tflite"), ("--format", "tflite")),
        (("RUN", "--scenes", "nowhere"), ("nowhere",)),
        (("RUN", "--checkpoint", "nowhere"), ("nowhere",)),
    ],
    ids=lambda value: " ".join(value),
)
def test_exports_that_cannot_be(clearway, trained, tmp_path, monkeypatch, words, parts):
    monkeypatch.chdir(tmp_path)
    assert clearway("export", *(trained.run if word == "RUN" else word for word in words)).refusal(*parts)
    assert not list(tmp_path.iterdir())


def test_it_says_at_once_what_it_does(clearway, trained, tmp_path, monkeypatch):
    monkeypatch.setattr("clearway.deploy.export._write", lambda path, *_: path.touch())
    answer = clearway("export", trained.run, "--out", tmp_path / "policy.onnx", "--no-encoder")
    begun, told = answer.err.splitlines()
    assert begun == "exporting an agent for scene bathroom_02" and told.startswith("policy: ")


@pytest.mark.slow
def test_a_policy_exported_and_loaded(clearway, trained, tmp_path):
    out = tmp_path / "policy.onnx"
    answer = clearway("export", trained.run, "--format", "onnx", "--out", out, "--no-encoder")
    assert (answer.code, answer.out) == (0, "")
    begun, told = answer.err.splitlines(keepends=True)
    assert begun == "exporting an agent for scene bathroom_02\n"
    assert told.startswith(f"policy: {out}, ") and told.endswith("MB, for scene bathroom_02\n")
    assert [path.name for path in tmp_path.iterdir()] == ["policy.onnx"]
    assert package.Navigator(out).card.scene == "bathroom_02"
