"""Rooms from floor plans: walls round the cells that can be entered, furniture on those that cannot.

`layout` says where everything stands, with `cell_map` and `walls` for plans that name their walls; `pieces`,
`decoration` and `finish` say how it looks, `plan_room` puts it together.
"""
