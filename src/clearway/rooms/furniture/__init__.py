"""Furniture, one file a kind; every piece is a function of a room and a frame.

A piece stands on the frame's origin and faces the frame's +y; pieces for walls hang on a frame of `Room.wall`.
"""
