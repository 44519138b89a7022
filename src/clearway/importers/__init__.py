"""Scenes from what others have: photographs, other simulators' data, other data sets. One module a kind of source."""
