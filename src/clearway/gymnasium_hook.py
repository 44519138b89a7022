"""Makes Gymnasium know `Clearway/ImageGoal-v0` without importing Gymnasium, which would take a tenth of a second.

Gymnasium has loaded no plugins since 1.0: whoever offers an environment has to be imported. So `import clearway` waits
for Gymnasium's registry, whichever of the two is imported first; and the installed package brings a file
`clearway.pth`, by which every Python of that environment begins with `import clearway` (a millisecond).
"""

import sys

TYPE_CHECKING = False  # as in `clearway`
if TYPE_CHECKING:
    from collections.abc import Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType

REGISTRY = "gymnasium.envs.registration"


class _OnRegistry:
    """Finds Gymnasium's registry as Python would, and has the environments entered once it is loaded."""

    @staticmethod
    def find_spec(
        name: str, path: "Sequence[str] | None" = None, target: "ModuleType | None" = None
    ) -> "ModuleSpec | None":
        """The module's spec where it is the registry's; None for all others."""
        if name != REGISTRY:
            return None
        others = [finder for finder in sys.meta_path if finder is not _OnRegistry]
        spec = next((found for finder in others if (found := finder.find_spec(name, path, target))), None)
        if spec is None or spec.loader is None:
            return spec
        load = spec.loader.exec_module

        def load_and_register(module: "ModuleType") -> None:
            load(module)
            if _OnRegistry in sys.meta_path:
                sys.meta_path.remove(_OnRegistry)
            _register()

        spec.loader.exec_module = load_and_register  # type: ignore[method-assign]
        return spec


def register_with_gymnasium() -> None:
    """Enter the environments in Gymnasium's registry: now, where it is loaded, else as soon as it is."""
    if REGISTRY in sys.modules:
        _register()
    elif _OnRegistry not in sys.meta_path:
        sys.meta_path.insert(0, _OnRegistry)


def _register() -> None:
    from importlib import import_module

    import_module("clearway.envs")  # which registers
