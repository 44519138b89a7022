"""MuJoCo models of others, compiled in a process of their own with bounded memory and time.

MuJoCo makes whatever sizes a model asks for; a model that is broken, or meant to do harm, ends that process and not
ours. The process is given the model and all files that it names on standard input (see `mjcf_files`), and can open none
itself. It writes the model in MuJoCo's binary format to standard output, or the reason why there is none to standard
error.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from clearway.children import limit, open_nothing_more
from clearway.errors import SceneError
from clearway.importers.mjcf_files import REMEDY, ModelFiles, files_of_model

if TYPE_CHECKING:
    import mujoco

    from clearway.rooms.obstacles import AgentShape

MEMORY_LIMIT_BYTES = 8 << 30  # of the process's address space
MODEL_LIMIT_BYTES = 1 << 30  # of the compiled model
TIME_LIMIT_S = 300
COMMAND = (
    "import sys; sys.path[:] = {path!r}; from clearway.children import end_with_parent; end_with_parent({parent}); "
    "from clearway.importers.mjcf_compile import main; main()"
)
REFUSED = 3
MESSAGE_LENGTH = 300
EMPTY = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"


def compiled(path: Path, agent: AgentShape, files: ModelFiles | None = None) -> mujoco.MjModel:
    """The model in an MJCF file, with the agent's body in it (see `obstacles.add_body`).

    Args:
        path: the file.
        agent: the body.
        files: that and what it names; None: read here, all of it in the model's folder.

    Raises:
        SceneError: as `files_of_model`; MuJoCo refuses it, or it takes more than the limits of memory and time.
    """
    from clearway.rooms.render_worker import model_of_binary

    files = files or files_of_model(path)
    search = [os.path.abspath(folder) for folder in sys.path]  # the child runs in another folder
    environment = {**os.environ, "MUJOCO_GL": "disabled", "PYTHONPATH": os.pathsep.join(search)}
    limits = {"memory_bytes": MEMORY_LIMIT_BYTES, "seconds": TIME_LIMIT_S}
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as given:
        _write_job(given, files, {"agent": asdict(agent), "limits": limits})
        try:
            done = subprocess.run(
                [sys.executable, "-c", COMMAND.format(path=search, parent=os.getpid())],
                stdin=given,
                capture_output=True,
                cwd=folder,
                env=environment,
                timeout=TIME_LIMIT_S,
            )
        except subprocess.TimeoutExpired as fault:
            raise SceneError(path, f"MuJoCo took more than {TIME_LIMIT_S} s to compile it", "Simplify it") from fault
    if done.returncode != 0:
        raise SceneError(path, _failure(done.returncode, done.stderr), REMEDY)
    return model_of_binary(done.stdout)


def _write_job(file: BinaryIO, files: ModelFiles, job: dict[str, Any]) -> None:
    """A line of JSON with the length of every file, then the files, one after the other; ready to be read."""
    parts = {"models": files.models, "assets": files.assets}
    sizes = {part: {name: len(content) for name, content in named.items()} for part, named in parts.items()}
    file.write(json.dumps({**job, "text": len(files.text), **sizes}).encode() + b"\n")
    for content in (files.text, *files.models.values(), *files.assets.values()):
        file.write(content)
    file.seek(0)


def _read_job(file: BinaryIO) -> tuple[dict[str, Any], ModelFiles]:
    """What `_write_job` wrote."""
    job = json.loads(file.readline())
    text = file.read(job["text"])
    models = {name: file.read(size) for name, size in job["models"].items()}
    assets = {name: file.read(size) for name, size in job["assets"].items()}
    return job, ModelFiles(text, models, assets)


def _failure(code: int, messages: bytes) -> str:
    """What went wrong in the process, in one line."""
    words = " ".join(messages.decode(errors="replace").split())
    if code == REFUSED:
        return f"MuJoCo cannot use it ({words[-MESSAGE_LENGTH:]})"
    how = f"signal {signal.Signals(-code).name}" if code < 0 else f"exit code {code}"
    limit = f"it may use {MEMORY_LIMIT_BYTES >> 30} GiB of memory"
    return f"MuJoCo ended with {how} when it compiled it; {limit} ({words[-MESSAGE_LENGTH:] or 'no message'})"


def main() -> None:
    """Compile the model on standard input; the process's work."""
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as output:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what MuJoCo prints must not mix with the model
        job, files = _read_job(sys.stdin.buffer)
        limit(**job["limits"])
        import mujoco

        from clearway.rooms.obstacles import AgentShape, add_body
        from clearway.rooms.render_worker import binary_model

        mujoco.MjSpec.from_string(EMPTY).compile()  # whatever is loaded late has been by now
        open_nothing_more()
        try:
            spec = mujoco.MjSpec.from_string(files.text, include=files.models, assets=files.assets)
            spec.compiler.discardvisual = False  # the agent's body collides with nothing, and must stay
            add_body(spec, AgentShape(**job["agent"]))
            model = spec.compile()
            mujoco.mj_forward(model, mujoco.MjData(model))  # its data must fit as well
            size = mujoco.mj_sizeModel(model)
            if size > MODEL_LIMIT_BYTES:
                raise ValueError(f"the compiled model has {size >> 20} MiB, more than {MODEL_LIMIT_BYTES >> 20}")
        except (ValueError, TypeError, MemoryError, mujoco.FatalError, mujoco.UnexpectedError) as error:
            print(f"{error}" or type(error).__name__, file=sys.stderr, flush=True)
            sys.exit(REFUSED)
        output.write(binary_model(model))


if __name__ == "__main__":
    main()
