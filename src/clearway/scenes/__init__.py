"""Scenes: a room as pictures, features and a graph of poses; made by the room builder or read from files."""
