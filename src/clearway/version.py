"""The version, in a module without imports so that the build and the command line read it cheaply."""

__version__ = "0.1.0"
