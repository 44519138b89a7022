"""The grid as tables, and the transition rule on them for many episodes at once; Gymnasium is not needed here."""
