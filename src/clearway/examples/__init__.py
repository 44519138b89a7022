"""What comes along to be opened at once: a scene with its pictures, and two agents trained in it."""
