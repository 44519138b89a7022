"""clearway: agents that walk to where a picture was taken and anticipate collisions on the way."""

from clearway.version import __version__

__all__ = ["__version__"]
