"""Agents: one protocol, and what implements it on the grid and on what a camera sees.

An agent is asked what to do by all that walks: evaluation, live walks, films, the viewer, deployment, the service.
"""
