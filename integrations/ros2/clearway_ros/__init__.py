"""A ROS 2 node around `clearway.Navigator`: pictures in, velocity commands out.

`motion`, `walk` and `pictures` know nothing of ROS; `node` is all that does.
"""
