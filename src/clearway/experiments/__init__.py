"""Experiments: what is run to show something, built from the parts below."""
