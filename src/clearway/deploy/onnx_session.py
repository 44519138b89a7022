"""`BoundedSession`: onnxruntime, with a limit to the memory that a file's graph may take and to the time of a call.

Few bytes of a graph can ask for any amount of memory and time: a number repeated to a hundred gigabytes, a thousand
products of large matrices.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from clearway.errors import DeployError

MEMORY_LIMIT_BYTES = 4 << 30  # of all open files of a process together, their weights too
TIME_LIMIT_S = 60.0  # of a call; looked at between operators
REASON_LENGTH = 300


class BoundedSession:
    """A graph that is run within limits.

    Args:
        content: the ONNX file.
        source: its path, for errors.
        threads: processor threads; None: one a core.

    Raises:
        DeployError: onnxruntime is not installed, or cannot run it.
    """

    def __init__(self, content: bytes, source: str, threads: int | None) -> None:
        try:
            import onnxruntime
        except ImportError as fault:
            raise DeployError(f"{source}: needs onnxruntime. Install it: pip install 'clearway[onnx]'") from fault
        self._source = source
        _bound_memory()
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads or 0
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")  # idle threads leave the processor
        options.add_session_config_entry("session.use_env_allocators", "1")
        wanted: dict[str, Any] = {"providers": ["CPUExecutionProvider"]}
        wanted["disabled_optimizers"] = ["ConstantFolding"]  # would run parts of the graph here, without a time limit
        try:
            self._session = onnxruntime.InferenceSession(content, options, **wanted)
        except Exception as fault:  # onnxruntime's own errors share no other base
            version = onnxruntime.__version__
            raise DeployError(f"{source}: onnxruntime {version} cannot run it ({_said(fault)}). Upgrade it") from fault
        self.metadata: Mapping[str, str] = self._session.get_modelmeta().custom_metadata_map

    def run(self, outputs: Sequence[str], given: Mapping[str, np.ndarray]) -> list[np.ndarray]:
        """The outputs of these names, by the inputs.

        Raises:
            DeployError: it takes more than the limits of memory and time, or the graph is not what its card says.
        """
        import onnxruntime

        run = onnxruntime.RunOptions()
        run.log_severity_level = 4
        ended = threading.Timer(TIME_LIMIT_S, setattr, (run, "terminate", True))
        ended.daemon = True
        ended.start()
        try:
            return self._session.run(list(outputs), dict(given), run)
        except Exception as fault:  # as above
            limits = f"{TIME_LIMIT_S:g} s and {MEMORY_LIMIT_BYTES >> 30} GiB"
            problem = f"{self._source}: its graph cannot be run ({_said(fault)}; its limits: {limits})"
            raise DeployError(f"{problem}. Export it again, or give fewer pictures at once") from fault
        finally:
            ended.cancel()


@cache
def _bound_memory() -> None:
    """Bound what all sessions of this process take together, as far as they ask for it; once."""
    import onnxruntime as ort

    kind = ort.OrtMemoryInfo("Cpu", ort.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, ort.OrtMemType.DEFAULT)
    ort.create_and_register_allocator(kind, ort.OrtArenaCfg(MEMORY_LIMIT_BYTES, -1, -1, -1))


def _said(fault: Exception) -> str:
    return " ".join(str(fault).split())[:REASON_LENGTH]
