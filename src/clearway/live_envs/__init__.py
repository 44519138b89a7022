"""Gymnasium's environments off the grid, `Clearway/LiveImageGoal-v0`: a continuous pose, contacts, live pictures.

Nothing here imports PyTorch, so that environments in processes start fast.
"""
