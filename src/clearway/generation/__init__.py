"""Rooms and flats without end: floor plans drawn from kind, split, seed and number alone, and their scene files.

A file a stage, each a pure function of plain data and a generator of random numbers: `request` (what is asked for),
`outline` (the shape of a room), `structure` (rooms, corridor, walls and doors of a flat), `furnish` (furniture),
`plans` (the stages in turn, and what is rejected), `split` (which split owns a plan). `held_out` sets poses apart,
`statistics` measures plans, `files` makes scene files.
"""
