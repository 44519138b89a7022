"""clearway: agents that walk to where a picture was taken and anticipate collisions on the way."""

from typing import TYPE_CHECKING

from clearway.version import __version__

if TYPE_CHECKING:
    from clearway.deploy.navigator import Navigator

__all__ = ["Navigator", "__version__"]


def __getattr__(name: str) -> object:
    """`Navigator`, imported when it is asked for: `import clearway` alone loads nothing."""
    if name == "Navigator":
        from clearway.deploy.navigator import Navigator

        return Navigator
    raise AttributeError(f"module 'clearway' has no attribute {name!r}")
