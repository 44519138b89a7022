"""Agents off the grid: in the room itself, with a continuous pose, live pictures and MuJoCo's contacts."""
