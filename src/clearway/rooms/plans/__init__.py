"""Rooms from floor plans: walls round the cells that can be entered, furniture on those that cannot.

`layout` says where everything stands, `pieces`, `decoration` and `finish` how it looks, `plan_room` puts it together.
"""
